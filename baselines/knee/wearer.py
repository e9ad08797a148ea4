"""Deviation of the wearer's knee from his path under the assistance, over a horizon.

The tension of a torque depends on the angle, and the angle on the torque: the wearer holds his path
like a spring and a damper (:mod:`pam_envs.mechanics.leg`), and the brace, which has a torque,
damping and inertia of its own, pushes him off it by ``e``:

    (I + I_brace) e'' = -(tau_a + D q' + I_brace q'' - borne) - K e - B e'

with the path ``q`` and the torque of the wire ``borne`` by the wearer. ``K`` and ``B`` increase
with the load on the leg. In stance the deviation is a few hundredths of a radian and settles within
60 ms, about the dead time of the regulator: a prediction that keeps it constant is late by most of
a control period.

The nominal leg is integrated along the torques of the nominal brace and the load, which is sensed
at present and that of the nominal stride over the horizon. What then remains of the sensed angle is
attributed to the path.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.kernels.build import entry, kernel
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

SUBSTEPS = 2
"""Sub-steps of a control period."""


@dataclass(frozen=True)
class WearerModel:
    """Leg and brace of a nominal plant."""

    plant: KneeOrthosis

    @cached_property
    def _hold(self) -> Array:
        """Stiffness [N m/rad] and damping [N m s/rad] without load, and what a load adds."""
        leg = self.plant.leg
        upright = leg.mass * GRAVITY * leg.centre
        return np.array(
            [
                leg.stiffness + leg.hold_stiffness + upright,
                leg.damping + leg.hold_damping + self.plant.lever.damping,
                leg.stance_stiffness,
                leg.stance_damping,
                1.0 / (leg.inertia + self.plant.lever.inertia),
            ]
        )

    def load(self, ground_force: Array) -> Array:
        """Return the load on the leg [1], from the vertical ground force [N]."""
        return ground_force / (self.plant.leg.body_mass * GRAVITY)

    def passive(self, path: Array) -> Array:
        """Return the torque [N m] that carries the brace along a path.

        ``path``, shape (n_env, n + 2), are angles [rad] a control period apart; the torque is that
        of all but the first and the last, shape (n_env, n).
        """
        period, lever = self.plant.control_period, self.plant.lever
        rate = (path[:, 2:] - path[:, :-2]) / (2.0 * period)
        bend = (path[:, 2:] - 2.0 * path[:, 1:-1] + path[:, :-2]) / period**2
        past = np.maximum(path[:, 1:-1] - lever.relaxed_angle, 0.0)
        borne = self.plant.leg.habituation * lever.stiffness * past
        return np.asarray(lever.damping * rate + lever.inertia * bend - borne)

    def along(self, start: Array, torque: Array, load: Array) -> Array:
        """Return deviations [rad] and their rates [rad/s], shape (n_env, n + 1, 2).

        Parameters
        ----------
        start : ndarray, shape (n_env, 2)
            Deviation [rad] and its rate [rad/s].
        torque : ndarray, shape (n_env, n)
            Torque on the leg [N m] in each control period, extension positive.
        load : ndarray, shape (n_env, n)
            Load on the leg [1].
        """
        found = np.empty((*torque.shape, 2))
        begin, given = np.ascontiguousarray(start), np.ascontiguousarray(torque)
        step = self.plant.control_period / SUBSTEPS
        deviate_rows(begin, given, np.ascontiguousarray(load), self._hold, step, found)
        return np.concatenate([begin[:, None], found], axis=1)

    def response(self, load: Array, scale: Array, ends: Array, delay: Array) -> Array:
        """Return the deviation [rad] at nodes for unit torques at nodes [rad/(N m)].

        Its shape is (n_env, n_nodes, n_nodes), the deviations first. The torque is linear between
        the nodes.

        Parameters
        ----------
        load : ndarray, shape (n_env, n)
            Load on the leg [1] in each control period.
        scale : ndarray, shape (n_env, n + 1)
            Deviation over the nominal one [1] at the ends of control periods.
        ends : ndarray, shape (n_env, n_nodes)
            Times of the nodes [control periods], at most ``n``.
        delay : ndarray, shape (n_env,)
            Time [control periods] before which a torque at the first node does not act.
        """
        found = np.zeros((*ends.shape, ends.shape[1]))
        step = self.plant.control_period / SUBSTEPS
        loads, scales = np.ascontiguousarray(load), np.ascontiguousarray(scale)
        course = np.empty((6, load.shape[1]))
        respond_rows(loads, scales, ends, delay, self._hold, step, course, found)
        return found


@kernel
def deviated(
    off: float, rate: float, torque: float, load: float, hold: Any, step: float
) -> tuple[float, float]:
    """Return the deviation [rad] and its rate [rad/s] one control period later."""
    stiffness = hold[0] + hold[2] * load
    damping = hold[1] + hold[3] * load
    for _ in range(SUBSTEPS):
        push = (-torque - stiffness * off) * hold[4]
        rate = (rate + step * push) / (1.0 + step * damping * hold[4])
        off = off + step * rate
    return off, rate


@entry
def deviate_rows(
    start: Array, torque: Array, load: Array, hold: Array, step: float, found: Array
) -> None:
    """Write deviations and their rates at the ends of control periods."""
    for i in range(len(start)):
        off, rate = start[i, 0], start[i, 1]
        for k in range(torque.shape[1]):
            off, rate = deviated(off, rate, torque[i, k], load[i, k], hold, step)
            found[i, k, 0], found[i, k, 1] = off, rate


@entry
def respond_rows(
    load: Array, scale: Array, ends: Array, delay: Array, hold: Array, step: float, course: Any,
    found: Array,
) -> None:  # fmt: skip
    """Write the deviation [rad] at each node for a unit torque at each node, (n_env, k, j).

    The torque is linear between nodes; that of the first node begins when a setpoint takes effect.
    Nodes before that of the torque are left at 0. ``course``, (6, n), is scratch.
    """
    nodes, last = ends.shape[1], load.shape[1]
    for i in range(len(load)):
        for m in range(last):
            course[0][m], course[1][m] = deviated(1.0, 0.0, 0.0, load[i, m], hold, step)
            course[2][m], course[3][m] = deviated(0.0, 1.0, 0.0, load[i, m], hold, step)
            course[4][m], course[5][m] = deviated(0.0, 0.0, 1.0, load[i, m], hold, step)
        for j in range(nodes):
            begin = delay[i] if j == 0 else ends[i, j - 1]
            off, rate, k = 0.0, 0.0, j
            for m in range(int(begin), last):
                time = m + 0.5
                torque = 0.0
                if time >= begin:
                    if time <= ends[i, j]:
                        torque = (time - begin) / (ends[i, j] - begin) if j > 0 else 1.0
                    elif j == nodes - 1:
                        torque = 1.0
                    elif time < ends[i, j + 1]:
                        torque = (ends[i, j + 1] - time) / (ends[i, j + 1] - ends[i, j])
                before = off * scale[i, m]
                moved = course[0][m] * off + course[2][m] * rate + course[4][m] * torque
                rate = course[1][m] * off + course[3][m] * rate + course[5][m] * torque
                off = moved
                after = off * scale[i, m + 1]
                while k < nodes and ends[i, k] <= m + 1:
                    part = ends[i, k] - m
                    found[i, k, j] = before + part * (after - before)
                    k += 1
