"""Redundant manipulator as a diagnosable plant: angles, pressures, torques and forces.

All joints have the same muscles and regulators, and so the same causes. An arm of other joints than
the default's is given as a plant.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.recording.channels import arm_channels
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.families.antagonistic_joint import (
    MUSCLES,
    JointKind,
    PairFamily,
    difference_of,
)
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.diagnosis.fit.single_muscle import CLOCK
from pam_envs.diagnosis.plant_protocol import Loop, Signals
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import JOINT_OUTPUTS, MUSCLE_OUTPUTS

SETTINGS: dict[str, dict[str, Any]] = {
    **MUSCLES,
    "arm.mass_factor": {"log": True, "prior": 0.7},
    "arm.damping_factor": {"log": True, "low": 1e-2, "prior": 1.5},
    "link.damping": {"log": True, "low": 1e-3, "prior": 1.5},
}
"""Base parameters with the settings of their fits."""


@dataclass(frozen=True)
class BoundArm(PairFamily):
    """Arm with the inputs of a recording.

    ``loaded``: whether torques or forces are recorded. If not, forces are known only over the
    masses: the area then keeps its value, and the factor of the masses is relative to it.
    """

    loaded: bool = False

    settings: ClassVar[Mapping[str, Mapping[str, Any]]] = SETTINGS
    last: ClassVar[tuple[str, ...]] = ("muscle.braid_strain", CLOCK)
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

    def base(self) -> tuple[Free, ...]:
        """Return the base parameters that a recording may show."""
        idle = set() if self.loaded else {"muscle.area"}
        if not any(self.plant.joint_damping):
            idle.add("arm.damping_factor")
        return tuple(free for free in super().base() if free.name not in idle)

    def guesses(
        self, measured: Array, noise: Array, column: Array
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Return starting values of the flexible base from the balance of torques.

        They show a difference of the muscles, which may lead the fit of the base astray. The base
        starts from its plant: where most muscles are slack, only light links balance their torques,
        and a regression on the law alone leads fits into another valley.
        """
        _, wide = super().guesses(measured, noise, column)
        return {}, wide

    def weights_at(self, angles: Array, payload: Array | float) -> Array:
        """Return the torques of weight and payload [kg] at angles (n, T) [rad], (n, T)."""
        return np.asarray(self.plant.weight_torque(angles.T, payload).T)

    def named(self, found: dict[str, float]) -> dict[str, float]:
        """Return a guess whose factor on the own weight is that on the masses."""
        factor = found.pop("weight", 1.0)
        return {**found, "arm.mass_factor": factor * self.plant.arm.mass_factor} if found else {}

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

    def pairs_of(self, plant: Any) -> Mapping[str, str]:
        """Return the name of each setpoint and that of its pressure."""
        return arm_channels(plant.stages).measured

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> BoundArm:
        """Return an arm with the inputs of a recording."""
        loaded = any(name.startswith(("torque", "force")) for name in recording.outputs)
        return replace(super().bind(plant, recording, sheet), loaded=loaded)
