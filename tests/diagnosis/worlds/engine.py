"""The loop over time steps, shared by all worlds."""

import math

import numpy as np
from numba import njit

from .actions import (
    SOFT,
    STATES,
    added_force,
    felt_pressure,
    felt_strain,
    loop_scale,
    remember,
    setpoint,
)
from .laws import balance, force
from .loops import SIZE, loop_step, start_loop
from .names import (
    DRIVE,
    DROOP,
    EXHAUST,
    GRAVITY,
    LEAK,
    PAYLOAD,
    SHAPE,
    SLACK,
    SLEW,
)
from .valve import AMBIENT, FLOWS, flow, valve_rate

PREROLL = 110
"""Rows at rest before the first one."""
MOVED = 50
"""Rows before the first one in which what an earlier motion left is held."""
SCALARS = (
    "length",
    "half",
    "friction",
    "growth",
    "carriage",
    "damping",
    "stiffness",
    "length_driven",
    "start_bar",
    "start_strain",
    "settling",
    "memory",
    "squeeze",
)


@njit(cache=True)
def _slowed(rate: float, eff: np.ndarray, p: float) -> float:
    """Return a rate of pressure [bar/s], slowed by the effect during exhaust."""
    size = eff[EXHAUST, 0]
    if rate >= 0.0 or size <= 0.0:
        return rate
    if eff[EXHAUST, 1] > 0.5:
        size *= math.exp(-p / eff[EXHAUST, 2])
    return rate / (1.0 + size)


@njit(cache=True)
def _limited(rate: float, eff: np.ndarray, valve: np.ndarray, kind: int) -> float:
    """Return a rate of pressure [bar/s] within the limits of its regulator."""
    slope = valve[3] if rate > 0.0 else valve[4]
    added = 0.0
    if eff[SLEW, 0] > 0.0:
        added = eff[SLEW, 0] * (eff[SLEW, 2] if rate < 0.0 else 1.0)
        if eff[SLEW, 1] > 0.5 and kind != 1:
            rate /= math.sqrt(1.0 + (rate * added) ** 2)
            added = 0.0
    slope += added
    if slope > 0.0:
        rate = min(max(rate, -1.0 / slope), 1.0 / slope)
    return rate


@njit(cache=True)
def _lost(eff: np.ndarray, p: float, strain: float) -> float:
    """Rate of pressure that a leak costs [bar/s]."""
    if eff[LEAK, 1] < 0.5:
        return eff[LEAK, 0] * p
    open_ = 1.0 + eff[LEAK, 2] * max(strain, 0.0) / 0.15
    return eff[LEAK, 0] * 7.0 * flow(p + AMBIENT, AMBIENT) * open_


@njit(cache=True)
def _carried(eff: np.ndarray, load: float, lifted: float, out: np.ndarray) -> float:
    """Return the part of the load that hangs on the muscle [N]; `lifted` is from its rest [mm]."""
    size = eff[SLACK, 0]
    if eff[SLACK, 1] < 0.5:
        width = min(eff[SLACK, 2], size)
        share = min(max(1.0 + (lifted - size) / width, 0.0), 1.0)
        if 0.0 < share < 1.0:
            out[2] += load / width
        return load * share
    rest = math.exp(-max(lifted, 0.0) / size)
    out[2] += load / size * rest
    return load * (1.0 - rest)


@njit(cache=True)
def run(
    law: int,
    q: np.ndarray,
    table: np.ndarray,
    kinds: np.ndarray,
    ops: np.ndarray,
    valve_kind: int,
    valve: np.ndarray,
    c: np.ndarray,
    eff: np.ndarray,
    command: np.ndarray,
    load: np.ndarray,
    warm: np.ndarray,
    shut: np.ndarray,
    rest_mm: np.ndarray,
    noise: np.ndarray,
    period: float,
    sub: int,
    rows: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return pressure [bar] and contraction from rest [mm] at every step.

    `kinds` and `ops` hold the normal, the alternative and the partner loop; `c` the scalars in
    the order of `SCALARS`; `noise` drawn walks, bursts, shaking and catches, shape (rows, 4).
    """
    dt = period / sub
    length, half, driven = c[0], c[1], c[7] > 0.5
    steps = rows * sub
    out_p, out_x = np.empty(steps), np.empty(steps)
    st = np.zeros(STATES)
    st[SOFT] = 1.0
    work, extra = np.zeros((2, 4)), np.zeros(3)
    states = np.zeros((3, SIZE))
    vs = np.zeros(4)
    p = max(valve[1], 0.0)
    vs[1] = p
    x = length * balance(law, q, table, p, load[0])
    st[0] = st[1] = 0.0
    for i in range(3):
        by_length = driven if i < 2 else not driven
        start_loop(kinds[i], ops[i], states[i], x if by_length else p, c[11] if i < 2 else 0.0)
    v = acceleration = dx = 0.0
    last_p = p
    zero = x
    leftover = 0.0
    shape, drive = eff[SHAPE, 0], eff[DRIVE, 0]
    for k in range(-PREROLL * sub, steps):
        row = 0 if k < 0 else min(k // sub, command.size - 1)
        time = k * dt
        if k == -MOVED * sub:
            zero = x
            p += c[8]
            leftover = c[9]
            vs[1] = p
        now = noise[row]
        target = setpoint(eff, st, command, time, period, valve, p, now, dt)
        rate = 0.0
        if (shut[row] and k >= 0) or (-MOVED * sub <= k < 0 and c[8] > 0.0):
            vs[0] = vs[2] = vs[3] = 0.0
        else:
            supply = valve[14]
            if eff[DROOP, 0] > 0.0 and eff[DROOP, 1] < 0.5:
                supply -= eff[DROOP, 0] * st[6]
            rate = valve_rate(valve_kind, valve, p, vs, target, supply, dt)
            if valve_kind == 1:  # the exhaust throttles what the spool of second order lets through
                vs[0] = _limited(rate, eff, valve, valve_kind)
                rate = _slowed(vs[0], eff, p)
            else:
                rate = _limited(_slowed(rate, eff, p), eff, valve, valve_kind)
                vs[0] = rate
        if valve_kind == FLOWS[0] or valve_kind == FLOWS[1] or valve_kind == FLOWS[2]:
            swell = 1.0 + 4.0 * x / length
            rate = rate / swell - (p + AMBIENT) * 4.0 * v / (length * swell)
        if eff[LEAK, 0] > 0.0:
            rate -= _lost(eff, p, x / length)
        before = p
        p += dt * rate
        if p < 0.0:
            p = vs[0] = 0.0
        weight = load[row]
        if eff[PAYLOAD, 0] > 0.0:
            added = weight if eff[PAYLOAD, 1] < 0.5 else (10.0 if weight > 0.0 else 0.0)
            weight = max(weight + eff[PAYLOAD, 0] * eff[PAYLOAD, 2] * added, 0.0)
        mass = c[4] + weight / GRAVITY
        strain = x / length
        added_force(eff, st, p, x - zero, dx, v, acceleration, strain, mass, time, now, extra, dt)
        if eff[SLACK, 0] > 0.0:
            weight = _carried(eff, weight, x - rest_mm[row], extra)
        felt = felt_pressure(eff, st, p, strain, weight, warm[row], now, dt)
        felt_e = felt_strain(eff, st, strain, weight, warm[row], dt) - leftover
        if k >= 0:
            leftover -= dt / c[10] * leftover
        scale = loop_scale(eff, p, weight)
        slip = max(1.0 + c[3] * (p / 3.0 - 1.0), 0.05)
        if c[12] > 0.0:
            slip = math.sqrt((p + c[12]) / (3.0 + c[12]))
        dp = felt - last_p
        last_p = felt
        if driven:
            h = loop_step(kinds[0], ops[0], states[0], x, dx, v, scale * slip)
            if shape > 0.0:
                other = loop_step(kinds[1], ops[1], states[1], x, dx, v, scale * slip)
                h += shape * (other - h)
            rubbing, lost = c[2] * h, 0.0
            if drive > 0.0:
                lost = (
                    half * drive * loop_step(kinds[2], ops[2], states[2], felt, dp, dp / dt, scale)
                )
                rubbing *= 1.0 - drive
        else:
            h = loop_step(kinds[0], ops[0], states[0], felt, dp, dp / dt, scale)
            if shape > 0.0:
                other = loop_step(kinds[1], ops[1], states[1], felt, dp, dp / dt, scale)
                h += shape * (other - h)
            rubbing, lost = 0.0, half * h
            if drive > 0.0:
                h = loop_step(kinds[2], ops[2], states[2], x, dx, v, scale)
                rubbing = c[2] * drive * h
                lost *= 1.0 - drive
        pull = force(law, q, table, felt - lost, felt_e, weight, work) + extra[0]
        pull -= weight + rubbing
        old = v
        v += dt * 1e3 / mass * pull
        v /= 1.0 + dt * 1e3 / mass * (c[5] + extra[1] + dt * (c[6] + extra[2]))
        acceleration = (v - old) / dt
        dx = dt * v
        x += dx
        remember(eff, st, p - before, dx, length, dt)
        if k >= 0:
            out_p[k], out_x[k] = p, x - zero
    return out_p, out_x
