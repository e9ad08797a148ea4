"""The wanted stiffness one lag ahead, from the previewed references."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Reader, preview_names, reader
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.knee.nominal import KneeNominal
from baselines.knee.view import Eyes, View
from baselines.positioning.inverse import preview_weights
from pam_envs.parameters import Signals

KNOBS: Bounds = {"lead": (0.25, 4.0)}


@dataclass(frozen=True)
class Ahead:
    """Reads the wanted stiffness [N/m] some time ahead.

    Attributes
    ----------
    nominal : KneeNominal
    tension, angle : Reader
        Of the reference, or the angle's reference, and its preview; no angle without a gait.
    weights : ndarray, shape (n_preview + 1,)
        That give the value at the time.
    stiffness : bool
        Whether the reference is a stiffness.
    """

    nominal: KneeNominal
    tension: Reader
    angle: Reader | None
    weights: Array
    stiffness: bool

    def wanted(self, observation: ArrayLike) -> Array:
        """Return the wanted stiffness [N/m], shape (n_env,)."""
        samples = self.tension.rows(observation)
        if not self.stiffness:
            samples = samples / self.nominal.stretch(self._angles(observation, samples))
        return np.add.reduce(self.weights[:, None] * samples, axis=0)

    def free(self, observation: ArrayLike) -> Array:
        """Return the stiffness [N/m] that takes the wire's torque off the knee, (n_env,)."""
        assert self.angle is not None
        angles = self.angle.rows(observation)
        samples = self.nominal.free_tension(angles) / self.nominal.stretch(angles)
        return np.add.reduce(self.weights[:, None] * samples, axis=0)

    def _angles(self, observation: ArrayLike, tension: Array) -> Array:
        """Return the angles [rad] that belong to the samples: planned, or where they balance."""
        if self.angle is not None:
            return self.angle.rows(observation)
        return self.nominal.angle_of(tension)


def make_ahead(
    nominal: KneeNominal, signals: Signals, eyes: Eyes, knobs: Knobs = AS_DESIGNED
) -> Ahead:
    """Return what looks ahead by the regulator's lag and half a control period."""
    samples = len(preview_names("reference", signals)) - 1
    delay = nominal.plant.regulator.time_constant + 0.5 * nominal.plant.control_period
    spacing = signals["reference_1"].ahead if samples else 0.0
    return Ahead(
        nominal,
        reader(signals, preview_names("reference", signals)),
        reader(signals, preview_names("angle_reference", signals)) if eyes.gait else None,
        preview_weights(samples, spacing, knob(knobs, "lead") * delay),
        eyes.stiffness,
    )


def tension(ahead: Ahead | None, view: View, observation: ArrayLike) -> Array:
    """Return the tension [N] of the present stretch for the stiffness wanted now, or ahead."""
    return view.wanted if ahead is None else ahead.wanted(observation) * view.stretch


def free_tension(eyes: Eyes, ahead: Ahead | None, view: View, observation: ArrayLike) -> Array:
    """Return the tension [N] that takes the wire's torque off the knee, now or ahead."""
    if ahead is None or not eyes.gait:
        return eyes.nominal.free_tension(view.angle)
    return ahead.free(observation) * view.stretch
