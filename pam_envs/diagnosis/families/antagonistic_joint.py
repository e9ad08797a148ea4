"""Antagonistic joint as a diagnosable plant: angle, both pressures, torque and forces."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, GRAVITY
from pam_envs.data.recording.recording import Recording
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.families.adapted import with_bearing
from pam_envs.diagnosis.families.regulated import REGULATOR, RegulatedFamily, RegulatedKind
from pam_envs.diagnosis.plant_protocol import Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import FROM_THEM

MUSCLES: dict[str, dict[str, Any]] = REGULATOR | {
    "muscle.area": {"log": True, "prior": 1.5},
    "muscle.taper": {"scale": 0.1, "prior": 60.0},
    "muscle.threshold": {"scale": 5.0, "prior": 60.0},
    "muscle.braid_force": {"scale": 5.0, "prior": 60.0},
    "muscle.stiffness": {"scale": 50.0, "prior": 60.0},
    "muscle.viscosity": {"scale": 5e-5, "prior": 60.0},
    "hysteresis.base": {"log": True, "low": 1.0, "prior": 1.5},
    "hysteresis.rate": {"log": True, "low": 1e-6, "prior": 1.5},
}
"""Parameters of regulators and muscles with the settings of their fits that differ from the
declarations."""
SETTINGS: dict[str, dict[str, Any]] = MUSCLES | {
    "link.damping": {"log": True, "low": 1e-3, "prior": 1.5},
    "link.mass": {"log": True, "prior": 0.7},
    "link.centre": {"log": True, "low": 1e-3, "prior": 0.7},
}
"""Base parameters of the joint with the settings of their fits."""
FACTORS = {
    ("m", "rad"): 20.0,
    ("m/s", "rad/s"): 20.0,
}
"""Usual sizes of the joint over those of a muscle, by their units: a lever of some centimetres."""
TITLES = {
    "creep": "creep of the muscles",
    "sensor_delay": "the delay of the encoder",
}
UNEQUAL = Cause(
    name="unequal_muscles",
    title="a difference between the two muscles",
    forms=(Form("imbalance", (Term("muscle.imbalance", (0.05, -0.05), scale=0.02),)),),
    signature="an angle at equal pressures that grows with the co-contraction",
    neighbours=("sensor_bias", "pressure_dependent_friction"),
    experiment=(
        "Equal pressures in both muscles, raised slowly: unequal muscles turn the joint with the "
        "pressure, a bias of the encoder is there without pressure too."
    ),
    source="fluidic_muscles: specimens of one type; forces of 5 % apart are assumed.",
    needs=("contraction",),
    sensor="a load cell at either muscle",
    compensable=True,
)
BREAKS = (0.002, 0.004, 0.008, 0.016, 0.03, 0.06, 0.12, 0.24)
"""Breakaway torques [N m] at which the search for a sticking bearing begins."""
PAIRS = {"set_point_a": "pressure_a", "set_point_b": "pressure_b"}


def difference_of(
    recording: Recording, command: Array, angle: Array, pressures: Array, joint: str = ""
) -> Signals:
    """Return an angle and the difference of two pressures (2, T), whose setpoint is ``command``."""
    load = recording.inputs.get("payload", np.zeros(len(recording.time))) * GRAVITY
    return Signals(
        "pressure_difference",
        command,
        np.array([angle, pressures[0] - pressures[1]]),
        load,
        label=f"pressure difference{joint} [bar]",
        scale=BAR,
    )


class BoundJoint(RegulatedFamily):
    """Joint with the inputs of a recording."""

    channels: ClassVar[tuple[str, ...]] = (
        *("angle", "pressure_a", "pressure_b", "torque", "force_a", "force_b"),
    )
    settings: ClassVar[Mapping[str, Mapping[str, Any]]] = SETTINGS
    pairs: ClassVar[Mapping[str, str]] = PAIRS

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return the angle and the difference of the pressures."""
        first, second = self.setpoints(recording)
        return difference_of(recording, first - second, outputs[0], outputs[1:3])


class JointKind(RegulatedKind):
    """Joint between two antagonistic muscles."""

    plant: ClassVar[Any] = AntagonisticJoint
    bound: ClassVar[type[RegulatedFamily]] = BoundJoint
    sizes: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "rest_length": ("muscle.rest_length",),
        "diameter": ("muscle.diameter",),
    }
    renamed = ({"position": "angle", "mass": "link"},)
    factors = FACTORS
    titles = TITLES
    catalogue = (*with_bearing("link", BREAKS), UNEQUAL)

    def drives(
        self, plant: Any, recording: Recording, set_points: Sequence[Array]
    ) -> Mapping[str, Array]:
        """Return the pressures, at which the plant also begins at rest."""
        named = dict(zip(self.pairs_of(plant).values(), set_points, strict=True))
        return named | {"direct": np.full(len(recording.time), FROM_THEM)}
