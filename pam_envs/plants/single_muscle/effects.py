"""One control period of the single muscle with every effect that a recording may show.

The plain plant is :mod:`pam_envs.plants.single_muscle.step`; this page is the same step with
the effects of the components in it. With all of them neutral it moves as the plain one does; a
plant runs on it when one is not neutral. The order is that of the signal::

    set-point -> gain, supply, dead band, lag, slew, exhaust -> leak -> ringing line
    -> dead pressure, hysteresis, first cycles -> creep -> temperature -> law, load, viscosity,
    strands
    -> support, sticking guide -> soft mount -> delayed, bowed, drifting sensor

A set-point below zero means that the valve is shut: the muscle keeps its air but for the leak.
"""

from __future__ import annotations

import math
from typing import Any

from pam_envs.constants import ATMOSPHERE, GRAVITY, ROOM_TEMPERATURE
from pam_envs.hysteresis.maxwell_slip import play
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import LANES, kernel, routine, scratch
from pam_envs.mechanics.hanging_mass import damped_motion
from pam_envs.muscle.effective_area import fine_slope, fine_tension, tension, tension_slope
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.step import HYSTERESIS_MODELS
from pam_envs.pneumatics.regulator import DELAY_PERIODS, delayed_fraction, regulator_step

FIRST = 0  # placeholder: the row after the hysteresis's state
plain_hysteresis: Any = None  # placeholder: one of the three hysteresis models

FULL_STRAIN = 0.15
"""Full scale of the position sensor, over the rest length."""
SLIDE = 0.2
"""Time [s] that a slipping clamp takes."""
FASTEST_DECAY, FASTEST_TURN = 1.0 / 24.0, 1.0 / 200.0
"""Over the sub-step: mass over damping, and mass over stiffness and the sub-step again."""
TURN = 6.283185307179586
NOWHERE = -1e9
"""Where a load hangs that has no support [m]."""
BREAKS = (0.1, 0.3, 0.6, 1.0)
"""Strains at which strands break away, over that of the last one."""
FINE_PARTS = 4
"""Parts of a sub-step where a guide sticks, or a loss depends on speed."""


@kernel
def count_on(values: Any, neutral: float) -> int:
    """Return on how many lanes of a tile a parameter is not neutral."""
    on = 0
    for j in range(LANES):
        on = on + (0 if values[j] == neutral else 1)
    return on


@kernel
def norm_8(a: float, b: float) -> float:
    """Return the eighth root of the sum of eighth powers: a slightly rounded maximum."""
    a2, b2 = a * a, b * b
    a4, b4 = a2 * a2, b2 * b2
    return math.sqrt(math.sqrt(math.sqrt(a4 * a4 + b4 * b4)))


@kernel
def filled(rows: Any, fixed: Any, j: int, target: float, width: float) -> float:
    """Return the regulated pressure [Pa] of lane ``j`` after ``width`` seconds."""
    pressure = rows[FIRST + R.REGULATED][j]
    drop = rows[FIRST + R.DROP][j]
    goal = fixed[R.GAIN][j] * target
    wide = fixed[R.DEAD_BAND][j]
    band = wide * fixed[R.DEAD_CLOSE][j]
    off, opened = abs(goal - pressure), rows[FIRST + R.OPEN][j]
    opened = 1.0 if off > wide else (opened if off > band * 1.0000001 else 0.0)
    goal = goal if opened > 0.0 else pressure
    stop_low, stop_high = min(pressure, goal + band), max(pressure, goal - band)
    slower = (fixed[R.EXHAUST_RATIO][j] - 1.0) * (
        1.0 - fixed[R.EXHAUST_TAPER][j] * pressure / fixed[R.MAX_PRESSURE][j]
    )
    lag = fixed[R.TIME_CONSTANT][j] * (1.0 + slower if goal < pressure else 1.0)
    # a spool opens beyond its overlap, by what the error exceeds it; within it leaks
    over, within = fixed[R.OVERLAP][j], fixed[R.OVERLAP_LEAK][j]
    shift = over * (1.0 - within) if abs(goal - pressure) > over else 0.0
    lag = lag / within if abs(goal - pressure) < over else lag
    aim = goal + shift if goal < pressure else goal - shift
    slew = fixed[R.SLEW_RATE][j]
    reached = regulator_step(pressure, aim, lag, 1.0 / lag, slew, 1.0 / slew, width)
    free = (aim - pressure) * (1.0 - decay(width / lag))
    most = slew * max(width, 1e-9)
    rounded = pressure + free * most / math.sqrt(free * free + most * most)
    bend = fixed[R.SLEW_BEND][j] if slew < 1e9 else 0.0
    reached = reached + bend * (rounded - reached)
    rate = fixed[R.EXHAUST_RATE][j]
    choked = (pressure + ATMOSPHERE) * decay(rate * width) - ATMOSPHERE
    reached = reached if rate >= 100.0 else max(reached, min(pressure, choked))
    # what the supply lets through: choked, and as the root of the difference near its pressure
    supply = fixed[R.SUPPLY_PRESSURE][j] - drop
    most = (supply + ATMOSPHERE) / fixed[R.SUPPLY_TIME][j]
    head = math.sqrt(max(0.0, supply - pressure))
    head = max(0.0, head - width * most / math.sqrt(2.0 * max(1.0, supply + ATMOSPHERE)))
    throat = max(0.0, min(width * most, supply - head * head - pressure))
    filling = max(1e-9, reached - pressure)
    share = throat / norm_8(filling, throat)  # the narrower of valve and throat, hardly rounded
    ample = reached <= pressure or fixed[R.SUPPLY_PRESSURE][j] >= 2e7
    reached = reached if ample else pressure + filling * share
    # the valve closes when the error has fallen to the band
    stopped = min(reached, stop_high) if goal > pressure else max(reached, stop_low)
    rows[FIRST + R.OPEN][j] = opened if stopped == reached else 0.0
    reached = stopped
    reached = pressure if target < 0.0 else reached
    # the reservoir is filled through an orifice, as the root of what it lacks
    lacks = math.sqrt(drop + fixed[R.SUPPLY_DROOP][j] * max(0.0, reached - pressure))
    full = math.sqrt(0.5 * (fixed[R.SUPPLY_PRESSURE][j] + ATMOSPHERE))
    lacks = max(0.0, lacks - full * width / fixed[R.SUPPLY_RECOVERY][j])
    rows[FIRST + R.DROP][j] = lacks * lacks
    return reached * decay(fixed[R.LEAK][j] * width)  # type: ignore[no-any-return]


@kernel
def filled_plainly(rows: Any, fixed: Any, j: int, target: float, width: float) -> float:
    """Return what :func:`filled` returns where none of its effects is on."""
    pressure, lag = rows[FIRST + R.REGULATED][j], fixed[R.TIME_CONSTANT][j]
    slew, goal = fixed[R.SLEW_RATE][j], fixed[R.GAIN][j] * target
    reached = regulator_step(pressure, goal, lag, 1.0 / lag, slew, 1.0 / slew, width)
    return pressure if target < 0.0 else reached  # type: ignore[no-any-return]


@kernel
def rung(
    rows: Any, j: int, state: int, was: float, now: float, turns: float, ratio: float, width: float
) -> float:
    """Return where a resonator stands whose input went from ``was`` to ``now`` in ``width`` s."""
    omega = TURN * turns
    k, d = omega * omega, 2.0 * ratio * omega
    y, rate = rows[FIRST + state][j], rows[FIRST + state + 1][j]
    span = max(width, 1e-9)
    moved, rate = damped_motion(
        rate, k * (was - y) - d * rate, k * (now - was) / span, k, d, decay(0.5 * d * span), span
    )
    rows[FIRST + state][j], rows[FIRST + state + 1][j] = y + moved, rate
    return y + moved


@kernel
def feel(
    rows: Any,
    fixed: Any,
    counts: Any,
    table: Any,
    hysteresis: int,
    first: int,
    last: int,
    elements: int,
    work: Any,
    width: Any,
    own: Any,
    creeps: int,
    worn: int,
) -> None:
    """Make the effective pressure of the pressure, ``width`` seconds after the last time."""
    pressure, drive = rows[R.PRESSURE], rows[R.DRIVE]
    true, friction, most = own[0], rows[FIRST + R.FRICTION], own[2]
    for j in range(first, last):
        true[j] = pressure[j]
        pressure[j] = max(0.0, pressure[j] - fixed[R.DEAD_PRESSURE][j])
    plain_hysteresis(rows, fixed, counts, table, hysteresis, first, last, elements, work)
    for j in range(first, last):
        felt = pressure[j]
        pressure[j] = true[j]
        friction[j] = felt - drive[j]
        drive[j] = felt - friction[j]
        true[j] = felt
        most[j] = 0.0
    for k in range(elements if worn > 0 else 0):
        for j in range(first, last):
            most[j] = most[j] + fixed[R.WEIGHT + k][j] * fixed[R.THRESHOLD + k][j]
    for j in range(first, last if worn > 0 else first):
        felt = true[j]
        new = decay(min(40.0, rows[FIRST + R.TRAVEL][j] / fixed[R.FIRST_TRAVEL][j]))
        share = min(1.0, abs(friction[j]) / max(most[j], 1.0))
        shape, u = fixed[R.SHAPE][j], pressure[j] / fixed[R.MAX_PRESSURE][j]
        friction[j] = friction[j] * shape / (1.0 + (shape - 1.0) * share)
        grown = (fixed[R.PRESSURE_SLOPE][j] + fixed[R.PRESSURE_BEND][j] * u) * u
        friction[j] = friction[j] * max(0.02, 1.0 + grown)
        w = felt - (1.0 + fixed[R.FIRST_WIDTH][j] * new) * friction[j]
        drive[j] = w
    if creeps > 0:
        for j in range(first, last):
            w = drive[j]
            added = 0.0
            for k in range(4):
                state = rows[FIRST + R.CREEP_1 + k]
                kept = decay(width[j] / fixed[R.CREEP_TIME_1 + k][j])
                state[j] = w - (w - state[j]) * kept
                added = added + fixed[R.DRIVE_CREEP_1 + k][j] * state[j]
            w = w + added
            drive[j] = w
    for j in range(first, last if worn > 0 else first):
        new = decay(min(40.0, rows[FIRST + R.TRAVEL][j] / fixed[R.FIRST_TRAVEL][j]))
        warm = rows[FIRST + R.KELVIN][j] - ROOM_TEMPERATURE
        gained = 1.0 + fixed[R.TEMPERATURE_GAIN][j] * warm
        drive[j] = drive[j] * gained * (1.0 - fixed[R.FIRST_LOSS][j] * new)


@kernel
def settled(
    rows: Any,
    fixed: Any,
    counts: Any,
    table: Any,
    hysteresis: int,
    first: int,
    last: int,
    elements: int,
    work: Any,
) -> None:
    """Make the effective pressure of a pressure that has been held for long."""
    own = scratch(3, LANES)
    for j in range(first, last):
        own[1][j] = 1e9
        rows[FIRST + R.KELVIN][j] = fixed[R.TEMPERATURE][j]
    feel(rows, fixed, counts, table, hysteresis, first, last, elements, work, own[1], own, 1, 1)


@kernel
def hung(x: float, hangs: float, slack: float) -> float:
    """Return the share of a load that hangs on the muscle, 0 to 1.

    The load rests on something that gives way: from where it would hang without pressure the
    muscle takes it over in ``slack``.
    """
    return 1.0 if slack <= 0.0 else max(0.0, min(1.0, (x - hangs) / slack))


@routine
def balance(fixed: Any, lane: int, drive: float, load: float, hangs: float) -> float:
    """Return the position [m] at rest of one lane, by bisection."""
    length = fixed[R.REST_LENGTH][lane]
    mass = load + (fixed[R.LOAD_ERROR][lane] if load > 0.0 else 0.0)
    weight = mass * GRAVITY
    stiffer = (
        1.0
        + (fixed[R.LOAD_STIFFENING][lane] + fixed[R.LOAD_STIFFENING_2][lane] * weight) * weight
        + fixed[R.LOAD_STIFFENING_ROOT][lane] * math.sqrt(max(0.0, weight))
    )
    shifted = drive - fixed[R.LOAD_CURVE][lane] * weight * weight
    low, high = -0.3, 0.6
    for _ in range(56):
        e = 0.5 * (low + high)
        pull = tension(
            shifted,
            e,
            decay(e / fixed[R.BRAID_STRAIN][lane]),
            fixed[R.AREA][lane],
            fixed[R.AREA_TAPER][lane],
            fixed[R.BRAID_FORCE][lane] * stiffer,
            fixed[R.STIFFNESS][lane] * stiffer,
            fixed[R.HARDENING][lane] * stiffer,
        ) + fine_tension(
            shifted,
            e,
            fixed[R.AREA][lane],
            fixed[R.AREA_CURVE][lane],
            fixed[R.SOFTENING][lane] * stiffer,
            fixed[R.STIFFENING][lane] * stiffer,
        )
        if pull > weight * hung(e * length, hangs, fixed[R.SLACK][lane]):
            low = e
        else:
            high = e
    return 0.5 * (low + high) * length


@routine
def rest_extended(fixed: Any, lane: int, drive: float, load: float) -> float:
    """Return the position [m] at rest under an effective pressure and a load told."""
    hangs = balance(fixed, lane, 0.0, load, NOWHERE)
    return balance(fixed, lane, drive, load, hangs)


@kernel
def begin_effects(rows: Any, fixed: Any, j: int) -> None:
    """Begin the effects of lane ``j`` at its position and pressure."""
    for k in (R.DROP, R.LINE_RATE, R.MOUNT_RATE, R.TRAVEL):
        rows[FIRST + k][j] = 0.0
    x, pressure = rows[R.CONTRACTION][j], rows[R.PRESSURE][j]
    rows[FIRST + R.REGULATED][j], rows[FIRST + R.LINE][j] = pressure, pressure
    for k in (R.SHOWN, R.MOUNT):
        rows[FIRST + k][j] = x
    rows[FIRST + R.STUCK][j] = 1.0
    for k in (R.STRAND_1, R.STRAND_2, R.STRAND_3, R.STRAND_4):
        rows[FIRST + k][j] = x / fixed[R.REST_LENGTH][j]
    rows[FIRST + R.KELVIN][j] = fixed[R.TEMPERATURE][j]
    for k in (R.STRETCH_1, R.STRETCH_2, R.STRETCH_3, R.STRETCH_4):
        rows[FIRST + k][j] = x
    crept = 0.0
    for k in range(4):
        crept = crept + fixed[R.LENGTH_CREEP_1 + k][j]
    rows[FIRST + R.SHOWN][j] = x * (1.0 + crept)
    rows[FIRST + R.MOUNT][j] = x * (1.0 + crept)
    rows[R.REST][j] = rows[R.REST][j] * (1.0 + crept)
    rows[FIRST + R.OPEN][j] = 0.0
    rows[FIRST + R.HUNG][j] = rows[R.LOAD][j]
    rows[FIRST + R.HANGS][j] = balance(fixed, j, 0.0, rows[R.LOAD][j], NOWHERE)
    for k in range(R.N_HISTORY):
        rows[FIRST + R.SEEN + k][j] = x * (1.0 + crept) - rows[R.REST][j]
    rows[FIRST + R.POSITION][j] = x * (1.0 + crept) - rows[R.REST][j]
    sense(rows, fixed, j, 0, 0.0, 0.01)


@routine
def drifted(time: float, rate: float, span: float) -> float:
    """Return a drift that begins at a rate and settles within a span [s]."""
    return rate * span * (1.0 - decay(min(40.0, time / span)))


@routine
def ramped(time: float, middle: float, over: float) -> float:
    """Return what rises from 0 to 1 about a middle [s], without a corner."""
    s = max(0.0, min(1.0, (time - middle) / over + 0.5))
    return s * s * (3.0 - 2.0 * s)


@kernel
def sense(rows: Any, fixed: Any, j: int, step: int, time: float, period: float) -> None:
    """Write what the sensors of lane ``j`` show, but for bias, noise and quantisation."""
    position, pressure = rows[FIRST + R.POSITION][j], rows[R.PRESSURE][j]
    rows[FIRST + R.SEEN + (step & (R.N_HISTORY - 1))][j] = position
    age = fixed[R.POSITION_DELAY][j] / period
    whole = min(int(age), R.N_HISTORY - 2)
    newer = rows[FIRST + R.SEEN + ((step + R.N_HISTORY - whole) & (R.N_HISTORY - 1))][j]
    older = rows[FIRST + R.SEEN + ((step + R.N_HISTORY - whole - 1) & (R.N_HISTORY - 1))][j]
    x = newer + (age - whole) * (older - newer)
    full = FULL_STRAIN * fixed[R.REST_LENGTH][j]
    slipped = max(0.0, min(1.0, (time - fixed[R.SLIP_AT][j]) / SLIDE + 0.5))
    drift = drifted(time, fixed[R.POSITION_DRIFT][j], fixed[R.DRIFT_TIME][j])
    ramp = fixed[R.RAMP][j] * ramped(time, fixed[R.RAMP_AT][j], fixed[R.RAMP_OVER][j])
    rows[FIRST + R.SEEN_POSITION][j] = (
        x
        + fixed[R.POSITION_BOW][j] * x * (x / full - 1.0)
        + drift
        + ramp
        + fixed[R.SLIP][j] * slipped
    )
    top = fixed[R.MAX_PRESSURE][j]
    drift = drifted(time, fixed[R.PRESSURE_DRIFT][j], fixed[R.PRESSURE_DRIFT_TIME][j])
    middle, over = fixed[R.PRESSURE_RAMP_AT][j], fixed[R.PRESSURE_RAMP_OVER][j]
    rows[FIRST + R.SEEN_PRESSURE][j] = (
        pressure
        + fixed[R.PRESSURE_BOW][j] * pressure * (pressure / top - 1.0)
        + drift
        + fixed[R.PRESSURE_RAMP][j] * ramped(time, middle, over)
    )


@kernel
def true_position(rows: Any, j: int) -> float:
    """Return where the load of lane ``j`` is [m], from its rest position."""
    return rows[FIRST + R.POSITION][j]  # type: ignore[no-any-return]


@kernel
def seen_position(rows: Any, j: int) -> float:
    """Return what the position sensor measures [m], before its bias, noise and steps."""
    return rows[FIRST + R.SEEN_POSITION][j]  # type: ignore[no-any-return]


@kernel
def seen_pressure(rows: Any, j: int) -> float:
    """Return what the pressure sensor measures [Pa], before its bias, noise and steps."""
    return rows[FIRST + R.SEEN_PRESSURE][j]  # type: ignore[no-any-return]


@kernel
def glide(rows: Any, fixed: Any, own: Any, h: float) -> None:
    """Move loads on guides that stick and slip.

    A guide holds until the push exceeds the breakaway force; in motion its friction falls with
    speed towards the kinetic one (Stribeck). It catches what stops where its speed passes zero.
    """
    x, v, stuck = rows[R.CONTRACTION], rows[R.VELOCITY], rows[FIRST + R.STUCK]
    springs, pushes, jerks, drags, lightness = own[3], own[4], own[5], own[6], own[7]
    for j in range(LANES):
        k, drag, speed = springs[j], drags[j], v[j]
        most = fixed[R.STICK][j] * lightness[j]
        push = pushes[j] + jerks[j] * h
        held = stuck[j] > 0.0 and most > 0.0
        side = 1.0 if (push if held or speed == 0.0 else speed) > 0.0 else -1.0
        kinetic, pace = fixed[R.STICK_KINETIC][j], fixed[R.STICK_SPEED][j]
        rubs = most * (kinetic + (1.0 - kinetic) * decay(min(40.0, abs(speed) / pace)))
        a = pushes[j] + 0.5 * k * h * speed - side * rubs
        dx, after = damped_motion(speed, a, jerks[j], k, drag, decay(0.5 * drag * h), h)
        turned = most > 0.0 and after * side < 0.0
        share = speed / (speed - after) if turned and speed * side > 0.0 else 0.0
        dx = 0.5 * speed * share * h if turned else dx
        rests = held and abs(push) <= most
        x[j] = x[j] + (0.0 if rests else dx)
        v[j] = 0.0 if rests or turned else after
        stuck[j] = 1.0 if rests or turned else 0.0


@kernel
def move(
    rows: Any,
    fixed: Any,
    was: Any,
    h: float,
    own: Any,
    strands: int,
    sticks: int,
    mounts: int,
    stretches: int,
) -> None:
    """Move the load of a tile for ``h`` seconds, the effective pressure going from ``was``."""
    x, v, drive, load = rows[R.CONTRACTION], rows[R.VELOCITY], rows[R.DRIVE], rows[R.LOAD]
    friction, sticking = own[0], own[1]
    springs, pushes, jerks, drags, lightness = own[3], own[4], own[5], own[6], own[7]
    for j in range(LANES):
        friction[j] = 0.0
        sticking[j] = 0.0
    for i in range(4 if strands > 0 else 0):
        slip, part = rows[FIRST + R.STRAND_1 + i], BREAKS[i]
        for j in range(LANES):
            e = (x[j] + 0.5 * h * v[j]) / fixed[R.REST_LENGTH][j]
            span = part * fixed[R.STRAND_BREAK][j]
            stiff = fixed[R.STRAND_FORCE_1 + i][j] / span
            gap = max(-span, min(span, e - slip[j]))
            friction[j] = friction[j] + stiff * gap
            sticking[j] = sticking[j] + (stiff if abs(e - slip[j]) < span else 0.0)
    for j in range(LANES):
        per_length = 1.0 / fixed[R.REST_LENGTH][j]
        mass = load[j] + (fixed[R.LOAD_ERROR][j] if load[j] > 0.0 else 0.0)
        weight = mass * GRAVITY
        stiffer = (
            1.0
            + (fixed[R.LOAD_STIFFENING][j] + fixed[R.LOAD_STIFFENING_2][j] * weight) * weight
            + fixed[R.LOAD_STIFFENING_ROOT][j] * math.sqrt(max(0.0, weight))
        )
        shift = fixed[R.LOAD_CURVE][j] * weight * weight
        ahead = 0.5 * h * v[j]
        e = (x[j] + ahead) * per_length
        bend = decay(e / fixed[R.BRAID_STRAIN][j])
        area, taper = fixed[R.AREA][j], fixed[R.AREA_TAPER][j]
        force = fixed[R.BRAID_FORCE][j] * stiffer
        k1, k3 = fixed[R.STIFFNESS][j] * stiffer, fixed[R.HARDENING][j] * stiffer
        curve, k2 = fixed[R.AREA_CURVE][j], fixed[R.SOFTENING][j] * stiffer
        k4 = fixed[R.STIFFENING][j] * stiffer
        pull = (
            tension(was[j] - shift, e, bend, area, taper, force, k1, k3)
            + fine_tension(was[j] - shift, e, area, curve, k2, k4)
            - friction[j]
        )
        slope = (
            tension_slope(
                0.5 * (was[j] + drive[j]) - shift,
                e,
                bend,
                area,
                taper,
                force / fixed[R.BRAID_STRAIN][j],
                k1,
                k3,
            )
            + fine_slope(0.5 * (was[j] + drive[j]) - shift, e, area, curve, k2, k4)
            + sticking[j]
        )
        slack = fixed[R.SLACK][j]
        hangs = hung(x[j] + ahead, rows[FIRST + R.HANGS][j], slack)
        eased = weight * fixed[R.REST_LENGTH][j] / max(slack, 1e-6)
        slope = slope + (eased if 0.0 < hangs < 1.0 else 0.0)
        pace = fixed[R.VISCOSITY_SPEED][j]
        loss = fixed[R.DAMPING][j] + fixed[R.VISCOSITY][j] / math.sqrt(1.0 + abs(v[j]) / pace)
        stiff = slope * per_length
        moved = max(0.0, mass) * fixed[R.CARRIED][j] + fixed[R.MOVING_MASS][j]
        # motion that is over within the sub-step is followed as slowly as the series reaches
        per_mass = 1.0 / max(moved, loss * h * FASTEST_DECAY, stiff * h * h * FASTEST_TURN)
        springs[j] = stiff * per_mass
        pushes[j] = (pull - weight * hangs) * per_mass
        jerks[j] = area * (1.0 - (taper + curve * e) * e) * (drive[j] - was[j]) * per_mass / h
        drags[j] = per_mass * loss
        lightness[j] = per_mass
    if sticks > 0:
        glide(rows, fixed, own, h)
    else:
        for j in range(LANES):
            k, drag = springs[j], drags[j]
            a = pushes[j] + 0.5 * k * h * v[j]
            dx, v[j] = damped_motion(v[j], a, jerks[j], k, drag, decay(0.5 * drag * h), h)
            x[j] = x[j] + dx
    for i in range(4 if strands > 0 else 0):
        slip, part = rows[FIRST + R.STRAND_1 + i], BREAKS[i]
        for j in range(LANES):
            slip[j] = play(x[j] / fixed[R.REST_LENGTH][j], part * fixed[R.STRAND_BREAK][j], slip[j])
    shown = rows[FIRST + R.SHOWN]
    for j in range(LANES):
        friction[j] = shown[j]
        shown[j] = x[j]
    if stretches > 0:
        for k in range(4):
            state = rows[FIRST + R.STRETCH_1 + k]
            for j in range(LANES):
                kept = decay(h / fixed[R.CREEP_TIME_1 + k][j])
                state[j] = x[j] - (x[j] - state[j]) * kept
                shown[j] = shown[j] + fixed[R.LENGTH_CREEP_1 + k][j] * state[j]
    for j in range(LANES):
        rows[FIRST + R.POSITION][j] = shown[j] - rows[R.REST][j]
    if mounts > 0:
        for j in range(LANES):
            turns, ratio = fixed[R.MOUNT_FREQUENCY][j], fixed[R.MOUNT_DAMPING][j]
            swung = rung(rows, j, R.MOUNT, friction[j], shown[j], turns, ratio, h)
            part = fixed[R.MOUNT_SHARE][j]
            rows[FIRST + R.POSITION][j] = (1.0 - part) * shown[j] + part * swung - rows[R.REST][j]


@kernel
def advance_extended(
    rows: Any,
    fixed: Any,
    counts: Any,
    table: Any,
    hysteresis: int,
    elements: int,
    substeps: int,
    period: float,
    work: Any,
) -> None:
    """Advance a tile by control period ``counts[STEP]``, with all effects."""
    h = period / substeps
    pressure, drive, load = rows[R.PRESSURE], rows[R.DRIVE], rows[R.LOAD]
    set_point, step, dead = rows[R.SET_POINT], counts[R.STEP], fixed[R.DEAD_TIME]
    older, newer, switch, was, width = work[3], work[4], work[5], work[6], work[7]
    late = work[8]
    own = scratch(8, LANES)
    creeps, stretches = 0, 0
    for k in range(4):
        creeps = creeps + count_on(fixed[R.DRIVE_CREEP_1 + k], 0.0)
        stretches = stretches + count_on(fixed[R.LENGTH_CREEP_1 + k], 0.0)
    lines = count_on(fixed[R.LINE_SHARE], 0.0) + count_on(fixed[R.LINE_FLOW], 0.0)
    mounts = count_on(fixed[R.MOUNT_SHARE], 0.0)
    air = (
        count_on(fixed[R.DEAD_BAND], 0.0)
        + count_on(fixed[R.OVERLAP], 0.0)
        + count_on(fixed[R.EXHAUST_RATIO], 1.0)
        + count_on(fixed[R.EXHAUST_RATE], 100.0)
        + count_on(fixed[R.LEAK], 0.0)
        + count_on(fixed[R.SUPPLY_PRESSURE], 2e7)
        + count_on(fixed[R.SLEW_BEND], 0.0)
    )
    worn = (
        count_on(fixed[R.SHAPE], 1.0)
        + count_on(fixed[R.PRESSURE_SLOPE], 0.0)
        + count_on(fixed[R.PRESSURE_BEND], 0.0)
        + count_on(fixed[R.FIRST_WIDTH], 0.0)
        + count_on(fixed[R.FIRST_LOSS], 0.0)
        + count_on(fixed[R.TEMPERATURE_GAIN], 0.0)
    )
    strands, sticks = 0, count_on(fixed[R.STICK], 0.0)
    fine = sticks + count_on(fixed[R.VISCOSITY], 0.0)
    for k in range(4):
        strands = strands + count_on(fixed[R.STRAND_FORCE_1 + k], 0.0)
    for j in range(LANES):
        if load[j] != rows[FIRST + R.HUNG][j]:
            rows[FIRST + R.HUNG][j] = load[j]
            rows[FIRST + R.HANGS][j] = balance(fixed, j, 0.0, load[j], NOWHERE)
        age = dead[j] / period
        whole = min(int(age), DELAY_PERIODS)
        switch[j] = (age - whole) * period
        now = step[j]
        rows[R.HISTORY + (now & (R.N_HISTORY - 1))][j] = set_point[j]
        newer[j] = rows[R.HISTORY + ((now + R.N_HISTORY - whole) & (R.N_HISTORY - 1))][j]
        older[j] = rows[R.HISTORY + ((now + R.N_HISTORY - whole - 1) & (R.N_HISTORY - 1))][j]
    for i in range(substeps):
        for j in range(LANES):
            late[j] = delayed_fraction((i + 1) * h, substeps / period, switch[j])
            was[j] = drive[j]
        for stage in range(2):  # towards the older set-point, then towards the newer one
            busy = 0
            for j in range(LANES):
                width[j] = h * (late[j] if stage == 1 else 1.0 - late[j])
                busy = busy + (1 if width[j] > 0.0 else 0)
            if busy == 0:
                continue
            for j in range(LANES):
                before = rows[FIRST + R.REGULATED][j]
                aim = newer[j] if stage == 1 else older[j]
                if air > 0:
                    after = filled(rows, fixed, j, aim, width[j])
                else:
                    after = filled_plainly(rows, fixed, j, aim, width[j])
                after = after if width[j] > 0.0 else before
                rows[FIRST + R.REGULATED][j] = after
                own[0][j], own[1][j] = before, pressure[j]
                pressure[j] = after
            if lines > 0:
                for j in range(LANES):
                    turns, ratio = fixed[R.LINE_FREQUENCY][j], fixed[R.LINE_DAMPING][j]
                    swung = rung(rows, j, R.LINE, own[0][j], pressure[j], turns, ratio, width[j])
                    part = fixed[R.LINE_SHARE][j]
                    flow = fixed[R.LINE_FLOW][j] * rows[FIRST + R.LINE_RATE][j] / (TURN * turns)
                    pressure[j] = max(0.0, (1.0 - part) * pressure[j] + part * swung + flow)
            for j in range(LANES):
                rows[FIRST + R.TRAVEL][j] += abs(pressure[j] - own[1][j])
            feel(
                rows,
                fixed,
                counts,
                table,
                hysteresis,
                0,
                LANES,
                elements,
                work,
                width,
                own,
                creeps,
                worn,
            )
        parts = FINE_PARTS if fine > 0 else 1
        for j in range(LANES):
            own[2][j] = drive[j]
        for q in range(parts):
            for j in range(LANES):
                drive[j] = was[j] + (own[2][j] - was[j]) / (parts - q)
            move(rows, fixed, was, h / parts, own, strands, sticks, mounts, stretches)
            for j in range(LANES):
                was[j] = drive[j]
    for j in range(LANES):
        sense(rows, fixed, j, step[j] + 1, (step[j] + 1) * period, period)


def replacements(kind: str, first: int) -> dict[str, Any]:
    """Return what stands where in a kernel of the plain plant to make it the extended one.

    ``first`` is the row after the hysteresis's state.
    """
    return {
        "FIRST": first,
        "plain_hysteresis": HYSTERESIS_MODELS[kind],
        "remember": settled,
        "advance": advance_extended,
        "rest_contraction": rest_extended,
        "begin_effects": begin_effects,
        "true_position": true_position,
        "seen_position": seen_position,
        "seen_pressure": seen_pressure,
    }
