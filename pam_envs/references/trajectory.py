"""Seeded references: held steps, ramps, sines, multi-sine, held staircase.

Every family is one formula with other constants, drawn once an episode:

    r(t) = base(t) + sum_i a_i sin(2 pi (f_i t + phi_i))

where ``base`` runs through knots of equal duration, holds each one for a share of it and moves to
the next in a straight line (share 1: steps; share 0: ramps). So a preview is an evaluation at a
later time, and only the constants are stored.
"""

from typing import Any

from pam_envs.kernels.arithmetic import sine_of_turns
from pam_envs.kernels.build import kernel, routine
from pam_envs.kernels.random import uniform

FAMILIES = ("steps", "ramps", "sines", "multisine", "staircase", "mixed")
SAMPLES = len(FAMILIES)  # family number of a reference that is given as samples

KNOTS = 24
SINES = 4
RATE, RAMP, KNOT, SINE = 0, 1, 2, 2 + KNOTS
ROWS = 2 + KNOTS + 3 * SINES
"""Rows of one reference: knots a second, ramp share, knots, then (a, f, phi) of each sine."""

STREAM = 32  # random stream of reference draws (one draw number a constant)

STEPS, RAMPS, SINGLE, MULTI, STAIRCASE, MIXED = 0, 1, 2, 3, 4, 5
_RISE = KNOTS // 4


def sines_needed(family: int) -> int:
    """Return the number of sines of a family."""
    return {SINGLE: 1, MULTI: SINES, MIXED: SINES}.get(family, 0)


@kernel
def reference_value(rows: Any, base: int, lane: int, t: float, sines: int) -> float:
    """Return r(t) of one lane, whose constants start at row ``base``."""
    share = t * rows[base][lane]
    share = share - KNOTS * float(int(share * (1.0 / KNOTS)))
    knot = int(share)
    value = rows[base + KNOT + knot][lane]
    ramp = rows[base + RAMP][lane]
    if ramp > 0.0:
        there = rows[base + KNOT + (knot + 1 if knot < KNOTS - 1 else 0)][lane]
        value = value + (there - value) * max(0.0, (share - knot - (1.0 - ramp)) / ramp)
    for i in range(sines):
        row = base + SINE + 3 * i
        turns = rows[row + 1][lane] * t + rows[row + 2][lane]
        value = value + rows[row][lane] * sine_of_turns(turns)
    return value


@routine
def draw_reference(
    rows: Any, base: int, lane: int, key_a: int, key_b: int, family: int, low: float, high: float
) -> None:
    """Draw the constants of one lane's reference between ``low`` and ``high``."""
    kind = family
    if family == MIXED:
        kind = int(uniform(key_a, key_b, STREAM, 0) * 5.0)
    middle = 0.5 * (low + high)
    span = high - low
    rows[base + RATE][lane] = 1.0 / (1.0 + 2.0 * uniform(key_a, key_b, STREAM, 1))
    rows[base + RAMP][lane] = 0.0
    for i in range(3 * SINES):
        rows[base + SINE + i][lane] = 0.0
    if kind == RAMPS:
        rows[base + RAMP][lane] = 1.0
    for k in range(KNOTS):
        level = middle
        if kind == STEPS or kind == RAMPS:
            level = low + span * uniform(key_a, key_b, STREAM, 8 + k)
        if kind == STAIRCASE:
            phase = k % (2 * _RISE)
            level = low + span * (_RISE - abs(phase - _RISE)) / _RISE
        rows[base + KNOT + k][lane] = level
    count = 0
    if kind == SINGLE:
        count = 1
    if kind == MULTI:
        count = SINES
    for i in range(count):
        row = base + SINE + 3 * i
        share = 0.5 + 0.5 * uniform(key_a, key_b, STREAM, 64 + 3 * i)
        rows[row][lane] = 0.5 * span / count * share
        rows[row + 1][lane] = 0.05 + (0.25 + 0.2 * i) * uniform(key_a, key_b, STREAM, 65 + 3 * i)
        rows[row + 2][lane] = uniform(key_a, key_b, STREAM, 66 + 3 * i)
