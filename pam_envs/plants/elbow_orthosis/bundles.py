"""The two bundles on their pulley as kernels: forces, torque, stiffness, volume."""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import kernel
from pam_envs.mechanics.pulley import contraction_of
from pam_envs.muscle.quadratic_bundle import bundle_shape, bundle_volume, grown_volume
from pam_envs.plants.elbow_orthosis import rows as K


@kernel
def contraction_at(fixed: Any, j: int, side: int, angle: float) -> float:
    """Return the contraction [m] of a bundle, 0 for a and 1 for b, at an angle [rad]."""
    sign = 2.0 * side - 1.0
    return contraction_of(
        angle,
        sign,
        fixed[K.PULLEY_RADIUS][j],
        fixed[K.PULLEY_LOWEST][j],
        fixed[K.PULLEY_HIGHEST][j],
    )


@kernel
def travel_at(fixed: Any, j: int, angle: float) -> float:
    """Return the travel of the pulley [m] from the middle of its range."""
    return fixed[K.PULLEY_RADIUS][j] * (
        angle - 0.5 * (fixed[K.PULLEY_LOWEST][j] + fixed[K.PULLEY_HIGHEST][j])
    )


@kernel
def factors_of(fixed: Any, j: int, side: int) -> tuple[float, float]:
    """Return ``k0`` [N/m2] and ``k1`` [N/(m2 Pa)] of a bundle."""
    row = side * len(K.BUNDLE)
    muscles, gain = fixed[row + K.BUNDLE.muscles][j], fixed[row + K.BUNDLE.gain][j]
    passive = (
        fixed[row + K.BUNDLE.passive_base][j] + fixed[row + K.BUNDLE.passive_each][j] * muscles
    )
    pressed = (
        fixed[row + K.BUNDLE.pressure_base][j] + fixed[row + K.BUNDLE.pressure_each][j] * muscles
    )
    return gain * passive, gain * pressed


@kernel
def shape_of(fixed: Any, j: int, side: int, contraction: float) -> tuple[float, float]:
    """Return the force over ``X`` [m2] of the law at a contraction [m], and its slope [m]."""
    row = side * len(K.BUNDLE)
    length = fixed[row + K.BUNDLE.nominal_length][j]
    return bundle_shape(contraction, length, fixed[row + K.BUNDLE.largest_contraction][j] * length)


@kernel
def friction_of(fixed: Any, j: int, side: int, lag: float) -> float:
    """Return the share of friction [m2] in the shape of a bundle at a lag [m] of the travel."""
    row = side * len(K.BUNDLE)
    length = fixed[row + K.BUNDLE.nominal_length][j]
    full = length * length * fixed[row + K.BUNDLE.largest_contraction][j]
    sign = 2.0 * side - 1.0
    return sign * 0.5 * fixed[K.HYSTERESIS_LOOP][j] * full * lag / fixed[K.LARGEST_LAG][j]


@kernel
def volume_of(fixed: Any, j: int, side: int, contraction: float) -> float:
    """Return the inner volume [m3] of a bundle at a contraction [m]."""
    row = side * len(K.BUNDLE)
    length, share = (
        fixed[row + K.BUNDLE.nominal_length][j],
        fixed[row + K.BUNDLE.largest_contraction][j],
    )
    empty = bundle_volume(
        fixed[row + K.BUNDLE.muscles][j], length, share, fixed[row + K.BUNDLE.diameter][j]
    )
    _, pressed = factors_of(fixed, j, side)
    grown = pressed * grown_volume(contraction, length, share * length)
    return empty + fixed[row + K.BUNDLE.line_volume][j] + grown


@kernel
def weight_of(fixed: Any, j: int, angle: float) -> float:
    """Return the flexing torque [N m] that supports the orthosis at an angle [rad]."""
    sine, _ = sine_and_cosine(angle)
    return fixed[K.LINK_MASS][j] * fixed[K.LINK_CENTRE][j] * fixed[K.LINK_GRAVITY][j] * sine
