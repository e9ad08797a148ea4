"""Hysteresis protocol, between models and plants, files and controllers, and its registry.

A model is one class in one file of this folder, marked :func:`register`. It offers

- an operator: ``step``, ``inverse_step``, ``simulate``, ``scaled``;
- :class:`Kernels` that advance the state rows of a tile of lanes from declared offsets;
- the rows that these kernels read: ``numbers`` (a column of the plant's parameters, so that each
  member of an ensemble, drawn per lane, has its own) and ``table_rows``;
- a record for plant files, and a preset that resembles a reference model.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.arrays import Array
from pam_envs.kernels.build import LANES, kernel, scratch
from pam_envs.wording import shown

Start = Literal["low", "virgin"]
RowsState = tuple[NDArray[Any], ...]

ELEMENTS = 12
"""Most elements of a model whose numbers are a column of the plant's parameters."""
DRIVES = ("length", "pressure")
"""Values of ``hysteresis_drive=``."""
NUMBERS = 2 + 2 * ELEMENTS
"""Parameter rows that a plant keeps for its model: the slope, then the model's own."""

# placeholders, replaced by :func:`kernels`
hysteresis_step: Any = None
MODEL_STATE = 0


@kernel
def lag_by_step(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, operators: int, model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance the operators and write how far their outputs lag behind their inputs."""
    for m in range(operators):
        x, lag = rows[x_at + m], rows[lag_at + m]
        hysteresis_step(
            x, lag, rows, fixed, counts, table, elements, state + m * MODEL_STATE, model, count + m,
            member, first, last,
        )  # fmt: skip
        for j in range(first, last):
            lag[j] = x[j] - lag[j]


@kernel
def peek_by_step(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, stick_at: int, operators: int, model: int, count: int, member: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write the lags at inputs and restore the state; half of the friction counts as stuck."""
    saved = scratch(MODEL_STATE + 1, LANES)
    for m in range(operators):
        at = state + m * MODEL_STATE
        x, lag, stick = rows[x_at + m], rows[lag_at + m], rows[stick_at + m]
        for j in range(first, last):
            saved[0][j] = counts[count + m][j]
            stick[j] = 0.5
        for k in range(MODEL_STATE):
            for j in range(first, last):
                saved[k + 1][j] = rows[at + k][j]
        hysteresis_step(
            x, lag, rows, fixed, counts, table, elements, at, model, count + m, member, first, last
        )
        for j in range(first, last):
            lag[j] = x[j] - lag[j]
            counts[count + m][j] = int(saved[0][j])
        for k in range(MODEL_STATE):
            for j in range(first, last):
                rows[at + k][j] = saved[k + 1][j]


@kernel
def scaled_by_step(
    x: Any, y: Any, width: Any, rows: Any, fixed: Any, counts: Any, table: Any, elements: int,
    at: int, model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance the operator and scale its hysteretic part by ``width`` about its line."""
    hysteresis_step(
        x, y, rows, fixed, counts, table, elements, at, model, count, member, first, last
    )
    slope = fixed[model]
    for j in range(first, last):
        line = slope[j] * x[j]
        y[j] = line + width[j] * (y[j] - line)


@kernel
def begin_at_zero(
    rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int, model: int, count: int,
    member: int, j: int,
) -> None:  # fmt: skip
    """Keep the cleared state: zeros, and a count of 1."""


class Kernels(NamedTuple):
    """Kernels of a model over the lanes ``first`` to ``last`` of a tile.

    ``step``, ``lag`` and ``scaled`` move the state, ``peek`` does not. Arguments of ``step``:

    x, y : rows of float, shape (lanes,)
        Inputs, and where the outputs go.
    rows, fixed, counts : rows, shape (., lanes)
        State, parameters and whole numbers of the plant.
    table : array, shape (members, ., .)
        :func:`tables_of` the ensemble's members.
    elements : int
        :attr:`HysteresisModel.elements`.
    at, model, count, member : int
        First row of the model's state in ``rows`` (``state_rows`` of them), of its numbers in
        ``fixed`` (``NUMBERS``, the slope first), and the rows of ``counts`` for the model's use (1
        at the start of a history) and with the member.
    first, last : int
        Lanes.

    ``lag`` and ``peek`` work on several operators, whose inputs and lags are rows of the plant from
    ``x_at`` and ``lag_at`` and whose states and counts follow each other from ``state`` and
    ``count``. They write ``x - output``; ``peek`` also writes the slope of the lag, from 0 (all
    slips) to 1 (all sticks), into rows from ``stick_at``. ``scaled`` takes the factor on the
    hysteretic part, one a lane, after ``y`` (a model that is used in no other way needs no
    ``step``); ``begin`` writes the state at the beginning of one lane ``j``, after zeros.
    """

    step: Any = None
    lag: Any = lag_by_step
    peek: Any = peek_by_step
    scaled: Any = scaled_by_step
    begin: Any = begin_at_zero


@dataclass(frozen=True)
class Usage:
    """Demands of a plant on its operator, for :meth:`HysteresisModel.check`.

    Attributes
    ----------
    plant : str
        Subject of the error's sentence (``"a muscle"``).
    start : {"virgin", "low"}
        State at the beginning: demagnetised at 0, or vented to the lowest input.
    full : float or None
        Largest input [unit of the input], if the plant fixes it.
    reach : float
        Smallest range [unit of the input] on either side of 0 that the operator needs to span.
    unit_slope : bool
        True if input and output are the same quantity: the total slope is 1.
    """

    plant: str
    start: Start
    full: float | None = None
    reach: float = 0.0
    unit_slope: bool = True


class HysteresisModel:
    """Base of the models: the protocol with the defaults that most models share.

    A model is a frozen dataclass with, at the least, ``kind``, ``kernels``, ``state_rows``,
    :meth:`initial_state`, :meth:`step`, :meth:`inverse_step` and :meth:`resembling`.
    """

    kind: ClassVar[str]
    """Name in plant files."""
    choice: ClassVar[str | None] = None
    """Value of ``hysteresis=`` that selects the model; ``kind`` unless given."""
    identity: ClassVar[bool] = False
    """True for the model whose output is its input."""
    drive: ClassVar[str] = "pressure"
    """``"length"`` for friction elements whose input is always a length (see ``slip``)."""
    kernels: ClassVar[Kernels]
    state_rows: ClassVar[int]
    """Rows of state of one operator."""
    largest_count: ClassVar[int] = 1
    """Largest value of the operator's row of ``counts``."""

    @property
    def elements(self) -> int:
        """Number of elements that the kernels loop over."""
        return 0

    @property
    def total_slope(self) -> float:
        """Slope of the line about which the hysteresis is scaled."""
        return 1.0

    @property
    def largest_lag(self) -> float:
        """Half the largest distance between the branches of the major loop, over the slope 1."""
        return 1.0

    def numbers(self, full: float | None = None) -> list[float]:
        """Return the column of ``NUMBERS`` values that the kernels read, the slope first.

        ``full`` is the largest input of the plant, if the model is to span exactly that.
        """
        return padded([self.total_slope])

    def table_rows(self) -> Array | None:
        """Return the table that the kernels read, shape (., .), or None."""
        return None

    def check(self, usage: Usage) -> None:
        """Raise ValueError if the model does not serve a plant."""

    def scaled(self, width: float, slope: float | None = None) -> Self:
        """Return the model with its hysteresis ``width`` times as wide about its line."""
        raise NotImplementedError

    def step(self, x: ArrayLike, state: Any) -> tuple[Array, Any]:
        """Return the output for one sample of every row, and the state after it."""
        raise NotImplementedError

    def simulate(self, x: ArrayLike, state: Any = None) -> tuple[Array, Any]:
        """Return the outputs, shape (T,), for inputs of shape (T,), and the last state."""
        state = self.initial_state() if state is None else state
        outputs = np.empty(np.shape(x))
        for t, value in enumerate(np.asarray(x, float)):
            outputs[t], state = self.step(value, state)
        return outputs, state

    def inverse_step(self, y: ArrayLike, state: Any) -> tuple[Array, Any]:
        """Return the input that gives an output, and the state after it."""
        raise NotImplementedError

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Any:
        """Return the state at the beginning of a history, last axis the elements."""
        raise NotImplementedError

    def rows(self) -> Any:
        """Return the operator over rows of environments, for controllers (:class:`Rows`)."""
        return Rows(self)

    def record(self) -> dict[str, Any]:
        """Return the model as plain data, in the layout of a plant file."""
        fields: dict[str, Any] = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}  # type: ignore[arg-type]
        return {"kind": self.kind} | {name: _plain(value) for name, value in fields.items()}

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Self:
        """Return the model of a record without its kind, whose keys are checked."""
        return cls(**{name: _number(value) for name, value in record.items()})

    @classmethod
    def optional(cls) -> tuple[str, ...]:
        """Return the keys that a record may leave out."""
        return ()

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Return the keys of a record, those of :meth:`optional` left out."""
        names = (f.name for f in dataclasses.fields(cls))  # type: ignore[arg-type]
        return tuple(name for name in names if name not in cls.optional())

    @classmethod
    def resembling(
        cls, reference: Any, low: float, high: float, levels: int, start: Start
    ) -> "HysteresisModel | None":
        """Return the model of this kind nearest to a reference model, for inputs low to high."""
        raise NotImplementedError


@dataclass(frozen=True)
class Rows:
    """An operator over rows of environments; states are tuples of arrays with the row first."""

    operator: Any

    def initial(self, rows: int) -> RowsState:
        """Return the initial states of a number of rows."""
        return (self.operator.initial_state((rows,)),)

    def forward(self, x: Array, state: RowsState) -> tuple[Array, RowsState]:
        """Return the outputs for inputs, shape (rows,), and the states they leave."""
        output, after = self.operator.step(x, state[0])
        return output, (after,)

    def along(self, x: Array, state: RowsState) -> RowsState:
        """Return the states after inputs one after the other, shape (n_steps, rows)."""
        for one in x:
            state = self.forward(one, state)[1]
        return state

    def inverse(self, y: Array, state: RowsState) -> Array:
        """Return the inputs that give outputs, shape (rows,); the states do not change."""
        return self.operator.inverse_step(y, state[0])[0]  # type: ignore[no-any-return]


def padded(values: Sequence[float]) -> list[float]:
    """Return values filled up with zeros to ``NUMBERS``."""
    return [*values, *[0.0] * (NUMBERS - len(values))]


def _plain(value: Any) -> Any:
    if isinstance(value, (tuple, list)):
        return [_plain(v) for v in value]
    return value if isinstance(value, str) else float(value)


def _number(value: Any) -> Any:
    if isinstance(value, (tuple, list)):
        return tuple(_number(v) for v in value)
    return float(value)


# --- registry -----------------------------------------------------------------------------------

MODELS: dict[str, type[HysteresisModel]] = {}
"""Registered models by kind."""
M = TypeVar("M", bound=type[HysteresisModel])


def register(model: M) -> M:
    """Register a model under its kind (a class decorator)."""
    MODELS[model.kind] = model
    return model


def kinds() -> tuple[str, ...]:
    """Return the values of ``hysteresis=``."""
    names = (kind for kind, model in MODELS.items() if model.choice in (None, kind))
    return tuple(sorted(names, key=lambda kind: MODELS[kind].identity))


def kind_of(choice: str, drive: str | None, usual: str = "length") -> str:
    """Return the kind of a choice of ``hysteresis=`` with a drive, ``DRIVES``.

    Without a drive it is the kind with the drive ``usual``, if there is one. A choice by itself
    is the kind driven by pressure; a model that a plant file or a script names by its kind stays
    what it is. Raises ValueError if there is none.
    """
    if drive is not None and drive not in DRIVES:
        raise ValueError(f"hysteresis_drive = {drive!r}; choose 'length' or 'pressure'")
    if (drive or usual) == "pressure" or choice not in kinds() or MODELS[choice].identity:
        return choice
    for kind, model in MODELS.items():
        if model.drive == (drive or usual) and model.choice == choice:
            return kind
    if drive is None:
        return choice
    raise ValueError(
        f"hysteresis = {choice!r} has no model driven by length: give hysteresis_drive='pressure'"
    )


def model_of(kind: str) -> type[HysteresisModel]:
    """Return the model of a kind; raise ValueError if there is none."""
    if kind not in MODELS:
        *rest, final = (repr(name) for name in kinds())
        raise ValueError(f"hysteresis = {kind!r}; choose {', '.join(rest)} or {final}")
    return MODELS[kind]


def operator_of(operator: HysteresisModel | None) -> HysteresisModel:
    """Return the operator, or the identity for None."""
    return MODELS["none"]() if operator is None else operator


def choice_of(operator: HysteresisModel | None) -> str:
    """Return the value of ``hysteresis=`` that an operator belongs to."""
    found = operator_of(operator)
    return found.choice or found.kind


def preset(
    kind: str, reference: HysteresisModel, low: float, high: float, levels: int, start: Start
) -> HysteresisModel | None:
    """Return the operator of a kind with the loops of a reference model, None for no hysteresis.

    A reference of that kind is the answer itself. The operator spans the inputs ``low`` to ``high``
    with ``levels`` levels of a map. Raises ValueError if there is no such kind.
    """
    if choice_of(reference) == kind:
        return reference
    return model_of(kind).resembling(reference, low, high, levels, start)


def tables_of(operators: Sequence[HysteresisModel | None]) -> Array:
    """Return the tables of an ensemble's operators, shape (members, ., .); (1, 2, 2) if none."""
    made = [table for o in operators if (table := operator_of(o).table_rows()) is not None]
    return np.ascontiguousarray(made) if made else np.zeros((1, 2, 2))


def state_rows(kind: str) -> int:
    """Return the number of state rows of one operator of a kind."""
    return model_of(kind).state_rows


def kernels(kind: str) -> dict[str, Any]:
    """Return the kernels of a kind by the placeholders that plants name them."""
    model = model_of(kind)
    named = {f"hysteresis_{name}": value for name, value in model.kernels._asdict().items()}
    return named | {"MODEL_STATE": model.state_rows}


def record(operator: HysteresisModel | None) -> dict[str, Any]:
    """Return an operator as plain data, in the layout of a plant file."""
    return operator_of(operator).record()


def read(record: Any, where: str) -> HysteresisModel | None:
    """Return the operator of a record; ``where`` names the file in messages.

    Raises ValueError if the kind is unknown, a key is missing or unknown, or a value is out of
    bounds.
    """
    if not isinstance(record, Mapping) or str(record.get("kind")) not in MODELS:
        raise ValueError(
            f"{where}: hysteresis must be a mapping with kind {', '.join(MODELS)}, "
            f"got {shown(record)}"
        )
    model = MODELS[record["kind"]]
    given = {key: value for key, value in record.items() if key != "kind"}
    if set(given) - set(model.optional()) != set(model.keys()):
        raise ValueError(
            f"{where}: a {model.kind} hysteresis needs exactly the keys {sorted(model.keys())}, "
            f"got {shown(sorted(map(str, given)))}"
        )
    try:
        made = model.from_record(given)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{where}: hysteresis: {error}") from error
    return None if model.kind == "none" else made
