"""Simultaneous recordings of a walking leg by a gait laboratory and by the orthosis.

The laboratory has a force plate and markers on the leg: it measures the horizontal force and, by
inverse dynamics, the knee torque. The orthosis measures shoe forces and the lean of the shank, and
computes Eq. (1) from them. Pace and centre of pressure vary from stride to stride.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.mechanics.leg import Leg
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee

PERIOD = KneeOrthosis.control_period
PACE_SPREAD = 0.06  # largest relative deviation of a stride's duration from the mean
AIM = (0.9, 1.15)  # range of the height [m] of the point through which the ground force acts
LAB_NOISE = 1.0  # standard deviation of the laboratory's knee torque [N m]
PLATE_NOISE = 2.0  # standard deviation of the plate's horizontal force [N]
LOADED = 50.0  # least vertical force [N] of a loaded foot


@dataclass(frozen=True)
class GaitRecording:
    """Strides one after the other, arrays of shape (T,) in SI."""

    stride: NDArray[np.int64]
    torque: Array  # knee torque by inverse dynamics [N m], NaN in swing
    vertical: Array  # force read by the orthosis [N]
    cop: Array  # centre of pressure read by the orthosis [m ahead of the ankle]
    lean: Array  # of the shank, read by the orthosis [rad]
    horizontal: Array  # ground force on the plate [N], forward positive
    knee: Array  # flexion [rad]
    knee_rate: Array
    ankle: Array  # dorsiflexion [rad]
    inertial: Array  # torque that accelerates shank and foot, from the markers
    leg: Leg

    @property
    def time(self) -> Array:
        """Time [s] of the concatenated strides."""
        return np.asarray(np.arange(len(self.torque)) * PERIOD, np.float64)

    def and_then(self, other: "GaitRecording") -> "GaitRecording":
        """Return this recording followed by another one of the same leg."""
        if self.leg != other.leg:
            raise ValueError("both recordings must be of one leg; record them with one plant")
        parts = {
            f.name: np.concatenate([getattr(self, f.name), getattr(other, f.name)])
            for f in fields(self)
            if f.name not in ("leg", "stride")
        }
        after = other.stride + int(self.stride.max()) + 1
        return GaitRecording(**parts, stride=np.concatenate([self.stride, after]), leg=self.leg)


def record(pace: float, strides: int, seed: int = 0, noise: float = 1.0) -> GaitRecording:
    """Return strides of level walking with a mean duration [s]; ``noise`` is a factor."""
    rng = np.random.default_rng(seed)
    times = pace * (1.0 + PACE_SPREAD * rng.uniform(-1.0, 1.0, strides))
    aims = rng.uniform(*AIM, strides)
    plants = [
        KneeOrthosis.on_leg("walk", float(time), "none").replace({"leg.aim_height": float(aim)})
        for time, aim in zip(times, aims, strict=True)
    ]
    columns = _strides(plants, times)
    plant, n, loaded = plants[0], len(columns["lean"]), columns["vertical"] > LOADED
    sizes = {
        "vertical": plant.ground.noise,
        "cop": plant.cop.noise,
        "lean": plant.ankle.noise,
        "horizontal": PLATE_NOISE,
        "torque": LAB_NOISE,
    }
    for name, size in sizes.items():
        columns[name] = columns[name] + noise * size * rng.standard_normal(n)
    columns["torque"] = np.where(loaded, columns["torque"], np.nan)
    of = columns.pop("stride").astype(np.int64)
    return GaitRecording(**columns, stride=of, leg=KneeOrthosis.on_leg("walk").leg)


def _strides(plants: list[KneeOrthosis], times: Array) -> dict[str, Array]:
    """Return the second of three strides of each plant, concatenated, without noise."""
    steps = round(3.0 * float(times.max()) / PERIOD)
    made = simulate_knee(plants, np.full(steps, 1.5e5), pressure=1.5e5)
    turns = (np.arange(1, steps + 1) * PERIOD)[:, None] / times
    source = {
        "torque": made["demand"],
        "vertical": made["ground_z"],
        "cop": made["cop"],
        "lean": made["shank"],
        "horizontal": made["ground_x"],
        "knee": made["knee"],
        "knee_rate": made["knee_rate"],
        "ankle": made["ankle"],
        "inertial": inertial_torque(made["shank"], made["knee"], plants[0].leg),
        "stride": np.broadcast_to(np.arange(len(plants)), turns.shape),
    }
    second = ((turns >= 1.0) & (turns < 2.0)).T
    return {name: np.asarray(values.T[second], np.float64) for name, values in source.items()}


def inertial_torque(lean: Array, knee: Array, leg: Leg) -> Array:
    """Return the knee torque [N m] that accelerates shank and foot; the hip's velocity is constant.

    Lean of the shank and flexion of the knee [rad]: shape (T, n), one sample per control period.
    """
    first, second = (_derivatives(angle) for angle in (lean, knee))
    thigh, rate, acceleration = knee - lean, second[0] - first[0], second[1] - first[1]
    s, c = np.sin(thigh), np.cos(thigh)
    ahead = leg.thigh * (c * acceleration - s * rate**2)
    up = leg.thigh * (s * acceleration + c * rate**2)
    lever = leg.mass * leg.centre
    return lever * (ahead * np.cos(lean) - up * np.sin(lean)) - leg.inertia * first[1]


def _derivatives(angle: Array) -> tuple[Array, Array]:
    """Return first and second derivative along the first axis."""
    after, before = np.roll(angle, -1, axis=0), np.roll(angle, 1, axis=0)
    return (after - before) / (2.0 * PERIOD), (after - 2.0 * angle + before) / PERIOD**2
