"""Base of plants that are replayed by their compiled loops, with parameter columns."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import MANY_CYCLES, SHUT_SECONDS, longest_shut
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.calibrate import Calibration, replayed_by
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base
from pam_envs.diagnosis.fit.least_squares import (
    LANES,
    Fit,
    Free,
    Problem,
    column_of,
    no_violations,
)
from pam_envs.diagnosis.fit.regulator_kind import (
    FITS,
    ORDER_GAIN,
    Selection,
    column_with,
    second_orders,
    simplest,
    start_at_guess,
)
from pam_envs.diagnosis.fit.single_muscle import (
    BORE,
    CLOCK,
    CONTROL,
    INTEGRAL,
    LAG,
    LEAST_SOURCE,
    ORIFICES,
    SETTINGS,
    SOURCE,
    SPEEDS,
    STAGES,
    clock_free,
    identified,
    stages_of,
)
from pam_envs.hysteresis.protocol import ELEMENTS
from pam_envs.parameters import Declaration
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.core.rollout import BEGIN, run
from pam_envs.pneumatics.flow import SWITCH

OFFSET = Declaration("s", -1.0, 1.0, "assumed", "offset of the readings' clock", 0.0)
CLOCK_PRIOR = 0.3
"""Prior of that offset, over its scale: a delay is a dead time unless readings are early."""
WEIGHT = "hysteresis.weight["
WEIGHTS = Declaration("1", 0.0, 1.0, "assumed", "weight of an element of the hysteresis")
ROUNDS, VALVE_ROUNDS = 25, 12
INSTANT = {"dead_time": 0.0, "slew_rate": 1e9, "gain": 1.0}
"""Parameters of a regulator whose pressures are the measured ones."""
VALVES = (*STAGES, *SPEEDS, *INTEGRAL, *ORIFICES, *CONTROL, BORE)
VALVE_SETTINGS = {name: SETTINGS[name] for name in VALVES}
"""Settings of the fit of regulators of other kinds than a lag of first order."""
LESS, MORE = 0.4, 2.5
"""Starting values of the orifice conductance, over that of the plant."""
LEAST_LAG = 2e-3
"""Least time constant of a regulator [s]."""
CONDUCTANCE = "regulator.conductance"

Causes = Sequence[Cause]


class UsualStart:
    """Defaults of a family whose base is fitted at once, from its usual start."""

    last: ClassVar[tuple[str, ...]] = ()
    """Base parameters that are fitted after the others, with which a fit converges less often."""
    limits: ClassVar[tuple[bool, ...]] = (True,)
    """Whether steps of a fit of the base are also limited by parameter; the best fit is kept."""
    linear: ClassVar[bool] = True
    """Whether a linear model may show that a difference is needed, without a refit."""
    volumes: ClassVar[tuple[str, ...]] = ()
    """Sizes of enclosed volumes, which are fitted with flow through orifices."""

    def guesses(
        self, measured: Array, noise: Array, column: Array
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Return starting values of the base, and of the flexible base.

        From readings (channels, T) with a noise (channels,), and a column with their regulator.
        """
        return {}, {}

    def flexible_guess(self, found: Mapping[str, float]) -> dict[str, float]:
        """Return starting values of the flexible base from the fitted values of the base."""
        return dict(found)

    def spanning(self, measured: Array) -> Any:
        """Return the family for readings (channels, T), NaN where there is none."""
        return self


@dataclass(frozen=True)
class CompiledFamily(UsualStart):
    """Plant with the inputs of a recording, replayed by its compiled loop.

    Attributes
    ----------
    plant : Plant
    period : float
        Sampling period [s].
    drives : ndarray, shape (channels, T, 1)
        Inputs [SI] in the order of the family's loop.
    fresh : ndarray of bool, shape (T,)
        Samples at which the plant restarts from rest.
    regulator : object or None
        The regulator of the given plant where, for lack of commands, the measured pressures are
        the inputs, and follow at once.
    commands : tuple of int
        Channels of the drives that are setpoints.
    clock : float
        Largest offset of the readings' clock [s].
    """

    plant: Any
    period: float
    drives: Array
    fresh: NDArray[np.bool_]
    regulator: Any = None
    commands: tuple[int, ...] = ()
    clock: float = 0.0

    channels: ClassVar[tuple[str, ...]]
    settings: ClassVar[Mapping[str, Mapping[str, Any]]]
    longest_step: ClassVar[float] = 0.0051
    linear: ClassVar[bool] = False

    @property
    def measured_drive(self) -> bool:
        """Whether the measured pressures are the inputs."""
        return self.regulator is not None

    @property
    def is_shut(self) -> bool:
        """Whether a valve is shut in some samples."""
        return any(bool(np.any(self.drives[k] < 0.0)) for k in self.commands)

    @property
    def orifices(self) -> dict[str, float]:
        """Parameters of regulators with flow through their orifices, with starting values."""
        return ORIFICES | {CONDUCTANCE: self.plant.value(CONDUCTANCE)}

    @property
    def conductances(self) -> tuple[float, ...]:
        """Conductances of orifices [m3/(s Pa)] at which a fit starts."""
        return tuple(share * self.plant.value(CONDUCTANCE) for share in (LESS, MORE))

    def finer(self, step: float) -> "CompiledFamily":
        """Return the family itself, whose sub-steps are short enough."""
        return self

    @property
    def column(self) -> Array:
        """Parameters of the plant and the offset of the clock, shape (p + 1,)."""
        return np.append(self.plant.parameter_rows(), 0.0)

    @property
    def lead(self) -> int:
        """Number of samples by which a replay with early readings advances the setpoints."""
        return int(np.ceil(self.clock / self.period - 1e-9))

    @cached_property
    def _advanced(self) -> Array:
        """Drives with the setpoints advanced within each run, but for its first sample."""
        if self.lead == 0:
            return self.drives
        n = self.drives.shape[1]
        starts = np.flatnonzero(self.fresh)
        ends = np.append(starts[1:], n)
        last = np.repeat(ends, np.diff(ends, prepend=0)) - 1
        ahead = np.minimum(np.arange(n) + self.lead, last)
        ahead[starts] = starts
        made = self.drives.copy()
        for k in self.commands:
            made[k] = self.drives[k][ahead]
        return made

    @property
    def loop(self) -> Any:
        """Loop whose outputs are the channels."""
        return self.plant.module("rollout").loop_of(self.plant, True, readings=True)

    def simulate(self, columns: Array) -> Array:
        """Return sensor readings for parameter columns (n, p + 1), shape (channels, T, n).

        An offset of the clock adds to the dead time; where their sum is below zero, readings
        precede the recorded setpoints, and these are advanced.
        """
        given = columns[:, :-1]
        if self.lead == 0:
            return self._run(given, self.drives)
        given, late = given.copy(), self.plant.names.index("regulator.dead_time")
        given[:, late] += columns[:, -1]
        early = given[:, late] < 0.0
        given[early, late] = np.maximum(given[early, late] + self.lead * self.period, 0.0)
        if early.all():
            return self._run(given, self._advanced)
        if not early.any():
            return self._run(given, self.drives)
        made = np.empty((len(columns), len(self.channels), len(self.fresh))).transpose(1, 2, 0)
        made[:, :, early] = self._run(given[early], self._advanced)
        made[:, :, ~early] = self._run(given[~early], self.drives)
        return made

    def _run(self, columns: Array, drives: Array) -> Array:
        """Return sensor readings with drives for plants' columns (n, p), (channels, T, n)."""
        substeps = max(1, int(np.ceil(self.period / self.longest_step)))
        flags = np.where(self.fresh, BEGIN, 0).astype(np.int64)
        made = run(
            self.loop, self.plant, columns, drives, flags=flags, substeps=substeps,
            period=self.period, before=True, lanes=LANES, parallel=True,
        )  # fmt: skip
        outputs = np.ascontiguousarray(made[: len(self.channels)].transpose(2, 0, 1))
        return outputs.transpose(1, 2, 0)  # plants apart in memory: residuals are read one by one

    def tie(self, columns: Array) -> None:
        """Complete columns: none needs it."""

    @property
    def checks(self) -> int:
        """Number of checks of :meth:`violations`."""
        return 0

    def violations(self, columns: Array) -> Array:
        """Return by how much columns are not physical: bounds suffice."""
        return no_violations(columns)

    @property
    def _weights(self) -> int:
        """First row of the weights of the hysteresis in a column."""
        return len(self.plant.names) + 2 + ELEMENTS

    @property
    def elements(self) -> int:
        """Number of elements of the hysteresis with a weight that a fit adapts."""
        operator = self.plant.hysteresis.operator
        return len(getattr(operator, "weights", ()))

    def friction_of(self, found: Mapping[str, float]) -> tuple[float, float]:
        """Return slip force and stiffness of the elements with fitted weights, over the friction's.

        Both are 0 without weights.
        """
        thresholds = np.array(getattr(self.plant.hysteresis.operator, "thresholds", ()))
        weights = np.array([found.get(f"{WEIGHT}{k}]", 0.0) for k in range(len(thresholds))])
        return float(weights @ thresholds), float(weights.sum())

    def declared(self, name: str) -> Declaration:
        """Return the declaration of a free parameter."""
        if name.startswith(WEIGHT):
            return WEIGHTS
        if name == CLOCK:
            return OFFSET
        found: Declaration = self.plant.declaration(name)
        return found

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter; ``changes`` override its declaration."""
        if name.startswith(WEIGHT):
            place = self._weights + int(name.removeprefix(WEIGHT)[:-1])
            usual = {"low": 0.0, "high": 1.0, "scale": 0.02, "prior": 25.0}
            return Free(name, place, **{**usual, "start": float(self.column[place]), **changes})
        if name == CLOCK:
            return clock_free(self.clock, len(self.column) - 1, {"prior": CLOCK_PRIOR, **changes})
        d, value = self.declared(name), self.plant.value(name)
        made: dict[str, Any] = {"low": d.low, "high": d.high, "start": value}
        made["scale"] = max(abs(value), 0.01 * (d.high - d.low)) * 0.1
        if name == SOURCE:  # a muscle is filled from above its largest setpoint
            made["low"] = max(d.low, LEAST_SOURCE * self.plant.regulator.max_pressure)
        place = self.plant.names.index(name)
        usual = VALVE_SETTINGS.get(BORE if name in self.volumes else name, {})
        settings = {**usual, **self.settings.get(name, {})}
        return Free(name, place, **{**made, **settings, **changes})

    def base(self) -> tuple[Free, ...]:
        """Return the base parameters, with those of effects that the plant already has."""
        plant, inert = self.plant, self.plant.inert
        names = [n for n in self.settings if not (self.measured_drive and in_valve(n))]
        if not self.measured_drive:
            names += stages_of(plant)
            names += (*ORIFICES, *self.volumes) if plant.air == "flow" else ()
        names = [name for name in names if name not in inert]
        names += [CLOCK] if self.lead else []
        names += [f"{WEIGHT}{k}]" for k in range(self.elements)]
        present = [
            name
            for name, off in plant.neutral.items()
            if name not in (*names, *inert)
            and name != SWITCH
            and plant.value(name) != off
            and not (self.measured_drive and in_valve(name))
        ]
        return tuple(self.free(name) for name in (*names, *present))

    def plant_of(self, column: Array) -> Any:
        """Return the plant with the parameters of a column."""
        values: dict[str, Any] = dict(
            zip(self.plant.names, map(float, column[: len(self.plant.names)]), strict=True)
        )
        n = self.elements
        if n:
            weights = tuple(map(float, column[self._weights : self._weights + n]))
            operator = dataclasses.replace(self.plant.hysteresis.operator, weights=weights)
            values["hysteresis.operator"] = operator
        made = self.plant.replace_with_substeps(values)
        return dataclasses.replace(made, regulator=self.regulator or made.regulator)

    def identified(self, plant: Any, frees: Iterable[Free], source: str) -> Any:
        """Return a plant with the provenance of its fitted parameters."""
        return identified(plant, frees, source)

    def needs_of_any(self, recording: Recording, sheet: Rig) -> dict[str, tuple[bool, str]]:
        """Return whether a recording meets the needs that all plants have in common, and why."""
        return {
            "pressure": (
                any(c.startswith("pressure") for c in recording.outputs)
                and not self.measured_drive,
                "the pressures are inputs, for lack of commands"
                if self.measured_drive
                else "no pressure was recorded",
            ),
            "command": (
                not self.measured_drive,
                "no command was recorded, and the measured pressures drive the replay: the valve "
                "cannot be judged",
            ),
            "temperature": (False, "the replay of this plant has no input for a temperature"),
            "weighed": (False, "this plant has no parameter for an error of its loads"),
            "valve_closed": (
                longest_shut(recording) > SHUT_SECONDS and not self.measured_drive,
                f"the valve was never shut for more than {SHUT_SECONDS:g} s (valve_closed in "
                "RIG.yaml)",
            ),
            "rest": (
                sheet.cycles_since_rest <= MANY_CYCLES,
                f"the muscles had already made {sheet.cycles_since_rest} cycles since they rested",
            ),
        }


def in_valve(name: str) -> bool:
    """Return whether a parameter acts upstream of the pressure."""
    return name.startswith(("regulator.", "valve.", "clock."))


def shut_off(values: Array, recording: Recording) -> Array:
    """Return setpoints [Pa], below zero where the valve is shut, but for the start of a run."""
    shut = recording.valve_closed & ~recording.restart
    return np.where(shut, -1.0, np.maximum(0.0, values))


def with_measured_drive(plant: Plant, period: float) -> Any:
    """Return a plant whose pressures pass through readings that are its setpoints one row ahead.

    Half a period of lag makes the mean delay zero (:func:`one_ahead`).
    """
    changes = {f"regulator.{name}": value for name, value in INSTANT.items()}
    changes["regulator.time_constant"] = max(LEAST_LAG, 0.5 * period)
    off = {n: v for n, v in plant.neutral.items() if in_valve(n)}
    return plant.replace({n: v for n, v in {**off, **changes}.items() if n in plant.names})


def one_ahead(values: Array, recording: Recording) -> Array:
    """Return readings one row ahead within each run, shape (T,)."""
    ahead = np.append(values[1:], values[-1])
    last = np.append(recording.restart[1:], True)
    return np.where(last, values, ahead)


def regulator_of(
    problem: Problem, family: Any, blocks: Blocks
) -> tuple[Any, Mapping[str, float], Array]:
    """Return the plant with the regulator that the pressures need, its values, and the column.

    Of first order, or of second order if it is better on held-out pressures.
    """
    valve = tuple(f for f in family.base() if in_valve(f.name))
    pressures = np.array([c.startswith("pressure") for c in family.channels])
    alone = np.where(pressures[:, None], problem.measured, np.nan)
    if not valve or not np.isfinite(alone).any():
        return family, {}, family.column
    only = dataclasses.replace(problem, measured=alone, violations=no_violations, checks=0)
    orders = [valve]
    if family.plant.air == "regulator":
        orders += second_orders(family, valve)
    fits = [Fit.at_start(frees, family.column) for frees in orders]
    chosen = simplest(only, blocks, fits, VALVE_ROUNDS)
    found = chosen.values()
    stages = {name: found[name] for name in STAGES if name in found}
    family = dataclasses.replace(family, plant=family.plant.replace(stages))
    return family, found, column_of(chosen, chosen.z)


def further_regulator(
    problem: Problem,
    family: Any,
    blocks: Blocks,
    base: Candidate,
    limit: Cause,
    causes: Causes,
) -> tuple[Any, Mapping[str, float]] | None:
    """Return a family with another kind of regulator and its values, if pressures need one.

    The regulator is simulated under the fitted motion, which changes the volume of the muscles.
    """
    pressures = [c.startswith("pressure") for c in family.channels]
    if family.measured_drive or {LAG, CONDUCTANCE}.isdisjoint(f.name for f in family.base()):
        return None
    if np.max(blocks.means(base.errors)[pressures], initial=0.0) < FITS:
        return None
    plant = family.plant_of(column_of(base.fit, base.fit.z))
    moved = dataclasses.replace(family, plant=plant)
    found, fit = Selection(problem, moved, blocks, limit, causes, lambda _: {}).kind()
    changed = {
        n: found.plant.value(n) for n in plant.names if found.plant.value(n) != plant.value(n)
    }
    if set(changed) <= STAGES:  # no other kind than the base's
        return None
    made = family.plant.replace_with_substeps(changed)
    return dataclasses.replace(family, plant=made), fit.values()


def calibrate_compiled(
    family: Any,
    measured: Array,
    noise: Array,
    blocks: Blocks,
    time: Array,
    shapes: Array,
    limit: Cause | None = None,
    causes: Causes = (),
) -> Calibration:
    """Fit the base of a plant: the regulator to the pressures alone, then all parameters.

    If the pressures need another kind of regulator than a lag, it is selected with ``limit``, the
    cause of a rate limit, and with those of the other ``causes`` that act on the pressures. Without
    ``limit``, no other kind is tried.
    """
    family = family.spanning(measured)
    problem = Problem(
        *(family.simulate, measured, noise, blocks.train, time, family.tie, shapes),
        violations=family.violations,
        checks=family.checks,
    )
    family, found, column = regulator_of(problem, family, blocks)
    made = fitted(problem, family, blocks, found, column)
    if limit is None:
        return made
    other = further_regulator(made.problem, family, blocks, made.base, limit, causes)
    if other is None:
        return made
    again, valve = other
    known = made.base.fit.values() | dict(valve)
    column = column_with(again, {f.name: known[f.name] for f in again.base() if f.name in known})
    better = fitted(problem, again, blocks, valve, column)
    return better if blocks.gain(made.base.errors, better.base.errors) > ORDER_GAIN else made


def fitted(
    problem: Problem, family: Any, blocks: Blocks, found: Mapping[str, float], column: Array
) -> Calibration:
    """Fit all base parameters, starting from regulator values and the column that has them."""
    measured, noise = problem.measured, problem.noise
    problem = replayed_by(family, problem)
    law, wide = family.guesses(measured, noise, column)
    usual = start_at_guess(family.base(), dict(found))
    starts = [tuple(free for free in usual if free.name not in family.last)]
    if law:
        starts.append(start_at_guess(family.base(), {**found, **law}))
    tried = [fit_base(problem, blocks, column, starts, ROUNDS, boxed) for boxed in family.limits]
    base = min(tried, key=lambda found: found.fit.cost)
    if family.last:
        whole = start_at_guess(family.base(), base.fit.values())
        base = fit_base(problem, blocks, column, [whole], ROUNDS, boxed=True)
    values = base.fit.values()
    guesses = [family.flexible_guess(values)]
    if wide:
        # not from the fit, which a large difference of the muscles may have led astray
        guesses.append(family.flexible_guess({**{f.name: f.start for f in usual}, **wide}))
    return Calibration(family, problem, base, tuple(guesses), {}, linear=family.linear)
