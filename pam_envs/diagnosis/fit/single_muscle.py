"""Single muscle as a diagnosable plant: recorded inputs, base parameters, parameter columns."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebval

from pam_envs.arrays import Array
from pam_envs.constants import CELSIUS, GRAVITY
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.muscle.effective_area import MAP_SIZES, EffectiveAreaMuscle
from pam_envs.muscle.effects import MAP_TERMS
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import CHANNELS, Inputs, replay_rows
from pam_envs.pneumatics.flow import SWITCH

P = TypeVar("P", bound=Plant)
THRESHOLDS = (3e3, 7e3, 1.2e4, 1.8e4, 2.5e4, 3.3e4, 4.2e4, 5.2e4, 6.3e4, 7.6e4, 9.1e4, 1.1e5)
"""Thresholds [Pa] of the base's play operators."""
SHARE_OF_PLAYS = 0.7
"""Share of all play operators in the slope, at the start of a fit."""
LEAST_LINEAR = 0.02
LEAST_STIFFNESS, LEAST_STIFFNESS_OF, LEAST_GAIN = 1.0, 50.0, 0.1
"""Least stiffness over strain, in parts of 50 N, and least slope of the force by pressure, over the
area: a law below them is not monotone."""
NOT_MONOTONE = 100.0
"""Weight of a unit of such a violation."""
LEVELS, MARGIN, REACH = (6, 10), 1.05, 1.1
"""Levels of pressure and strain by which recorded states are grouped for these checks, range of the
map over that of the groups, and range of the checks without pressure over the recorded one."""
YIELD = "muscle.yield_force"
BORE = "muscle.diameter"
"""Size of the enclosed volume at rest; the force law gives how it grows."""
SPEEDS = tuple(f"regulator.speed_{share}" for share in (2, 6, 20, 60))
"""Characteristic of the valve: rate over error, by the error in percent of full pressure."""
INTEGRAL = ("regulator.integral", "regulator.integral_release")
START = "hysteresis.start"
"""Friction when the recording starts: of the recording, not of the plant."""
SETTINGS: dict[str, dict[str, Any]] = {
    "regulator.gain": {"scale": 0.01},
    "regulator.time_constant": {"log": True, "prior": 1.5},
    "muscle.area": {"log": True, "prior": 1.5},
    "muscle.area_taper": {"scale": 0.1, "prior": 60.0},
    "muscle.area_curve": {"scale": 0.5, "prior": 60.0},
    "muscle.braid_force": {"scale": 5.0, "prior": 60.0},
    "muscle.braid_strain": {"log": True, "prior": 1.0},
    "muscle.stiffness": {"scale": 100.0, "prior": 60.0},
    "muscle.softening": {"scale": 500.0, "prior": 60.0},
    "muscle.hardening": {"scale": 2e3, "prior": 60.0},
    "muscle.stiffening": {"scale": 1e4, "prior": 60.0},
    "mass.moving_mass": {"log": True, "prior": 0.7},
    "mass.damping": {"log": True, "prior": 1.0},
    BORE: {"log": True, "prior": 1.0},
    START: {"scale": 0.2, "prior": 5.0},
    "regulator.conductance": {"log": True, "prior": 3.0},
    "regulator.exhaust_share": {"log": True, "prior": 1.5},
    "regulator.critical_ratio": {"scale": 0.1, "prior": 3.0},
    "regulator.opening_band": {"log": True, "prior": 2.0},
    "regulator.opening_bend": {"scale": 0.2, "prior": 3.0},
    "regulator.polytropic": {"scale": 0.05, "prior": 4.0},
    "regulator.source_pressure": {"log": True, "prior": 0.5},
    "regulator.opening_lag": {"log": True, "low": 2e-3, "high": 0.3, "prior": 2.0},
    "regulator.opening_integral": {"log": True, "low": 0.1, "high": 50.0, "prior": 2.0},
    "regulator.opening_windup": {"log": True, "low": 0.01, "high": 1.0, "prior": 2.0},
    "regulator.pilot_lag": {"log": True, "low": 2e-3, "prior": 2.0},
    "regulator.pilot_damping": {"log": True, "low": 0.15, "high": 4.0, "prior": 1.0},
    "regulator.rate_lag": {"log": True, "low": 2e-3, "prior": 2.0},
    "regulator.integral": {"high": 300.0, "scale": 10.0, "prior": 10.0},
    "regulator.integral_release": {"log": True, "prior": 2.0},
    **{name: {"log": True, "low": 0.03, "high": 10.0, "prior": 1.5} for name in SPEEDS},
}
"""Base parameters with the settings of their fits that differ from the declarations."""
USUAL = {
    "mass.moving_mass": (0.05, 5.0),
    "mass.damping": (10.0, 1e4),
    "muscle.strand_per_pressure": (-2e-6, 1e-4),
    "muscle.yield_per_pressure": (-1e-3, 1e-3),
    **dict.fromkeys((*(f"muscle.strand_{k}" for k in (1, 2, 3, 4)), YIELD), (0.0, 500.0)),
    **dict.fromkeys((f"muscle.{name}" for name in MAP_SIZES), (-500.0, 500.0)),
}
"""Bounds of fits [SI], narrower than the declared ones, but widened by the start of a plant."""
SHARE, FACTOR = 0.2, 20.0
"""Ratios of the bounds of a fit to a start outside the usual bounds."""
LEAST_SCALE = 0.01
"""Least scale over the start, for forces of large muscles."""
FORCES = ("muscle.braid_force", "muscle.stiffness", "muscle.softening", "muscle.hardening")
ORIFICES = {
    "regulator.conductance": 3e-10,
    "regulator.exhaust_share": 1.0,
    "regulator.critical_ratio": 0.3,
    "regulator.opening_band": 4e4,
    "regulator.opening_bend": 0.0,
    "regulator.polytropic": 1.2,
    "regulator.source_pressure": 8e5,
}
"""Parameters of a regulator with flow through its orifices, with their starting values."""
CONDUCTANCES = (1e-10, 8e-10)
"""Conductances [m3/(s Pa)] at which a fit starts."""
SOURCE, LEAST_SOURCE = "regulator.source_pressure", 1.001
"""Pressure of the supply, and the least one over the largest setpoint."""
LAG = "regulator.time_constant"
PILOT = {"regulator.pilot_lag": 0.02, "regulator.pilot_damping": 1.0}
"""Starting values of the pilot stage of a regulator of second order."""
SPOOL = {"regulator.rate_lag": 0.02}
"""Starting value of the lag of the rate, of a regulator of second order whose rate is limited."""
SECOND_ORDER = (PILOT, SPOOL)
STAGES = frozenset(name for order in SECOND_ORDER for name in order)
"""Parameters of regulators of second order."""
OPENINGS = (
    {"regulator.opening_lag": 0.01},
    {"regulator.opening_integral": 4.0, "regulator.opening_windup": 0.3},
)
"""Starting values of the lag of a valve's opening, and of the integral part of its controller."""
CONTROL = frozenset(name for opening in OPENINGS for name in opening)
"""Parameters of the control of a valve with orifices."""
ELSEWHERE = {*STAGES, *INTEGRAL, *ORIFICES, *CONTROL, *SPEEDS, BORE, START}
BASE = tuple(name for name in SETTINGS if name not in ELSEWHERE)
CLOCK = "clock.offset"
"""Time [s] by which the readings lag the command: no parameter of the plant."""
USUAL_ROWS = 2.5
"""Sampling periods within which the clocks of command and readings agree, if not declared."""


def stages_of(plant: Any) -> list[str]:
    """Return parameters of the second order, integral part and opening that a plant's valve has."""
    stages = (*SECOND_ORDER, INTEGRAL, *OPENINGS)
    on = [stage for stage in stages if plant.value(next(iter(stage))) > 0.0]
    return [name for stage in on for name in stage if name not in plant.inert]


def clock_of(recording: Any, rig: Any) -> float:
    """Return the largest offset of the readings' clock [s]."""
    known = rig.clock_tolerance
    return USUAL_ROWS * recording.period if known is None else known  # type: ignore[no-any-return]


PLAIN_NEUTRAL = {
    "regulator.dead_time": 0.0,
    "regulator.slew_rate": 1e9,
    "hysteresis.stretch": 0.0,
    "hysteresis.width_per_load": 0.0,
}
"""Effects of the plain step, which ``SingleMuscle.neutral`` does not list."""
SWITCHED_OFF = {
    k: v for k, v in {**SingleMuscle.neutral, **PLAIN_NEUTRAL}.items() if k != "mass.carried"
}
"""Neutral values of all effects; the rig declares the other parameter."""


@dataclass(frozen=True)
class MuscleFamily:
    """Single muscle with the inputs of a recording."""

    plant: SingleMuscle
    inputs: Inputs
    clock: float = 0.0  # largest offset of the readings' clock [s]
    # recorded pressures [Pa] and strains at which the static law has to be monotone, (2, k)
    states: Array = field(default_factory=lambda: np.zeros((2, 0)))

    channels = CHANNELS
    fallback_noise = (5e-5, 1e3)
    scales = (1e-3, 1e5)
    units = ("mm", "bar")
    volumes = (BORE,)
    orifices = ORIFICES
    conductances = CONDUCTANCES

    def finer(self, step: float) -> "MuscleFamily":
        """Return the family with another longest sub-step of the simulation [s]."""
        return dataclasses.replace(self, inputs=dataclasses.replace(self.inputs, longest_step=step))

    @property
    def column(self) -> Array:
        """Parameters of the plant and the offset of the clock, shape (p + 1,)."""
        return np.append(self.plant.parameter_rows(), 0.0)

    @property
    def is_shut(self) -> bool:
        """Whether the valve is shut in some samples."""
        return bool(np.any(self.inputs.command < 0.0))

    @property
    def lead(self) -> int:
        """Number of samples by which the replay advances the command."""
        return int(np.ceil(self.clock / self.inputs.period - 1e-9))

    @cached_property
    def _advanced(self) -> Inputs:
        """Inputs with the command advanced within each run."""
        if self.lead == 0:
            return self.inputs
        n = len(self.inputs.command)
        ends = np.append(np.flatnonzero(self.inputs.fresh)[1:], n)
        last = np.repeat(ends, np.diff(ends, prepend=0)) - 1
        command = self.inputs.command[np.minimum(np.arange(n) + self.lead, last)]
        return dataclasses.replace(self.inputs, command=command)

    def simulate(self, columns: Array) -> Array:
        """Return sensor readings for parameter columns (n, p + 1), shape (2, T, n)."""
        given = columns[:, :-1].copy()
        ahead = self.lead * self.inputs.period
        given[:, R.REGULATOR_DEAD_TIME] += np.maximum(ahead + columns[:, -1], 0.0)
        return replay_rows(self.plant, given, self._advanced)

    def tie(self, columns: Array) -> None:
        """Keep the total slope of the hysteresis at 1."""
        n = self.plant.elements
        if n == 0:
            return
        weights = columns[:, R.WEIGHT : R.WEIGHT + n]
        total = weights.sum(axis=1)
        weights *= np.minimum(1.0, (1.0 - LEAST_LINEAR) / np.maximum(total, 1e-12))[:, None]
        columns[:, R.LINEAR] = 1.0 - weights.sum(axis=1)

    @property
    def checks(self) -> int:
        """Number of checks of the static law."""
        return 2 * self.states.shape[1]

    def violations(self, columns: Array) -> Array:
        """Return by how much static laws fail to be monotone, shape (n, checks).

        The force has to fall with contraction and rise with pressure, near the recorded states.
        """
        w, e = self.states[:, None]

        def value(name: str) -> Array:
            return columns[:, R.place(name), None]  # type: ignore[no-any-return]

        area, taper, curve = (value(f"muscle.area{part}") for part in ("", "_taper", "_curve"))
        braid = value("muscle.braid_strain")
        stiff = area * (taper + 2.0 * curve * e) * w
        stiff = stiff + value("muscle.braid_force") / braid * np.exp(-e / braid)
        stiff = stiff + value("muscle.stiffness") + 2.0 * value("muscle.softening") * e
        stiff = stiff + 3.0 * value("muscle.hardening") * e**2
        stiff = stiff + 4.0 * value("muscle.stiffening") * e**3
        gain = area * (1.0 - (taper + curve * e) * e)
        sizes = columns[:, R.MUSCLE_MAP_05 : R.MUSCLE_MAP_05 + len(MAP_TERMS)]
        slopes, gains = self._map_slopes
        stiff = stiff - np.tensordot(sizes, slopes, 1)
        gain = gain + np.tensordot(sizes, gains, 1)
        return not_monotone(stiff, gain, area)

    @cached_property
    def _map_slopes(self) -> tuple[Array, Array]:
        """Derivatives of the map's terms by strain and pressure at the states, (terms, k)."""
        _, by_pressure, by_strain = map_of(self.plant.muscle, *self.states)
        return by_strain, by_pressure

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter; ``changes`` override its declaration."""
        if name.startswith("hysteresis.weight["):
            k = int(name.removeprefix("hysteresis.weight[")[:-1])
            weight = dict(low=0.0, high=1.0, scale=0.02, prior=25.0)
            start = float(self.column[R.WEIGHT + k])
            return Free(name, R.WEIGHT + k, **{**weight, "start": start, **changes})
        if name == CLOCK:
            return clock_free(self.clock, len(self.column) - 1, changes)
        d, value = self.plant.declaration(name), self.plant.value(name)
        made = dict(low=d.low, high=d.high, start=value)
        made["scale"] = max(abs(value), 0.01 * (d.high - d.low)) * 0.1
        if name in USUAL:
            low, high = USUAL[name]
            least = SHARE * value if value > 0.0 else FACTOR * value
            made["low"] = max(d.low, min(low, least))
            made["high"] = min(d.high, max(high, FACTOR * value))
        if name == SOURCE:  # a muscle is filled from above its largest setpoint
            made["low"] = max(d.low, LEAST_SOURCE * self.plant.regulator.max_pressure)
        made |= SETTINGS.get(name, {})
        if name in FORCES:
            made["scale"] = max(made["scale"], LEAST_SCALE * abs(value))
        return Free(name, R.place(name), **{**made, **changes})

    def base(self) -> tuple[Free, ...]:
        """Return the base parameters, with those of effects that the plant already has."""
        flows = self.plant.air == "flow"
        names = [name for name in BASE if not (flows and name == LAG)]
        names += [*((*ORIFICES, BORE) if flows else ()), *((CLOCK,) if self.clock > 0.0 else ())]
        names += stages_of(self.plant)
        names += [f"hysteresis.weight[{k}]" for k in range(self.plant.elements)]
        present = [
            name
            for name, off in SWITCHED_OFF.items()
            if name not in names and name != SWITCH and self.plant.value(name) != off
        ]
        return tuple(self.free(name) for name in (*names, *present))

    def plant_of(self, column: Array) -> SingleMuscle:
        """Return the plant with the parameters of a column."""
        values: dict[str, Any] = {n: float(column[R.place(n)]) for n in R.NAMES}
        values[START] = self.plant.value(START)
        if not any(values[f"muscle.{name}"] for name in MAP_SIZES):
            values |= UNUSED_MAP
        n = self.plant.elements
        if n:
            operator: Any = self.plant.hysteresis.operator
            weights = tuple(float(w) for w in column[R.WEIGHT : R.WEIGHT + n])
            values["hysteresis.operator"] = PlayOperator(
                operator.thresholds, weights, 1.0 - sum(weights)
            )
        return self.plant.replace_with_substeps(values)


def clock_free(most: float, place: int, changes: Mapping[str, Any]) -> Free:
    """Return the fit settings of the offset of a clock, at most ``most`` [s]."""
    made = dict(low=-most, high=most, scale=0.01, start=0.0, prior=50 * most)
    return Free(CLOCK, place, **{**made, **changes})


def not_monotone(stiff: Array, gain: Array, area: Array) -> Array:
    """Return by how much laws fail to be monotone, over a tolerance, shape (n, 2 k).

    ``stiff`` (n, k) is the stiffness over strain [N], ``gain`` (n, k) the slope of the force by
    pressure [m2], and ``area`` (n, 1) a usual slope.
    """
    lacks = np.maximum(0.0, LEAST_STIFFNESS - stiff / LEAST_STIFFNESS_OF)
    flat = np.maximum(0.0, LEAST_GAIN - gain / area)
    return NOT_MONOTONE * np.concatenate([lacks, flat], axis=1)


def map_of(
    law: Any, pressure: Array, strain: Array, terms: Sequence[tuple[int, int]] = MAP_TERMS
) -> tuple[Array, Array, Array]:
    """Return the terms of a map at pressures [Pa] and strains (k,), and their derivatives by each.

    Each has the shape (terms, k); beyond the range of the map they are those of its edge.
    """
    u = np.clip(2.0 * pressure / law.map_pressure - 1.0, -1.0, 1.0)
    s = np.clip(2.0 * strain / law.map_strain - 1.0, -1.0, 1.0)
    eye = np.eye(6)
    of = np.array([chebval(u, eye[p]) for p, _ in terms])
    by = np.array([chebval(u, chebder(eye[p])) * 2.0 / law.map_pressure for p, _ in terms])
    of_e = np.array([chebval(s, eye[q]) for _, q in terms])
    by_e = np.array([chebval(s, chebder(eye[q])) * 2.0 / law.map_strain for _, q in terms])
    return of * of_e, by * of_e, of * by_e


RANGE = "map_pressure", "map_strain"
UNUSED_MAP = {f"muscle.{name}": getattr(EffectiveAreaMuscle, name) for name in RANGE}
"""Range of a map without terms."""


def states_of(contraction: Array, pressure: Array, plant: SingleMuscle) -> Array:
    """Return mean pressures [Pa] and strains of groups of recorded states, and beside, (2, k).

    ``contraction`` [m] and ``pressure`` [Pa] have the shape (T,), NaN where there is no reading.
    """
    return grouped(contraction / plant.muscle.rest_length, pressure)


def grouped(strain: Array, pressure: Array, slack: bool = True) -> Array:
    """Return :func:`states_of` readings of strain and pressure [Pa], (T,).

    ``slack``: with states without pressure.
    """
    seen = np.isfinite(strain) & np.isfinite(pressure)
    if not seen.any():
        return np.zeros((2, 0))
    found = np.array([pressure[seen], strain[seen]])
    low, high = found.min(axis=1), found.max(axis=1)
    spans = np.maximum(high - low, 1e-9)[:, None] / np.reshape(LEVELS, (2, 1))
    levels = np.minimum((found - low[:, None]) // spans, np.reshape(LEVELS, (2, 1)) - 1.0)
    _, group = np.unique(levels[0] * LEVELS[1] + levels[1], return_inverse=True)
    counts = np.bincount(group)
    middle = np.array([np.bincount(group, values) / counts for values in found])
    steps = np.vstack([np.zeros(2), np.diag(spans[:, 0]), -np.diag(spans[:, 0])])
    near = (middle[:, None] + steps.T[:, :, None]).reshape(2, -1)
    near[0] = np.maximum(near[0], 0.0)
    if not slack:
        return near
    empty = np.linspace(0.0, REACH * high[1], LEVELS[1])  # where a start looks for its rest
    return np.hstack([near, [np.zeros(LEVELS[1]), empty]])


def spanning(plant: SingleMuscle, states: Array) -> SingleMuscle:
    """Return a plant whose map, if it has none yet, spans recorded states (:func:`states_of`)."""
    if plant.muscle.finer or not states.size:
        return plant
    return with_range(plant, "muscle", dict(zip(RANGE, MARGIN * states.max(1), strict=True)))


def with_range(plant: P, component: str, ends: Mapping[str, float]) -> P:
    """Return a plant with the range of the map of a component, within its bounds."""
    made = {}
    for name, end in ends.items():
        bounds = plant.declaration(f"{component}.{name}")
        made[f"{component}.{name}"] = float(np.clip(end, bounds.low, bounds.high))
    return plant.replace(made)


def spread(thresholds: Sequence[float]) -> PlayOperator:
    """Return play operators of equal weight at thresholds [Pa], where a fit of them starts."""
    weights = np.full(len(thresholds), SHARE_OF_PLAYS / len(thresholds))
    return PlayOperator(tuple(thresholds), tuple(weights), 1.0 - float(weights.sum()))


def start_plant(rig: Any) -> SingleMuscle:
    """Return the default plant of a rig: the shipped muscle, scaled, without any effect."""
    stock = SingleMuscle.mas10("maxwell_slip")
    values: dict[str, Any] = {
        **PLAIN_NEUTRAL,
        "hysteresis.operator": spread(THRESHOLDS),
        "mass.load": 0.0,
        "muscle.area_taper": 1.0,
        "muscle.braid_strain": 0.03,
        "mass.carried": 0.0 if rig.load == "constant_force" else 1.0,
    }
    if rig.rest_length is not None:
        values["muscle.rest_length"] = rig.rest_length
    if rig.diameter is not None:
        ratio = (rig.diameter / stock.muscle.diameter) ** 2
        values["muscle.diameter"] = rig.diameter
        for name in ("muscle.area", "muscle.braid_force", "muscle.stiffness", "muscle.hardening"):
            values[name] = stock.value(name) * ratio
    if rig.max_pressure is not None:
        values["regulator.max_pressure"] = rig.max_pressure
    made = dataclasses.replace(stock, ensemble=()).replace(values)
    return dataclasses.replace(made, provenance=known_of(rig, values))


GIVEN = {
    "muscle.rest_length": "rest_length",
    "muscle.diameter": "diameter",
    "regulator.max_pressure": "max_pressure",
}
"""Parameters that a rig file may declare, with the attribute of the rig."""


def known_of(rig: Any, values: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Return provenance and source of the assumed parameters of the default plant."""
    made = {name: ("assumed", TAKEN) for name in values if name != "hysteresis.operator"}
    for name, attribute in GIVEN.items():
        given = getattr(rig, attribute) is not None
        made[name] = ("assumed", "declared, RIG.yaml" if given else TAKEN)
    made["mass.carried"] = ("assumed", f"load: {rig.load}, RIG.yaml or its default")
    return made


TAKEN = "assumed by pam-envs diagnose, not fitted"


def identified(plant: P, frees: Iterable[Free], source: str) -> P:
    """Return a plant with the provenance of its fitted parameters."""
    found = {f.name: ("identified", source) for f in frees if f.name in plant.names}
    return dataclasses.replace(plant, provenance={**plant.provenance, **found})


def inputs_of(recording: Any, rig: Any) -> Inputs:
    """Return the inputs of a recording for the replay."""
    n = len(recording.time)
    command = np.where(recording.valve_closed, -1.0, recording.command)
    first = np.zeros(n, bool)
    if rig is not None and rig.rezeroed:
        first[1:] = recording.segment[1:] != recording.segment[:-1]
    kelvin = np.full(n, 20.0) if recording.temperature is None else recording.temperature
    return Inputs(
        recording.period,
        command,
        recording.load / GRAVITY,
        kelvin + CELSIUS,
        recording.restart.copy(),
        np.maximum(0.0, recording.command),
        first,
    )
