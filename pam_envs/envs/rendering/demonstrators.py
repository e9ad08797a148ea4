"""What moves a plant that is filmed: the inverse of its static law and of its hysteresis."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray


class InverseFeedForward:
    """The set-point that the plant's own inverse asks for: static law, then hysteresis."""

    def __init__(self, env: Any) -> None:
        self.plant, self.signals = env.plant, env.signals
        self.action = env.action_signals[0]
        self.inverse: Any = None
        self.state: Any = None

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        load = float(self.signals.decode(observation, "load"))
        if self.inverse is None:
            full = self.plant.regulator.max_pressure
            self.inverse = self.plant.hysteresis.inverse(load, full)
            self.state = self.inverse.initial_state((1,))
        wanted = self.signals.decode(observation, "reference")
        drive = np.atleast_1d(self.plant.drive_for(wanted, load))
        pressure, self.state = self.inverse.pressure(drive, self.state)
        return np.asarray(self.action.encode(pressure), np.float32)


class BraceFeedForward:
    """The set-point that the orthosis' own inverse asks for: spring and lever, then hysteresis."""

    def __init__(self, env: Any) -> None:
        self.plant, self.signals = env.plant, env.signals
        self.action = env.action_signals[0]
        self.operator: Any = env.plant.hysteresis.scaled
        self.state: Any = None if self.operator is None else self.operator.initial_state((1,))

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        wanted = self.signals.decode(observation, "reference")
        if self.signals["reference"].unit == "N":
            wanted = self.plant.stiffness_for(wanted, self.signals.decode(observation, "angle"))
        pressure = np.atleast_1d(wanted / self.plant.muscle.gain)
        if self.operator is None:
            pressure = pressure / self.plant.muscle.stiffness_ratio
        else:
            held, _ = self.operator.inverse_step(pressure, self.state)
            pressure = np.clip(held, 0.0, self.plant.regulator.max_pressure)
            _, self.state = self.operator.step(pressure, self.state)
        return np.asarray(self.action.encode(pressure), np.float32)


class ElbowAllocation:
    """The pressures that give torque and stiffness at the present angle, or pulses towards them."""

    per_pascal = 2e-6
    """Width of a pulse [s] for a pressure that is off."""

    def __init__(self, env: Any) -> None:
        self.plant, self.signals, self.actions = env.plant, env.signals, env.action_signals

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        names = ("angle", "reference", "stiffness_reference")
        angle, torque, stiffness = (float(self.signals.decode(observation, n)) for n in names)
        if self.actions[0].unit == "N m":
            asked = [torque, stiffness]
        else:
            pressures = self.plant.allocate(angle, torque, stiffness)
            asked = [min(max(0.0, float(p)), self.plant.full_pressure) for p in pressures]
        if self.actions[0].unit == "s":
            there = [float(self.signals.decode(observation, f"pressure_{k}")) for k in "ab"]
            asked = [self.per_pascal * (p - q) for p, q in zip(asked, there, strict=True)]
        made = [s.encode(v) for s, v in zip(self.actions, asked, strict=True)]
        return np.asarray(made, np.float32)


class JointsUpright:
    """The set-points of antagonistic joints that bear their weight and creep to their references.

    Weight by what the plant knows of it, and a slow integral of the error for the hysteresis.
    """

    per_step = 0.03

    def __init__(self, env: Any) -> None:
        self.plant, self.signals, self.actions = env.plant, env.signals, env.action_signals
        names = [signal.name for signal in self.actions if signal.unit == "rad"]
        self.angles = [name.replace("angle_set_point", "angle") for name in names]
        word = "joint_reference" if "reference" not in set(env.signals.names()) else "reference"
        self.wanted = [name.replace("angle_set_point", word) for name in names]
        self.carried = np.zeros(len(names))

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        read = self.signals.decode
        wanted = np.array([float(read(observation, name)) for name in self.wanted])
        angles = np.array([float(read(observation, name)) for name in self.angles])
        self.carried = self.carried + self.per_step * (wanted - angles)
        shift = self.plant.gravity_shift(wanted, float(read(observation, "payload")))
        asked = wanted + shift + self.carried
        made = [s.encode(v) for s, v in zip(self.actions, asked, strict=True)]
        return np.asarray(made, np.float32)


POLICIES: dict[str, Callable[[Any], Any]] = {
    "single_muscle": InverseFeedForward,
    "knee_orthosis": BraceFeedForward,
    "elbow_orthosis": ElbowAllocation,
    "antagonistic_joint": JointsUpright,
    "redundant_manipulator": JointsUpright,
}
"""What moves each family of plants."""
