"""Knee orthosis as a diagnosable plant: angle, pressure, tension and torque.

``variant: {mounting: no_load}``, the default, is the brace alone, which the muscle closes against
its wire; ``{mounting: rig}`` is the muscle held at ``fixture.length``, which shows its tension.
"""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.families.adapted import with_bearing
from pam_envs.diagnosis.families.regulated import REGULATOR, RegulatedFamily, RegulatedKind
from pam_envs.diagnosis.plant_protocol import Signals
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

SPRING: dict[str, dict[str, Any]] = REGULATOR | {
    "muscle.gain": {"log": True, "prior": 1.5},
    "hysteresis.width": {"scale": 0.05},
}
"""Parameters of regulator and muscle with the settings of their fits."""
BRACE: dict[str, dict[str, Any]] = SPRING | {
    "muscle.shortest_length": {"scale": 2e-3, "prior": 20.0},
    "lever.stiffness": {"log": True, "prior": 1.0},
    "lever.relaxed_angle": {"scale": 0.02, "prior": 30.0},
    "lever.inertia": {"log": True, "prior": 0.7},
    "lever.damping": {"log": True, "prior": 1.5},
}
"""Those of the brace alone."""
FACTORS = {
    ("m", "rad"): 12.0,
    ("m/s", "rad/s"): 12.0,
    ("m", "N"): 5e3,
}
"""Usual sizes over those of a muscle, by their units: a lever of 80 mm, and 5 N for 1 mm."""
BREAKS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
"""Breakaway torques [N m] at which the search for a sticking bearing begins."""
MOVING = "no_load"


class BoundKnee(RegulatedFamily):
    """Orthosis with the inputs of a recording."""

    channels: ClassVar[tuple[str, ...]] = ("angle", "pressure", "tension", "torque")
    pairs: ClassVar[Mapping[str, str]] = {"set_point": "pressure"}

    @property
    def settings(self) -> Mapping[str, Mapping[str, Any]]:  # type: ignore[override]
        """Base parameters of the mounting with the settings of their fits."""
        return BRACE if self.plant.mounting == MOVING else SPRING

    @property
    def elements(self) -> int:
        """Number of elements with a weight that a fit adapts: none of this operator."""
        return 0

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return the angle, or the tension at a held length, and the pressure."""
        (command,) = self.setpoints(recording)
        motion = outputs[0 if self.plant.mounting == MOVING else 2]
        made = np.array([motion, outputs[1]])
        load = np.zeros(len(recording.time))
        return Signals("pressure", command, made, load, label="pressure [bar]", scale=BAR)


class KneeKind(RegulatedKind):
    """Knee orthosis without a leg, or its muscle in a rig."""

    plant = KneeOrthosis
    bound = BoundKnee
    renamed = ({"position": "angle", "mass": "lever"}, {"position": "tension", "mass": "lever"})
    factors = FACTORS
    titles: ClassVar[Mapping[str, str]] = {"sensor_delay": "the delay of a sensor"}
    catalogue = with_bearing("lever", BREAKS)

    def preset(self) -> KneeOrthosis:
        """Return the brace alone."""
        return KneeOrthosis.no_load()

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> BoundKnee:
        """Return an orthosis with the inputs of a recording; ValueError on a leg."""
        if plant.mounting == "leg" or plant.dynamics == "measured":
            raise ValueError(
                f"a knee orthosis with mounting = {plant.mounting!r} and dynamics = "
                f"{plant.dynamics!r} cannot be replayed: a leg walks by a path of its own, and "
                "measured dynamics have no parameters; record the brace alone (variant: "
                "{mounting: no_load}) or its muscle at a held length ({mounting: rig}), with "
                "dynamics: lag"
            )
        bound: BoundKnee = super().bind(plant, recording, sheet)
        return bound

    def commanded(self, plant: Any) -> tuple[str, ...]:
        """Return the input of the loop that is the setpoint."""
        return ("set_point",)

    def drives(
        self, plant: Any, recording: Recording, set_points: Sequence[Array]
    ) -> Mapping[str, Array]:
        """Return the setpoint, and the pressure at the start."""
        return {"set_point": set_points[0], "pressure": np.maximum(0.0, set_points[0])}
