"""Stride of the nominal wearer: planned tension and angle, before they have been previewed.

The plan is that of the environments (yeh2010, sections 2 and 5): the orthosis gives a share of the
torque of Eq. (1), low-passed at 5 Hz, from the ground force and the lean of the measured stride. It
continues a preview beyond its end in a stride that has not been seen; the phase is that at which it
fits the previewed samples best.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.core.controller import Rows
from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.kernels.build import entry
from pam_envs.mechanics.leg import centre_of_pressure
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.references.gait import NATURAL_STRIDE, gait_curves, vertical_load
from pam_envs.sensing.butterworth import filtered
from pam_envs.sensing.shoe import estimated_torque, heel_load

RATIO = 0.2
"""Share of the knee torque that the orthosis gives: yeh2010, section 5."""
TENSION_MISFIT, ANGLE_MISFIT = 20.0, 0.02
"""Differences from a previewed tension [N] and angle [rad] that count alike."""


@dataclass(frozen=True)
class NominalStride:
    """Planned stride of a nominal plant on a leg."""

    plant: KneeOrthosis

    @property
    def length(self) -> float:
        """Duration of the stride [control periods]."""
        return self.plant.stride.time / self.plant.control_period

    @cached_property
    def samples(self) -> Array:
        """Tension [N] and angle [rad], shape (2, n_points), evenly over the stride."""
        return self._planned[:2]

    @cached_property
    def loads(self) -> Array:
        """Load on the leg [1], shape (n_points,), evenly over the stride."""
        return self._planned[2]

    @cached_property
    def torques(self) -> Array:
        """Torque reference [N m], also in swing, shape (n_points,), evenly over the stride."""
        return self._planned[4]

    @cached_property
    def stance(self) -> Rows:
        """Stance of the shoe's sensor, shape (n_points,), evenly over the stride."""
        return self._planned[3] > 0.0

    @cached_property
    def _planned(self) -> Array:
        """Tension [N], angle [rad], load [1], stance, and torque [N m], shape (5, n_points)."""
        plant, points = self.plant, math.ceil(self.length)
        leg, shoe = plant.leg, plant.shoe
        phases = np.arange(points) / points
        found, table = gait_curves(plant.activity, phases), plant.gait_table()
        angle = plant.lever.mount_angle + found["knee"]
        quick = NATURAL_STRIDE / plant.stride.time
        torque, load, stance = np.zeros(points), np.zeros(points), np.zeros(points, bool)
        for i, phase in enumerate(phases):
            loaded = vertical_load(table, phase, quick)
            load[i] = max(0.0, loaded)
            force = leg.body_mass * GRAVITY * load[i]
            cop = centre_of_pressure(
                found["cop"][i], found["ground_x"][i], loaded, quick, leg.aim_height, shoe.heel,
                shoe.tip,
            )  # fmt: skip
            shank, ankle = found["shank"][i], found["ankle"][i]
            lean = shank + shoe.flat_foot * (ankle - shank)
            torque[i] = RATIO * estimated_torque(force, cop, math.sin(lean), leg.shank)
            stance[i] = heel_load(force, cop, shoe.heel, shoe.tip) > shoe.threshold
        torque = filtered(np.tile(torque, 2))[points:]
        tension = plant.lever.tension(np.where(stance, torque, 0.0), angle)
        return np.stack([np.maximum(tension, 0.0), angle, load, stance, torque])

    def phase(self, seen: Array, ahead: NDArray[np.int64], sought: Rows, before: Array) -> Array:
        """Return the point of the stride at present [control periods], shape (n_env,).

        Parameters
        ----------
        seen : ndarray, shape (n_env, 2, n_samples)
            Previewed tension [N] and angle [rad].
        ahead : ndarray of int, shape (n_samples,)
            Times of the samples from the present [control periods].
        sought : ndarray of bool, shape (n_env,)
            Whether a point is sought.
        before : ndarray, shape (n_env,)
            Points of the others [control periods].
        """
        at = np.arange(self.samples.shape[1])[:, None] + ahead
        scale = np.array([TENSION_MISFIT, ANGLE_MISFIT])
        found = np.array(before, float)
        fit_rows(np.ascontiguousarray(seen), self.read(at), scale, sought, found)
        return found

    def read(self, points: NDArray[np.generic]) -> Array:
        """Return tension [N] and angle [rad] at the nearest points of the stride, (2, ...)."""
        return self.samples[:, self.nearest(points)]

    def load(self, points: NDArray[np.generic]) -> Array:
        """Return the load on the leg [1] at the nearest points of the stride."""
        return self.loads[self.nearest(points)]

    def torque(self, points: NDArray[np.generic]) -> Array:
        """Return the torque reference [N m], also in swing, at points of the stride."""
        count = len(self.torques)
        known = np.arange(count) * (self.length / count)
        return np.interp(np.asarray(points, float), known, self.torques, period=self.length)

    def in_stance(self, points: NDArray[np.generic]) -> Rows:
        """Return whether the nearest points of the stride are in stance."""
        return self.stance[self.nearest(points)]

    def nearest(self, points: NDArray[np.generic]) -> NDArray[np.int64]:
        """Return the indices of the nearest samples of the stride."""
        count = self.samples.shape[1]
        return np.floor(points * (count / self.length) + 0.5).astype(np.int64) % count


@entry
def fit_rows(seen: Array, planned: Array, scale: Array, sought: Any, found: Array) -> None:
    """Write the point whose planned samples, (2, n_points, n_samples), fit a row best.

    The nearest point is refined to a fraction of a period by least squares of the angle, which,
    unlike the tension, has no jump.
    """
    points = planned.shape[1]
    for i in range(len(seen)):
        best, least = -1, np.inf
        for point in range(points if sought[i] else 0):
            misfit = 0.0
            for c in range(len(scale)):
                if misfit >= least:
                    break
                for k in range(planned.shape[2]):
                    off = (seen[i, c, k] - planned[c, point, k]) / scale[c]
                    misfit += off * off
            if misfit < least:
                best, least = point, misfit
        if best >= 0:
            product, square = 0.0, 1e-12
            for k in range(planned.shape[2]):
                after, before = (
                    planned[1, (best + 1) % points, k],
                    planned[1, (best - 1) % points, k],
                )
                rate = 0.5 * (after - before)
                product += rate * (seen[i, 1, k] - planned[1, best, k])
                square += rate * rate
            found[i] = best + max(-1.0, min(1.0, product / square))
