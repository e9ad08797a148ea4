"""Jitted: how load, slow memory and what else can move go on by one step."""

from __future__ import annotations

import math

from .kernel_muscle import force
from .kernel_tools import NUDGE, PRESSURE_SPAN, STEP, jit, uniform
from .records import MEMORIES


@jit
def outside(p, s, t):
    """Return forces from outside the rig's own physics [N]."""
    extra = 0.0
    if p.shake > 0.0:
        beat = 0.7 + 0.3 * math.sin(2 * math.pi * p.shake_beat * t)
        extra += p.shake * beat * math.sin(2 * math.pi * p.shake_hz * t)
    if p.bump > 0.0:
        cell = math.floor(t / p.bump_cell)
        since = t - cell * p.bump_cell - 0.8 * p.bump_cell * uniform(p.bump_seed, cell)
        if 0.0 < since < p.bump_length:
            side = 1.0 if uniform(p.bump_seed + 7.0, cell) > 0.5 else -1.0
            extra += side * p.bump * math.sin(math.pi * since / p.bump_length)
    if p.swing > 0.0:
        ratio = s.angle_rate / p.swing_omega
        extra += p.swing * s.load * (0.5 * s.angle * s.angle - ratio * ratio)
    return extra


@jit
def stuck(p, s, push):
    """Hold the guide until the push breaks it away."""
    if s.stuck == 1 and abs(push) <= p.breakaway:
        s.speed = 0.0
        return True
    s.stuck = 0
    return False


@jit
def move(p, s, work, soft, extra):
    """Move the load on by one step; speeds are strain rates [1/s]."""
    push = force(p, s, work, soft, s.strain) + extra
    stiff = (push - extra - force(p, s, work, soft, s.strain + NUDGE)) / NUDGE
    speed = s.speed
    if p.breakaway > 0.0:
        if stuck(p, s, push):
            return 0.0
        push -= p.kinetic * math.copysign(1.0, speed if speed != 0.0 else push)
    mass = p.length * (p.mass + s.weight)
    damping = p.length * p.damping
    loss = 0.0
    if p.loss > 0.0:
        flow = 1e3 * p.length * speed
        loss = p.loss * 1e3 * p.length * (flow * flow + 0.25) ** (0.5 * (p.loss_power - 1.0))
    lean = max(stiff, 0.0)
    gain = (push - (0.5 * STEP * lean + damping + loss) * speed) / (
        mass / STEP + 0.25 * STEP * lean + 0.5 * damping + loss
    )
    s.speed = speed + gain
    if p.breakaway > 0.0 and speed * s.speed < 0.0:
        s.speed = 0.0
        s.stuck = 1
    s.strain += 0.5 * STEP * (speed + s.speed)
    s.travel += 0.5 * STEP * abs(speed + s.speed)
    return (s.speed - speed) / STEP


@jit
def remember(p, s, work):
    """Move the slow memory on by one stride."""
    source = s.strain - p.creep * s.level if p.creep_strain > 0.5 else 0.16 * work / PRESSURE_SPAN
    level = 0.0
    for i in range(MEMORIES):
        s.memory[i] += p.creep_pace[i] * (source - s.memory[i])
        level += p.creep_share[i] * s.memory[i]
    s.level = level


@jit
def oscillate(p, s, acceleration):
    """Move the swinging load and the springy sensor target on by one step."""
    if p.swing > 0.0:
        omega = p.swing_omega
        turn = -omega * omega * math.sin(s.angle) - 0.03 * omega * s.angle_rate
        s.angle_rate += STEP * (turn + p.swing_drive * omega * s.rate)
        s.angle_rate = min(max(s.angle_rate, -0.5 * omega), 0.5 * omega)
        s.angle += STEP * s.angle_rate
    if p.target > 0.0:
        omega = p.target_omega
        turn = -omega * omega * s.target - 2.0 * p.target_zeta * omega * s.target_rate
        s.target_rate += STEP * (turn - p.length * acceleration)
        s.target += STEP * s.target_rate


@jit
def snap(p, s):
    """Let the bladder buckle at a high strain and straighten at a low one."""
    goal = 1.0 if s.strain > p.buckle_up else 0.0
    if p.buckle_down < s.strain <= p.buckle_up:
        goal = 1.0 if s.buckled > 0.5 else 0.0
    s.buckled += 6.0 * STEP * (goal - s.buckled)
