"""Intended motion of a wearer: minimum-jerk reaches, sines, or rest.

Every motion is a function of time, of the key of an episode's random numbers and of a few constants
that are drawn when it begins, so that a preview is an evaluation at a later time. Reaches run from
one drawn place to the next, one in each window of equal duration, with a rest before it, at minimum
jerk (T. Flash, N. Hogan, The coordination of arm movements, J. Neuroscience 5 (1985)).
"""

from typing import Any

from pam_envs.kernels.arithmetic import TURN, sine_of_turns
from pam_envs.kernels.build import kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.references.path import least_jerk

MOTIONS = ("reaches", "sines", "still", "mixed")
REACHES, SINES, STILL, MIXED = range(len(MOTIONS))

KIND, LOW, SPAN, WINDOW, FIRST, SIZE_1, RATE_1, SIZE_2, RATE_2 = range(9)
ROWS = 9
"""Rows of one motion: its kind, the range, seconds of a window, the place where it begins, and size
and frequency [Hz] of two sines."""

STREAM = 36  # random stream of motions: the first draws are of the constants, then three a window
FIRST_WINDOW = 16
SHORTEST, LONGEST = 0.4, 0.9  # shares of a window that a reach may take


@kernel
def least_jerk_rate(share: float) -> float:
    """Return the slope of :func:`~pam_envs.references.path.least_jerk`."""
    u = max(0.0, min(1.0, share))
    v = u * (1.0 - u)
    return 30.0 * v * v


@kernel
def least_jerk_bend(share: float) -> float:
    """Return the second derivative of :func:`~pam_envs.references.path.least_jerk`."""
    u = max(0.0, min(1.0, share))
    return 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)


@kernel
def place_of(rows: Any, base: int, lane: int, key_a: int, key_b: int, window: int) -> float:
    """Return the place at which the reach of a window ends and the next one begins."""
    if window < 0:
        return rows[base + FIRST][lane]  # type: ignore[no-any-return]
    u = uniform(key_a, key_b, STREAM, FIRST_WINDOW + 3 * window)
    return rows[base + LOW][lane] + rows[base + SPAN][lane] * u  # type: ignore[no-any-return]


@kernel
def reach(
    rows: Any, base: int, lane: int, key_a: int, key_b: int, t: float
) -> tuple[float, float, float]:
    """Return angle, rate and acceleration of the reach at a time [s]."""
    length = rows[base + WINDOW][lane]
    window = int(t / length)
    draw = FIRST_WINDOW + 3 * window
    taken = SHORTEST + (LONGEST - SHORTEST) * uniform(key_a, key_b, STREAM, draw + 1)
    rest = (1.0 - taken) * uniform(key_a, key_b, STREAM, draw + 2)
    share = ((t / length - window) - rest) / taken
    start = place_of(rows, base, lane, key_a, key_b, window - 1)
    way = place_of(rows, base, lane, key_a, key_b, window) - start
    angle, per_second = start + way * least_jerk(share), 1.0 / (taken * length)
    rate = way * least_jerk_rate(share) * per_second
    return angle, rate, way * least_jerk_bend(share) * per_second * per_second


@kernel
def swing(rows: Any, base: int, lane: int, t: float) -> tuple[float, float, float]:
    """Return angle, rate and acceleration of two sines that begin at a turning point."""
    angle, rate, acceleration = rows[base + FIRST][lane], 0.0, 0.0
    for i in range(2):
        size, hertz = rows[base + SIZE_1 + 2 * i][lane], rows[base + RATE_1 + 2 * i][lane]
        speed, cosine = TURN * hertz, sine_of_turns(hertz * t + 0.25)
        angle = angle + size * (1.0 - cosine)
        rate = rate + size * speed * sine_of_turns(hertz * t)
        acceleration = acceleration + size * speed * speed * cosine
    return angle, rate, acceleration


@kernel
def motion_at(
    rows: Any, base: int, lane: int, key_a: int, key_b: int, t: float
) -> tuple[float, float, float]:
    """Return the intended angle [rad], its rate and acceleration at a time [s] of one lane.

    The key is the one with which the motion was drawn.
    """
    kind = rows[base + KIND][lane]
    if kind == REACHES:
        return reach(rows, base, lane, key_a, key_b, t)
    if kind == SINES:
        return swing(rows, base, lane, t)
    return rows[base + FIRST][lane], 0.0, 0.0


@routine
def draw_motion(
    rows: Any,
    base: int,
    lane: int,
    key_a: int,
    key_b: int,
    kind: int,
    low: float,
    high: float,
    window: float,
) -> None:
    """Draw the constants of one lane's motion between ``low`` and ``high``.

    ``kind`` is one of ``MOTIONS``; ``MIXED`` draws one of the others. ``window`` is the duration
    [s] of a reach with its rest; a sine takes two of them or more.
    """
    chosen = kind
    if kind == MIXED:
        chosen = int(uniform(key_a, key_b, STREAM, 0) * 3.0)
    span = high - low
    rows[base + KIND][lane] = float(chosen)
    rows[base + LOW][lane], rows[base + SPAN][lane] = low, span
    rows[base + WINDOW][lane] = window
    first = low + span * uniform(key_a, key_b, STREAM, 1)
    second = 0.3 * uniform(key_a, key_b, STREAM, 2)
    if chosen == SINES:  # away from the end that is near, by three quarters of the way or more
        first = low if first < 0.5 * (low + high) else high
    turn = 1.0 if first < 0.5 * (low + high) else -1.0
    whole = 0.5 * span * turn * (0.75 + 0.25 * uniform(key_a, key_b, STREAM, 3))
    rows[base + FIRST][lane] = first
    rows[base + SIZE_1][lane], rows[base + SIZE_2][lane] = whole * (1.0 - second), whole * second
    hertz = 0.5 / window * (0.4 + 0.6 * uniform(key_a, key_b, STREAM, 4))
    rows[base + RATE_1][lane] = hertz
    rows[base + RATE_2][lane] = hertz * (1.5 + 1.5 * uniform(key_a, key_b, STREAM, 5))
