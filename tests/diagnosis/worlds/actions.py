"""What effects do to setpoint, pressure, strain, loop width and force; inactive at strength 0.

A row of the table of effects holds strength, form and six constants; `st` is their state.
"""

import math

import numpy as np
from numba import njit

from .names import (
    CATCH,
    COMMAND_STEPS,
    CREEP,
    CROSSTALK,
    DEAD_BAND,
    DEAD_TIME,
    DITHER,
    DROOP,
    END_STOP,
    LOAD_SHIFT,
    LOAD_WIDTH,
    PENDULUM,
    PRESSURE_FRICTION,
    SOFTENING,
    STICK,
    TEMPERATURE,
    THRESHOLD,
    VIBRATION,
    VISCOUS,
    WALK,
)

STATES = 24
SOFT, TANK, BRISTLE, SLIDING, DWELL, OWN, SWING, SWING_RATE, CAUGHT, LATCH, TUBE = range(5, 16)
"""Places in the state; creep has the first five, the tube the three from `TUBE`."""


@njit(cache=True)
def _row(command: np.ndarray, row: int) -> float:
    return 0.0 if row < 0 else command[min(row, command.size - 1)]


@njit(cache=True)
def held(command: np.ndarray, time: float, period: float, dt: float) -> float:
    """Return the mean command over the step from a time on, 0 before the first row."""
    first = math.floor(time / period + 1e-7)
    last = math.floor((time + dt) / period - 1e-7)
    if first == last:
        return _row(command, first)
    share = (time + dt - last * period) / dt
    return (1.0 - share) * _row(command, first) + share * _row(command, last)


@njit(cache=True)
def setpoint(
    eff: np.ndarray,
    st: np.ndarray,
    command: np.ndarray,
    time: float,
    period: float,
    valve: np.ndarray,
    p: float,
    noise: np.ndarray,
    dt: float,
) -> float:
    """Return the pressure that the regulator aims at [bar]."""
    delay, tube = valve[2], 0.0
    if eff[DEAD_TIME, 0] > 0.0:
        tube = eff[DEAD_TIME, 0] if eff[DEAD_TIME, 1] > 0.5 else 0.0
        delay += eff[DEAD_TIME, 0] - 0.5 * tube
    wanted = held(command, time - delay, period, dt)
    if valve[15] > 0.0:  # a fall arrives later than a rise
        wanted = max(wanted, held(command, time - delay - valve[15], period, dt))
    if tube > 0.0:
        for i in range(TUBE, TUBE + 3):
            st[i] += (wanted - st[i]) * dt / (dt + tube / 6.0)
            wanted = st[i]
    if eff[COMMAND_STEPS, 0] > 0.0:
        wanted = eff[COMMAND_STEPS, 0] * math.floor(wanted / eff[COMMAND_STEPS, 0] + 0.5)
    target = max(valve[0] * wanted + valve[1], 0.0)
    if eff[DITHER, 0] > 0.0 and target > 0.1:
        wave = math.sin(2.0 * math.pi * eff[DITHER, 2] * time)
        if eff[DITHER, 1] > 0.5:
            wave = 0.6366 * math.asin(wave)
        target += eff[DITHER, 0] * wave
    if eff[CROSSTALK, 0] > 0.0:
        target -= eff[CROSSTALK, 0] * noise[1] * (0.2 + target / 6.0)
    if eff[DROOP, 0] > 0.0:
        if eff[DROOP, 1] > 0.5:
            target -= eff[DROOP, 0] * st[TANK] * target / 6.0
        else:
            target = min(target, eff[DROOP, 4] - eff[DROOP, 0] * st[TANK])
    if eff[DEAD_BAND, 0] > 0.0:
        band, error = eff[DEAD_BAND, 0], target - p
        if eff[DEAD_BAND, 1] < 0.5:
            target -= min(max(error, -band), band)
        else:
            if abs(error) > band:
                st[LATCH] = 1.0
            elif abs(error) < eff[DEAD_BAND, 2] * band:
                st[LATCH] = 0.0
            if st[LATCH] < 0.5:
                target = p
    return max(target, 0.0)


@njit(cache=True)
def felt_pressure(
    eff: np.ndarray,
    st: np.ndarray,
    p: float,
    strain: float,
    load: float,
    warm: float,
    noise: np.ndarray,
    dt: float,
) -> float:
    """Return the pressure that acts on the muscle's law [bar]."""
    felt = p
    if eff[THRESHOLD, 0] > 0.0:
        gap = eff[THRESHOLD, 0]
        if eff[THRESHOLD, 1] < 0.5:
            felt = max(p - gap, 0.0)
        else:
            grown = gap * (1.0 + eff[THRESHOLD, 3] * max(strain, 0.0) / 0.15)
            felt = p - grown * (1.0 - math.exp(-p / (eff[THRESHOLD, 2] + 0.7 * grown)))
    if eff[CREEP, 0] > 0.0 and eff[CREEP, 1] > 0.5:
        late = 0.0
        tau = eff[CREEP, 2]
        for i in range(5):
            st[i] += dt / tau * (p - st[i])
            late += 0.2 * (p - st[i])
            tau *= eff[CREEP, 3]
        felt -= eff[CREEP, 0] * late
    if eff[SOFTENING, 0] > 0.0 and eff[SOFTENING, 1] < 0.5:
        felt *= max(1.0 - eff[SOFTENING, 0] * st[SOFT], 0.2)
    if eff[TEMPERATURE, 0] > 0.0 and eff[TEMPERATURE, 1] < 0.5:
        felt *= max(1.0 + eff[TEMPERATURE, 0] * eff[TEMPERATURE, 2] * warm, 0.2)
    if eff[LOAD_SHIFT, 0] > 0.0 and eff[LOAD_SHIFT, 1] > 0.5:
        felt *= max(1.0 - eff[LOAD_SHIFT, 0] * math.sqrt(load / 30.0), 0.2)
    if eff[WALK, 0] > 0.0:
        felt *= max(1.0 + eff[WALK, 0] * noise[0], 0.2)
    return felt


@njit(cache=True)
def felt_strain(
    eff: np.ndarray, st: np.ndarray, strain: float, load: float, warm: float, dt: float
) -> float:
    """Return the strain that acts on the muscle's law [-]."""
    felt = strain
    if eff[CREEP, 0] > 0.0 and eff[CREEP, 1] < 0.5:
        share = eff[CREEP, 4]
        st[0] += dt / eff[CREEP, 2] * (eff[CREEP, 0] * share * strain - st[0])
        st[1] += dt / eff[CREEP, 3] * (eff[CREEP, 0] * (1.0 - share) * strain - st[1])
        felt -= st[0] + st[1]
    if eff[TEMPERATURE, 0] > 0.0 and eff[TEMPERATURE, 1] > 0.5:
        felt += eff[TEMPERATURE, 0] * eff[TEMPERATURE, 2] * warm * strain
    if eff[LOAD_SHIFT, 0] > 0.0 and eff[LOAD_SHIFT, 1] < 0.5:
        shift = eff[LOAD_SHIFT, 0] * (load / 30.0) ** eff[LOAD_SHIFT, 2]
        felt += eff[LOAD_SHIFT, 3] * shift
    return felt


@njit(cache=True)
def loop_scale(eff: np.ndarray, p: float, load: float) -> float:
    """Return the factor by which effects widen the normal loop [-]."""
    scale = 1.0
    if eff[LOAD_WIDTH, 0] > 0.0:
        power = 1.0 if eff[LOAD_WIDTH, 1] < 0.5 else eff[LOAD_WIDTH, 3]
        scale += eff[LOAD_WIDTH, 0] * eff[LOAD_WIDTH, 2] * (load / 30.0) ** power
    if eff[PRESSURE_FRICTION, 0] > 0.0 and eff[PRESSURE_FRICTION, 1] > 0.5:
        slope = eff[PRESSURE_FRICTION, 0] * eff[PRESSURE_FRICTION, 2]
        scale *= max(1.0 + slope * (p / 3.0 - eff[PRESSURE_FRICTION, 3]), 0.05)
    return min(max(scale, 0.05), 8.0)


@njit(cache=True)
def _guide(eff: np.ndarray, st: np.ndarray, dx: float, v: float, dt: float) -> float:
    """Friction of a guide whose breakaway exceeds its kinetic force [N]."""
    size, reach, kinetic = eff[STICK, 0], eff[STICK, 2], eff[STICK, 3]
    if eff[STICK, 1] < 0.5:
        bound = kinetic + (1.0 - kinetic) * math.exp(-((v / eff[STICK, 4]) ** 2))
        st[BRISTLE] = (st[BRISTLE] + dx / reach) / (1.0 + abs(dx) / (reach * bound))
        return size * st[BRISTLE]
    st[BRISTLE] += dx / reach
    if st[SLIDING] < 0.5 and abs(st[BRISTLE]) >= 1.0:
        st[SLIDING], st[DWELL] = 1.0, 0.0
    if st[SLIDING] > 0.5:
        st[BRISTLE] = min(max(st[BRISTLE], -kinetic), kinetic)
        st[DWELL] = st[DWELL] + dt if abs(v) < eff[STICK, 4] else 0.0
        if st[DWELL] > 0.03:
            st[SLIDING] = 0.0
    return size * st[BRISTLE]


@njit(cache=True)
def added_force(
    eff: np.ndarray,
    st: np.ndarray,
    p: float,
    x: float,
    dx: float,
    v: float,
    acceleration: float,
    strain: float,
    mass: float,
    time: float,
    noise: np.ndarray,
    out: np.ndarray,
    dt: float,
) -> None:
    """Put force [N], damping [N s/mm] and stiffness [N/mm] that effects add into `out`."""
    out[0] = out[1] = out[2] = 0.0
    if eff[VISCOUS, 0] > 0.0:
        if eff[VISCOUS, 1] < 0.5:
            out[1] += eff[VISCOUS, 0] * (1.0 + eff[VISCOUS, 2] * p / 3.0)
        else:
            side = 1.0 if v > 0.0 else eff[VISCOUS, 4]
            out[1] += eff[VISCOUS, 0] * side * (abs(v) / 10.0 + 0.2) ** (eff[VISCOUS, 3] - 1.0)
    if eff[SOFTENING, 0] > 0.0 and eff[SOFTENING, 1] > 0.5:
        out[0] -= eff[SOFTENING, 0] * st[SOFT] * max(strain, 0.0)
    if eff[STICK, 0] > 0.0:
        out[0] -= _guide(eff, st, dx, v, dt)
        out[2] += eff[STICK, 0] / eff[STICK, 2]
    if eff[PRESSURE_FRICTION, 0] > 0.0 and eff[PRESSURE_FRICTION, 1] < 0.5:
        size = p / 3.0 if eff[PRESSURE_FRICTION, 2] > 0.0 else math.exp(-p / 1.5)
        st[OWN] = min(max(st[OWN] + dx / eff[PRESSURE_FRICTION, 4], -size), size)
        out[0] -= eff[PRESSURE_FRICTION, 0] * st[OWN]
        out[2] += eff[PRESSURE_FRICTION, 0] / eff[PRESSURE_FRICTION, 4]
    if eff[CATCH, 0] > 0.0:
        st[CAUGHT] = min(max(st[CAUGHT] + dx / eff[CATCH, 2], -1.0), 1.0) * noise[3]
        out[0] -= eff[CATCH, 0] * st[CAUGHT]
        out[2] += eff[CATCH, 0] / eff[CATCH, 2]
    if eff[END_STOP, 0] > 0.0:
        over = x - (eff[END_STOP, 2] - eff[END_STOP, 0])
        if over > 0.0:
            out[0] -= eff[END_STOP, 3] * over
            out[2] += eff[END_STOP, 3]
    if eff[PENDULUM, 0] > 0.0:
        rate = 2.0 * math.pi * eff[PENDULUM, 2]
        pull = rate * rate * st[SWING] + 2.0 * eff[PENDULUM, 3] * rate * st[SWING_RATE]
        st[SWING_RATE] -= dt * (pull + acceleration)
        st[SWING] += dt * st[SWING_RATE]
        out[0] += eff[PENDULUM, 0] * mass * 1e-3 * pull
    if eff[VIBRATION, 0] > 0.0:
        shake = math.sin(2.0 * math.pi * eff[VIBRATION, 2] * time)
        if eff[VIBRATION, 1] > 0.5:
            shake += math.sin(2.0 * math.pi * eff[VIBRATION, 3] * time + 1.0)
        out[0] += eff[VIBRATION, 0] * mass * 0.1 * noise[2] * shake


@njit(cache=True)
def remember(
    eff: np.ndarray, st: np.ndarray, dp: float, dx: float, length: float, dt: float
) -> None:
    """Advance the states of the supply and of softening."""
    if eff[DROOP, 0] > 0.0:
        st[TANK] += max(dp, 0.0) * eff[DROOP, 2] - dt / eff[DROOP, 3] * st[TANK]
    if eff[SOFTENING, 0] > 0.0:
        moved = abs(dp) if eff[SOFTENING, 1] < 0.5 else max(dx, 0.0) / length
        st[SOFT] += -st[SOFT] * moved / eff[SOFTENING, 2]
        st[SOFT] += dt / eff[SOFTENING, 3] * (1.0 - st[SOFT])
