"""One step of a pressure regulator: its rate of pressure before limits and leaks."""

import math

import numpy as np
from numba import njit

VALVES = (
    "lag",
    "second_order",
    "orifice",
    "slow_tail",
    "integrating",
    "pulsed",
    "tube",
    "offset",
    "cascade",
    "coarse_fine",
    "back_calculation",
    "throttle",
    "flapper",
    "sampled",
    "gap_gain",
)
FLOWS = (VALVES.index("orifice"), VALVES.index("pulsed"), VALVES.index("coarse_fine"))
"""Valves that pass a mass flow, so that the muscle's volume acts on its pressure."""
KEYS = (
    "gain",
    "offset_bar",
    "dead_time_s",
    "fill_limit_s_bar",
    "vent_limit_s_bar",
    "lag_s",
    "frequency_rad_s",
    "damping",
    "slow_share",
    "slow_s",
    "fill_bar_s",
    "vent_bar_s",
    "opening_bar",
    "spool_s",
    "supply_bar",
    "vent_delay_s",
    "vent_lag_s",
    "integral_s2",
    "clamp_bar_s",
    "short_pulse",
    "bulge_bar",
    "tilt_bar",
    "pilot_s",
    "coarse_bar",
    "windup_s",
    "throttle_s2_bar",
    "vent_pilot_s",
    "sample_s",
    "quantum_bar_s",
    "low_gain",
    "gap_bar",
)
"""Constants of a valve, in the order of its vector; limits are reciprocal rates, 0 for none."""
AMBIENT = 1.013  # [bar]
CRITICAL = 0.3


@njit(cache=True)
def flow(upstream: float, downstream: float) -> float:
    """Return the flow through an orifice relative to the choked one at 7 bar absolute."""
    if upstream <= downstream:
        return 0.0
    ratio = (downstream / upstream - CRITICAL) / (1.0 - CRITICAL)
    if ratio <= 0.0:
        return upstream / 7.0
    return upstream / 7.0 * math.sqrt(max(1.0 - ratio * ratio, 0.0))


@njit(cache=True)
def _staged(
    c: np.ndarray, p: float, state: np.ndarray, error: float, supply: float, dt: float
) -> float:
    """Small proportional valves, and large ones that open beyond half an error of `coarse_bar`."""
    fine = min(max(error, -c[23]), c[23])
    opening = min(max(2.0 * abs(error) / c[23] - 1.0, 0.0), 1.0)
    state[2] += dt / c[13] * (math.copysign(opening, error) - state[2])
    if state[2] >= 0.0:
        coarse = state[2] * c[10] * flow(supply + AMBIENT, p + AMBIENT)
    else:
        coarse = state[2] * c[11] * flow(p + AMBIENT, AMBIENT)
    return fine / c[5] + coarse


@njit(cache=True)
def _back_calculated(c: np.ndarray, state: np.ndarray, error: float, dt: float) -> float:
    """Controller whose integral follows the rate that its limits have let through."""
    if abs(error) < 1e-9:
        state[3] -= dt / c[5] * state[3]
        state[2] = state[3]
        return state[2]
    state[3] += dt * (c[17] * error + (state[0] - state[2]) / c[24])
    state[2] = error / c[5] + state[3]
    return state[2]


@njit(cache=True)
def _throttled(c: np.ndarray, p: float, state: np.ndarray, target: float, dt: float) -> float:
    """Line behind a regulator, and a restriction: loss of pressure is linear plus quadratic."""
    state[1] += dt / c[22] * (target - state[1])
    drop = state[1] - p
    rate = 2.0 * abs(drop) / (c[5] + math.sqrt(c[5] * c[5] + 4.0 * c[25] * abs(drop)))
    return math.copysign(rate, drop)


@njit(cache=True)
def valve_rate(
    kind: int, c: np.ndarray, p: float, state: np.ndarray, target: float, supply: float, dt: float
) -> float:
    """Return the rate of pressure [bar/s]; the state is rate, slow part, spool, integral."""
    if kind == 1:
        pull = c[6] * c[6] * (target - p) - 2.0 * c[7] * c[6] * state[0]
        return state[0] + dt * pull
    if kind == 2:
        wanted = min(max((target - p) / c[12], -1.0), 1.0)
        state[2] += dt / c[13] * (wanted - state[2])
        if state[2] >= 0.0:
            return state[2] * c[10] * flow(supply + AMBIENT, p + AMBIENT)
        return state[2] * c[11] * flow(p + AMBIENT, AMBIENT)
    if kind == 3:
        state[1] += dt / c[9] * (target - state[1])
        return ((1.0 - c[8]) * target + c[8] * state[1] - p) / c[5]
    error = target - p
    if kind == 4:  # proportional valve with a controller whose integral is clamped
        if abs(error) < 1e-9:
            state[2] -= dt / c[13] * state[2]
            return state[2]
        state[3] = min(max(state[3] + dt * c[17] * error, -c[18]), c[18])
        state[2] += dt / c[13] * (error / c[5] + state[3] - state[2])
        return state[2]
    if kind == 5:  # on/off valves, pulses averaged; short pulses pass less than their share
        duty = min(max(error / c[12], -1.0), 1.0)
        duty *= abs(duty) / (abs(duty) + c[19])
        if duty >= 0.0:
            return duty * c[10] * flow(supply + AMBIENT, p + AMBIENT)
        return duty * c[11] * flow(p + AMBIENT, AMBIENT)
    if kind == 6:
        return error / (c[5] if error > 0.0 else c[16])
    if kind == 7:
        u = min(target / 6.0, 1.0)
        return (error + c[20] * 4.0 * u * (1.0 - u) + c[21] * math.sin(2.0 * math.pi * u)) / c[5]
    if kind == 8:
        state[1] += dt / c[22] * (target - state[1])
        return (state[1] - p) / c[5]
    if kind == 9:
        return _staged(c, p, state, error, supply, dt)
    if kind == 10:
        return _back_calculated(c, state, error, dt)
    if kind == 11:
        return _throttled(c, p, state, target, dt)
    if kind == 12:  # nozzle and flapper, whose chamber fills and empties with different lags
        state[1] += dt / (c[22] if target > state[1] else c[26]) * (target - state[1])
        return (state[1] - p) / c[5]
    if kind == 13:  # digital controller: the rate is held between samples, in small steps
        state[3] += dt
        if state[3] > c[27] - 0.25 * dt:
            state[3] = 0.0
            state[2] = c[28] * math.floor(error / (c[5] * c[28]) + 0.5)
        return state[2]
    if kind == 14:  # spool whose edges open gradually: less gain at small errors
        return error / c[5] * (c[29] + (1.0 - c[29]) * abs(error) / (abs(error) + c[30]))
    return (target - p) / c[5]
