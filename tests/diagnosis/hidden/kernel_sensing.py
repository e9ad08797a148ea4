"""Kernels of the position and pressure sensors."""

import math

from .kernel_tools import PRESSURE_SPAN, STEP, jit, uniform
from .records import HISTORY

WARM_UP = 5.0
"""Time in which the electronics warm up [s]."""


@jit
def position_mm(p, s):
    """Return the true contraction since the start [mm]."""
    place = 1e3 * p.length * (s.strain - s.rest)
    if p.slip > 0.0:
        since = (STEP * s.tick - p.slip_time) / p.slip_blur
        if p.slip_kind > 0.5:
            place -= p.slip / (1.0 + math.exp(-4.0 * since)) if since > -9.0 else 0.0
        elif since > 0.0:
            place -= p.slip * (1.0 - math.exp(-since))
    return place


@jit
def listen(p, s):
    """Advance the slow position sensor by one step."""
    value = position_mm(p, s)
    s.integral += STEP * value
    s.history[s.tick % HISTORY] = s.integral
    lags = int(p.late_lags)
    share = STEP / (STEP + p.late / lags)
    for i in range(lags):
        s.late[i] += share * (value - s.late[i])
        value = s.late[i]


@jit
def delayed_mm(p, s):
    """Return the reading of the slow position sensor [mm]."""
    if p.late_kind < 0.5:
        return s.late[int(p.late_lags) - 1]
    window = 2.0 * p.late / STEP
    whole = math.floor(window)
    back = s.tick - int(whole)
    newer = s.history[back % HISTORY] if back > 0 else 0.0
    older = s.history[(back - 1) % HISTORY] if back > 1 else 0.0
    return (s.integral - newer - (window - whole) * (older - newer)) / (window * STEP)


@jit
def bow(p, share):
    """Return the bow of a sensor at a share of its span, about 1 at the middle."""
    if p.bow_kind > 0.5:
        return math.sin(math.pi * share)
    curve = p.bow_curve
    return 4.0 / curve * (math.atan(curve * share) / math.atan(curve) - share)


@jit
def drifted(p, t):
    """Return the share of a sensor's drift that has occurred."""
    if p.drift_kind > 0.5:
        return t / (t + p.drift_time)
    early = 1.0 / (1.0 + math.exp(4.0))
    return 1.0 / (1.0 + math.exp(4.0 - 4.0 * t / p.drift_time)) - early


@jit
def dropped(p, t):
    """Return whether the position sensor holds its last value."""
    cell = math.floor(t / p.dropout_cell)
    since = t - p.dropout_cell * (cell + 0.5 * uniform(p.dropout_seed, cell))
    return 0.0 <= since < p.dropout * (0.4 + 1.2 * uniform(p.dropout_seed + 3.0, cell))


@jit
def read(p, s):
    """Return the readings of the position sensor [mm] and of the pressure sensor [bar]."""
    t = STEP * s.tick
    place = delayed_mm(p, s) if p.late > 0.0 else position_mm(p, s)
    pressure = s.pressure + s.line
    if p.target > 0.0:
        place += 1e3 * p.target * (s.target + p.target_lever * s.foot)
    if p.bow_mm != 0.0:
        place += p.bow_mm * bow(p, place / (160.0 * p.length))
    if p.bow_bar != 0.0:
        pressure += p.bow_bar * bow(p, pressure / PRESSURE_SPAN)
    cold = max(0.0, 1.0 - t / WARM_UP)
    warm = 1.0 - cold * cold
    place += p.bias_mm * warm
    pressure += p.bias_bar * warm
    if p.drift_time > 0.0:
        place += p.drift_mm * drifted(p, t)
        pressure += p.drift_bar * drifted(p, t)
    if p.dropout > 0.0 and dropped(p, t):
        place = s.held
    s.held = place
    return place, pressure
