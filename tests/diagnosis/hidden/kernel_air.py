"""Jitted: regulator, supply and line, from the command to the pressure.

In all kernels `p` is the record of constants and `s` that of the state; see `records` for units.
"""

from __future__ import annotations

import math

from .kernel_tools import ATMOSPHERE, STEP, jit


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
def capped(rate, limit, power):
    """Return `rate`, bent smoothly so that it never passes `limit`."""
    return rate / (1.0 + (abs(rate) / limit) ** power) ** (1.0 / power)


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
    """Return by how much another muscle on the same supply pulls the set-point [bar]."""
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
    """Return the pressure that the regulator aims at [bar]."""
    if p.dither > 0.0:
        command += p.dither * (2.0 / math.pi) * math.asin(math.sin(2 * math.pi * p.dither_hz * t))
    aim = p.gain * queued(p, s, command)
    if p.neighbour > 0.0:
        aim += neighbour_dip(p, t)
    return max(aim, 0.0)


@jit
def comparator(p, s, error):
    """Open the valve on a large error and close it on a small one."""
    if p.open_at <= 0.0:
        return True
    if abs(error) > p.open_at:
        s.open = 1
    elif abs(error) < p.close_at:
        s.open = 0
    return s.open == 1


@jit
def valve_rate(p, s, error):
    """Return how fast the regulator moves the pressure [bar/s]."""
    if not comparator(p, s, error):
        return 0.0
    if p.slew > 0.0:
        error = capped(error, 1.0 / p.slew, p.slew_power)
    rate = error * p.approach / STEP
    absolute = s.pressure + ATMOSPHERE
    if p.exhaust > 0.0 and rate < 0.0:
        rate /= 1.0 + p.exhaust * 4.0 / absolute
    if p.throat > 0.0 and rate > 0.0:
        flow = orifice(s.supply + ATMOSPHERE, absolute) / (p.supply + ATMOSPHERE)
        rate = 0.0 if flow <= 0.0 else capped(rate, flow / p.throat, 2.0)
    return rate


@jit
def fill(p, s, command, shut, t):
    """Move the pressure, the supply and the ringing of the line on by one step."""
    error = set_point(p, s, command, t) - s.pressure
    rate = 0.0 if shut else valve_rate(p, s, error)
    if p.throat > 0.0:
        drawn = p.draw * max(rate, 0.0)
        s.supply += STEP * ((p.supply - s.supply) / p.recovery - drawn)
    if p.leak > 0.0:
        rate -= p.leak * orifice(s.pressure + ATMOSPHERE, ATMOSPHERE)
    s.pressure = max(s.pressure + STEP * rate, 0.0) if p.leak > 0.0 else s.pressure + STEP * rate
    s.rate = rate
    if p.line > 0.0:
        omega = p.line_omega
        pull = p.line * omega * rate - 2.0 * p.line_zeta * omega * s.line_rate
        s.line_rate += STEP * (pull - omega * omega * s.line)
        s.line += STEP * s.line_rate
