"""Antagonistic joint as a diagnosable plant: angle, both pressures, torque and forces."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, GRAVITY
from pam_envs.data.recording.recording import Recording
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.families.adapted import (
    with_bearing,
    with_correction,
    with_yielding,
)
from pam_envs.diagnosis.families.compiled import WEIGHT
from pam_envs.diagnosis.families.pair_balance import PairBalance
from pam_envs.diagnosis.families.regulated import REGULATOR, RegulatedFamily, RegulatedKind
from pam_envs.diagnosis.fit.single_muscle import BORE, grouped
from pam_envs.diagnosis.plant_protocol import Loop, Signals
from pam_envs.plants.antagonistic_joint.hysteresis import REFERENCE_PRESSURE
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import FROM_THEM

MUSCLES: dict[str, dict[str, Any]] = REGULATOR | {
    "muscle.area": {"log": True, "prior": 1.5},
    "muscle.taper": {"scale": 0.1, "prior": 60.0},
    "muscle.threshold": {"scale": 5.0, "prior": 60.0},
    "muscle.braid_force": {"scale": 5.0, "prior": 60.0},
    "muscle.braid_strain": {"log": True, "prior": 1.0},
    "muscle.stiffness": {"scale": 50.0, "prior": 60.0},
    "muscle.viscosity": {"scale": 5e-5, "prior": 60.0},
    "hysteresis.base": {"log": True, "low": 50.0, "prior": 1.5},
    "hysteresis.rate": {"log": True, "low": 3e-4, "prior": 1.5},
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
    forms=(
        Form(
            "imbalance",
            (
                Term("muscle.imbalance", (0.05, -0.05), scale=0.02),
                Term("muscle.friction_imbalance", (0.0,), scale=0.1, prior=3.0),
            ),
        ),
    ),
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
    common=True,
)
BREAKS = (0.002, 0.004, 0.008, 0.016, 0.03, 0.06, 0.12, 0.24)
"""Breakaway torques [N m] at which the search for a sticking bearing begins."""
CORRECTED = (
    *((0, 2), (0, 3), (0, 4), (1, 2), (1, 3)),
    *((2, 0), (2, 1), (2, 2), (3, 0), (3, 1)),
)
"""Orders in pressure and strain of the terms that the law of the muscles lacks, up to order 4."""
LEAST_BREAK = 2e-3
"""Least strain over which yielding friction builds up, where a fit starts."""
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


class PairFamily(RegulatedFamily):
    """Plant whose joints have pairs of muscles, all alike."""

    law: ClassVar[str] = "muscle"
    corrected: ClassVar[tuple[tuple[int, int], ...]] = CORRECTED
    """Orders in pressure and strain of the terms that the law lacks."""
    last: ClassVar[tuple[str, ...]] = ("muscle.braid_strain",)
    volumes: ClassVar[tuple[str, ...]] = (BORE,)

    def joint_channels(self) -> list[tuple[str, tuple[str, str]]]:
        """Return the channel of each joint's angle, and those of its pressures."""
        return [("angle", ("pressure_a", "pressure_b"))]

    def recorded_states(self, measured: Array) -> Array:
        """Return groups of pressures [Pa] and strains of all muscles, (2, k)."""
        plant, place = self.plant, self.channels.index
        strains, pressures = [], []
        for angle, pair in self.joint_channels():
            strain = plant.lever.contraction(measured[place(angle)], plant.muscle.rest_length)
            strains += list(strain.T)
            pressures += [measured[place(name)] for name in pair]
        return grouped(np.concatenate(strains), np.concatenate(pressures), slack=False)

    def guesses(
        self, measured: Array, noise: Array, column: Array
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Return starting values of base and flexible base from the balance of torques."""
        joints = self.joint_channels()
        place = self.channels.index
        angles = measured[[place(angle) for angle, _ in joints]]
        if not hasattr(self.plant.hysteresis.operator, "thresholds") or np.any(
            np.isfinite(angles).sum(axis=1) < len(angles.T) // 2
        ):
            return {}, {}
        gauges = [place(name) for _, pair in joints for name in pair]
        pressures = np.maximum(0.0, self.simulate(column[None])[gauges, :, 0])
        known = np.nan_to_num(angles)
        own, whole = (self.weights_at(known, mass) for mass in (0.0, self.payload()))
        size = float(noise[place(joints[0][0])])
        data = (self.plant, REFERENCE_PRESSURE, angles, size, pressures, own, whole - own)
        balance = PairBalance(*data, self.period, self.corrected)
        return self.named(balance.solve()), self.named(balance.flexible())

    def flexible_guess(self, found: Mapping[str, float]) -> dict[str, float]:
        """Return starting values at which all friction yields smoothly."""
        slip, stiff = self.friction_of(found)
        if stiff <= 0.0:
            return dict(found)
        base, rate = found["hysteresis.base"], found["hysteresis.rate"]
        away = slip / stiff * base / (base + rate * REFERENCE_PRESSURE)
        return {
            **found,
            **{name: 0.0 for name in found if name.startswith(WEIGHT)},
            "muscle.yield_force": base * slip,
            "muscle.yield_per_pressure": rate * slip,
            "muscle.yield_break": max(away, LEAST_BREAK),
            "muscle.yield_ratio": 0.5,
        }

    def payload(self) -> Array:
        """Return the payload [kg], (T,)."""
        names = list(self.plant.module("rollout").channels_of(self.plant))
        return np.asarray(self.drives[names.index("payload"), :, 0])

    def weights_at(self, angles: Array, payload: Array | float) -> Array:
        """Return the torques of weight and payload [kg] at angles (n, T) [rad], (n, T)."""
        return np.asarray(self.plant.weight_torque(angles, payload))

    def named(self, found: dict[str, float]) -> dict[str, float]:
        """Return a guess whose factor on the own weight is that on a parameter."""
        factor = found.pop("weight", 1.0)
        return {**found, "link.centre": factor * self.plant.link.centre} if found else {}

    def law_slopes(self, columns: Array, pressure: Array, strain: Array) -> tuple[Array, ...]:
        """Return slopes of the laws of columns (n, p), without correction, at states (k,)."""

        def value(name: str) -> Array:
            return columns[:, [self.plant.names.index(f"muscle.{name}")]]

        area, stretch, width = value("area"), value("stretch"), value("braid_strain")
        e = strain / stretch
        braid = value("braid_force") / width * np.exp(-e / width)
        stiff = (area * value("taper") * pressure + braid + value("stiffness")) / stretch
        return stiff, area * (1.0 - value("taper") * e), area


class BoundJoint(PairFamily):
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
    loop = Loop("PAM/AntagonisticJoint-v0", "joint_mfc_mu", "deg", np.pi / 180.0)
    bound: ClassVar[type[RegulatedFamily]] = BoundJoint
    sizes: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "rest_length": ("muscle.rest_length",),
        "diameter": ("muscle.diameter",),
    }
    renamed = ({"position": "angle", "mass": "link"},)
    factors = FACTORS
    titles = TITLES
    catalogue = (
        *with_yielding(with_correction(with_bearing("link", BREAKS), "muscle", CORRECTED)),
        UNEQUAL,
    )

    def drives(
        self, plant: Any, recording: Recording, set_points: Sequence[Array]
    ) -> Mapping[str, Array]:
        """Return the pressures, at which the plant also begins at rest."""
        named = dict(zip(self.pairs_of(plant).values(), set_points, strict=True))
        return named | {"direct": np.full(len(recording.time), FROM_THEM)}
