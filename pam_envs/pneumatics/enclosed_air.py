"""Air in a muscle behind the orifices of its regulator: flow, compression by motion, stiffness.

A sub-step has three parts: the air moves to the volume of the predicted middle, at which the
valve lets air through (explicit midpoint rule); the muscle moves, with the air's stiffness beside
that of the law; the air moves to the volume that the motion has reached. Motion keeps
``p_abs V^n``, so that without flow and leak the air is conserved exactly.

The plant writes volume and rate of change of the volume of the present position (``here``,
``gives``), and the predicted displacement to the middle (``ahead``).
"""

from typing import Any

from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY
from pam_envs.kernels.arithmetic import clip, count_on, decay
from pam_envs.kernels.build import LANES, kernel, scratch
from pam_envs.pneumatics.flow import (
    answered_error,
    gathered_rate,
    inflow,
    integrated_opening,
    power_of_ratio,
    valve_opening,
)
from pam_envs.pneumatics.regulator import AIR, AIR_STATE, leaked, line_step

LEAST_VOLUME = 1e-9
"""Least volume [m3] that is reckoned with."""
AHEAD, REACHED = 1.0, 0.0
"""Position to which :func:`squeeze` moves the air: the predicted middle, or the one reached."""


@kernel
def flows_on(fixed: Any, effects: int) -> int:
    """Return the number of lanes with flow through orifices."""
    return count_on(fixed[effects + AIR.flow], 0.0)  # type: ignore[no-any-return]


@kernel
def enclose(rows: Any, j: int, state: int, volume: float, gives: float, ahead: float) -> None:
    """Write the volume of a muscle at its position [m3], its rate of change, and what is ahead.

    ``gives`` is the change of the volume with the displacement, ``ahead`` the displacement from now
    to the middle of the next sub-step.
    """
    rows[state + AIR_STATE.here][j] = volume
    rows[state + AIR_STATE.gives][j] = gives
    rows[state + AIR_STATE.ahead][j] = ahead


@kernel
def air_stiffness(rows: Any, j: int, state: int) -> float:
    """Return the stiffness ``n p_abs / V (dV/dx)^2`` of the enclosed air, 0 without flow."""
    return rows[state + AIR_STATE.slope][j] * rows[state + AIR_STATE.gives][j]  # type: ignore[no-any-return]


@kernel
def squeeze(
    rows: Any, fixed: Any, state: int, effects: int, pressure: Any, change: Any, share: float
) -> None:
    """Move the air of a tile to another volume; write the change of the pressures [Pa].

    ``state`` and ``effects`` are the first rows of the air's state (``AIR_STATE``) and effects
    (``AIR``), ``share`` is ``AHEAD`` or ``REACHED``. Also writes the rise of the pressure with the
    displacement that shrinks the muscle [Pa a unit].
    """
    regulated, space, here, gives, ahead = (
        rows[state + AIR_STATE.regulated],
        rows[state + AIR_STATE.space],
        rows[state + AIR_STATE.here],
        rows[state + AIR_STATE.gives],
        rows[state + AIR_STATE.ahead],
    )
    on, exponent = fixed[effects + AIR.flow], fixed[effects + AIR.polytropic]
    own = scratch(4, LANES)
    ratio, volume, per_volume, rise = own[0], own[1], own[2], own[3]
    for j in range(LANES):
        most = max(LEAST_VOLUME, here[j])
        volume[j] = max(0.5 * most, most + share * gives[j] * ahead[j])
        per_volume[j] = 1.0 / volume[j]
        ratio[j] = (space[j] if space[j] > 0.0 else most) * per_volume[j]
    if count_on(exponent, 1.0) > 0:
        for j in range(LANES):
            ratio[j] = ratio[j] * power_of_ratio(ratio[j], exponent[j] - 1.0)
    for j in range(LANES):
        before = regulated[j] + ATMOSPHERE
        change[j] = before * (ratio[j] - 1.0) if on[j] > 0.0 else 0.0
        after = before + change[j]
        rise[j] = exponent[j] * after * gives[j] * per_volume[j] if on[j] > 0.0 else 0.0
    line, slope = rows[state + AIR_STATE.line], rows[state + AIR_STATE.slope]
    for j in range(LANES):
        regulated[j] = regulated[j] + change[j]
    for j in range(LANES):
        pressure[j] = pressure[j] + change[j]
    for j in range(LANES):
        line[j] = line[j] + change[j]
    for j in range(LANES):
        space[j] = volume[j]
    for j in range(LANES):
        slope[j] = rise[j]


@kernel
def mean_share(x: float) -> float:
    """Return the mean of ``exp(-t)`` over ``t`` from 0 to ``x``, at least 1e-6."""
    return (1.0 - decay(x)) / x


@kernel
def controlled_flow(
    rows: Any, fixed: Any, j: int, state: int, effects: int, first: float, last: float,
    goal: float, next_goal: float, fed: float, per_volume: float, h: float,
) -> float:  # fmt: skip
    """Return the pressure [Pa] of lane ``j`` after ``h`` seconds with an integral part, or a lag.

    ``first`` and ``last`` are the shares of the step with ``goal`` and ``next_goal``, ``fed`` is
    the absolute pressure of the source [Pa], ``per_volume`` the rise of the pressure with the mass
    [Pa/kg].
    """
    p, dead = rows[state + AIR_STATE.regulated][j], fixed[effects + AIR.dead_band][j]
    band, bend = fixed[effects + AIR.opening_band][j], fixed[effects + AIR.opening_bend][j]
    gain, lag = fixed[effects + AIR.opening_integral][j], fixed[effects + AIR.opening_lag][j]
    bound = fixed[effects + AIR.opening_windup][j] * band
    fills, b = fixed[effects + AIR.conductance][j], fixed[effects + AIR.critical_ratio][j]
    empties, span = fills * fixed[effects + AIR.exhaust_share][j], 1.0 / (1.0 - b)
    spool, gathered = rows[state + AIR_STATE.opened][j], rows[state + AIR_STATE.integral][j]
    middle, summed, opened = p, gathered, spool
    for stage in range(2):  # explicit midpoint rule
        part = 0.5 * h if stage == 0 else h
        rate = first * gathered_rate(answered_error(middle, goal, dead), summed, band, gain)
        rate = rate + last * gathered_rate(
            answered_error(middle, next_goal, dead), summed, band, gain
        )
        wish = first * integrated_opening(middle, goal, dead, 1.0 / band, bend, summed)
        wish = wish + last * integrated_opening(middle, next_goal, dead, 1.0 / band, bend, summed)
        left = part / max(lag, 1e-9)
        mean = wish + ((spool - wish) * mean_share(left) if lag > 0.0 else 0.0)
        opened = wish + ((spool - wish) * decay(left) if lag > 0.0 else 0.0)
        flow = inflow(mean, middle, fed, fills, empties, b, span)
        middle = max(0.0, p + part * per_volume * flow)
        summed = clip(gathered + part * rate, -bound, bound)
    rows[state + AIR_STATE.integral][j] = summed
    rows[state + AIR_STATE.opened][j] = opened
    return middle


@kernel
def flow_step(
    rows: Any, fixed: Any, state: int, effects: int, pressure: Any, older: Any, newer: Any,
    late: Any, h: float, own: Any, valve: int, lines: int,
) -> None:  # fmt: skip
    """Let air through the valves of a tile for ``h`` seconds.

    The setpoint [Pa] is ``older`` and then, for the share ``late``, ``newer``; below zero the valve
    is shut. A muscle is not filled past its setpoint or the source, nor emptied below the
    atmosphere; with an integral part or a lag of the opening, the pressure may pass the setpoint.
    ``own`` is two rows of scratch that receive the pressures before, at the regulator and behind
    the line; ``valve`` and ``lines`` are those of ``regulator.air_step``.
    """
    regulated, space, drop = (
        rows[state + AIR_STATE.regulated],
        rows[state + AIR_STATE.space],
        rows[state + AIR_STATE.drop],
    )
    on, gain, dead, band, bends = (
        fixed[effects + AIR.flow],
        fixed[effects + AIR.gain],
        fixed[effects + AIR.dead_band],
        fixed[effects + AIR.opening_band],
        fixed[effects + AIR.opening_bend],
    )
    supply, share, critical = (
        fixed[effects + AIR.conductance],
        fixed[effects + AIR.exhaust_share],
        fixed[effects + AIR.critical_ratio],
    )
    upstream, reservoir = fixed[effects + AIR.source_pressure], fixed[effects + AIR.supply_pressure]
    found = scratch(1, LANES)
    reached = found[0]
    for j in range(LANES):
        p, wide, per_band, b = regulated[j], dead[j], 1.0 / band[j], critical[j]
        bend = bends[j]
        span = 1.0 / (1.0 - b)
        first = 1.0 - late[j] if older[j] >= 0.0 else 0.0
        last = late[j] if newer[j] >= 0.0 else 0.0
        goal, next_goal = gain[j] * older[j], gain[j] * newer[j]
        source = min(upstream[j], reservoir[j]) - drop[j]
        fed = source + ATMOSPHERE
        fills, empties = supply[j], supply[j] * share[j]
        # pressures that the valve cannot pass
        end = goal if first > 0.0 else p
        next_end = next_goal if last > 0.0 else p
        high = max(p, min(source, max(end, next_end) - wide))
        low = min(p, max(0.0, min(end, next_end) + wide))
        rate = h * PRESSURE_PER_DENSITY / max(LEAST_VOLUME, space[j])
        opened = first * valve_opening(p, goal, wide, per_band, bend)
        opened = opened + last * valve_opening(p, next_goal, wide, per_band, bend)
        middle = p + 0.5 * rate * inflow(opened, p, fed, fills, empties, b, span)
        middle = max(low, min(high, middle))
        opened = first * valve_opening(middle, goal, wide, per_band, bend)
        opened = opened + last * valve_opening(middle, next_goal, wide, per_band, bend)
        after = p + rate * inflow(opened, middle, fed, fills, empties, b, span)
        after = max(low, min(high, after))
        reached[j] = after if on[j] > 0.0 else p
    integrals, lags = fixed[effects + AIR.opening_integral], fixed[effects + AIR.opening_lag]
    if count_on(integrals, 0.0) + count_on(lags, 0.0) > 0:
        for j in range(LANES):
            if on[j] > 0.0 and (integrals[j] > 0.0 or lags[j] > 0.0):
                first = 1.0 - late[j] if older[j] >= 0.0 else 0.0
                last = late[j] if newer[j] >= 0.0 else 0.0
                p, source = regulated[j], min(upstream[j], reservoir[j]) - drop[j]
                reached[j] = min(
                    max(p, source),
                    controlled_flow(
                        rows, fixed, j, state, effects, first, last, gain[j] * older[j],
                        gain[j] * newer[j], source + ATMOSPHERE,
                        PRESSURE_PER_DENSITY / max(LEAST_VOLUME, space[j]), h,
                    ),
                )  # fmt: skip
                shut = (newer[j] if late[j] > 0.0 else older[j]) < 0.0
                for row in (AIR_STATE.opened, AIR_STATE.integral):
                    rows[state + row][j] = 0.0 if shut else rows[state + row][j]
    if valve + count_on(fixed[effects + AIR.supply_droop], 0.0) > 0:
        for j in range(LANES):
            if on[j] > 0.0:
                reached[j] = leaked(
                    rows, fixed, j, state, effects, min(upstream[j], reservoir[j]), regulated[j],
                    reached[j], h,
                )  # fmt: skip
    for j in range(LANES):
        own[0][j] = regulated[j]
    for j in range(LANES):
        own[1][j] = pressure[j]
    for j in range(LANES):
        regulated[j] = reached[j]
    if lines > 0:
        for j in range(LANES):
            if on[j] > 0.0:
                pressure[j] = line_step(
                    rows, fixed, j, state + AIR_STATE.line, effects + AIR.ring_share, own[0][j],
                    reached[j], h,
                )  # fmt: skip
    else:
        for j in range(LANES):
            pressure[j] = reached[j] if on[j] > 0.0 else pressure[j]


@kernel
def without_flow(fixed: Any, effects: int, width: Any) -> None:
    """Stop the time of lanes with flow, before a step that is not theirs."""
    for j in range(LANES):
        width[j] = width[j] if fixed[effects + AIR.flow][j] == 0.0 else 0.0
