"""Preview of the reference stiffness by one lag of the regulator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Reader, preview_names, reader
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.knee.nominal import KneeNominal
from baselines.knee.view import KneeObserver, KneeView
from baselines.positioning.inverse import preview_weights
from pam_envs.parameters import Signals

KNOBS: Bounds = {"lead": (0.25, 4.0)}


@dataclass(frozen=True)
class StiffnessPreview:
    """Interpolation of the previewed reference stiffness [N/m] at a later time.

    Attributes
    ----------
    nominal : KneeNominal
    tension, angle : Reader
        Of the reference, or the angle's reference, and its preview; no angle without a gait.
    weights : ndarray, shape (n_preview + 1,)
        Interpolation weights of the later time.
    stiffness : bool
        Whether the reference is a stiffness.
    """

    nominal: KneeNominal
    tension: Reader
    angle: Reader | None
    weights: Array
    stiffness: bool

    def reference(self, observation: ArrayLike) -> Array:
        """Return the reference stiffness [N/m], shape (n_env,)."""
        samples = self.tension.rows(observation)
        if not self.stiffness:
            samples = samples / self.nominal.stretch(self._angles(observation, samples))
        return np.add.reduce(self.weights[:, None] * samples, axis=0)

    def free(self, observation: ArrayLike) -> Array:
        """Return the stiffness [N/m] of zero wire torque on the knee, shape (n_env,)."""
        assert self.angle is not None
        angles = self.angle.rows(observation)
        samples = self.nominal.free_tension(angles) / self.nominal.stretch(angles)
        return np.add.reduce(self.weights[:, None] * samples, axis=0)

    def _angles(self, observation: ArrayLike, tension: Array) -> Array:
        """Return the angles [rad] of the samples: planned, or in equilibrium with the tension."""
        if self.angle is not None:
            return self.angle.rows(observation)
        return self.nominal.angle_of(tension)


def make_stiffness_preview(
    nominal: KneeNominal, signals: Signals, observer: KneeObserver, knobs: Knobs = AS_DESIGNED
) -> StiffnessPreview:
    """Return the preview by the regulator's lag and half a control period."""
    samples = len(preview_names("reference", signals)) - 1
    delay = nominal.plant.regulator.time_constant + 0.5 * nominal.plant.control_period
    spacing = signals["reference_1"].ahead if samples else 0.0
    return StiffnessPreview(
        nominal,
        reader(signals, preview_names("reference", signals)),
        reader(signals, preview_names("angle_reference", signals)) if observer.gait else None,
        preview_weights(samples, spacing, knob(knobs, "lead") * delay),
        observer.stiffness,
    )


def tension(preview: StiffnessPreview | None, view: KneeView, observation: ArrayLike) -> Array:
    """Return the reference tension [N] at the present stretch, now or previewed."""
    return view.reference if preview is None else preview.reference(observation) * view.stretch


def free_tension(
    observer: KneeObserver, preview: StiffnessPreview | None, view: KneeView, observation: ArrayLike
) -> Array:
    """Return the tension [N] of zero wire torque on the knee, now or previewed."""
    if preview is None or not observer.gait:
        return observer.nominal.free_tension(view.angle)
    return preview.free(observation) * view.stretch
