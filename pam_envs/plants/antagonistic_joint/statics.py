"""Statics of a pair of muscles on its lever, without hysteresis: of a joint and of an arm's.

The static load check compares them with the weights at the angles of a plan.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.arrays import Array
from pam_envs.mechanics.antagonistic_lever import SIDES, AntagonisticLever
from pam_envs.muscle.force_map import ForceMap
from pam_envs.plants.antagonistic_joint.hysteresis import JointHysteresis
from pam_envs.plants.antagonistic_joint.link import Stage, StagePoint
from pam_envs.plants.core.passivity import ImposedMuscles
from pam_envs.plants.core.plant import Plant
from pam_envs.pneumatics.regulator import JointRegulator

STEP = 1e-6
SMALLEST_TORQUE = 1e-9
"""Largest missing torque [N m] that is attributed to rounding."""
SMALLEST_ARM = 1e-12
PRESTRESS_RANGE = (20.0, 120.0)
"""Co-contractions [N] that the preset takes: more and the buckling lever leaves no stiffness."""


class PairPlant(Plant):
    """A plant whose joints have an antagonistic pair of muscles each, all alike."""

    regulator: JointRegulator
    hysteresis: JointHysteresis
    muscle: ForceMap
    lever: AntagonisticLever
    link: Stage
    nominal: StagePoint

    def _check(self) -> None:
        """Refuse a stop past the toggle, and a limit past the stop."""
        limits, toggle = self.link, self.lever.toggle
        if limits.stop >= toggle:
            raise ValueError(
                f"stop = {limits.stop:g} rad lies beyond {toggle:.4g} rad, where the stretched "
                "muscle loses its lever arm; set the stop below it, or change the lever"
            )
        if limits.limit > limits.stop:
            raise ValueError(
                f"limit = {limits.limit:g} rad of the setpoint lies beyond the stop at "
                f"{limits.stop:g} rad; lower the limit"
            )

    # --- ranges ---------------------------------------------------------------------------------

    @property
    def angle_range(self) -> tuple[float, float]:
        """Lowest and highest setpoint [rad] of a joint."""
        return -self.link.limit, self.link.limit

    @property
    def largest_angle(self) -> float:
        """Angle of the mechanical stop [rad]."""
        return self.link.stop

    @property
    def prestress(self) -> float:
        """Usual co-contraction [N]."""
        return self.nominal.prestress

    # --- statics --------------------------------------------------------------------------------

    def forces_for(
        self, angle: ArrayLike, prestress: ArrayLike, torque: ArrayLike = 0.0
    ) -> tuple[Array, Array]:
        """Return the forces [N] of both muscles whose mean is ``prestress`` [N].

        ``torque`` [N m] is what they exert together, at an angle [rad].
        """
        rate = self.lever.rate(angle)
        spread = rate[..., 1] - rate[..., 0]
        stress = np.asarray(prestress, float)
        a = (2.0 * stress * rate[..., 1] + np.asarray(torque, float)) / spread
        return a, 2.0 * stress - a

    def pressures_for(
        self, angle: ArrayLike, prestress: ArrayLike | None = None, torque: ArrayLike = 0.0
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return both pressures [Pa] for an angle [rad], co-contraction [N] and torque [N m].

        The exact inverse of the static law, without hysteresis. Where a muscle would need more than
        full pressure the co-contraction is reduced; the last value marks angles that are out of
        reach even without co-contraction.
        """
        full, total = self.regulator.max_pressure, np.asarray(torque, float)
        x = self.lever.contraction(angle, self.muscle.rest_length)
        rate = np.broadcast_to(self.lever.rate(angle), x.shape)
        top = self.muscle.law(full, x)
        a, b = self.forces_for(angle, self.prestress if prestress is None else prestress, torque)
        a, b = np.minimum(a, top[..., 0]), np.minimum(b, top[..., 1])
        held = a
        a = np.minimum(a, np.maximum(0.0, -(total + b * rate[..., 1]) / rate[..., 0]))
        b = np.minimum(b, np.maximum(0.0, -(total + held * rate[..., 0]) / rate[..., 1]))
        pulls = np.stack([a, b], axis=-1)
        missed = np.abs(np.sum(pulls * rate, axis=-1) + total)
        pressures = np.clip(self.muscle.pressure(pulls, x), 0.0, full)
        return pressures[..., 0], pressures[..., 1], missed > SMALLEST_TORQUE

    def torque(self, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
        """Return a pair's torque [N m], positive towards muscle A, at pressures [Pa]."""
        x = self.lever.contraction(angle, self.muscle.rest_length)
        p = np.stack(np.broadcast_arrays(pressure_a, pressure_b, x[..., 0])[:2], axis=-1)
        gains = self.muscle.gain * (1.0 + np.array(SIDES) * self.muscle.imbalance)
        return -np.sum(gains * self.muscle.force(p, x) * self.lever.rate(angle), axis=-1)

    def volumes(self, angle: ArrayLike) -> tuple[Array, Array]:
        """Return the inner volumes [m3] of both muscles at angles [rad], shape (..., 2).

        And their changes with the angle [m3/rad].
        """
        x = self.lever.contraction(angle, self.muscle.rest_length)
        gives = -self.muscle.area_at(x) * self.lever.rate(angle)
        return self.muscle.volume_at(x), gives

    def imposed_muscles(self, cycles: int) -> ImposedMuscles:
        """Return a pair under imposed pressures (2, n) [Pa] and an angle [rad], always taut.

        Muscles that are slack in the plant push here, so that the work is that of the law.
        """
        length, sides = self.muscle.rest_length, np.array(SIDES)
        gains = self.muscle.gain * (1.0 + sides * self.muscle.imbalance)
        rubs = 1.0 + sides * self.muscle.friction_imbalance
        straight = self.lever.contraction(0.0, length)
        start = self.hysteresis.model.initial_state((cycles,))

        def law(p: Array, angle: Array) -> Array:
            forces = gains * self.muscle.corrected(p.T, self.lever.contraction(angle, length))
            return -np.sum(forces * self.lever.rate(angle), axis=-1)

        def force(p: Array, angle: Array, states: Any) -> tuple[Array, Any]:
            at, rate = self.lever.contraction(angle, length) - straight, self.lever.rate(angle)
            moved = [self.hysteresis.friction(at[:, k], p[k], states[k]) for k in range(2)]
            drag = sum(rubs[k] * moved[k][0] * rate[:, k] for k in range(2))
            return law(p, angle) + drag, tuple(after for _, after in moved)

        return ImposedMuscles(force, law, (start, start))

    def stiffness(self, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
        """Return minus the derivative of the torque by the angle [N m/rad] at held pressures."""
        phi = np.asarray(angle, float)
        ahead = self.torque(phi + STEP, pressure_a, pressure_b)
        return (self.torque(phi - STEP, pressure_a, pressure_b) - ahead) / (2.0 * STEP)

    def stiffness_at(self, angle: ArrayLike, prestress: ArrayLike | None = None) -> Array:
        """Return a pair's stiffness [N m/rad] at rest, pressures held, without hysteresis."""
        return self.stiffness(angle, *self.pressures_for(angle, prestress)[:2])

    def torque_range(self, angles: ArrayLike, by_pressure: bool = False) -> tuple[Array, Array]:
        """Return the least and the largest torque [N m] of the muscles at angles [rad].

        The limit of angle setpoints also limits the torque; pressure setpoints have no such limit.
        """
        a, b = np.array(self.regulator.max_pressure), np.array(0.0)
        if not by_pressure:
            a, b, _ = self.pressures_for(self.link.limit)
        return self.torque(angles, b, a), self.torque(angles, a, b)

    def weight_torque(self, angles: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return the torques [N m] that hold plant and payload [kg] at angles [rad]."""
        raise NotImplementedError

    def shift_for(
        self, angle: ArrayLike, prestress: float, torque: ArrayLike, limit: float
    ) -> Array:
        """Return the addition to a setpoint [rad] within ``limit`` to rest under a torque.

        The muscles then exert ``torque`` [N m] at ``angle`` [rad], or come as near as they can.
        """
        phi, load = np.broadcast_arrays(np.asarray(angle, float), np.asarray(torque, float))
        low, high = np.full(phi.shape, -limit), np.full(phi.shape, limit)
        for _ in range(50):
            middle = 0.5 * (low + high)
            less = self.torque(phi, *self.pressures_for(middle, prestress)[:2]) < load
            low, high = np.where(less, middle, low), np.where(less, high, middle)
        return np.asarray(0.5 * (low + high) - phi)

    def gravity_shift(self, angles: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return the addition to setpoints [rad] that compensates gravity, shape (..., n).

        ``angles`` (..., n) [rad] are those at rest, with a payload (...) [kg].
        """
        phi, limit = np.asarray(angles, float), self.link.limit
        held = np.clip(phi, -limit, limit)
        return self.shift_for(held, self.prestress, self.weight_torque(phi, payload), limit)

    def _reach(self, prestress: float | None, load: Callable[[float], float]) -> float:
        """Return the largest angle [rad] up to the stop at which the co-contraction [N] is held.

        ``load`` is the torque [N m] against which the muscles hold an angle.
        """
        stress = self.prestress if prestress is None else prestress

        def held(angle: float) -> bool:
            pulls = np.array(self.forces_for(angle, stress, load(angle)))
            x = self.lever.contraction(angle, self.muscle.rest_length)
            within = self.muscle.pressure(pulls, x) <= self.regulator.max_pressure
            return bool(np.all(within & (pulls >= 0.0)))

        low, high = 0.0, self.link.stop
        if held(high) or not held(low):
            return high if held(high) else low
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if held(middle) else (low, middle)
        return low


class UnbearableLoad(ValueError):
    """The muscles cannot hold the weight at an angle of the plan."""


def bearable_payload(plant: PairPlant, angles: ArrayLike, by_pressure: bool = False) -> float:
    """Return the largest payload [kg] that is borne at all angles (k, n) [rad]; below 0 if none is.

    ``by_pressure``: pressures are set, so that the limits of angle setpoints do not apply.
    """
    low, high = plant.torque_range(angles, by_pressure)
    empty = plant.weight_torque(angles)
    each = plant.weight_torque(angles, 1.0) - empty
    if np.any(empty > high) or np.any(empty < low):
        return -1.0
    room = np.where(each > 0.0, high - empty, empty - low)
    return float(np.min(room / np.maximum(np.abs(each), SMALLEST_ARM)))


def check_borne(
    plant: PairPlant, angles: ArrayLike, payload: float, where: str, by_pressure: bool = False
) -> None:
    """Raise :class:`UnbearableLoad` where the muscles cannot hold a plan's angles (k, n) [rad].

    ``payload`` is the heaviest [kg], ``where`` the subject of the error's sentence.
    """
    low, high = plant.torque_range(angles, by_pressure)
    needed_torque = plant.weight_torque(angles, payload)
    short = np.maximum(needed_torque - high, low - needed_torque)
    pose, joint = np.unravel_index(int(np.argmax(short)), short.shape)
    if short[pose, joint] <= SMALLEST_TORQUE:
        return
    needed = float(needed_torque[pose, joint])
    there = float((high if needed > high[pose, joint] else low)[pose, joint])
    most = bearable_payload(plant, angles, by_pressure)
    remedy = (
        f"give it a payload of {most:.3g} kg or less, payload_change included"
        if most >= 0.0
        else "nor is it borne without a payload: take lighter links, or smaller angles"
    )
    raise UnbearableLoad(
        f"{where}, pose {pose}: with {payload:g} kg of payload joint {joint} needs "
        f"{abs(needed):.3g} N m at {np.degrees(np.asarray(angles)[pose, joint]):.1f} degrees and "
        f"its muscles exert {np.sign(needed) * there + 0.0:.3g} N m there at most; {remedy}"
    )
