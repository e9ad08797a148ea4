"""The statics of a pair of muscles on its lever, without hysteresis."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.mechanics.antagonistic_lever import SIDES, AntagonisticLever
from pam_envs.muscle.force_map import ForceMap
from pam_envs.pneumatics.regulator import JointRegulator

Array = NDArray[np.float64]
STEP = 1e-6
SMALLEST_TORQUE = 1e-9


class Limits(Protocol):
    """Limits of set-points and of the motion."""

    @property
    def limit(self) -> float:
        """Of the set-point [rad]."""

    @property
    def stop(self) -> float:
        """Of the motion [rad]."""


class Pair(Protocol):
    """A plant with a pair of muscles on a lever."""

    @property
    def muscle(self) -> ForceMap:
        """The law of force."""

    @property
    def lever(self) -> AntagonisticLever:
        """The lever."""

    @property
    def regulator(self) -> JointRegulator:
        """The regulators."""


def check_angles(pair: Pair, limits: Limits) -> None:
    """Refuse a stop past the toggle, and a limit past the stop."""
    toggle = pair.lever.toggle
    if limits.stop >= toggle:
        raise ValueError(
            f"stop = {limits.stop:g} rad lies beyond {toggle:.4g} rad, where the stretched muscle "
            "loses its lever arm; set the stop below it, or change the lever"
        )
    if limits.limit > limits.stop:
        raise ValueError(
            f"limit = {limits.limit:g} rad of the set-point lies beyond the stop at "
            f"{limits.stop:g} rad; lower the limit"
        )


def forces_for(
    pair: Pair, angle: ArrayLike, prestress: ArrayLike, torque: ArrayLike = 0.0
) -> tuple[Array, Array]:
    """Return the forces [N] of both muscles with a mean [N] and a torque [N m] together."""
    rate = pair.lever.rate(angle)
    spread = rate[..., 1] - rate[..., 0]
    stress, wanted = np.asarray(prestress, float), np.asarray(torque, float)
    a = (2.0 * stress * rate[..., 1] + wanted) / spread
    return a, 2.0 * stress - a


def pressures_for(
    pair: Pair, angle: ArrayLike, prestress: ArrayLike, torque: ArrayLike = 0.0
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the pressures [Pa] for these forces, and where their torque is out of reach.

    Where a muscle would need more than full pressure, the co-contraction gives way.
    """
    x = pair.lever.contraction(angle, pair.muscle.rest_length)
    rate = np.broadcast_to(pair.lever.rate(angle), x.shape)
    top, wanted = pair.muscle.law(pair.regulator.max_pressure, x), np.asarray(torque, float)
    a, b = forces_for(pair, angle, prestress, torque)
    a, b = np.minimum(a, top[..., 0]), np.minimum(b, top[..., 1])
    held = a
    a = np.minimum(a, np.maximum(0.0, -(wanted + b * rate[..., 1]) / rate[..., 0]))
    b = np.minimum(b, np.maximum(0.0, -(wanted + held * rate[..., 0]) / rate[..., 1]))
    pulls = np.stack([a, b], axis=-1)
    missed = np.abs(np.sum(pulls * rate, axis=-1) + wanted)
    pressures = np.clip(pair.muscle.pressure(pulls, x), 0.0, pair.regulator.max_pressure)
    return pressures[..., 0], pressures[..., 1], missed > SMALLEST_TORQUE


def shift_for(
    pair: Pair, angle: ArrayLike, prestress: float, torque: ArrayLike, limit: float
) -> Array:
    """Return what to add to a set-point [rad] within ``limit`` to rest at an angle under a torque.

    The muscles then exert ``torque`` [N m] at ``angle`` [rad], or come as near to it as they can.
    """
    phi, wanted = np.broadcast_arrays(np.asarray(angle, float), np.asarray(torque, float))
    low, high = np.full(phi.shape, -limit), np.full(phi.shape, limit)
    for _ in range(50):
        middle = 0.5 * (low + high)
        pressures = pressures_for(pair, middle, prestress)[:2]
        less = pull(pair, phi, *pressures) < wanted
        low, high = np.where(less, middle, low), np.where(less, high, middle)
    return np.asarray(0.5 * (low + high) - phi)


def forces(pair: Pair, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
    """Return the forces [N] at an angle [rad] and pressures [Pa], shape (..., 2)."""
    x = pair.lever.contraction(angle, pair.muscle.rest_length)
    p = np.stack(np.broadcast_arrays(pressure_a, pressure_b, x[..., 0])[:2], axis=-1)
    gains = pair.muscle.gain * (1.0 + np.array(SIDES) * pair.muscle.imbalance)
    return gains * pair.muscle.force(p, x)


def pull(pair: Pair, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
    """Return the muscles' torque [N m], positive towards muscle A."""
    pulls = forces(pair, angle, pressure_a, pressure_b)
    return -np.sum(pulls * pair.lever.rate(angle), axis=-1)


def stiffness(pair: Pair, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
    """Return minus the derivative of the torque by the angle [N m/rad] at held pressures."""
    phi = np.asarray(angle, float)
    ahead = pull(pair, phi + STEP, pressure_a, pressure_b)
    return (pull(pair, phi - STEP, pressure_a, pressure_b) - ahead) / (2.0 * STEP)


def torque_range(
    pair: Pair, angle: ArrayLike, limit: float | None, prestress: float
) -> tuple[Array, Array]:
    """Return the least and the largest torque [N m] of the muscles at an angle [rad].

    ``limit`` [rad] bounds the set-points at a co-contraction [N]; without one the pressures are
    free.
    """
    a, b = np.array(pair.regulator.max_pressure), np.array(0.0)
    if limit is not None:
        a, b, _ = pressures_for(pair, limit, prestress)
    return pull(pair, angle, b, a), pull(pair, angle, a, b)


def reachable_angle(
    pair: Pair, stop: float, prestress: float, load: Callable[[float], float]
) -> float:
    """Return the largest angle [rad] up to ``stop`` at which the co-contraction [N] is held.

    ``load`` is the torque [N m] against which the muscles hold an angle.
    """

    def held(angle: float) -> bool:
        pulls = np.array(forces_for(pair, angle, prestress, load(angle)))
        x = pair.lever.contraction(angle, pair.muscle.rest_length)
        within = pair.muscle.pressure(pulls, x) <= pair.regulator.max_pressure
        return bool(np.all(within & (pulls >= 0.0)))

    low, high = 0.0, stop
    if held(stop) or not held(0.0):
        return stop if held(stop) else 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if held(middle) else (low, middle)
    return low
