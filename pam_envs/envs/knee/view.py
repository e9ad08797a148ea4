"""The picture of the knee orthosis: leg, brace, muscle, torques, phase of the stride."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pam_envs.envs.rendering.scene import (
    COLD,
    GRID,
    HOT,
    INK,
    MUTED,
    OUTPUT,
    PRESSURE,
    REFERENCE,
    STEEL,
    Color,
    Point,
    Strip,
    View,
    blend,
    pressure_scale,
    pressure_strip,
)

if TYPE_CHECKING:
    from pam_envs.envs.rendering.renderer import Canvas

KNEE: Point = (160.0, 225.0)
"""Where the knee's axis stands [pixels]."""
PER_METRE = 400.0
GROUND = 430.0
SKIN = (232, 214, 198)
TORQUE_SPAN = 30.0
"""Torque [N m] at the end of a bar."""


def along(start: Point, angle: float, length: float) -> Point:
    """Return the end of a line of ``length`` [pixels], ``angle`` [rad] ahead of straight down."""
    return start[0] + length * math.sin(angle), start[1] + length * math.cos(angle)


def _limb(canvas: Canvas, a: Point, b: Point, thick: float, thin: float, color: Color) -> None:
    """Fill a limb that tapers from ``a`` to ``b``."""
    length = max(1e-9, math.dist(a, b))
    x, y = (a[1] - b[1]) / length, (b[0] - a[0]) / length
    corners = [(a[0] + thick * x, a[1] + thick * y), (b[0] + thin * x, b[1] + thin * y)]
    corners += [(b[0] - thin * x, b[1] - thin * y), (a[0] - thick * x, a[1] - thick * y)]
    canvas.polygon(corners, color)
    canvas.disc(a, thick, color)
    canvas.disc(b, thin, color)


def _brace(
    canvas: Canvas,
    env: Any,
    knee: Point,
    middle: float,
    info: Any,
    per_metre: float = PER_METRE,
) -> None:
    """Draw the two arms of the wire and the muscle that spans their ends.

    ``middle`` is the direction [rad] half-way between the arms, ahead of straight down.
    """
    lever, full = env.plant.lever, env.plant.regulator.max_pressure
    half = 0.5 * info["state/angle"]
    arm, thick = lever.arm * per_metre, per_metre / PER_METRE
    upper, lower = (along(knee, middle + way * half, arm) for way in (1.0, -1.0))
    for way in (1.0, -1.0):
        wire = [along(knee, middle + way * half, arm * k / 6) for k in range(7)]
        zigzag = [
            (x + 4.0 * thick * (k % 2 - 0.5) * (0 < k < 6), y) for k, (x, y) in enumerate(wire)
        ]
        canvas.line(zigzag, STEEL, 3 * thick)
    tint = blend(COLD, HOT, info["state/pressure"] / full)
    width = thick * (5.0 + 16.0 * max(0.0, 1.0 - info["state/length"] / 0.27))
    _limb(canvas, upper, lower, width, width, tint)
    for end in (upper, lower):
        canvas.disc(end, 4.0 * thick, INK)
    canvas.disc(knee, 6.0 * thick, INK)


def _bar(canvas: Canvas, row: int, name: str, torque: float, color: Color) -> None:
    """Draw a bar of a torque [N m], extension to the right."""
    top, zero, half = 512.0 + 20.0 * row, 190.0, 80.0
    end = zero + half * max(-1.0, min(1.0, torque / TORQUE_SPAN))
    canvas.text(name, (100, top - 1), MUTED, 11, "right")
    canvas.rectangle((zero - half, top, 2 * half, 12), GRID, 2)
    canvas.rectangle((min(zero, end), top, max(1.0, abs(end - zero)), 12), color, 2)
    canvas.line([(zero, top - 3), (zero, top + 15)], MUTED, 1)
    canvas.text(f"{torque:+.1f}", (314, top - 1), color, 11, "right")


def gait_scene(canvas: Canvas, env: Any, info: Any) -> None:
    """Draw the wearer's leg with the orthosis on it, torques and the phase of the stride."""
    leg, stance = env.plant.leg, info["state/stance"] > 0.5
    off = info["state/deviation"]
    shank = -info["state/shank"] - 0.5 * off
    thigh = shank + info["state/knee"] + off
    hip = along(KNEE, thigh + math.pi, leg.thigh * PER_METRE)
    ankle = along(KNEE, shank, leg.shank * PER_METRE)
    foot = -info["state/shank"] + 0.5 * math.pi + info["state/ankle"]
    heel, toe = along(ankle, foot - 2.4, 34.0), along(ankle, foot - 0.32, 76.0)
    canvas.line([(20, GROUND), (250, GROUND)], GRID, 2)
    _limb(canvas, hip, KNEE, 36.0, 24.0, SKIN)
    _limb(canvas, KNEE, ankle, 24.0, 14.0, SKIN)
    canvas.polygon([ankle, heel, toe], blend(SKIN, INK, 0.55 if stance else 0.25))
    path = along(KNEE, shank + off, leg.shank * PER_METRE)
    canvas.dashed(KNEE, path, REFERENCE)
    _brace(canvas, env, KNEE, 0.5 * (thigh + math.pi + shank), info)
    if info["state/ground_force"] > 1.0:
        _ground_force(canvas, ankle, info)
    pressure_scale(canvas, info["state/pressure"], env.plant.regulator.max_pressure)
    _phase(canvas, info["state/phase"], stance)
    _bar(canvas, 0, "knee asks for", info["state/demand"], INK)
    _bar(canvas, 1, "wanted", info["state/torque_reference"] if stance else 0.0, REFERENCE)
    _bar(canvas, 2, "delivered", info["state/torque"], OUTPUT)
    canvas.text("N m, extension to the right", (314, 574), MUTED, 11, "right")


def _ground_force(canvas: Canvas, ankle: Point, info: Any) -> None:
    """Draw the ground's force at the centre of pressure."""
    foot = (ankle[0] + info["state/cop"] * PER_METRE, GROUND)
    tip = (
        foot[0] + 0.1 * info["state/ground_force_ahead"],
        foot[1] - 0.1 * info["state/ground_force"],
    )
    canvas.line([foot, tip], PRESSURE, 2.5)
    canvas.disc(foot, 3.0, PRESSURE)


def _phase(canvas: Canvas, phase: float, stance: bool) -> None:
    """Draw a ring with the phase of the stride, and whether it is stance or swing."""
    centre, radius = (280.0, 290.0), 20.0
    ring = [
        (centre[0] + radius * math.sin(a), centre[1] - radius * math.cos(a))
        for a in (2 * math.pi * k / 40 for k in range(41))
    ]
    canvas.line(ring, GRID, 3)
    canvas.line(ring[: 1 + round(40 * phase)], OUTPUT, 4)
    canvas.text(f"{100 * phase:.0f} %", (centre[0], centre[1] - 7), INK, 11, "center")
    word, color = ("stance", INK) if stance else ("swing", MUTED)
    canvas.text(word, (centre[0], centre[1] + 28), color, 13, "center")


def brace_scene(canvas: Canvas, env: Any, info: Any) -> None:
    """Draw the brace alone."""
    half, knee, middle = 0.5 * info["state/angle"], (60.0, 250.0), 0.5 * math.pi
    for way in (1.0, -1.0):
        canvas.line([knee, along(knee, middle + way * half, 200.0)], GRID, 26)
    _brace(canvas, env, knee, middle, info, per_metre=1000.0)
    pressure_scale(canvas, info["state/pressure"], env.plant.regulator.max_pressure)
    for row, (name, value) in enumerate(
        (
            ("tension", f"{info['state/tension']:.1f} N"),
            ("stiffness", f"{1e-2 * info['state/stiffness']:.1f} N/cm"),
            ("angle", f"{math.degrees(info['state/angle']):.1f} deg"),
            ("length", f"{1e2 * info['state/length']:.2f} cm"),
        )
    ):
        canvas.text(name, (40, 480 + 22 * row), MUTED, 13)
        canvas.text(value, (150, 480 + 22 * row), INK, 13)


def _first(name: str, unit: str, scale: float, span: Point, step: int, height: int = 116) -> Strip:
    """Return the strip of output and reference."""
    return Strip(
        name,
        unit,
        scale,
        (("reference", REFERENCE, 1.5), ("output", OUTPUT, 2.0)),
        350,
        height,
        lambda _: span,
        lambda _: range(0, int(span[1]) + 1, step),
    )


ANGLE = Strip(
    "angle",
    "deg",
    180.0 / math.pi,
    (("state/angle_reference", REFERENCE, 1.5), ("state/angle", OUTPUT, 2.0)),
    446,
    56,
    lambda _: (80.0, 180.0),
    lambda _: (80, 130, 180),
)
VIEWS = {
    "knee_tension": View(
        brace_scene, (_first("tension", "N", 1.0, (0.0, 360.0), 100), pressure_strip(498, 60))
    ),
    "knee_stiffness": View(
        brace_scene, (_first("stiffness", "N/cm", 1e-2, (0.0, 80.0), 20), pressure_strip(498, 60))
    ),
    "knee_gait": View(
        gait_scene,
        (_first("tension", "N", 1.0, (0.0, 400.0), 200, 64), ANGLE, pressure_strip(534, 34)),
    ),
}
