"""Plants whose muscles have pressure regulators, replayed from setpoints or measured pressures."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array, Flags
from pam_envs.constants import BAR
from pam_envs.data.recording.channels import WIRINGS
from pam_envs.data.recording.clock import runs_of
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import Audit, audit_channels, levels_of
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.causes import by_name
from pam_envs.diagnosis.experiment.channel_plans import ChannelMeans, ChannelPlan, channel_plans
from pam_envs.diagnosis.experiment.plans import PERIOD
from pam_envs.diagnosis.families.adapted import adapted
from pam_envs.diagnosis.families.compiled import (
    CompiledFamily,
    calibrate_compiled,
    one_ahead,
    shut_off,
    with_measured_drive,
)
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.calibrate import Calibration
from pam_envs.diagnosis.fit.least_squares import no_violations
from pam_envs.diagnosis.fit.single_muscle import (
    SETTINGS,
    clock_of,
    map_of,
    not_monotone,
    with_range,
)
from pam_envs.diagnosis.fit.starting_values import Grid
from pam_envs.diagnosis.plant_protocol import Experiment, Loop, Output
from pam_envs.muscle.law_correction import NAMES as TERM_NAMES
from pam_envs.muscle.law_correction import TERMS, LawCorrection
from pam_envs.plants.core.rollout import drives_of
from pam_envs.wording import near

REGULATOR: dict[str, dict[str, Any]] = {
    **{name: SETTINGS[name] for name in ("regulator.gain", "regulator.time_constant")},
    "regulator.dead_time": {"scale": 0.01},
    "regulator.slew_rate": {"log": True, "high": 1e8, "prior": 2.0},
}
"""Settings of the fit of a regulator's parameters."""
FALL = 0.5 * BAR
"""Fall of a setpoint [Pa] from which a recording shows the exhaust."""
FORGOTTEN, FIRST = 0.2, 5
"""Motion over the range of a recording from which friction has forgotten its start, and the number
of readings of the rest at the start."""
RANGE = "map_pressure", "map_least", "map_strain"
"""Parameters of the range of a correction."""
DRIVE_GAIN = 0.1
"""Gain on held-out blocks from which the friction of a base has the other drive: a tenth less of
the mean square, beyond what the draw of the blocks changes."""
PAYLOAD_STEP = 0.05
"""Largest difference of payloads of one level [kg]."""
NOISE = {"angle": 1e-3, "pressure": 1e3, "torque": 0.02, "force": 0.5, "tension": 1.0}
"""RMS of the noise [SI] where a recording shows none, by the first word of a channel."""


@dataclass(frozen=True)
class RegulatedFamily(CompiledFamily):
    """Plant with the inputs of a recording; outputs are readings of sensors, and loads and torques.

    ``channels`` holds names of the plant's sensors, in their order, then of further signals;
    ``states`` are recorded pressures [Pa] and strains at which the static law has to be monotone,
    (2, k).
    """

    states: Array = field(default_factory=lambda: np.zeros((2, 0)))

    pairs: ClassVar[Mapping[str, str]]
    """Name of each setpoint to that of its pressure."""
    law: ClassVar[str] = ""
    """Component with the correction of the static law."""

    @property
    def abreast(self) -> float:
        """Number of muscles side by side with whose force a law is checked."""
        return 1.0

    def recorded_states(self, measured: Array) -> Array:
        """Return groups of pressures [Pa] and strains of readings (channels, T), (2, k)."""
        return np.zeros((2, 0))

    def law_slopes(self, columns: Array, pressure: Array, strain: Array) -> tuple[Array, ...]:
        """Return slopes of the laws of columns (n, p), without correction, at states (k,).

        Stiffness over strain [N] and slope by pressure [m2], (n, k), and a usual slope, (n, 1).
        """
        raise NotImplementedError

    def spanning(self, measured: Array) -> "RegulatedFamily":
        """Return the family whose correction of the law spans readings (channels, T)."""
        states = self.recorded_states(measured) if self.law else self.states
        plant = self.plant
        if states.size and not getattr(plant, self.law).corrects:
            (_, least), (full, most) = states.min(1), states.max(1)
            ends = {"map_pressure": full, "map_least": least, "map_strain": most - least}
            plant = with_range(plant, self.law, ends)
        return dataclasses.replace(self, plant=plant, states=states)

    @property
    def checks(self) -> int:
        """Number of checks of the static law."""
        return 2 * self.states.shape[1]

    def violations(self, columns: Array) -> Array:
        """Return by how much static laws fail to be monotone, shape (n, checks)."""
        if not self.states.size:
            return no_violations(columns)
        pressure, strain = self.states
        stiff, gain, usual = self.law_slopes(columns, pressure, strain)
        sizes = columns[:, [self.plant.names.index(f"{self.law}.{name}") for name in TERM_NAMES]]
        by_pressure, by_strain = self._correction_slopes
        sizes = self.abreast * sizes
        return not_monotone(stiff - sizes @ by_strain, gain + sizes @ by_pressure, usual)

    @cached_property
    def _correction_slopes(self) -> tuple[Array, Array]:
        """Derivatives of the correction's terms by pressure and strain, each (terms, k)."""
        law, (pressure, strain) = getattr(self.plant, self.law), self.states
        return map_of(law, pressure, strain - law.map_least, TERMS)[1:]

    def plant_of(self, column: Array) -> Any:
        """Return the plant with the parameters of a column; an unused map has its usual range."""
        made = super().plant_of(column)
        if not self.law or getattr(made, self.law).corrects:
            return made
        usual = {name: getattr(LawCorrection, name) for name in RANGE}
        return made.replace({f"{self.law}.{name}": value for name, value in usual.items()})

    def signal_rows(self) -> Mapping[str, int]:
        """Return the row of state of each signal that is no reading."""
        return self.plant.module("rollout").OUTPUTS  # type: ignore[no-any-return]

    @property
    def loop(self) -> Any:
        """Loop whose outputs are the channels."""
        loop, rows = super().loop, self.signal_rows()
        biases = self.plant.module("rollout").readings_of(self.plant)
        places = dict(zip(biases, loop.outputs, strict=True))
        read = [c for c in self.channels if c in places]
        return dataclasses.replace(
            loop,
            name=f"{loop.name}_diagnosed",
            kernels={**loop.kernels, "BIAS_ROWS": tuple(biases[c] for c in read)},
            outputs=tuple(places.get(c, rows.get(c, 0)) for c in self.channels),
        )

    def setpoints(self, recording: Recording, names: Iterable[str] = ()) -> list[Array]:
        """Return setpoints [Pa], all by default; without commands the measured pressures."""
        return [
            recording.inputs[s] if s in recording.inputs else recording.outputs[self.pairs[s]]
            for s in names or self.pairs
        ]

    def unmet_needs(self, recording: Recording, sheet: Rig) -> dict[str, str]:
        """Return the needs of causes that a recording does not meet, and why."""
        load = recording.inputs.get("payload", np.zeros(1))
        falls = any(np.any(np.maximum.accumulate(v) - v > FALL) for v in self.setpoints(recording))
        moved = [c for c in self.channels if c not in self.pairs.values()]
        weighs = "payload" in {c.name for c in WIRINGS[self.plant.family].inputs}
        needs = self.needs_of_any(recording, sheet) | {
            "contraction": (
                any(c in recording.outputs for c in moved),
                f"none of {', '.join(moved)} was recorded",
            ),
            "loads": (
                np.ptp(load) > PAYLOAD_STEP,
                f"the payload was {float(load[0]):.3g} kg throughout"
                if weighs
                else "the replay of this plant has no input for a load",
            ),
            "exhaust": (falls, "no commanded pressure ever falls by more than 0.5 bar"),
        }
        return {word: reason for word, (met, reason) in needs.items() if not met}


def planned(plan: ChannelPlan, recording: Recording) -> Recording:
    """Return the recording of a planned experiment; all other channels keep their mean."""
    labels, shut = plan.labels
    time = PERIOD * np.arange(len(labels))
    held = {name: np.full(len(time), v.mean()) for name, v in recording.inputs.items()}
    outputs = {name: float(v.mean()) for name, v in recording.outputs.items()}
    return Recording.of_channels(
        time,
        held | plan.inputs,
        outputs,
        channels=tuple(recording.channels.values()),
        segment=labels,
        valve_closed=shut,
        source=plan.name,
    )


class RegulatedKind:
    """Kind of plants with pressure regulators.

    Attributes
    ----------
    plant : type
        Class of the plant.
    bound : type
        Class of the plant with the inputs of a recording.
    sizes : mapping
        Number of a rig file (``rest_length``, ``diameter``) to the parameters that it gives.
    renamed, factors, titles
        Of the causes (:func:`pam_envs.diagnosis.families.adapted.adapted`), for each sensor of the
        motion.
    loop : Loop
        Closed loop with the paper's controller.
    """

    plant: ClassVar[Any]
    bound: ClassVar[type[RegulatedFamily]]
    sizes: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    renamed: ClassVar[tuple[Mapping[str, str], ...]]
    factors: ClassVar[Mapping[tuple[str, str], float]]
    titles: ClassVar[Mapping[str, str]] = {}
    catalogue: ClassVar[tuple[Cause, ...]]
    weighed: ClassVar[bool] = False
    loop: ClassVar[Loop]
    loop_reason: ClassVar[str] = ""

    @property
    def name(self) -> str:
        """Name of the family."""
        return str(self.plant.family)

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Outputs that a recording may hold."""
        names = [c.name for c in WIRINGS[self.name].outputs]
        return tuple(Output(name, NOISE[name.partition("_")[0]]) for name in names)

    def preset(self) -> Any:
        """Return the default plant."""
        return self.plant.paper()

    def start(self, sheet: Rig) -> Any:
        """Return the default plant with the variant and sizes of a rig, without any effect."""
        plant = self.preset()
        for key in sheet.variant:
            if key not in plant.makes:
                raise ValueError(
                    f"RIG.yaml: variant.{key} is no choice of the plant {self.name}"
                    + near(key, plant.makes)
                )
        plant = dataclasses.replace(plant, **sheet.variant)
        sizes = {**self.sizes, "max_pressure": ("regulator.max_pressure",)}
        given = {
            name: getattr(sheet, key)
            for key, names in sizes.items()
            for name in names
            if getattr(sheet, key) is not None
        }
        return plant.replace({**given, **sheet.parameters})

    def causes(self, asked: Sequence[Cause]) -> tuple[Cause, ...]:
        """Return the requested causes in the plant's parameters, with forms for each sensor."""
        plant = self.preset()
        made: dict[str, Cause] = {}
        for renamed in self.renamed:
            for cause in adapted(asked, plant, renamed, self.factors, self.titles):
                known = made.get(cause.name)
                if known is None:
                    made[cause.name] = cause
                    continue
                # searches in the residual are of the first sensor
                more = [f for f in cause.forms if f.search is None or isinstance(f.search, Grid)]
                new = tuple(f for f in more if f not in known.forms)
                made[cause.name] = dataclasses.replace(known, forms=(*known.forms, *new))
        return tuple(made.values())

    def drives(
        self, plant: Any, recording: Recording, set_points: Sequence[Array]
    ) -> Mapping[str, Array]:
        """Return inputs of the loop by name that are no inputs of a recording.

        ``set_points`` [Pa] are below zero where the valve is shut.
        """
        raise NotImplementedError

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> Any:
        """Return a plant with the inputs of a recording."""
        given, regulator = dict(recording.inputs), plant.regulator
        pairs = self.pairs_of(plant)
        measured = not set(pairs) <= set(given)
        if measured:
            lacking = [name for name in pairs.values() if name not in recording.outputs]
            if lacking:
                raise ValueError(
                    f"the recording has neither every setpoint nor {' and '.join(lacking)}; give "
                    + " and ".join((*pairs, *lacking))
                )
            given |= {s: one_ahead(recording.outputs[p], recording) for s, p in pairs.items()}
            plant = with_measured_drive(plant, recording.period)
        set_points = [shut_off(given[name], recording) for name in pairs]
        usual = plant.module("rollout").channels_of(plant)
        made = {**usual, **given, **self.drives(plant, recording, set_points)}
        channels = [np.broadcast_to(made[name], (len(recording.time),)) for name in usual]
        data = (plant, recording.period, drives_of(channels), recording.restart.copy())
        if measured:
            return self.bound(*data, regulator)
        commands = tuple(list(usual).index(name) for name in self.commanded(plant))
        return self.bound(*data, None, commands, clock_of(recording, sheet))

    def plans(self, recording: Recording, sheet: Rig, family: Any) -> tuple[Experiment, ...]:
        """Return the experiments that the rig of a recording can do."""
        named = dict(zip(family.pairs, family.setpoints(recording), strict=True))
        names = list(named)
        joints = [{n: named[n] for n in names[k : k + 2]} for k in range(0, len(names), 2)]
        payload = recording.inputs.get("payload")
        means = ChannelMeans(
            joints,
            () if payload is None else levels_of(payload, PAYLOAD_STEP),
            bool(sheet.valve_closed) or bool(recording.valve_closed.any()),
        )
        return tuple(
            Experiment(
                plan.name,
                plan.description,
                plan.segments,
                dataclasses.replace(
                    self.bind(family.plant, planned(plan, recording), sheet), clock=family.clock
                ),
            )
            for plan in channel_plans(means)
        )

    def commanded(self, plant: Any) -> tuple[str, ...]:
        """Return the inputs of the loop that are setpoints."""
        return tuple(self.pairs_of(plant).values())

    def pairs_of(self, plant: Any) -> Mapping[str, str]:
        """Return the name of each setpoint and that of its pressure."""
        return self.bound.pairs

    def audit(self, recording: Recording, sheet: Rig) -> Audit:
        """Return the findings on a recording before its diagnosis."""
        return audit_channels(recording, sheet, self.plant.names)

    def compared(self, measured: Array, family: Any, restart: Flags) -> Array:
        """Return readings (channels, T), without those of motion before friction is known.

        How a plant came to rest before a run decides in which state its friction is, and where
        between the branches of its loops it rests. Motion by a share of the range forgets it.
        """
        made = measured.copy()
        runs = runs_of(restart)
        for channel, values in zip(family.channels, made, strict=True):
            if channel.startswith("pressure") or not np.isfinite(values).any():
                continue
            least = FORGOTTEN * float(np.nanmax(values) - np.nanmin(values))
            for run in (values[places] for places in runs):  # views
                first = np.nanmedian(run[:FIRST]) if np.isfinite(run[:FIRST]).any() else np.nan
                moved = np.abs(run - first) > least
                run[: int(np.argmax(moved)) if moved.any() else 0] = np.nan
        return made

    def calibrate(
        self,
        family: Any,
        measured: Array,
        noise: Array,
        blocks: Blocks,
        time: Array,
        shapes: Array,
    ) -> Calibration:
        """Fit regulators, then all base parameters.

        Of a plant with a rival, the base is the one that is clearly better.
        """
        if family.measured_drive:
            measured = measured.copy()
            inputs = set(self.pairs_of(family.plant).values())
            measured[[c in inputs for c in family.channels]] = np.nan  # inputs are no outputs
        every = self.causes(self.catalogue)
        limit = by_name("slew_limit", every)
        others = [cause for cause in every if not cause.common]
        data = measured, noise, blocks, time, shapes, limit, others
        found, rival = calibrate_compiled(family, *data), self.rival(family.plant)
        if rival is None:
            return found
        other = calibrate_compiled(dataclasses.replace(family, plant=rival), *data)
        gain = blocks.gain(found.base.errors, other.base.errors)
        return other if gain > DRIVE_GAIN else found

    def rival(self, plant: Any) -> Any:
        """Return a plant whose friction has the other drive; None where there is no choice."""
        return None
