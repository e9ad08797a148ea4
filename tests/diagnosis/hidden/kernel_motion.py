"""Kernels of motion: one step of load, creep and other moving parts."""

import math

from .kernel_muscle import force
from .kernel_tools import NUDGE, PRESSURE_SPAN, STEP, jit, uniform
from .records import CREEP_ELEMENTS

PARTS = 2  # of a step where a guide rubs


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
def dragged(p, s, speed):
    """Return the drag of strands and holder over the speed [N per 1/s of strain]."""
    pace = 1e3 * p.length * speed
    drag = 0.0
    if p.loss > 0.0:
        turn = pace / p.loss_pace
        drag += p.loss * (math.asinh(turn) / turn if abs(turn) > 1e-3 else 1.0)
    if p.tray > 0.0:
        drag += p.tray * p.tray_rub / (abs(pace) + 1.0)
    return 1e3 * p.length * drag


@jit
def rub(p, s, push, lean, mass, damping):
    """Move a load on a guide whose bristles bend, slip and ease with speed (LuGre).

    The linear parts go as in `move`; the bristles are linear in the new speed.
    """
    h = STEP / PARTS
    spring = p.breakaway / p.bristle * 1e3 * p.length  # over the strain
    back = spring * p.oil / h
    ease = (1e3 * p.length / p.stribeck) ** 2
    bent, speed = s.bristle, s.speed
    slow = 0.5 * h * lean + damping
    inertia = mass / h + 0.25 * h * lean + 0.5 * damping
    for _ in range(PARTS):
        eased = 1.0 + ease * speed * speed
        grip = p.kinetic * eased + (p.breakaway - p.kinetic)  # the friction in slip, times eased
        keep = grip / (grip + h * spring * abs(speed) * eased)
        held = (spring + back) * keep
        free = push - (held - back) * bent
        after = speed + (free - (slow + h * held) * speed) / (inertia + h * held)
        moved = 0.5 * h * (speed + after)
        bent = keep * (bent + h * after)
        speed = after
        s.strain += moved
        s.travel += abs(moved)
        push -= lean * moved
    s.bristle, s.speed = bent, speed


@jit
def move(p, s, work, soft, extra):
    """Advance the load by one step; speeds are strain rates [1/s]."""
    push = force(p, s, work, soft, s.strain) + extra
    stiff = (push - extra - force(p, s, work, soft, s.strain + NUDGE)) / NUDGE
    speed = s.speed
    mass = p.length * (p.mass + s.weight)
    damping = p.length * p.damping
    loss = dragged(p, s, speed) if p.loss > 0.0 or p.tray > 0.0 else 0.0
    lean = max(stiff, 0.0)
    if p.breakaway > 0.0:
        rub(p, s, push, lean, mass, damping + loss)
        return (s.speed - speed) / STEP
    gain = (push - (0.5 * STEP * lean + damping + loss) * speed) / (
        mass / STEP + 0.25 * STEP * lean + 0.5 * damping + loss
    )
    s.speed = speed + gain
    s.strain += 0.5 * STEP * (speed + s.speed)
    s.travel += 0.5 * STEP * abs(speed + s.speed)
    return (s.speed - speed) / STEP


@jit
def creep_step(p, s, work):
    """Advance creep by one stride."""
    source = s.strain - p.creep * s.level if p.creep_strain > 0.5 else 0.16 * work / PRESSURE_SPAN
    level = 0.0
    for i in range(CREEP_ELEMENTS):
        s.crept[i] += p.creep_pace[i] * (source - s.crept[i])
        level += p.creep_share[i] * s.crept[i]
    s.level = level


@jit
def shake(p, s, acceleration):
    """Shake a bracket, and the foot that tilts on it with the sensor's target, by one step."""
    low, high = p.target_omega, p.target_foot
    foot = high * high * s.foot + 2.0 * p.target_zeta * high * s.foot_rate
    turn = -low * low * s.target - 2.0 * p.target_zeta * low * s.target_rate
    turn += p.target_share * foot - acceleration
    s.foot_rate -= STEP * (foot + turn + acceleration)
    s.target_rate += STEP * turn
    s.target += STEP * s.target_rate
    s.foot += STEP * s.foot_rate


@jit
def oscillate(p, s, acceleration):
    """Advance the swinging load and the sensor target on its spring by one step."""
    if p.swing > 0.0:
        omega = p.swing_omega
        turn = -omega * omega * math.sin(s.angle) - 0.03 * omega * s.angle_rate
        s.angle_rate += STEP * (turn + p.swing_drive * omega * s.rate)
        s.angle_rate = min(max(s.angle_rate, -0.5 * omega), 0.5 * omega)
        s.angle += STEP * s.angle_rate
    if p.target > 0.0:
        shake(p, s, p.length * acceleration)


@jit
def snap(p, s):
    """Let the bladder buckle at a high strain and straighten at a low one."""
    goal = 1.0 if s.strain > p.buckle_up else 0.0
    if p.buckle_down < s.strain <= p.buckle_up:
        goal = 1.0 if s.buckled > 0.5 else 0.0
    s.buckled += 6.0 * STEP * (goal - s.buckled)
