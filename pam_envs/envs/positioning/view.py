"""The picture of a muscle that lifts a hanging load."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from pam_envs.envs.rendering.scene import (
    COLD,
    HOT,
    INK,
    MUTED,
    OUTPUT,
    PAPER,
    REFERENCE,
    STEEL,
    Color,
    Strip,
    View,
    blend,
    pressure_scale,
    pressure_strip,
)

if TYPE_CHECKING:
    from pam_envs.envs.rendering.renderer import Canvas

LOWEST_MM = -1.0
AXIS, TOP, NATURAL, RADIUS = 140.0, 76.0, 300.0, 21.0
"""Where the muscle hangs, and its length and radius at rest [pixels]."""
PER_METRE = 5400.0
"""Pixels for a metre of contraction: the stroke is drawn 1.8 times larger than the muscle."""
BULGE = 3.0
"""By how much the change of the radius is drawn larger than it is."""
THREADS = 12
LARGEST_LOAD = 5.0


def highest_mm(plant: Any) -> float:
    """Return the contraction [mm] up to which scales go: a little above the largest at rest."""
    reached = 1e3 * float(plant.contraction_at(plant.regulator.max_pressure, 0.0))
    return max(2.0, math.ceil(reached + 0.2))


def muscle_scene(canvas: Canvas, env: Any, info: Any) -> None:
    """Draw a muscle that lifts a hanging load, with ruler, reference marker and pressure scale."""
    plant, pressure = env.plant, info["state/pressure"]
    contraction = info["state/contraction"]
    bottom = TOP + NATURAL - contraction * PER_METRE
    full = plant.regulator.max_pressure
    canvas.rectangle((50, TOP - 30, 180, 12), STEEL, 3)
    for x in range(56, 230, 14):
        canvas.line([(x, TOP - 30), (x + 8, TOP - 39)], STEEL, 1.5)
    canvas.rectangle((AXIS - 9, TOP - 18, 18, 19), INK, 3)
    _braid(canvas, bottom, plant, contraction, blend(COLD, HOT, pressure / full))
    canvas.rectangle((AXIS - 9, bottom, 18, 14), INK, 3)
    _weight(canvas, bottom + 14, info["state/load"])
    _ruler(canvas, highest_mm(plant), contraction, info["reference"])
    pressure_scale(canvas, pressure, full)


def _braid(canvas: Canvas, bottom: float, plant: Any, contraction: float, tint: Color) -> None:
    """Draw the muscle's body: threads of constant length on a tube that bulges as it shortens."""
    braid_angle = plant.muscle.braid_angle
    cosine = (1.0 - contraction / plant.muscle.rest_length) * math.cos(braid_angle)
    widening = math.sqrt(max(0.0, 1.0 - cosine * cosine)) / math.sin(braid_angle)
    radius, end = RADIUS * (1.0 + BULGE * (widening - 1.0)), 13.0
    along = np.linspace(0.0, 1.0, 80)
    profile = end + (radius - end) * np.minimum(1.0, np.sin(np.pi * along) * 2.2) ** 0.7
    y = TOP + along * (bottom - TOP)
    left = list(zip(AXIS - profile, y, strict=True))
    right = list(zip(AXIS + profile, y, strict=True))
    canvas.polygon(left + right[::-1], tint)
    turns = NATURAL * math.tan(braid_angle) / (2 * math.pi * RADIUS)  # a thread keeps its turns
    thread = blend(tint, PAPER, 0.42)
    for k in range(THREADS):
        for way in (1.0, -1.0):
            angle = 2 * np.pi * (way * turns * along + k / THREADS)
            seen = np.cos(angle) > 0
            points = list(zip(AXIS + profile * np.sin(angle), y, strict=True))
            for i in range(len(points) - 1):
                if seen[i]:
                    canvas.line(points[i : i + 2], thread, 1.5)
    for side in (left, right):
        canvas.line(side, blend(tint, INK, 0.5), 1.5)


def _weight(canvas: Canvas, top: float, load: float) -> None:
    """Draw the load [kg] below ``top``; its width follows the cube root of its mass."""
    if load < 0.005:
        canvas.text("no load", (AXIS, TOP + NATURAL + 24), MUTED, 13, "center")
        return
    rod, side = top + 18, 12 + 44 * (load / LARGEST_LOAD) ** (1 / 3)
    canvas.line([(AXIS, top), (AXIS, rod)], INK, 3)
    waist, foot = 0.62 * side, rod + 1.15 * side
    corners = [(AXIS - waist, rod), (AXIS + waist, rod), (AXIS + side, foot), (AXIS - side, foot)]
    canvas.polygon(corners, blend(STEEL, INK, 0.55))
    if side > 40:
        canvas.text(f"{load:.2f} kg", (AXIS, rod + 0.47 * side), PAPER, 14, "center")
    else:
        canvas.text(f"{load:.2f} kg", (AXIS, foot + 6), INK, 14, "center")


def _ruler(canvas: Canvas, highest: float, contraction: float, reference: float) -> None:
    """Draw a ruler in mm beside the lower fitting, with output and reference [m] on it."""

    def level(metres: float) -> float:
        return TOP + NATURAL + 7 - metres * PER_METRE

    for mm in range(int(highest) + 1):
        y = level(1e-3 * mm)
        canvas.line([(50, y), (62 if mm % 5 == 0 else 57, y)], MUTED, 1)
        if mm % 5 == 0:
            canvas.text(f"{mm}", (44, y - 6), MUTED, 11, "right")
    canvas.line([(50, level(0.0)), (50, level(1e-3 * highest))], MUTED, 1)
    canvas.text("mm", (50, level(1e-3 * highest) - 22), MUTED, 11, "center")
    y = level(contraction)
    canvas.polygon([(66, y), (77, y - 6), (77, y + 6)], OUTPUT)
    y = level(reference)
    canvas.dashed((84, y), (208, y), REFERENCE)
    canvas.text("reference", (214, y - 8), REFERENCE, 12)


VIEWS = {
    "single_muscle": View(
        muscle_scene,
        (
            Strip(
                "contraction",
                "mm",
                1e3,
                (("reference", REFERENCE, 1.5), ("output", OUTPUT, 2.0)),
                350,
                116,
                lambda plant: (LOWEST_MM, highest_mm(plant)),
                lambda plant: range(0, int(highest_mm(plant)) + 1, 5),
            ),
            pressure_strip(498, 60),
        ),
    )
}
