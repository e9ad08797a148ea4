"""Constants and functions common to the kernels."""

import math

from numba import njit

STEP = 1e-3
GRAVITY = 9.80665
ATMOSPHERE = 1.013
PRESSURE_SPAN = 6.0
CREEP_STRIDE = 5  # steps between two updates of the slow hysteresis
NUDGE = 1e-6  # strain over which the stiffness is measured

jit = njit(cache=True, error_model="numpy")


@jit
def uniform(seed, cell):
    """Return a number in [0, 1) for a cell of time."""
    mixed = math.sin(12.9898 * (seed + 1.0) + 78.233 * (cell + 1.0)) * 43758.5453
    return mixed - math.floor(mixed)
