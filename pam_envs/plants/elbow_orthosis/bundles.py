"""The two bundles on their pulley as kernels: forces, torque, stiffness, volume."""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import kernel
from pam_envs.mechanics.pulley import contraction_of
from pam_envs.muscle.quadratic_bundle import bundle_shape, bundle_volume, grown_volume
from pam_envs.plants.elbow_orthosis.rows import (
    BUNDLE,
    BUNDLE_ROWS,
    DIAMETER,
    GAIN,
    GRAVITY,
    HIGHEST,
    LARGEST_CONTRACTION,
    LARGEST_LAG,
    LINE_VOLUME,
    LINK_CENTRE,
    LINK_MASS,
    LOOP,
    LOWEST,
    MUSCLES,
    NOMINAL_LENGTH,
    PASSIVE_BASE,
    PASSIVE_EACH,
    PRESSURE_BASE,
    PRESSURE_EACH,
    RADIUS,
)


@kernel
def contraction_at(fixed: Any, j: int, side: int, angle: float) -> float:
    """Return the contraction [m] of a bundle, 0 for a and 1 for b, at an angle [rad]."""
    sign = 2.0 * side - 1.0
    return contraction_of(angle, sign, fixed[RADIUS][j], fixed[LOWEST][j], fixed[HIGHEST][j])


@kernel
def travel_at(fixed: Any, j: int, angle: float) -> float:
    """Return the travel of the pulley [m] from the middle of its range."""
    return fixed[RADIUS][j] * (angle - 0.5 * (fixed[LOWEST][j] + fixed[HIGHEST][j]))


@kernel
def factors_of(fixed: Any, j: int, side: int) -> tuple[float, float]:
    """Return ``k0`` [N/m2] and ``k1`` [N/(m2 Pa)] of a bundle."""
    row = BUNDLE + side * BUNDLE_ROWS
    muscles, gain = fixed[row + MUSCLES][j], fixed[row + GAIN][j]
    passive = fixed[row + PASSIVE_BASE][j] + fixed[row + PASSIVE_EACH][j] * muscles
    pressed = fixed[row + PRESSURE_BASE][j] + fixed[row + PRESSURE_EACH][j] * muscles
    return gain * passive, gain * pressed


@kernel
def shape_of(fixed: Any, j: int, side: int, contraction: float) -> tuple[float, float]:
    """Return the force over ``X`` [m2] of the law at a contraction [m], and its slope [m]."""
    row = BUNDLE + side * BUNDLE_ROWS
    length = fixed[row + NOMINAL_LENGTH][j]
    return bundle_shape(contraction, length, fixed[row + LARGEST_CONTRACTION][j] * length)


@kernel
def friction_of(fixed: Any, j: int, side: int, lag: float) -> float:
    """Return what friction takes [m2] of the shape of a bundle at a lag [m] of the travel."""
    row = BUNDLE + side * BUNDLE_ROWS
    length = fixed[row + NOMINAL_LENGTH][j]
    full = length * length * fixed[row + LARGEST_CONTRACTION][j]
    sign = 2.0 * side - 1.0
    return sign * 0.5 * fixed[LOOP][j] * full * lag / fixed[LARGEST_LAG][j]


@kernel
def volume_of(fixed: Any, j: int, side: int, contraction: float) -> float:
    """Return the inner volume [m3] of a bundle at a contraction [m]."""
    row = BUNDLE + side * BUNDLE_ROWS
    length, share = fixed[row + NOMINAL_LENGTH][j], fixed[row + LARGEST_CONTRACTION][j]
    empty = bundle_volume(fixed[row + MUSCLES][j], length, share, fixed[row + DIAMETER][j])
    _, pressed = factors_of(fixed, j, side)
    grown = pressed * grown_volume(contraction, length, share * length)
    return empty + fixed[row + LINE_VOLUME][j] + grown


@kernel
def weight_of(fixed: Any, j: int, angle: float) -> float:
    """Return the flexing torque [N m] that bears the orthosis at an angle [rad]."""
    sine, _ = sine_and_cosine(angle)
    return fixed[LINK_MASS][j] * fixed[LINK_CENTRE][j] * fixed[GRAVITY][j] * sine
