"""Elbow orthosis as a diagnosable plant: angle, both pressures, torque and forces.

The pressure may change how far the friction of the bundles reaches, or how stiff it is (see
:mod:`pam_envs.plants.elbow_orthosis.hysteresis`): the base has the one that fits better.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.recording.clock import runs_of
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.families.adapted import with_bearing, with_correction, with_yielding
from pam_envs.diagnosis.families.antagonistic_joint import (
    LEAST_BREAK,
    PAIRS,
    TITLES,
    difference_of,
)
from pam_envs.diagnosis.families.regulated import REGULATOR, RegulatedFamily, RegulatedKind
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.diagnosis.fit.single_muscle import grouped
from pam_envs.diagnosis.plant_protocol import Loop, Signals
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.hysteresis import REFERENCE_PRESSURE, elbow_hysteresis
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

BUNDLE: dict[str, dict[str, Any]] = {
    "passive_each": {"scale": 20.0, "prior": 60.0},
    "pressure_each": {"log": True, "prior": 1.5},
    "largest_contraction": {"scale": 5e-3, "prior": 20.0},
}
"""Settings of the fit of a bundle's parameters: ``k0``, ``k1``, and where the force ends."""
SETTINGS: dict[str, dict[str, Any]] = {
    **REGULATOR,
    **{f"bundle_{side}.{name}": how for side in "ab" for name, how in BUNDLE.items()},
    "hysteresis.loop": {"log": True, "low": 1e-4, "prior": 1.5},
    "link.damping": {"log": True, "low": 1e-3, "prior": 1.5},
    "link.inertia": {"log": True, "prior": 0.7},
    "link.mass": {"log": True, "prior": 0.7},
    "wearer.stiffness": {"log": True, "prior": 1.5},
    "wearer.damping": {"log": True, "prior": 1.5},
}
"""Base parameters with the settings of their fits. Both bundles are apart from each other, so that
a difference between them is no cause."""
FACTORS = {
    ("m", "rad"): 32.0,
    ("m/s", "rad/s"): 32.0,
}
"""Usual sizes of the elbow over those of a muscle, by their units: a pulley of 31.5 mm."""
BREAKS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
"""Breakaway torques [N m] at which the search for a sticking bearing begins."""
FURTHER = 1.001
"""Least contraction at which a bundle's force ends, over the stroke: just beyond it, as the plant
demands."""
BY_LENGTH, BY_PRESSURE = "maxwell_slip_length", "maxwell_slip"
CORRECTED = (
    *((0, 1), (0, 2), (0, 3), (1, 2), (1, 3)),
    *((2, 0), (2, 1), (2, 2), (3, 0), (3, 1)),
)
"""Orders in pressure and strain of the terms that the law of the bundles lacks, up to order 4."""


class BoundElbow(RegulatedFamily):
    """Orthosis with the inputs of a recording."""

    channels: ClassVar[tuple[str, ...]] = (
        *("angle", "pressure_a", "pressure_b", "torque", "force_a", "force_b"),
    )
    settings: ClassVar[Mapping[str, Mapping[str, Any]]] = SETTINGS
    volumes: ClassVar[tuple[str, ...]] = ("bundle_a.diameter", "bundle_b.diameter")
    pairs: ClassVar[Mapping[str, str]] = PAIRS
    law: ClassVar[str] = "muscle"

    @property
    def abreast(self) -> float:
        """Number of muscles of the smaller bundle."""
        return float(min(self.plant.bundle_a.muscles, self.plant.bundle_b.muscles))

    def recorded_states(self, measured: Array) -> Array:
        """Return groups of pressures [Pa] and strains of both bundles, (2, k)."""
        plant, place = self.plant, self.channels.index
        contractions = plant.pulley.contractions(measured[place("angle")])
        lengths = plant.bundle_a.nominal_length, plant.bundle_b.nominal_length
        strains = np.concatenate([c / n for c, n in zip(contractions, lengths, strict=True)])
        pressures = np.concatenate([measured[place(f"pressure_{side}")] for side in "ab"])
        return grouped(strains, pressures, slack=False)

    def law_slopes(self, columns: Array, pressure: Array, strain: Array) -> tuple[Array, ...]:
        """Return slopes of the laws of columns (n, p), without correction, at states (k,).

        Of as many muscles as the smaller bundle has; of both bundles the smaller slopes.
        """
        stiff, gain, usual = zip(
            *(self._slopes(side, columns, pressure, strain) for side in "ab"), strict=True
        )
        return np.minimum(*stiff), np.minimum(*gain), np.minimum(*usual)

    def _slopes(
        self, side: str, columns: Array, pressure: Array, strain: Array
    ) -> tuple[Array, Array, Array]:
        def value(name: str) -> Array:
            return columns[:, [self.plant.names.index(f"bundle_{side}.{name}")]]

        muscles, length = value("muscles"), value("nominal_length")
        part, reach = self.abreast / muscles, value("largest_contraction") * length
        passive = value("passive_base") + value("passive_each") * muscles
        pressed = part * (value("pressure_base") + value("pressure_each") * muscles)
        contraction = length * strain
        stiff = (
            (part * passive + pressed * pressure) * length * (length + reach - 2.0 * contraction)
        )
        shape = (length - contraction) * (reach - contraction)
        return stiff, pressed * shape, pressed * length * reach

    def tie(self, columns: Array) -> None:
        """Complete the largest lag of the hysteresis, to which ``hysteresis.loop`` refers."""
        n, first = self.elements, self._weights
        if n:
            thresholds = np.array(self.plant.hysteresis.operator.thresholds)
            columns[:, K.LARGEST_LAG] = columns[:, first : first + n] @ thresholds

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter; bundles do not end before the stroke does."""
        component, _, entry = name.partition(".")
        if entry == "largest_contraction":
            length = getattr(self.plant, component).nominal_length
            changes = {"low": FURTHER * self.plant.pulley.stroke / length, **changes}
        return super().free(name, **changes)

    def plant_of(self, column: Array) -> Any:
        """Return the plant with the parameters of a column.

        The friction depends on the ratios of the weights; their sum is that of the operator, which
        must have a slope of 1 where the pressure drives it.
        """
        n, first = self.elements, self._weights
        weights = column[first : first + n]
        if self.plant.hysteresis.drive == "pressure" and weights.sum() > 0.0:
            whole = sum(self.plant.hysteresis.operator.weights)
            column = column.copy()
            column[first : first + n] = weights * (whole / weights.sum())
        return super().plant_of(column)

    def flexible_guess(self, found: Mapping[str, float]) -> dict[str, float]:
        """Return starting values at which all friction yields smoothly.

        At half of the full pressure it is that of the base, and there half of it is without
        pressure.
        """
        slip, stiff = self.friction_of(found)
        if stiff <= 0.0:
            return dict(found)
        way = slip / stiff  # mean break [m]
        law = {name: found[f"bundle_b.{name}"] for name in BUNDLE}
        bundle = dataclasses.replace(self.plant.bundle_b, **law)
        usual = 0.5 * self.plant.full_pressure
        now, there = (float(bundle.factor(p)) for p in (usual, REFERENCE_PRESSURE))
        nearer = 0.5 * now / there if self.plant.hysteresis.drive == "length" else 1.0
        force = 0.5 * found["hysteresis.loop"] * float(bundle.shape(0.0)) * now / bundle.muscles
        away = nearer * way / bundle.nominal_length
        return {
            **found,
            "hysteresis.loop": self.free("hysteresis.loop").low,
            "hysteresis.yield_force": 0.5 * force,
            "hysteresis.yield_per_pressure": 0.5 * force / usual,
            "hysteresis.yield_break": max(away, LEAST_BREAK),
            "hysteresis.yield_ratio": 0.5,
        }

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return the angle and the difference of the pressures, positive in flexion."""
        first, second = self.setpoints(recording)
        return difference_of(recording, second - first, outputs[0], outputs[2:0:-1])


class ElbowKind(RegulatedKind):
    """Elbow orthosis with two bundles of muscles and proportional valves."""

    plant = ElbowOrthosis
    loop = Loop("PAM/ElbowOrthosis-v0", "elbow_allocation", "N m", 1.0)
    bound = BoundElbow
    sizes: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "rest_length": ("bundle_a.nominal_length", "bundle_b.nominal_length"),
        "diameter": ("bundle_a.diameter", "bundle_b.diameter"),
    }
    renamed = ({"position": "angle", "mass": "link"},)
    factors = FACTORS
    titles = TITLES
    catalogue = with_correction(
        with_yielding(with_bearing("link", BREAKS), "hysteresis"), "muscle", CORRECTED
    )

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> BoundElbow:
        """Return an orthosis with the inputs of a recording; ValueError with on/off valves."""
        if plant.valves == "on_off":
            raise ValueError(
                "valves = 'on_off' take pulses, which a recording does not hold; leave the columns "
                "pressure_command_a_bar and pressure_command_b_bar out, so that the measured "
                "pressures drive the replay, and take valves = 'proportional'"
            )
        bound: BoundElbow = super().bind(plant, recording, sheet)
        return bound

    def rival(self, plant: Any) -> Any:
        """Return the orthosis whose pressure changes the stiffness of the friction."""
        if plant.hysteresis.kind != BY_LENGTH:
            return None
        operator = elbow_hysteresis(BY_PRESSURE).operator
        return plant.replace({"hysteresis.operator": operator})

    def commanded(self, plant: Any) -> tuple[str, ...]:
        """Return the inputs of the loop that are setpoints."""
        return ("command_a", "command_b")

    def drives(
        self, plant: Any, recording: Recording, set_points: Sequence[Array]
    ) -> Mapping[str, Array]:
        """Return setpoints, pressures at the start, and the motion that the wearer intends."""
        a, b = set_points
        start = {"start_a": np.maximum(0.0, a), "start_b": np.maximum(0.0, b)}
        return {"command_a": a, "command_b": b} | start | intended(plant, recording)


def intended(plant: ElbowOrthosis, recording: Recording) -> dict[str, Array]:
    """Return the pose [rad] that the wearer intends, with its rate and acceleration.

    Unless it was recorded, it is the mean angle: an arm held relaxed where the motion is.
    """
    pose = recording.inputs.get("intent")
    if pose is None:
        angle = recording.outputs.get("angle")
        mean = plant.pulley.middle if angle is None else float(np.mean(angle))
        return {"intent": np.full(len(recording.time), mean)}
    rate, acceleration = np.zeros(len(pose)), np.zeros(len(pose))
    for run in runs_of(recording.restart):
        if run.stop - run.start > 1:
            rate[run] = np.gradient(pose[run], recording.period)
            acceleration[run] = np.gradient(rate[run], recording.period)
    return {"intent": pose, "intent_rate": rate, "intent_acceleration": acceleration}
