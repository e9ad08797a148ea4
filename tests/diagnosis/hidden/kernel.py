"""Integrator of the rig: linearly implicit midpoint rule with steps of 1 ms."""

import numpy as np

from .kernel_air import fill
from .kernel_motion import creep_step, move, oscillate, outside, snap
from .kernel_muscle import effective, hang, pressure_gain, sliders, softness
from .kernel_sensing import listen, position_mm, read
from .kernel_tools import CREEP_STRIDE, STEP, jit


@jit
def step(p, s, command, shut, heat):
    """Advance the rig by one step under a command [bar] at a temperature [deg C]."""
    t = STEP * s.tick
    fill(p, s, command, shut, t)
    work = effective(p, s)
    extra = outside(p, s, t)
    if p.strand > 0.0:
        extra -= p.strand * p.force * s.strand_grip
    before = s.strain
    acceleration = move(p, s, work * pressure_gain(p, s, heat, t), softness(p, s), extra)
    if p.strand > 0.0:
        shift = s.strain - before
        s.strand_grip = sliders(s.strands, p.strand_stiffness, p.strand_breaks, shift)
    if p.creep != 0.0 and s.tick % CREEP_STRIDE == 0:
        creep_step(p, s, work)
    oscillate(p, s, acceleration)
    if p.buckle > 0.0:
        snap(p, s)
    s.tick += 1
    if p.late > 0.0:
        listen(p, s)


@jit
def start(p, s, load):
    """Put the rig to rest under its first load at 0 bar."""
    hang(p, s, load)
    s.strain = s.hang
    s.rest = s.hang
    s.supply = p.supply
    s.held = 0.0


@jit
def advance(p, s, command, shut, heat, steps):
    """Hold a command for some steps."""
    for _ in range(steps):
        step(p, s, command, shut, heat)


@jit
def run(parameters, state, command, load, heat, shut, steps):
    """Run a campaign of (n,) commands [bar], loads [N] and temperatures [deg C].

    Return the readings of contraction [mm] and pressure [bar] and the true contraction [mm], shape
    (n, 3), each before the command of its row acts.
    """
    p, s = parameters[0], state[0]
    rows = np.empty((command.size, 3))
    start(p, s, load[0])
    for k in range(command.size):
        hang(p, s, load[k])
        rows[k, 0], rows[k, 1] = read(p, s)
        rows[k, 2] = position_mm(p, s)
        advance(p, s, command[k], shut[k], heat[k], steps)
    return rows


@jit
def one_period(parameters, state, command, heat, steps):
    """Hold a command for one period and return the row that follows it."""
    p, s = parameters[0], state[0]
    advance(p, s, command, False, heat, steps)
    place, pressure = read(p, s)
    return place, pressure, position_mm(p, s)


@jit
def begin(parameters, state, load):
    """Put a stepped rig to rest under its load."""
    start(parameters[0], state[0], load)
