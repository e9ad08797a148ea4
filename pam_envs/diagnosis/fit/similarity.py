"""Dynamic similarity of muscles: a recording of one size as that of a muscle of 10 mm.

Motion stays the same if all forces, masses and dampings are multiplied by one factor, and all
pressures by another, with areas by their ratio. Scales, priors and bounds of the fits are those of
a muscle of 10 mm at 6 bar; a muscle of another size is fitted as the similar one.
"""

import dataclasses
from typing import Any

from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.fit.single_muscle import SWITCHED_OFF
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.families import PRESSURE, SIZE
from pam_envs.plants.single_muscle.plant import SingleMuscle

EXPONENTS = {
    "Pa": (0.0, 1.0),
    "Pa/s": (0.0, 1.0),
    "1/Pa": (0.0, -1.0),
    "m2": (1.0, -1.0),
    "N/Pa": (1.0, -1.0),
    "N": (1.0, 0.0),
    "kg": (1.0, 0.0),
    "N s/m": (1.0, 0.0),
    "N s/(m Pa)": (1.0, -1.0),
    "1/kg": (-1.0, 0.0),
    "1/N": (-1.0, 0.0),
    "1/N2": (-2.0, 0.0),
    "1/N^0.5": (-0.5, 0.0),
    "Pa/N2": (-2.0, 1.0),
    "m3/(s Pa)": (1.0, -1.0),
    **dict.fromkeys(("1", "s", "m", "rad", "1/s", "1/s2", "Hz", "K", "1/K", "m/s"), (0.0, 0.0)),
}
"""Exponents of force and pressure in each unit of a parameter of the single muscle."""
KEPT = 4.0
"""Ratio to 6 bar, either way, within which pressures are not scaled."""
KEPT_NAMES = ("muscle.diameter", "regulator.supply_pressure", "regulator.source_pressure")
"""Parameters that stay: the drawn size, and absolute sources, which are not fitted as similar."""
NO_FLOW = {"regulator.exhaust_ratio": 1.001}
"""A slower exhaust, which is fitted in place of orifices: their flow is not similar."""


@dataclasses.dataclass(frozen=True)
class Similarity:
    """Factors on forces and pressures to the similar muscle of 10 mm."""

    force: float
    pressure: float

    @classmethod
    def of(cls, plant: SingleMuscle) -> "Similarity":
        """Return the factors for the muscle of a plant."""
        rated = plant.regulator.max_pressure / PRESSURE
        regular = 1.0 / KEPT <= rated <= KEPT or plant.air == "flow"
        pressure = 1.0 if regular else 1.0 / rated
        return cls((SIZE / plant.muscle.diameter) ** 2 * pressure, pressure)

    @property
    def inverse(self) -> "Similarity":
        """Factors from the similar muscle to the original one."""
        return Similarity(1.0 / self.force, 1.0 / self.pressure)

    def factor(self, unit: str) -> float:
        """Return the factor on a parameter with a unit."""
        force, pressure = EXPONENTS[unit]
        return float(self.force**force * self.pressure**pressure)

    def factor_of(self, plant: SingleMuscle, name: str) -> float:
        """Return the factor on a parameter by its dotted name."""
        if self == SAME_SIZE or name in KEPT_NAMES or name in plant.inert or name not in R.NAMES:
            return 1.0
        return self.factor(plant.declaration(name).unit)

    def plant(self, plant: SingleMuscle) -> SingleMuscle:
        """Return the similar plant, with as many sub-steps as it needs."""
        off = {
            name
            for group in plant.effects
            if all(plant.value(n) == plant.neutral.get(n, plant.value(n)) for n in group)
            for name in group
        }
        values: dict[str, Any] = {
            name: plant.value(name) * self.factor_of(plant, name)
            for name in R.NAMES
            if name not in off and plant.value(name) != SWITCHED_OFF.get(name)
        }
        operator = plant.hysteresis.operator
        if isinstance(operator, PlayOperator):
            thresholds = tuple(self.pressure * t for t in operator.thresholds)
            values["hysteresis.operator"] = PlayOperator(
                thresholds, operator.weights, operator.linear
            )
        elif operator is not None and self.pressure != 1.0:
            raise ValueError(
                f"hysteresis {plant.hysteresis.kind} cannot be calibrated at "
                f"{plant.regulator.max_pressure / 1e5:g} bar; start from maxwell_slip"
            )
        return dataclasses.replace(plant, ensemble=()).replace_with_substeps(values)

    def recording(self, recording: Recording) -> Recording:
        """Return the recording of the similar muscle."""
        factors = {
            "command": self.pressure,
            "pressure": self.pressure,
            "load": self.force,
            "force": self.force,
        }
        changed: dict[str, Any] = {
            name: getattr(recording, name) * factor
            for name, factor in factors.items()
            if getattr(recording, name) is not None
        }
        raw = None if recording.raw is None else self.recording(recording.raw)
        return dataclasses.replace(recording, **changed, raw=raw)

    def rig(self, rig: Rig) -> Rig:
        """Return the declared properties of the similar rig."""
        noise, full = rig.pressure_noise, rig.max_pressure
        return dataclasses.replace(
            rig,
            diameter=None if rig.diameter is None else SIZE,
            max_pressure=None if full is None else full * self.pressure,
            pressure_noise=None if noise is None else noise * self.pressure,
        )


SAME_SIZE = Similarity(1.0, 1.0)
"""That of a plant to itself."""
