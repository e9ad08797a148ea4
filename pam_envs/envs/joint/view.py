"""The picture of an antagonistic joint: lever, both muscles, where it should be, what pushes it."""

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
    PANEL,
    PAPER,
    REFERENCE,
    STEEL,
    Axes,
    Point,
    Strip,
    Trace,
    View,
    blend,
    draw_loop,
    full_bar,
    pressure_scale,
)

if TYPE_CHECKING:
    from pam_envs.envs.rendering.renderer import Canvas

PIVOT: Point = (140.0, 196.0)
"""Where the joint's axis stands [pixels]."""
PER_METRE = 1350.0
ARM = 0.14
"""Length [m] of the arm that is drawn below the axis."""
TORQUE_PER_RADIAN = 2.5
"""Torque [N m] whose arrow spans a radian."""
PULL_A, PULL_B = (0, 114, 178), (170, 90, 160)
"""Colours of what belongs to muscle A and to muscle B."""


def turned(angle: float, across: float, along: float) -> Point:
    """Return a point [m] of the hanging arm, which leans right by ``angle`` [rad], in pixels."""
    sine, cosine = math.sin(angle), math.cos(angle)
    x, y = across * cosine + along * sine, along * cosine - across * sine
    return PIVOT[0] + PER_METRE * x, PIVOT[1] + PER_METRE * y


def _muscle(canvas: Canvas, lower: Point, upper: Point, share: float, shortened: float) -> None:
    """Draw a muscle between its fittings; it bulges as it shortens."""
    tint, steps = blend(COLD, HOT, share), 24
    length = max(1e-9, math.dist(lower, upper))
    across = ((lower[1] - upper[1]) / length, (upper[0] - lower[0]) / length)
    ends = 31.0  # pixels of each fitting
    radius = 8.0 + 34.0 * max(0.0, shortened)
    left, right = [], []
    for i in range(steps + 1):
        s = i / steps
        at = (ends + s * (length - 2 * ends)) / length
        x, y = (lower[k] + at * (upper[k] - lower[k]) for k in (0, 1))
        wide = 6.0 + (radius - 6.0) * min(1.0, math.sin(math.pi * s) * 2.2) ** 0.7
        left.append((x - wide * across[0], y - wide * across[1]))
        right.append((x + wide * across[0], y + wide * across[1]))
    canvas.line([lower, upper], STEEL, 5)
    canvas.polygon(left + right[::-1], tint)
    for i in range(2, steps - 1, 3):
        canvas.line([left[i], right[i + 2]], blend(tint, PAPER, 0.4), 1.2)
        canvas.line([right[i], left[i + 2]], blend(tint, PAPER, 0.4), 1.2)
    for side in (left, right):
        canvas.line(side, blend(tint, INK, 0.5), 1.5)


def _arc(canvas: Canvas, torque: float) -> None:
    """Draw the disturbance as an arrow around the end of the arm."""
    if abs(torque) < 1e-3:
        return
    span, radius = max(-1.2, min(1.2, torque / TORQUE_PER_RADIAN)), ARM + 0.042
    points = [turned(span * k / 20, 0.0, radius) for k in range(21)]
    canvas.line(points, HOT, 3)
    side = 0.011 if span > 0 else -0.011
    root = span - 2.0 * side / radius
    head = [turned(span, 0.0, radius)]
    head += [turned(root, 0.0, radius + way * abs(side)) for way in (1.0, -1.0)]
    canvas.polygon(head, HOT)
    canvas.text(f"{torque:+.1f} N m", (PIVOT[0], 458), HOT, 12, "center")


def _scale(canvas: Canvas, largest: float) -> None:
    """Draw a scale of degrees below the arm."""
    radius, end = ARM + 0.012, math.degrees(largest)
    canvas.line([turned(math.radians(end * k / 20), 0.0, radius) for k in range(-20, 21)], GRID, 2)
    for degrees in range(-10 * int(end // 10), int(end) + 1, 10):
        angle = math.radians(degrees)
        ends = [turned(angle, 0.0, radius), turned(angle, 0.0, radius + 0.008)]
        canvas.line(ends, MUTED, 1)
        x, y = turned(angle, 0.0, radius + 0.019)
        canvas.text(f"{degrees}", (x, y - 7), MUTED, 10, "center")


def joint_scene(canvas: Canvas, env: Any, info: Any) -> None:
    """Draw the joint with its muscles, the wanted angle, the disturbance and the payload."""
    plant, angle = env.plant, info["state/angle"]
    lever, full = plant.lever, plant.regulator.max_pressure
    pressure_scale(canvas, info["state/pressure_a"], full, 282.0, 290.0)
    _scale(canvas, plant.angle_range[1])
    canvas.dashed(PIVOT, turned(info["reference"], 0.0, ARM + 0.004), REFERENCE)
    base = lever.l_u
    for side, letter in ((1.0, "a"), (-1.0, "b")):
        fixed = (PIVOT[0] + side * PER_METRE * lever.r_u, PIVOT[1] - PER_METRE * base)
        moved = turned(angle, side * lever.r_o, lever.l_o)
        length = math.dist(fixed, moved) / PER_METRE - lever.fittings
        share = info[f"state/pressure_{letter}"] / full
        _muscle(canvas, fixed, moved, share, 1.0 - length / plant.muscle.rest_length)
    ceiling, wide = PIVOT[1] - PER_METRE * base, lever.r_o * PER_METRE
    canvas.rectangle((PIVOT[0] - wide - 22, ceiling - 10, 2 * wide + 44, 10), STEEL, 3)
    canvas.line([PIVOT, (PIVOT[0], ceiling)], INK, 9)
    plate = [turned(angle, way * (lever.r_o + 0.012), lever.l_o) for way in (1, -1)]
    canvas.line([PIVOT, turned(angle, 0.0, ARM)], INK, 7)
    canvas.line(plate, INK, 7)
    canvas.disc(PIVOT, 8.0, PAPER)
    canvas.disc(PIVOT, 5.0, INK)
    _payload(canvas, turned(angle, 0.0, ARM), info["state/payload"])
    _arc(canvas, info["state/disturbance"])
    _numbers(canvas, info)


def _payload(canvas: Canvas, at: Point, mass: float) -> None:
    """Draw the payload [kg] at the end of the arm."""
    canvas.disc(at, 6.0 + 9.0 * max(0.0, mass) ** (1 / 3), blend(STEEL, INK, 0.55))
    if mass > 0.005:
        canvas.text(f"{mass:.2f} kg", (at[0] - 20, at[1] - 6), MUTED, 11, "right")


def _numbers(canvas: Canvas, info: Any) -> None:
    """Write the muscles' pressures and forces, and what they make of them."""
    for column, name, color in ((96, "muscle B", PULL_B), (176, "muscle A", PULL_A)):
        letter = name[-1].lower()
        values = (
            f"{1e-5 * info[f'state/pressure_{letter}']:.2f} bar",
            f"{info[f'state/force_{letter}']:.0f} N",
        )
        canvas.text(name, (column, 484), color, 12)
        for row, value in enumerate(values):
            canvas.text(value, (column, 504 + 20 * row), INK, 13)
    for row, words in enumerate(("pressure", "force")):
        canvas.text(words, (24, 504 + 20 * row), MUTED, 13)
    canvas.text("stiffness", (24, 548), MUTED, 13)
    canvas.text(f"{info['state/stiffness']:.1f} N m/rad", (96, 548), INK, 13)
    if info["state/slack"] > 0.0:
        canvas.text("a muscle is slack", (24, 570), HOT, 13)


def both_pressures(info: Any) -> float:
    """Return pressure of A minus that of B [bar]."""
    return float(1e-5 * (info["state/pressure_a"] - info["state/pressure_b"]))


def _difference_loop(canvas: Canvas, env: Any, _: Any, points: Trace) -> None:
    """Draw the angle over the difference of the pressures."""
    first, full = ANGLE, full_bar(env.plant)
    axes = Axes(canvas, PANEL, (-full, full), first.span(env.plant))
    across = tuple(first.ticks(env.plant))
    axes.frame(
        range(-int(full), int(full) + 1, max(1, round(full / 4))),
        across,
        "pressure of A minus B [bar]",
        f"{first.name} [{first.unit}]",
    )
    draw_loop(canvas, points, axes, first.scale)


def _degrees(plant: Any) -> Point:
    end = math.degrees(plant.angle_range[1]) + 3.0
    return -end, end


def angle_ticks(plant: Any) -> range:
    """Return the tens of degrees within the joint's range."""
    end = int(math.degrees(plant.angle_range[1]) + 1e-6) // 10 * 10
    return range(-end, end + 1, 10)


ANGLE = Strip(
    "angle",
    "deg",
    180.0 / math.pi,
    (("reference", REFERENCE, 1.5), ("output", OUTPUT, 2.0)),
    350,
    116,
    _degrees,
    angle_ticks,
)
PRESSURES = Strip(
    "pressures",
    "bar",
    1e-5,
    (("state/pressure_b", PULL_B, 1.5), ("state/pressure_a", PULL_A, 2.0)),
    498,
    60,
    lambda plant: (0.0, full_bar(plant)),
    lambda plant: (0.0, 0.5 * full_bar(plant), full_bar(plant)),
)
VIEWS = {
    "antagonistic_joint": View(
        joint_scene,
        (ANGLE, PRESSURES),
        number=("pressures, A - B", "bar", both_pressures),
        trace=lambda info: (both_pressures(info), info["output"]),
        panel=_difference_loop,
    )
}
