"""Base of all plants: named parameters in components, ensemble members, files, identity."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.constants import ATMOSPHERE
from pam_envs.hysteresis.protocol import (
    HysteresisModel,
    Usage,
    choice_of,
    operator_of,
    tables_of,
)
from pam_envs.kernels.motion import LARGEST_PHASE
from pam_envs.parameters import Declaration, check, declarations
from pam_envs.plants.core import plant_file
from pam_envs.plants.core.passivity import ImposedMuscles
from pam_envs.pneumatics.flow import AIRS, REPLACED, SWITCH, FlowEffects
from pam_envs.pneumatics.regulator import NO_SLEW_LIMIT
from pam_envs.wording import near

LAG_ALONE = {"regulator.dead_time": 0.0, "regulator.slew_rate": NO_SLEW_LIMIT}


class UnstableParameters(ValueError):
    """Parameters whose motion the sub-steps cannot follow."""


FINER = (6, 8, 12, 20, 40, 70, 100)
"""Numbers of sub-steps tried where those of a plant cannot follow its motion."""


@dataclass(frozen=True)
class OperatorComponent:
    """Hysteresis of a plant.

    Attributes
    ----------
    operator : HysteresisModel or None
        The operator; None for no hysteresis.
    """

    operator: HysteresisModel | None = None

    @property
    def model(self) -> HysteresisModel:
        """The operator, the identity in place of None."""
        return operator_of(self.operator)

    @property
    def kind(self) -> str:
        """Registered kind of the operator, which selects the kernels."""
        return self.model.kind

    @property
    def drive(self) -> str:
        """Input of the hysteresis, as declared by its operator: ``"length"`` or ``"pressure"``."""
        return self.model.drive

    @property
    def choice(self) -> str:
        """Value of ``hysteresis=`` that the operator belongs to."""
        return choice_of(self.operator)


@dataclass(frozen=True)
class Plant:
    """A plant made of components; a family of plants derives from it, with its module ``rows``.

    Fields with a factory are its components. From their declarations and from ``rows`` follow
    ``components``, ``names``, ``effects`` and ``neutral``.

    Attributes
    ----------
    family : str
        Name in files.
    control_period : float
        Time between two commands [s].
    components : tuple of str
        Names of the components, in the order of a file.
    names : tuple of str
        Dotted names of the parameters that the kernels read.
    makes : mapping
        Allowed values of each field that selects a variant.
    choices : tuple of str
        Further keys of a file: by default the fields of ``makes``.
    effects : tuple of tuple of str
        Parameters that switch an effect on, each with those that shape it. A file leaves out what
        is off, so that a plant's digest stays when a new effect is added.
    shared_effects : tuple of tuple of str
        Those of them that span several components.
    neutral : mapping
        Value of each parameter that switches an effect off.
    provenance : mapping
        Parameter name (``"muscle.area"``) to ``(provenance, source)`` where it differs from the
        declaration.
    ensemble : tuple of mapping
        Other parameter sets that fit the data equally well (parameter name to value; operators of
        the hysteresis under ``"hysteresis.operator"``), for domain randomization.
    substeps : int
        Steps of the integrator in a control period.
    """

    family: ClassVar[str]
    control_period: ClassVar[float] = 0.01
    components: ClassVar[tuple[str, ...]]
    names: ClassVar[tuple[str, ...]]
    makes: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    choices: ClassVar[tuple[str, ...]] = ()
    effects: ClassVar[tuple[tuple[str, ...], ...]] = ()
    shared_effects: ClassVar[tuple[tuple[str, ...], ...]] = ()
    neutral: ClassVar[Mapping[str, float]] = {}

    provenance: Mapping[str, tuple[str, str]] = field(
        default_factory=dict, compare=False, kw_only=True
    )
    ensemble: tuple[Mapping[str, Any], ...] = field(default=(), compare=False, kw_only=True)
    substeps: int = field(default=4, kw_only=True)

    def __init_subclass__(cls, rows: Any = None, **arguments: Any) -> None:
        """Gather components, effects and neutral values; ``rows`` is a module (``core.rows``)."""
        super().__init_subclass__(**arguments)
        if rows is None:  # a base of several families
            return
        parts = {
            name: type(entry.default_factory())
            for name, entry in vars(cls).items()
            if isinstance(entry, dataclasses.Field) and callable(entry.default_factory)
        }
        cls.components, cls.names = tuple(parts), rows.NAMES
        cls.choices = cls.choices or tuple(cls.makes)
        cls.effects = (
            *(
                tuple(f"{part}.{name}" for name in group)
                for part, component in parts.items()
                for group in getattr(component, "effects", ())
            ),
            *cls.shared_effects,
        )
        declared = {
            f"{part}.{name}": declaration.neutral
            for part, component in parts.items()
            for name, declaration in declarations(component).items()
        }
        neutral = {name: declared[name] for name in rows.EFFECTS}
        cls.neutral = {name: value for name, value in neutral.items() if value is not None}

    def __post_init__(self) -> None:
        """Raise if a choice, a parameter, the hysteresis or the number of sub-steps is invalid."""
        for name, allowed in self.makes.items():
            if getattr(self, name) not in allowed:
                raise ValueError(
                    f"{name} = {getattr(self, name)!r}; choose one of {', '.join(allowed)}"
                )
        for name in self.components:
            check(getattr(self, name), name)
        if not isinstance(self.substeps, int) or not 1 <= self.substeps <= 100:
            raise ValueError(
                f"substeps = {self.substeps!r} must be a whole number from 1 to 100; "
                "4 is the default"
            )
        self._model.check(self._usage())
        self._check_air()
        self._check()

    def _check_air(self) -> None:
        """Refuse a switch that is neither on nor off, and flow where the variant has none."""
        flow = self._flow
        if flow not in (0.0, 1.0):
            raise ValueError(
                f"{SWITCH} = {flow:g} must be 0 (air = 'regulator') or 1 (air = 'flow')"
            )
        if flow and self.flowless:
            raise ValueError(f"air = 'flow' ({SWITCH} = 1): {self.flowless}")
        for name in (f"regulator.{r}" for r in REPLACED if flow):
            if name in self.neutral and self.value(name) != self.neutral[name]:
                raise ValueError(
                    f"{name} = {self.value(name):g} has no effect with air = 'flow', whose "
                    f"orifices replace it: leave it at {self.neutral[name]:g}, or take "
                    "air = 'regulator'"
                )
        source, full = "regulator.source_pressure", "regulator.max_pressure"
        if flow and self.value(source) <= self.value(full):
            raise ValueError(
                f"{source} = {self.value(source):g} Pa must be above {full} = "
                f"{self.value(full):g} Pa, or the muscle is never filled: raise the source, or "
                "lower the largest setpoint"
            )

    def _usage(self) -> Usage:
        """Return the demands on the hysteresis operator."""
        return Usage(f"the {self.family}", "virgin")

    def _check(self) -> None:
        """Raise if the plant cannot be built or simulated: checks of a single family."""

    def check_phase(self, stiffness: float, damping: float, motion: str) -> None:
        """Refuse a motion that the sub-steps cannot follow (see ``kernels.motion``).

        ``stiffness`` [1/s2] and ``damping`` [1/s] are the largest, per unit mass or inertia;
        ``motion`` is the subject of the error's sentence.
        """
        h = self.control_period / self.substeps
        phase = max(stiffness, (0.5 * damping) ** 2) * h * h
        if phase > LARGEST_PHASE:
            enough = math.ceil(self.substeps * math.sqrt(phase / LARGEST_PHASE))
            raise UnstableParameters(
                f"{motion} moves too fast for {self.substeps} sub-steps: phase {phase:.1f} against "
                f"at most {LARGEST_PHASE:g}; use at least {enough} sub-steps "
                f"(dataclasses.replace(plant, substeps={enough})) or a larger mass or inertia"
            )

    def replace(self, values: Mapping[str, Any]) -> Self:
        """Return the plant with parameters replaced by dotted name (``"mass.load"``)."""
        changed: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            component, _, entry = name.partition(".")
            known = component in self.components and entry in declarations(getattr(self, component))
            if not known and name != "hysteresis.operator":
                raise ValueError(f"no parameter named {name!r}{near(name, self.names)}")
            changed.setdefault(component, {})[entry] = value
        parts: dict[str, Any] = {
            c: dataclasses.replace(getattr(self, c), **v) for c, v in changed.items()
        }
        return dataclasses.replace(self, **parts)

    def replace_with_substeps(self, values: Mapping[str, Any]) -> Self:
        """Return :meth:`replace` with as many sub-steps as the motion needs.

        Raises
        ------
        UnstableParameters
            If the motion is too fast for the largest number.
        """
        for substeps in (self.substeps, *FINER):
            try:
                return dataclasses.replace(self, substeps=substeps).replace(values)
            except UnstableParameters as error:
                unstable = error
        raise unstable

    def declaration(self, name: str) -> Declaration:
        """Return the declaration of a parameter by dotted name."""
        component, _, entry = name.partition(".")
        return declarations(getattr(self, component))[entry]

    def changed(self, changes: Mapping[str, float]) -> Self:
        """Return :meth:`replace` of keyword arguments, with ``__`` for the dot (``mass__load``)."""
        return self.replace({name.replace("__", "."): value for name, value in changes.items()})

    def without_noise(self) -> Self:
        """Return the plant with sensors that show true values."""
        return self.replace(
            {name: 0.0 for name in self.names if name.endswith((".noise", ".resolution"))}
        )

    def value(self, name: str) -> float:
        """Return a parameter by dotted name, in SI."""
        component, _, entry = name.partition(".")
        return float(getattr(getattr(self, component), entry))

    def with_lag_alone(self) -> Self:
        """Return the plant whose regulators have neither dead time nor rate limit.

        The regulators of papers that identify a lag, and the linear part of any.
        """
        return self.replace({n: v for n, v in LAG_ALONE.items() if n in self.names})

    @property
    def dead_time(self) -> float:
        """Dead time [s] from a setpoint to the pressure; 0 where the dynamics have none."""
        return self.regulator.dead_time  # type: ignore[attr-defined, no-any-return]

    @property
    def _flow(self) -> float:
        """1 with flow through the regulator's orifices; 0 without, or without a regulator."""
        return self.value(SWITCH) if SWITCH in self.names else 0.0

    @property
    def air(self) -> str:
        """Air supply: ``"regulator"``, closed-loop, or ``"flow"`` through its orifices."""
        return AIRS[int(self._flow)]

    @property
    def flowless(self) -> str:
        """Reason why this variant has no flow through a regulator's orifices, and the remedy."""
        return ""

    @property
    def inert(self) -> frozenset[str]:
        """Parameters of the regulator that have no effect with this air supply."""
        names = REPLACED if self._flow else declarations(FlowEffects)
        return frozenset(f"regulator.{name}" for name in names) - {SWITCH}

    def with_air(self, air: str) -> Self:
        """Return the plant with an air supply, ``"regulator"`` or ``"flow"``."""
        if air not in AIRS:
            raise ValueError(f"air = {air!r}; choose one of {', '.join(AIRS)}")
        return self.replace({SWITCH: float(AIRS.index(air))})

    def air_stiffness(self, volume: ArrayLike, gives: ArrayLike) -> float:
        """Return the largest stiffness ``n p_abs / V (dV/dx)^2`` of the air in one muscle.

        At full pressure, 0 without flow; ``volume`` [m3] and its change with the displacement
        ``gives`` are those of several positions.
        """
        if not self._flow:
            return 0.0
        full = self.value("regulator.max_pressure") + ATMOSPHERE
        worst = np.max(np.square(gives) / np.asarray(volume, float))
        return float(self.value("regulator.polytropic") * full * worst)

    @property
    def extended(self) -> bool:
        """True if an effect is on, so that the extended step is needed."""
        return any(self.value(name) != neutral for name, neutral in self.neutral.items())

    def needs_effects(self, spread: ArrayLike = ()) -> bool:
        """Return whether the extended step is needed with parameters that are drawn.

        Parameters
        ----------
        spread : array_like, shape (n, 3)
            Row of each parameter that is drawn, and its range [SI].
        """
        drawn = {self.names[int(row[0])] for row in np.asarray(spread, float).reshape(-1, 3)}
        return self.extended or not drawn.isdisjoint(self.neutral)

    def members(self) -> tuple[Self, ...]:
        """Return this plant and the equally good fits beside it."""
        return (self, *(self.replace(values) for values in self.ensemble))

    def parameter_rows(self) -> NDArray[np.float64]:
        """Return the parameters as the column that the kernels read, shape (n_parameters,)."""
        return np.array([*map(self.value, self.names), *self.table_values()])

    def table_values(self) -> Sequence[float]:
        """Return the values after the named parameters: the numbers of the hysteresis operator."""
        return self._model.numbers()

    @property
    def elements(self) -> int:
        """Elements of the hysteresis that the kernels loop over."""
        return self._model.elements

    def hysteresis_tables(self) -> NDArray[np.float64]:
        """Return the tables of the hysteresis of all members, shape (members, ., .)."""
        return tables_of([member.hysteresis.operator for member in self.members()])  # type: ignore[attr-defined]

    @property
    def _model(self) -> HysteresisModel:
        return self.hysteresis.model  # type: ignore[attr-defined, no-any-return]

    @classmethod
    def module(cls, name: str) -> Any:
        """Return a module of the plant's folder: ``"rollout"`` or ``"at_rest"``."""
        return import_module(f"{cls.__module__.rpartition('.')[0]}.{name}")

    def imposed_muscles(self, cycles: int) -> ImposedMuscles:
        """Return the muscles under imposed pressures and position (``core.passivity``)."""
        raise NotImplementedError

    def linearise(self, **point: Any) -> Any:
        """Return the ``control.StateSpace`` about a point of rest (``core.linearise``)."""
        from pam_envs.plants.core.linearise import linearise

        return linearise(self, **point)

    def to_yaml(self, path: str | Path) -> None:
        """Write the plant to a file that :meth:`from_yaml` and ``gym.make(plant=...)`` read."""
        plant_file.write(self, Path(path))

    @classmethod
    def from_yaml(cls, path: str | Path) -> Self:
        """Read a plant; what the file leaves out keeps its default.

        Raises
        ------
        ValueError
            If the file cannot be read, or a value is unknown or out of bounds.
        """
        return plant_file.read(cls, Path(path))

    def digest(self) -> str:
        """Return a hash of family, make, parameters and hysteresis, 16 hexadecimal digits."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        return plant_file.digest(self)
