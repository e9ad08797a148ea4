"""Kernels of regulator, supply and line, from the command to the pressure.

In all kernels `p` is the record of constants and `s` that of the state; see `records` for units.
"""

import math

from .kernel_tools import ATMOSPHERE, STEP, jit
from .records import TUBE

LAMINAR = 0.995  # ratio of pressures above which the flow through a restriction is laminar


@jit
def orifice(upstream, downstream):
    """Return the flow through an orifice over its choked flow at 1 bar, absolute pressures."""
    ratio = downstream / upstream
    if ratio <= 0.528:
        return upstream
    if ratio >= 1.0:
        return 0.0
    return upstream * math.sqrt(max(0.0, 1.0 - ((ratio - 0.528) / 0.472) ** 2))


@jit
def passed(critical, upstream, downstream):
    """Return the flow through a restriction of ISO 6358 over its choked flow at 1 bar.

    Absolute pressures; `critical` is the ratio of pressures below which the flow is choked. Above
    it follows a quarter of an ellipse, and very near to 1, where that would be infinitely steep,
    a straight line.
    """
    ratio = downstream / upstream
    if ratio <= critical:
        return upstream
    if ratio >= 1.0:
        return 0.0
    bound = min(ratio, LAMINAR)
    share = (bound - critical) / (1.0 - critical)
    flow = upstream * math.sqrt(1.0 - share * share)
    return flow if ratio < LAMINAR else flow * (1.0 - ratio) / (1.0 - LAMINAR)


@jit
def queued(p, s, command):
    """Pass the command through the chain of short lags."""
    if p.chain <= 0.0:
        return command
    lags = int(p.chain_lags)
    share = STEP / (STEP + p.chain / lags)  # the chain's mean delay is p.chain at any size
    for i in range(lags):
        s.queue[i] += share * (command - s.queue[i])
        command = s.queue[i]
    return command


@jit
def neighbour_dip(p, t):
    """Return the change of the setpoint by another muscle on the same supply [bar]."""
    phase = t / p.neighbour_period
    phase -= math.floor(phase)
    since_fill = phase * p.neighbour_period
    since_vent = (phase - p.neighbour_duty) * p.neighbour_period
    dip = -math.exp(-since_fill / p.neighbour_decay)
    if since_vent >= 0.0:
        dip += 0.7 * math.exp(-since_vent / p.neighbour_decay)
    return p.neighbour * dip


@jit
def set_point(p, s, command, t):
    """Return the setpoint of the regulator [bar]."""
    if p.dither > 0.0:
        command += p.dither * (2.0 / math.pi) * math.asin(math.sin(2 * math.pi * p.dither_hz * t))
    aim = p.gain * queued(p, s, command)
    if p.neighbour > 0.0:
        aim += neighbour_dip(p, t)
    return max(aim, 0.0)


@jit
def driven(p, error):
    """Return the error that the valve's coil of limited force can drive.

    Either its iron saturates, or a current limit leaves a small slope; a return spring makes the
    limits unequal.
    """
    limit = (1.0 + math.copysign(p.slew_lean, error)) / p.slew
    if p.slew_kind > 0.5:
        return limit * math.tanh(error / limit)
    over = abs(error) - limit
    if over <= 0.0:
        return error
    return math.copysign(limit + p.slew_rest * over, error)


@jit
def uncovered(p, error):
    """Return the opening of a spool whose lands overlap the ports, rounded and leaking."""
    edge = p.overlap * p.overlap_edge
    past = abs(error) - p.overlap
    opened = 0.5 * (past + math.sqrt(past * past + edge * edge))
    shut = 0.5 * (math.sqrt(p.overlap * p.overlap + edge * edge) - p.overlap)
    wide = (1.0 - p.overlap_leak) * (opened - shut) + p.overlap_leak * abs(error)
    return math.copysign(wide, error)


@jit
def volume(p, strain):
    """Return the muscle's volume over that at rest and its slope: a braided cylinder's."""
    stretch = 1.0 - strain
    square = p.braid * stretch * stretch
    return stretch * (3.0 - square) / (3.0 - p.braid), 3.0 * (square - 1.0) / (3.0 - p.braid)


@jit
def supplied(p, s, rate, shut):
    """Take the air of the muscle from the reservoir; return the remaining rate [bar/s].

    Balances of air in muscle and reservoir. The valve opens as far as it must, and not further
    than fully; the reservoir is fed through an orifice. Flows in volumes of the muscle at rest.
    """
    absolute = s.pressure + ATMOSPHERE
    stock, feed = s.supply + ATMOSPHERE, p.supply + ATMOSPHERE
    wide, slope = volume(p, s.strain)
    swallowed = absolute * slope * s.speed
    demand = wide * rate + swallowed
    taken = 0.0
    if demand > 0.0 and not shut:
        taken = min(demand, passed(p.critical, stock, absolute) / p.throat)
        rate = min(rate, (taken - swallowed) / wide)
    filled = passed(p.critical, feed, stock) / p.recovery
    s.supply += STEP * (filled - p.draw * taken)
    return rate


@jit
def valve_rate(p, s, error):
    """Return the rate of the regulated pressure [bar/s]."""
    if p.overlap > 0.0:
        error = uncovered(p, error)
    if p.slew > 0.0:
        error = driven(p, error)
    rate = error * p.approach / STEP
    if p.exhaust > 0.0 and rate < 0.0:
        rate /= 1.0 + p.exhaust * 4.0 / (s.pressure + ATMOSPHERE)
    return rate


@jit
def behind(values, tick, steps):
    """Return the value of a ring a number of steps ago, interpolated."""
    whole = int(steps)
    newer = values[(tick - whole) % TUBE]
    older = values[(tick - whole - 1) % TUBE]
    return newer + (steps - whole) * (older - newer)


@jit
def resound(p, s):
    """Send a wave down a closed tube and add a share of the oscillation at its end.

    The valve's end holds its pressure, the far one reflects the wave, weaker and rounded by the
    wall; both ways take the same time.
    """
    tick = s.tick
    s.sent[tick % TUBE] = s.pressure - behind(s.returned, tick, p.line_trip)
    arrived = behind(s.sent, tick, p.line_trip)
    s.line_end += p.line_wall * (arrived - s.line_end)
    s.returned[tick % TUBE] = p.line_return * s.line_end
    swung = arrived + p.line_return * s.line_end
    s.line = p.line * (swung - s.pressure)


@jit
def fill(p, s, command, shut, t):
    """Advance pressure, supply and waves in the line by one step."""
    error = set_point(p, s, command, t) - s.pressure
    rate = 0.0 if shut else valve_rate(p, s, error)
    if p.throat > 0.0:
        rate = supplied(p, s, rate, shut)
    if p.leak > 0.0:
        rate -= p.leak * orifice(s.pressure + ATMOSPHERE, ATMOSPHERE)
    s.pressure = max(s.pressure + STEP * rate, 0.0) if p.leak > 0.0 else s.pressure + STEP * rate
    s.rate = rate
    if p.line > 0.0:
        resound(p, s)
