"""Single muscle, the kind of plant whose base absorbs most differences between rigs."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from pam_envs.arrays import Array, Flags
from pam_envs.constants import GRAVITY, ROOM_TEMPERATURE
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import Audit, audit, unmet_needs
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.causes import by_name, catalogue
from pam_envs.diagnosis.experiment.plans import PERIOD, Means, Plan, plans
from pam_envs.diagnosis.families.compiled import OFFSET, WEIGHTS
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.calibrate import Calibration, calibrate
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.diagnosis.fit.single_muscle import (
    CLOCK,
    MuscleFamily,
    clock_of,
    identified,
    inputs_of,
    start_plant,
)
from pam_envs.diagnosis.plant_protocol import Experiment, Output, Parameter, Signals
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import LONGEST_STEP, Inputs, replay_rows


class BoundMuscle(MuscleFamily):
    """Single muscle with the inputs of a recording."""

    def declared(self, name: str) -> Parameter:
        """Return the declaration of a free parameter."""
        if name == CLOCK:
            return OFFSET
        if name.startswith("hysteresis.weight"):
            return WEIGHTS
        return self.plant.declaration(name)

    def unmet_needs(self, recording: Recording, sheet: Rig) -> dict[str, str]:
        """Return the needs of causes that a recording does not meet, and why."""
        return unmet_needs(recording, sheet)

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return contraction and pressure with command, load and temperature."""
        r = recording
        return Signals("pressure", r.command, outputs, r.load, r.temperature)

    def identified(self, plant: Any, frees: Iterable[Free], source: str) -> SingleMuscle:
        """Return a plant with the provenance of its fitted parameters."""
        return identified(plant, frees, source)


class PlannedMuscle(BoundMuscle):
    """Single muscle with the inputs of an experiment, read by the clock of the command."""

    def simulate(self, columns: Array) -> Array:
        """Return sensor readings for parameter columns (n, p + 1), shape (2, T, n)."""
        return replay_rows(self.plant, columns, self.inputs)


def planned_inputs(plan: Plan, longest_step: float = LONGEST_STEP) -> Inputs:
    """Return the inputs of a plan for the replay."""
    n = len(plan.command)
    fresh = np.zeros(n, bool)
    fresh[0] = True
    return Inputs(
        PERIOD,
        plan.command,
        plan.load / GRAVITY,
        plan.kelvin + ROOM_TEMPERATURE,
        fresh,
        np.zeros(n),
        np.zeros(n, bool),
        longest_step,
    )


def experiments(
    plant: SingleMuscle, means: Means, longest_step: float = LONGEST_STEP
) -> tuple[Experiment, ...]:
    """Return the experiments that a rig can do, on a muscle."""
    return tuple(
        Experiment(
            plan.name,
            plan.description,
            plan.segments,
            PlannedMuscle(plant, planned_inputs(plan, longest_step)),
        )
        for plan in plans(means)
    )


class MuscleKind:
    """Single muscle that lifts a load."""

    name = SingleMuscle.family
    outputs = tuple(
        Output(*pair)
        for pair in zip(MuscleFamily.channels, MuscleFamily.fallback_noise, strict=True)
    )
    catalogue = catalogue()
    weighed = True
    loop, loop_reason = None, ""

    def start(self, sheet: Rig) -> SingleMuscle:
        """Return the shipped muscle, scaled to the rig, without any effect."""
        return start_plant(sheet).replace(sheet.parameters)

    def causes(self, asked: Sequence[Cause]) -> tuple[Cause, ...]:
        """Return the requested causes."""
        return tuple(asked)

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> BoundMuscle:
        """Return a muscle with the inputs of a recording."""
        return BoundMuscle(plant, inputs_of(recording, sheet), clock_of(recording, sheet))

    def plans(self, recording: Recording, sheet: Rig, family: Any) -> tuple[Experiment, ...]:
        """Return the experiments that a rig can do."""
        means = Means.of(recording, sheet)
        return experiments(family.plant, means, family.inputs.longest_step)

    def audit(self, recording: Recording, sheet: Rig) -> Audit:
        """Return the findings on a recording before its diagnosis."""
        return audit(recording, sheet)

    def compared(self, measured: Array, family: Any, restart: Flags) -> Array:
        """Return readings (channels, T) that are compared with a simulation: all."""
        return measured

    def calibrate(
        self,
        family: Any,
        measured: Array,
        noise: Array,
        blocks: Blocks,
        time: Array,
        shapes: Array,
    ) -> Calibration:
        """Fit regulator, static law and friction in stages."""
        limit = by_name("slew_limit")
        causes = [c for c in catalogue() if not c.common]
        return calibrate(family, measured, noise, blocks, time, shapes, limit, causes)
