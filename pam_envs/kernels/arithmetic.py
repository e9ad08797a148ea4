"""Arithmetic without libm: the same bits on every processor, compiled or not."""

from typing import Any

from pam_envs.kernels.build import LANES, kernel

TURN = 6.283185307179586
"""Radians in a turn."""
PER_TURN = 0.15915494309189535
"""Turns in a radian."""


@kernel
def clip(x: float, low: float, high: float) -> float:
    """Return ``x`` held between ``low`` and ``high``."""
    return max(low, min(high, x))


@kernel
def round_to_integer(x: float) -> float:
    """Return the nearest integer as a float, ties to even, for ``abs(x) < 2**51``."""
    return (x + 6755399441055744.0) - 6755399441055744.0


@kernel
def quantise(x: float, step: float) -> float:
    """Return the nearest multiple of ``step``; ``step = 0`` leaves ``x`` as it is."""
    if step > 0.0:
        return round_to_integer(x / step) * step
    return x


@kernel
def decay(x: float) -> float:
    """Return ``exp(-x)`` for ``x`` from -20 to 40, to 1e-9 relative (1e-13 up to 5 in size).

    The tenth-order series of ``exp(-x / 64)``, squared six times. Larger ``x`` count as 40.
    """
    y = -min(x, 40.0) * 0.015625
    y2 = y * y
    low = (1.0 + y) + y2 * (0.5 + y * (1.0 / 6.0))
    middle = (1.0 / 24.0 + y * (1.0 / 120.0)) + y2 * (1.0 / 720.0 + y * (1.0 / 5040.0))
    high = (1.0 / 40320.0 + y * (1.0 / 362880.0)) + y2 * (1.0 / 3628800.0)
    y4 = y2 * y2
    t = low + y4 * (middle + y4 * high)
    t = t * t
    t = t * t
    t = t * t
    t = t * t
    t = t * t
    return t * t


@kernel
def sine_of_turns(turns: float) -> float:
    """Return ``sin(2 pi turns)`` to 1e-15, for ``abs(turns) < 1e9``."""
    x = turns - round_to_integer(turns)
    if x > 0.25:
        x = 0.5 - x
    if x < -0.25:
        x = -0.5 - x
    a = x * 6.283185307179586
    y = a * a
    t = y * (1.0 / 51090942171709440000.0) - 1.0 / 121645100408832000.0
    t = t * y + 1.0 / 355687428096000.0
    t = t * y - 1.0 / 1307674368000.0
    t = t * y + 1.0 / 6227020800.0
    t = t * y - 1.0 / 39916800.0
    t = t * y + 1.0 / 362880.0
    t = t * y - 1.0 / 5040.0
    t = t * y + 1.0 / 120.0
    t = t * y - 1.0 / 6.0
    t = t * y + 1.0
    return t * a


@kernel
def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle [rad]."""
    turns = angle * PER_TURN
    return sine_of_turns(turns), sine_of_turns(turns + 0.25)


@kernel
def log_of_fraction(u: float) -> float:
    """Return ``log(u)`` for ``2**-33 <= u <= 1``, to 1e-11 absolute."""
    e = 0.0
    if u < 1.52587890625e-05:
        u = u * 65536.0
        e = e - 16.0
    if u < 0.00390625:
        u = u * 256.0
        e = e - 8.0
    if u < 0.0625:
        u = u * 16.0
        e = e - 4.0
    if u < 0.25:
        u = u * 4.0
        e = e - 2.0
    if u < 0.5:
        u = u * 2.0
        e = e - 1.0
    if u < 0.5:  # 2**-33 needs one step more
        u = u * 2.0
        e = e - 1.0
    s = (u - 0.7071067811865476) / (u + 0.7071067811865476)
    y = s * s
    t = y * (2.0 / 13.0) + 2.0 / 11.0
    t = t * y + 2.0 / 9.0
    t = t * y + 2.0 / 7.0
    t = t * y + 2.0 / 5.0
    t = t * y + 2.0 / 3.0
    t = t * y + 2.0
    return s * t + (e - 0.5) * 0.6931471805599453


@kernel
def count_on(values: Any, neutral: float) -> int:
    """Return the number of lanes of a tile in which a parameter is not neutral."""
    on = 0
    for j in range(LANES):
        on = on + (0 if values[j] == neutral else 1)
    return on
