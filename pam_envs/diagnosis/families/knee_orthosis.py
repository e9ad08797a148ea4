"""Knee orthosis as a diagnosable plant: angle, pressure, tension and torque.

``variant: {mounting: no_load}``, the default, is the brace alone, which the muscle closes against
its wire; ``{mounting: rig}`` is the muscle held at ``fixture.length``, which shows its tension.

The friction of a muscle in a brace that moves may follow its pressure or its length: the base has
the one that fits better.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.families.adapted import with_bearing, with_correction, with_yielding
from pam_envs.diagnosis.families.compiled import WEIGHT
from pam_envs.diagnosis.families.regulated import REGULATOR, RegulatedFamily, RegulatedKind
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.diagnosis.fit.single_muscle import grouped
from pam_envs.diagnosis.plant_protocol import Loop, Signals
from pam_envs.hysteresis.protocol import ELEMENTS
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.hysteresis import (
    FULL_PRESSURE,
    FULL_STIFFNESS,
    REFERENCE_PRESSURE,
    knee_hysteresis,
)
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

SPRING: dict[str, dict[str, Any]] = REGULATOR | {
    "muscle.gain": {"log": True, "prior": 1.5},
    "hysteresis.width": {"scale": 0.05},
}
"""Parameters of regulator and muscle with the settings of their fits."""
RUBBING: dict[str, dict[str, Any]] = REGULATOR | {
    "muscle.stiffness_ratio": {"log": True, "prior": 1.5},
    "hysteresis.friction": {"log": True, "low": 0.1, "prior": 1.5},
    "hysteresis.empty": {"scale": 0.1, "prior": 5.0},
}
"""Those of a muscle whose friction follows its length."""
BRACE: dict[str, dict[str, Any]] = {
    "muscle.shortest_length": {"scale": 2e-3, "prior": 20.0},
    "lever.stiffness": {"log": True, "prior": 1.0},
    "lever.relaxed_angle": {"scale": 0.02, "prior": 30.0},
    "lever.inertia": {"log": True, "prior": 0.7},
    "lever.damping": {"log": True, "prior": 1.5},
}
"""Those of the brace alone, beside those of its muscle."""
FACTORS = {
    ("m", "rad"): 12.0,
    ("m/s", "rad/s"): 12.0,
    ("m", "N"): 5e3,
}
"""Usual sizes over those of a muscle, by their units: a lever of 80 mm, and 5 N for 1 mm."""
BREAKS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
"""Breakaway torques [N m] at which the search for a sticking bearing begins."""
LEAST_FORCE = 0.1
"""Least yielding friction [N] without pressure, where a fit starts."""
MOVING = "no_load"
USUAL_STRETCH = 0.2
"""Stretch of the muscle over its length at which a slope of the law by pressure is usual."""
BY_LENGTH = "maxwell_slip_length"
WEIGHT_SCALE = 0.1
"""Meaningful change of the weight of an element, over that with which it has all friction."""


CORRECTED = (
    *((0, 0), (0, 1), (0, 2), (0, 3), (1, 2), (1, 3)),
    *((2, 0), (2, 1), (2, 2), (3, 0), (3, 1)),
)
"""Orders in pressure and strain of the terms that the law of the muscle lacks, up to order 4."""


class BoundKnee(RegulatedFamily):
    """Orthosis with the inputs of a recording."""

    law: ClassVar[str] = "muscle"

    channels: ClassVar[tuple[str, ...]] = ("angle", "pressure", "tension", "torque")
    pairs: ClassVar[Mapping[str, str]] = {"set_point": "pressure"}
    volumes: ClassVar[tuple[str, ...]] = ("muscle.full_volume",)

    @property
    def settings(self) -> Mapping[str, Mapping[str, Any]]:  # type: ignore[override]
        """Base parameters of the mounting with the settings of their fits."""
        muscle = RUBBING if self.plant.hysteresis.drive == "length" else SPRING
        return muscle | BRACE if self.plant.mounting == MOVING else muscle

    @property
    def elements(self) -> int:
        """Number of elements with a weight that a fit adapts: of friction of the length alone."""
        return super().elements if self.plant.hysteresis.drive == "length" else 0

    @property
    def _weights(self) -> int:
        """First row of the weights of the hysteresis in a column."""
        return int(K.MODEL) + 2 + ELEMENTS

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter; a weight is at most that of one element alone."""
        if name.startswith(WEIGHT):
            k = int(name.removeprefix(WEIGHT)[:-1])
            most = 1.0 / self.plant.hysteresis.operator.thresholds[k]
            changes = {"high": most, "scale": WEIGHT_SCALE * most, "prior": 5.0, **changes}
        return super().free(name, **changes)

    def recorded_states(self, measured: Array) -> Array:
        """Return groups of pressures [Pa] and strains of the muscle, (2, k)."""
        lever, place = self.plant.lever, self.channels.index
        angle, pressure = measured[place("angle")], measured[place("pressure")]
        if self.plant.mounting != MOVING:
            angle = np.full(len(pressure), float(lever.angle(self.plant.fixture.length)))
        return grouped(1.0 - lever.length(angle) / lever.full_length, pressure, slack=False)

    def law_slopes(self, columns: Array, pressure: Array, strain: Array) -> tuple[Array, ...]:
        """Return slopes of the laws of columns (n, p), without correction, at states (k,)."""

        def value(name: str) -> Array:
            return columns[:, [self.plant.names.index(f"muscle.{name}")]]

        full = self.plant.lever.full_length
        slope = value("gain")
        if self.plant.hysteresis.drive == "length":
            slope = slope * value("stiffness_ratio")
        else:
            slope = slope * (FULL_STIFFNESS / FULL_PRESSURE)
        stretch = np.maximum(0.0, full * (1.0 - strain) - value("shortest_length"))
        return slope * full * pressure, slope * stretch, slope * full * USUAL_STRETCH

    def flexible_guess(self, found: Mapping[str, float]) -> dict[str, float]:
        """Return starting values at which friction driven by length yields smoothly."""
        away, stiff = self.friction_of(found)
        if stiff <= 0.0:
            return dict(found)
        slip, empty = found["hysteresis.friction"] * away, found["hysteresis.empty"]
        return {
            **found,
            **{name: 0.0 for name in found if name.startswith(WEIGHT)},
            "muscle.yield_force": max(LEAST_FORCE, empty * slip),
            "muscle.yield_per_pressure": (1.0 - empty) * slip / REFERENCE_PRESSURE,
            "muscle.yield_break": away / stiff / self.plant.lever.full_length,
            "muscle.yield_ratio": 0.5,
        }

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
    loop = Loop("PAM/KneeTension-v0", "knee_inverse_ltr", "N", 1.0)
    bound = BoundKnee
    renamed = ({"position": "angle", "mass": "lever"}, {"position": "tension", "mass": "lever"})
    factors = FACTORS
    titles: ClassVar[Mapping[str, str]] = {"sensor_delay": "the delay of a sensor"}
    catalogue = with_yielding(with_correction(with_bearing("lever", BREAKS), "muscle", CORRECTED))

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

    def rival(self, plant: Any) -> Any:
        """Return the brace with friction of the length; None for a muscle that does not move."""
        if plant.mounting != MOVING or plant.hysteresis.drive == "length":
            return None
        return dataclasses.replace(plant, hysteresis=knee_hysteresis(BY_LENGTH))

    def commanded(self, plant: Any) -> tuple[str, ...]:
        """Return the input of the loop that is the setpoint."""
        return ("set_point",)

    def drives(
        self, plant: Any, recording: Recording, set_points: Sequence[Array]
    ) -> Mapping[str, Array]:
        """Return the setpoint, and the pressure at the start."""
        return {"set_point": set_points[0], "pressure": np.maximum(0.0, set_points[0])}
