"""Path of the air from a setpoint to a muscle: dead time, regulator, supply, leak and line."""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.history import note, noted
from pam_envs.pneumatics.regulator import (
    AIR,
    AIR_STATE,
    DELAY_PERIODS,
    line_step,
    regulate_with_effects,
    regulate_with_gain,
)


@kernel
def delay_commands(
    rows: Any, ring: int, set_point: Any, dead: Any, step: Any, period: float, older: Any,
    newer: Any,
    switch: Any,
) -> None:  # fmt: skip
    """Write the two delayed setpoints of a control period and the time between them.

    ``ring`` is the first row of the last setpoints, ``dead`` the dead times [s], ``step`` the
    control periods and ``period`` their duration [s]. ``older`` takes effect first, then, at
    ``switch`` [s], ``newer`` [Pa].
    """
    for j in range(LANES):
        age = dead[j] / period
        whole = min(int(age), DELAY_PERIODS)
        switch[j] = (age - whole) * period
        note(rows, ring, j, step[j], set_point[j])
        newer[j] = noted(rows, ring, j, step[j], whole)
        older[j] = noted(rows, ring, j, step[j], whole + 1)


@kernel
def air_step(
    rows: Any, fixed: Any, state: int, effects: int, pressure: Any, full: Any, lag: Any, slew: Any,
    target: Any, width: Any, own: Any, valve: int, lines: int,
) -> None:  # fmt: skip
    """Advance the pressures of a tile towards their targets, each by its ``width`` [s].

    ``state`` and ``effects`` are the first rows of the air's state (``AIR_STATE``) and effects
    (``AIR``); ``full`` [Pa], ``lag`` [s] and ``slew`` [Pa/s] are rows. A target below zero shuts
    the valve. ``own`` is two rows of scratch; the second receives the pressures before. ``valve``
    and ``lines`` are above 0 where effects of valve and supply, and of the line, are on.
    """
    regulated = rows[state + AIR_STATE.regulated]
    for j in range(LANES):
        before = regulated[j]
        if valve > 0:
            after = regulate_with_effects(
                rows, fixed, j, state, effects, lag[j], slew[j], full[j], target[j], width[j]
            )
        else:
            after = regulate_with_gain(
                rows, fixed, j, state, effects, lag[j], slew[j], target[j], width[j]
            )
        after = after if width[j] > 0.0 else before
        regulated[j] = after
        own[0][j], own[1][j] = before, pressure[j]
        pressure[j] = after
    if lines > 0:
        for j in range(LANES):
            pressure[j] = line_step(
                rows, fixed, j, state + AIR_STATE.line, effects + AIR.ring_share, own[0][j],
                pressure[j], width[j],
            )  # fmt: skip
