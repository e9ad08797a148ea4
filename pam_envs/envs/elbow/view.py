"""The picture of the elbow orthosis: arm, bundles, object, and what the pressures can give."""

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
    Color,
    Point,
    Strip,
    Trace,
    View,
    blend,
    pressure_scale,
)
from pam_envs.tasks.torque_stiffness import WALL, WEIGHT

if TYPE_CHECKING:
    from pam_envs.envs.rendering.renderer import Canvas

ELBOW: Point = (92.0, 300.0)
"""Where the elbow stands [pixels]; the upper arm comes down to it."""
PER_METRE = 470.0
PULLEY = 30.0
SKIN = (232, 214, 198)
PULL_A, PULL_B = (170, 90, 160), (0, 140, 100)
"""Colours of what belongs to bundle a and to bundle b."""
TORQUE_SPAN = 12.0
"""Torque [N m] at the end of a bar."""


def bent(angle: float, length: float) -> Point:
    """Return the end of a line from the elbow, ``angle`` [rad] ahead of straight down."""
    return ELBOW[0] + length * math.sin(angle), ELBOW[1] + length * math.cos(angle)


def _limb(canvas: Canvas, a: Point, b: Point, thick: float, thin: float) -> None:
    """Fill a limb that tapers from ``a`` to ``b``."""
    length = max(1e-9, math.dist(a, b))
    x, y = (a[1] - b[1]) / length, (b[0] - a[0]) / length
    corners = [(a[0] + thick * x, a[1] + thick * y), (b[0] + thin * x, b[1] + thin * y)]
    corners += [(b[0] - thin * x, b[1] - thin * y), (a[0] - thick * x, a[1] - thick * y)]
    canvas.polygon(corners, SKIN)
    canvas.disc(a, thick, SKIN)
    canvas.disc(b, thin, SKIN)


def _bundle(canvas: Canvas, side: float, share: float, contracted: float, muscles: float) -> None:
    """Draw a bundle beside the upper arm, ``side`` 1 in front; it bulges as it contracts."""
    x, top = ELBOW[0] + side * PULLEY, 96.0
    end = top + 128.0 * (1.0 - 0.9 * contracted)
    wide = (4.0 + 1.3 * muscles) * (1.0 + 1.6 * contracted)
    left, right = [], []
    for k in range(17):
        bulge = wide * min(1.0, math.sin(math.pi * k / 16) * 2.0 + 0.25)
        y = top + (end - top) * k / 16
        left.append((x - bulge, y))
        right.append((x + bulge, y))
    tint = blend(COLD, HOT, share)
    canvas.line([(x, top - 10), (x, top)], STEEL, 5)
    canvas.line([(x, end), (x, ELBOW[1])], STEEL, 3)
    canvas.polygon(left + right[::-1], tint)
    for k in range(1, 15, 2):
        canvas.line([left[k], right[k + 2]], blend(tint, PAPER, 0.4), 1.2)
        canvas.line([right[k], left[k + 2]], blend(tint, PAPER, 0.4), 1.2)


def _object(canvas: Canvas, info: Any, hand: Point) -> None:
    """Draw the weight in the hand, or say what else there is to feel."""
    kind, torque = info["state/object"], info["state/object_torque"]
    words = "free motion"
    if kind == WEIGHT:
        canvas.line([hand, (hand[0], hand[1] + 26.0)], INK, 2)
        canvas.rectangle((hand[0] - 13.0, hand[1] + 26.0, 26.0, 22.0), REFERENCE, 4)
        words = "a weight in the hand"
    if kind == WALL:
        words = "in the wall" if torque < 0.0 else "before the wall"
    canvas.text(words, (20, 24), REFERENCE, 14)


def _bar(canvas: Canvas, row: int, name: str, torque: float, color: Color) -> None:
    """Draw a bar of a torque [N m], bending to the right."""
    top, zero, half = 492.0 + 20.0 * row, 196.0, 76.0
    end = zero + half * max(-1.0, min(1.0, torque / TORQUE_SPAN))
    canvas.text(name, (112, top - 1), MUTED, 11, "right")
    canvas.rectangle((zero - half, top, 2 * half, 12), GRID, 2)
    canvas.rectangle((min(zero, end), top, max(1.0, abs(end - zero)), 12), color, 2)
    canvas.line([(zero, top - 3), (zero, top + 15)], MUTED, 1)
    canvas.text(f"{torque:+.1f}", (314, top - 1), color, 11, "right")


def elbow_scene(canvas: Canvas, env: Any, info: Any) -> None:
    """Draw the arm with the orthosis on it, what is to be felt, and torques."""
    plant, angle = env.plant, info["state/angle"]
    length = plant.wearer.handle * PER_METRE
    hand = bent(angle, length)
    _limb(canvas, (ELBOW[0], 84.0), ELBOW, 23.0, 18.0)
    _limb(canvas, ELBOW, hand, 17.0, 11.0)
    canvas.dashed(ELBOW, bent(info["state/intent"], length + 22.0), MUTED)
    stroke, full = plant.pulley.stroke, plant.full_pressure
    bent_by = plant.pulley.radius * (angle - plant.pulley.lowest)
    for side, name, bundle, contraction in (
        (-1.0, "a", plant.bundle_a, stroke - bent_by),
        (1.0, "b", plant.bundle_b, bent_by),
    ):
        share = info[f"state/pressure_{name}"] / full
        _bundle(canvas, side, share, contraction / bundle.nominal_length, bundle.muscles)
    canvas.disc(ELBOW, PULLEY, STEEL)
    canvas.disc(ELBOW, PULLEY - 5.0, PAPER)
    canvas.line([ELBOW, bent(angle, 0.72 * length)], STEEL, 7)
    canvas.line([ELBOW, bent(angle, PULLEY - 5.0)], INK, 4)
    canvas.disc(ELBOW, 5.0, INK)
    canvas.disc(hand, 9.0, blend(SKIN, INK, 0.35))
    _object(canvas, info, hand)
    pressure_scale(canvas, info["state/pressure_b"], full)
    for x, name, color in ((46.0, "a", PULL_A), (138.0, "b", PULL_B)):
        canvas.text(f"bundle {name}", (x, 62), color, 11, "center")
    _bar(canvas, 0, "to be felt", info["state/object_torque"], REFERENCE)
    _bar(canvas, 1, "felt", info["state/felt"], INK)
    _bar(canvas, 2, "orthosis", info["state/torque"], OUTPUT)
    _bar(canvas, 3, "wearer", info["state/wearer"], MUTED)
    canvas.text("N m, bending to the right", (314, 574), MUTED, 11, "right")


def _reach(canvas: Canvas, env: Any, info: Any, points: Trace) -> None:
    """Draw torque and stiffness in what the pressures can give at this angle."""
    axes = Axes(canvas, PANEL, (-15.0, 30.0), (0.0, 15.0))
    axes.frame(range(-10, 31, 10), range(0, 16, 5), "torque [N m]", "stiffness [N m/rad]")
    torque, stiffness = env.plant.corners(info["state/angle"])
    corners = [axes.at(q, s) for q, s in zip(torque.tolist(), stiffness.tolist(), strict=True)]
    canvas.polygon(corners, blend(PAPER, OUTPUT, 0.12))
    canvas.line([*corners, corners[0]], blend(PAPER, OUTPUT, 0.5), 1.5)
    places = [axes.at(q, s) for q, s in points]
    for i in range(0, len(places) - 1, 12):
        shade = blend(GRID, OUTPUT, 0.15 + 0.85 * i / len(places))
        canvas.line(places[i : i + 13], shade, 2)
    asked = axes.at(info["reference"], info["state/stiffness_reference"])
    canvas.disc(asked, 6.0, REFERENCE)
    canvas.disc(asked, 3.5, PAPER)
    if places:
        canvas.disc(places[-1], 4.5, OUTPUT)


def _strip(
    name: str, unit: str, keys: tuple[str, str], colors: tuple[Color, Color], box: tuple[int, int],
    span: Point, step: int, scale: float = 1.0,
) -> Strip:  # fmt: skip
    return Strip(
        name,
        unit,
        scale,
        ((keys[0], colors[0], 1.5), (keys[1], colors[1], 2.0)),
        *box,
        lambda _: span,
        lambda _: range(int(span[0]), int(span[1]) + 1, step),
    )


BOTH = (REFERENCE, OUTPUT)
VIEWS = {
    "elbow_orthosis": View(
        elbow_scene,
        (
            _strip("torque", "N m", ("reference", "output"), BOTH, (350, 56), (-8.0, 8.0), 4),
            _strip(
                "stiffness",
                "N m/rad",
                ("state/stiffness_reference", "state/stiffness"),
                BOTH,
                (442, 46),
                (0.0, 12.0),
                4,
            ),
            _strip(
                "pressures, a and b",
                "bar",
                ("state/pressure_a", "state/pressure_b"),
                (PULL_A, PULL_B),
                (524, 40),
                (0.0, 6.0),
                3,
                1e-5,
            ),
        ),
        number=("felt", "N m", lambda info: info["state/felt"]),
        trace=lambda info: (info["state/torque"], info["state/stiffness"]),
        panel=_reach,
    ),
}
