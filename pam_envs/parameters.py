"""Declared physical parameters and named signals.

A component is a frozen dataclass whose fields are made by :func:`assumed`, :func:`published`,
:func:`derived`, :func:`identified` or :func:`effect`, so that every number carries unit, bounds,
provenance and source. :func:`check` refuses a value out of bounds.
"""

import dataclasses
import math
from collections import namedtuple
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache, partial
from itertools import accumulate
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Provenance = Literal["published", "derived", "assumed", "identified"]
PROVENANCES: tuple[str, ...] = ("published", "derived", "assumed", "identified")


@dataclasses.dataclass(frozen=True)
class Declaration:
    """Declaration of one parameter.

    Attributes
    ----------
    unit : str
        SI unit, ``"1"`` for a pure number.
    low, high : float
        Bounds within which the parameter is physical, in ``unit``.
    provenance : {"published", "derived", "assumed", "identified"}
        Origin of the default.
    source : str
        The paper and place, or the reason for an assumption.
    neutral : float or None
        The value [unit of the parameter] that switches the effect off, where there is one.
    spread : tuple of float or None
        Range over which domain randomization draws an assumed parameter, in ``unit``.
    """

    unit: str
    low: float
    high: float
    provenance: Provenance
    source: str
    neutral: float | None = None
    spread: tuple[float, float] | None = None


def parameter(
    default: float,
    unit: str,
    low: float,
    high: float,
    source: str,
    *,
    provenance: Provenance = "assumed",
    neutral: float | None = None,
    spread: tuple[float, float] | None = None,
) -> Any:
    """Return a dataclass field for a physical parameter (see :class:`Declaration`)."""
    declaration = Declaration(unit, low, high, provenance, source, neutral, spread)
    return dataclasses.field(default=default, metadata={"declaration": declaration})


assumed = parameter
published = partial(parameter, provenance="published")
derived = partial(parameter, provenance="derived")
identified = partial(parameter, provenance="identified")


def effect(unit: str, low: float, high: float, source: str) -> Any:
    """Return an assumed :func:`parameter` that is 0, its neutral value, until identified."""
    return assumed(0.0, unit, low, high, source, neutral=0.0)


def declarations(component: Any) -> dict[str, Declaration]:
    """Return the declared parameters of a component class or instance, by field name.

    A class attribute ``quantity = (unit, size)`` completes declarations whose unit holds ``{}``:
    ``unit`` takes its place, and their bounds are multiples of ``size``.
    """
    return dict(_declarations(component if isinstance(component, type) else type(component)))


@lru_cache(maxsize=256)
def _declarations(component: Any) -> dict[str, Declaration]:
    found = {
        field.name: field.metadata["declaration"]
        for field in dataclasses.fields(component)
        if "declaration" in field.metadata
    }
    unit, size = getattr(component, "quantity", ("1", 1.0))
    for name, declared in found.items():
        if "{}" in declared.unit:
            found[name] = dataclasses.replace(
                declared,
                unit=declared.unit.format(unit),
                low=declared.low * size,
                high=declared.high * size,
            )
    return found


def named_rows(*names: str) -> Any:
    """Return a named tuple of row numbers, which kernels read as constants.

    ``named_rows("pressure", "rate").rate`` is 1.
    """
    return namedtuple("Rows", names)(*range(len(names)))  # type: ignore[misc]


def row_blocks(start: int = 0, **sizes: int) -> Any:
    """Return a named tuple of the first row of each block of rows, and ``end`` behind the last."""
    firsts = list(accumulate(sizes.values(), initial=start))
    return namedtuple("Blocks", (*sizes, "end"))(*firsts)  # type: ignore[misc, arg-type]


def parameter_rows(*components: type) -> Any:
    """Return the :func:`named_rows` of the declared parameters of components."""
    return named_rows(*(name for component in components for name in declarations(component)))


def check(component: Any, where: str = "") -> None:
    """Raise ValueError if a parameter of ``component`` is not a finite number within its bounds."""
    prefix = f"{where}." if where else ""
    for name, declared in declarations(component).items():
        value = getattr(component, name)
        if isinstance(value, bool) or not isinstance(value, (int, float, np.floating, np.integer)):
            raise ValueError(
                f"{prefix}{name} must be a number in {declared.unit}, got {value!r}; "
                f"give a value between {declared.low:g} and {declared.high:g}"
            )
        if not math.isfinite(value) or not declared.low <= value <= declared.high:
            unit = "" if declared.unit == "1" else f" {declared.unit}"
            raise ValueError(
                f"{prefix}{name} = {value:g}{unit} is outside its bounds "
                f"[{declared.low:g}, {declared.high:g}]{unit}; "
                "check the unit (all parameters are SI) or move the value inside the bounds"
            )


@dataclasses.dataclass(frozen=True)
class Signal:
    """One named component of an observation or an action.

    Attributes
    ----------
    name, unit : str
        For example ``"pressure"``; SI unit.
    low, high : float
        Range in ``unit``; the normalised signal runs over [-1, 1] between them.
    index : int
        Position in the observation (or action) vector.
    normalized : bool
        Whether the vector holds the normalised or the SI value.
    ahead : float
        Time [s] after the observation to which the value applies, for previews.
    """

    name: str
    unit: str
    low: float
    high: float
    index: int
    normalized: bool = True
    ahead: float = 0.0

    @property
    def scale(self) -> tuple[float, float]:
        """``(a, b)`` such that the vector's entry is ``a * si + b``."""
        if not self.normalized:
            return 1.0, 0.0
        a = 2.0 / (self.high - self.low)
        return a, -1.0 - a * self.low

    def decode(self, vector: ArrayLike) -> NDArray[np.float64]:
        """Return the SI value, shape (...), from vectors of shape (..., n)."""
        a, b = self.scale
        return (np.asarray(vector, np.float64)[..., self.index] - b) / a

    def encode(self, value: ArrayLike) -> NDArray[np.float64]:
        """Return the vector's entry for an SI value, clipped to the range."""
        a, b = self.scale
        return a * np.clip(np.asarray(value, np.float64), self.low, self.high) + b


class Signals(tuple[Signal, ...]):
    """Signals in the order of their vector, also by name: ``signals["pressure"]``."""

    __slots__ = ()

    def __new__(cls, signals: Iterable[Signal]) -> "Signals":
        """Check that indices run 0, 1, 2, ... and names are unique."""
        made = super().__new__(cls, signals)
        if [s.index for s in made] != list(range(len(made))):
            raise ValueError("signal indices must run 0, 1, 2, ... in order")
        if len({s.name for s in made}) != len(made):
            raise ValueError("signal names must differ")
        return made

    def __getitem__(self, key: Any) -> Any:
        """Return a signal by name or position."""
        if isinstance(key, str):
            for signal in self:
                if signal.name == key:
                    return signal
            names = ", ".join(s.name for s in self)
            raise KeyError(f"no signal named {key!r}; there are: {names}")
        return super().__getitem__(key)

    def names(self) -> Iterator[str]:
        """Yield the names in order."""
        return (signal.name for signal in self)

    def decode(self, vector: ArrayLike, name: str) -> NDArray[np.float64]:
        """Return the SI value of the signal ``name`` from vectors of shape (..., n)."""
        found: Signal = self[name]
        return found.decode(vector)

    def encode(self, values: Mapping[str, ArrayLike]) -> NDArray[np.float32]:
        """Return vectors, shape (..., n), from the SI values of every signal by name.

        Values are clipped to the ranges of their signals; their shapes (...) are broadcast.

        Raises
        ------
        ValueError
            If a signal has no value, or a value no signal.
        """
        names = list(self.names())
        missing, unknown = [n for n in names if n not in values], sorted({*values} - {*names})
        if missing or unknown:
            wrong = f"no value of {missing[0]}" if missing else f"no signal named {unknown[0]!r}"
            raise ValueError(f"{wrong}; give SI values of exactly: {', '.join(names)}")
        entries = np.broadcast_arrays(*(self[n].encode(values[n]) for n in names))
        return np.stack(entries, axis=-1).astype(np.float32)
