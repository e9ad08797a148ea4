"""Redundant manipulator as a diagnosable plant: angles, pressures, torques and forces.

All joints have the same muscles and regulators, and so the same causes. An arm of other joints than
the default's is given as a plant.
"""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.recording.channels import arm_channels
from pam_envs.data.recording.recording import Recording
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.families.adapted import with_yielding
from pam_envs.diagnosis.families.antagonistic_joint import (
    MUSCLES,
    UNEQUAL,
    JointKind,
    PairFamily,
    difference_of,
)
from pam_envs.diagnosis.fit.single_muscle import CLOCK
from pam_envs.diagnosis.plant_protocol import Loop, Signals
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import JOINT_OUTPUTS, MUSCLE_OUTPUTS

SETTINGS: dict[str, dict[str, Any]] = {
    **{name: values for name, values in MUSCLES.items() if name != "muscle.braid_strain"},
    "arm.mass_factor": {"log": True, "prior": 0.7},
    "arm.damping_factor": {"log": True, "low": 1e-2, "prior": 1.5},
    "hysteresis.base": {"log": True, "low": 1.0, "prior": 1.5},
    "hysteresis.rate": {"log": True, "low": 1e-6, "prior": 1.5},
}
"""Base parameters with the settings of their fits. The law of the muscles keeps its shape: with a
free one the fits stall, and a corrected law explains the rest."""


class BoundArm(PairFamily):
    """Arm with the inputs of a recording."""

    settings: ClassVar[Mapping[str, Mapping[str, Any]]] = SETTINGS
    last: ClassVar[tuple[str, ...]] = (CLOCK,)
    limits: ClassVar[tuple[bool, ...]] = (False, True)

    @cached_property
    def channels(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names of the outputs."""
        return tuple(c.name for c in arm_channels(self.plant.stages).outputs)

    @cached_property
    def pairs(self) -> Mapping[str, str]:  # type: ignore[override]
        """Name of each setpoint to that of its pressure."""
        return arm_channels(self.plant.stages).measured

    def joint_channels(self) -> list[tuple[str, tuple[str, str]]]:
        """Return the channel of each joint's angle, and those of its pressures."""
        joints = range(self.plant.stages)
        return [(f"angle_{k}", (f"pressure_{2 * k}", f"pressure_{2 * k + 1}")) for k in joints]

    def guesses(
        self, measured: Array, noise: Array, column: Array
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Return no starting values: the arm weighs too little for a balance of torques."""
        return {}, {}

    def signal_rows(self) -> Mapping[str, int]:
        """Return the row of state of each torque and force."""
        n = self.plant.stages
        torques = {f"torque_{k}": JOINT_OUTPUTS["torque"] + k for k in range(n)}
        return torques | {f"force_{m}": MUSCLE_OUTPUTS["force"] + m for m in range(2 * n)}

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return angle and difference of pressures of the joint whose pressures move most."""
        commands = self.setpoints(recording)
        apart = [a - b for a, b in zip(commands[::2], commands[1::2], strict=True)]
        k, n = int(np.argmax([np.ptp(v) for v in apart])), self.plant.stages
        first = n + 2 * k
        pressures = outputs[first : first + 2]
        return difference_of(recording, apart[k], outputs[k], pressures, f" of joint {k}")


class ArmKind(JointKind):
    """Arm of joints between antagonistic muscles."""

    plant = RedundantManipulator
    loop = Loop("PAM/RedundantManipulator-v0", "joint_mfc_mu", "mm", 1e-3, "drawn")
    bound = BoundArm
    catalogue = (*(c for c in with_yielding(catalogue()) if c.name != "static_law"), UNEQUAL)

    def pairs_of(self, plant: Any) -> Mapping[str, str]:
        """Return the name of each setpoint and that of its pressure."""
        return arm_channels(plant.stages).measured
