"""Antagonistic joint as a diagnosable plant: angle, both pressures and the muscles' torque."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, GRAVITY
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import Audit, audit_channels
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.causes import by_name, catalogue
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
from pam_envs.diagnosis.fit.starting_values import grid
from pam_envs.diagnosis.plant_protocol import Output, Signals
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import FROM_THEM, channels_of
from pam_envs.plants.core.rollout import drives_of

SETTINGS: dict[str, dict[str, Any]] = {
    "regulator.gain": {"scale": 0.01},
    "regulator.time_constant": {"log": True, "prior": 1.5},
    "regulator.dead_time": {"scale": 0.01},
    "regulator.slew_rate": {"log": True, "high": 1e8, "prior": 2.0},
    "muscle.area": {"log": True, "prior": 1.5},
    "muscle.taper": {"scale": 0.1, "prior": 60.0},
    "muscle.threshold": {"scale": 5.0, "prior": 60.0},
    "muscle.braid_force": {"scale": 5.0, "prior": 60.0},
    "muscle.stiffness": {"scale": 50.0, "prior": 60.0},
    "muscle.viscosity": {"scale": 5e-5, "prior": 60.0},
    "hysteresis.base": {"log": True, "low": 1.0, "prior": 1.5},
    "hysteresis.rate": {"log": True, "low": 1e-6, "prior": 1.5},
    "link.damping": {"log": True, "low": 1e-3, "prior": 1.5},
    "link.mass": {"log": True, "prior": 0.7},
    "link.centre": {"log": True, "low": 1e-3, "prior": 0.7},
}
"""Base parameters with the settings of their fits that differ from the declarations."""
KEPT = frozenset(
    {"hysteresis.width", "muscle.stretch", "muscle.gain", "link.gravity", "angle.noise"}
    | {"angle.resolution", "pressure.noise", "pressure.resolution"}
)
FACTORS = {
    ("m", "rad"): 20.0,
    ("m/s", "rad/s"): 20.0,
}
"""Usual sizes of the joint over those of a muscle, by their units: a lever of some centimetres."""
RENAMED = {"position": "angle", "mass": "link"}
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
HOLDS, SPEEDS = (0.45, 0.7), (0.02, 0.1)
STICKING = dataclasses.replace(
    by_name("stick_slip"),
    title="stick-slip in the bearing",
    forms=(
        Form(
            "Stribeck",
            (
                Term("link.stick", (0.01,), scale=0.01),
                Term("link.stick_kinetic", (0.4,), high=0.95, scale=1.0, amount=False),
                Term("link.stick_speed", (0.05,), high=5.0, log=True, amount=False),
            ),
            search=grid(BREAKS, HOLDS, SPEEDS, best=5),
        ),
    ),
)
PRESSURES = ("pressure_a", "pressure_b")
SET_POINTS = ("set_point_a", "set_point_b")


class BoundJoint(CompiledFamily):
    """Joint with the inputs of a recording."""

    channels: ClassVar[tuple[str, ...]] = ("angle", *PRESSURES, "torque")
    settings: ClassVar[Mapping[str, Mapping[str, Any]]] = SETTINGS
    kept: ClassVar[frozenset[str]] = KEPT

    @property
    def loop(self) -> Any:
        """Loop of the sensors, and of the torque of the muscles."""
        loop = super().loop
        return dataclasses.replace(
            loop, name=f"{loop.name}_torque", outputs=(*loop.outputs, K.TORQUE)
        )

    def signals(self, recording: Recording, outputs: Array) -> Signals:
        """Return the angle and the difference of the pressures."""
        commands = [self.drives[k, :, 0] for k in (4, 5)]
        load = recording.inputs.get("payload", np.zeros(len(recording.time))) * GRAVITY
        return Signals(
            "pressure_difference",
            commands[0] - commands[1],
            np.array([outputs[0], outputs[1] - outputs[2]]),
            load,
            label="pressure difference [bar]",
            scale=BAR,
        )

    def unmet_needs(self, recording: Recording, sheet: Rig) -> dict[str, str]:
        """Return the needs of causes that a recording does not meet, and why."""
        load = recording.inputs.get("payload", np.zeros(1))
        falls = any(
            np.any(np.maximum.accumulate(v) - v > 0.5 * BAR)
            for v in (recording.inputs.get(name, np.zeros(1)) for name in SET_POINTS)
        )
        needs = self.needs_of_any(recording, sheet) | {
            "contraction": ("angle" in recording.outputs, "the angle was not recorded"),
            "loads": (
                np.ptp(load) > 0.05,
                f"the payload was {float(load[0]):.3g} kg throughout",
            ),
            "exhaust": (falls, "no commanded pressure ever falls by more than 0.5 bar"),
        }
        return {word: reason for word, (met, reason) in needs.items() if not met}


class JointKind:
    """Joint between two antagonistic muscles."""

    name = AntagonisticJoint.family
    outputs = (
        Output("angle", 1e-3),
        Output("pressure_a", 1e3),
        Output("pressure_b", 1e3),
        Output("torque", 0.02),
    )
    catalogue = (*(c for c in catalogue() if c.name != STICKING.name), STICKING, UNEQUAL)
    weighed, experiments = False, False
    loop_reason = "controllers of an antagonistic joint are not compared"

    def start(self, sheet: Rig) -> AntagonisticJoint:
        """Return the joint of the paper, with the sizes of the rig, without any effect."""
        given = {
            "muscle.rest_length": sheet.rest_length,
            "muscle.diameter": sheet.diameter,
            "regulator.max_pressure": sheet.max_pressure,
        }
        sizes = {name: value for name, value in given.items() if value is not None}
        return AntagonisticJoint.paper().replace({**sizes, **sheet.parameters})

    def causes(self, asked: Sequence[Cause]) -> tuple[Cause, ...]:
        """Return the requested causes in the joint's parameters."""
        return adapted(asked, AntagonisticJoint(), RENAMED, FACTORS, TITLES)

    def bind(self, plant: Any, recording: Recording, sheet: Rig) -> BoundJoint:
        """Return a joint with the inputs of a recording."""
        given, n = dict(recording.inputs), len(recording.time)
        measured, regulator = not set(SET_POINTS) <= set(given), plant.regulator
        if measured:
            lacking = [name for name in PRESSURES if name not in recording.outputs]
            if lacking:
                raise ValueError(
                    f"the recording has neither both setpoints nor {' and '.join(lacking)}; give "
                    + " and ".join((*SET_POINTS, *lacking))
                )
            pairs = zip(SET_POINTS, PRESSURES, strict=True)
            given |= {s: one_ahead(recording.outputs[p], recording) for s, p in pairs}
            plant = with_measured_drive(plant, recording.period)
        usual = channels_of(plant) | {"direct": FROM_THEM}
        names = {"pressure_a": "set_point_a", "pressure_b": "set_point_b"}
        channels = [
            shut_off(given[names[name]], recording)
            if name in names
            else np.broadcast_to(given.get(name, value), (n,))
            for name, value in usual.items()
        ]
        data = (plant, recording.period, drives_of(channels), recording.restart.copy())
        return BoundJoint(*data, regulator if measured else None)

    def audit(self, recording: Recording, sheet: Rig) -> Audit:
        """Return the findings on a recording before its diagnosis."""
        return audit_channels(recording, sheet, AntagonisticJoint.names)

    def calibrate(
        self,
        family: Any,
        measured: Array,
        noise: Array,
        blocks: Blocks,
        time: Array,
        shapes: Array,
    ) -> Calibration:
        """Fit regulators, then all base parameters."""
        if family.measured_drive:
            measured = measured.copy()
            measured[1:3] = np.nan  # inputs are no outputs
        return calibrate_compiled(family, measured, noise, blocks, time, shapes)
