"""Kernels of friction, muscle force and hanging load."""

import math

from .kernel_tools import GRAVITY, jit
from .records import SLIDERS, WAVES


@jit
def sliders(stops, stiffness, breaks, move):
    """Drag every slider by `move` and return the sum of their forces."""
    total = 0.0
    for i in range(SLIDERS):
        stops[i] = min(max(stops[i] + move, -breaks[i]), breaks[i])
        total += stiffness[i] * stops[i]
    return total


@jit
def remapped(p, grip):
    """Bend the inner loops and leave the fully slipped ones unchanged."""
    share = grip / p.friction
    if p.map_kind > 0.5:
        return p.friction * math.tanh(p.map * share) / math.tanh(p.map)
    return p.friction * math.sinh(p.map * share) / math.sinh(p.map)


@jit
def virgin(p, s):
    """Return the remaining first-cycle state, 1 at first."""
    if p.virgin_kind > 0.5:
        return math.exp(-math.sqrt(s.travel / p.virgin_scale))
    return 1.0 / (1.0 + s.travel / p.virgin_scale) ** 1.5


@jit
def grip_factor(p, s, pressure):
    """Return the factor of the pressure-driven friction."""
    factor = 1.0
    if p.load_grip > 0.0:
        more = 1.0 + p.load_grip * (s.load / 30.0) ** 1.5
        factor *= more if p.load_grip_sign > 0.0 else 1.0 / more
    if p.pressure_grip != 0.0:
        bend = p.pressure_grip_bend
        rise = (1.0 - math.exp(-max(pressure, 0.0) / bend)) / (1.0 - math.exp(-3.0 / bend))
        factor *= math.exp(p.pressure_grip * (rise - 1.0))
    if p.virgin > 0.0:
        factor *= 1.0 + p.virgin * p.virgin_grip * virgin(p, s)
    return factor


@jit
def effective(p, s):
    """Return the effective pressure after friction [bar]."""
    pressure = s.pressure + s.line
    if p.threshold > 0.0:
        blur = p.threshold * p.threshold_blur
        above = (pressure - p.threshold) / blur
        pressure = blur * (math.log1p(math.exp(-abs(above))) + max(above, 0.0))
    grip = sliders(s.stops, p.stiffness, p.breaks, pressure - s.drive)
    s.drive = pressure
    if p.map > 0.0:
        grip = remapped(p, grip)
    grip *= grip_factor(p, s, pressure)
    return pressure - (1.0 - p.strand) * grip


@jit
def braid_gain(p, strain):
    """Return the gain of the pressure's pull at a strain, 1 at rest."""
    geometry = (p.braid * (1.0 - strain) ** 2 - 1.0) / (p.braid - 1.0)
    return (1.0 - p.blend) * geometry + p.blend * math.exp(-p.dome * (strain / p.span) ** 2)


@jit
def elastic(p, strain):
    """Return the elastic force of bladder and braid over the force of 1 bar at rest."""
    ratio = strain / p.span
    stretch = 1.0 - strain
    rubber = p.rubber * (1.0 - math.exp(-p.bend * ratio))
    bulk = p.bulk * (1.0 / (stretch * stretch) - stretch)
    return rubber + bulk + p.grip * math.tanh(ratio / p.grip_span)


@jit
def wire(p, s, strain):
    """Return the part of the load that hangs on the muscle, 0 to 1."""
    if p.slack <= 0.0:
        return 1.0
    taut = (strain - s.hang - p.slack) / (p.slack * p.slack_blur)
    return 1.0 - math.exp(-(taut**1.5)) if taut > 0.0 else 0.0


@jit
def force(p, s, work, soft, strain):
    """Return the net force that shortens the muscle at rest [N].

    `work` is the effective pressure times its gain [bar], `soft` the factor of the elastic part.
    """
    own = strain - p.creep * s.level
    pull = p.force * (work * max(braid_gain(p, own), 0.0) - soft * elastic(p, own))
    if p.stop > 0.0 and strain > p.stop_at:
        pull -= p.stop * (1e3 * p.length * (strain - p.stop_at)) ** 1.5
    return pull - s.load * wire(p, s, strain)


@jit
def pressure_gain(p, s, heat, t):
    """Return the factor of the pressure's pull."""
    gain = math.exp(p.heat * (1.0 / 293.15 - 1.0 / (heat + 273.15)))
    if p.wander > 0.0:
        wave = 0.0
        for i in range(WAVES):
            wave += p.wave_size[i] * (
                math.sin(2 * math.pi * p.wave_hz[i] * t + p.wave_phase[i])
                - math.sin(p.wave_phase[i])
            )
        gain *= math.exp(p.wander * wave)
    return gain + p.buckle * s.buckled


@jit
def softness(p, s):
    """Return the factor of the elastic part."""
    soft = 1.0
    if p.load_soft > 0.0:
        more = 1.0 + p.load_soft * (s.load / 30.0) ** p.load_soft_power
        soft *= more if p.load_soft_sign > 0.0 else 1.0 / more
    if p.virgin > 0.0:
        soft *= 1.0 + p.virgin * virgin(p, s)
    return soft


@jit
def hanging_strain(p, load):
    """Return the strain at which the muscle rests at 0 bar under a load [N]."""
    low, high = -0.3, 0.1
    for _ in range(60):
        middle = 0.5 * (low + high)
        if p.force * elastic(p, middle) + load > 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high) if load > 0.0 else 0.0


@jit
def hang(p, s, declared):
    """Hang a declared load [N] with its errors.

    Scales show all loads wrong by a factor. A tray rests on a soft support, and a heavier load
    lifts more of it.
    """
    load = declared
    if p.tray > 0.0:
        load += p.tray * (1.0 - math.exp(-declared / p.tray_rest) + p.tray_scale * declared / 30.0)
    if load != s.load or s.tick == 0:
        s.load = load
        s.weight = load / GRAVITY
        s.hang = hanging_strain(p, load)
