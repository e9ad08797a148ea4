"""View of a muscle that lifts a hanging load."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.rendering import scene as S

LOWEST_MM = -1.0
AXIS, TOP, NATURAL, RADIUS = 140.0, 76.0, 300.0, 21.0
"""Position of the muscle, and its length and radius at rest [pixels]."""
PER_METRE = 5400.0
"""Pixels per metre of contraction: the stroke is drawn 1.8 times larger than the muscle."""
BULGE = 3.0
"""Magnification of the change of the radius."""
THREADS = 12
LARGEST_LOAD = 5.0


def highest_mm(plant: Any) -> float:
    """Return the contraction [mm] at the top of scales: a little above the largest at rest."""
    reached = 1e3 * float(plant.contraction_at(plant.regulator.max_pressure, 0.0))
    return max(2.0, math.ceil(reached + 0.2))


def muscle_scene(canvas: S.Canvas, env: Any, info: Any) -> None:
    """Draw a muscle that lifts a hanging load, with ruler, reference marker and pressure scale."""
    plant, pressure = env.plant, info["state/pressure"]
    contraction = info["state/contraction"]
    bottom = TOP + NATURAL - contraction * PER_METRE
    full = plant.regulator.max_pressure
    canvas.rectangle((50, TOP - 30, 180, 12), S.STEEL, 3)
    for x in range(56, 230, 14):
        canvas.line([(x, TOP - 30), (x + 8, TOP - 39)], S.STEEL, 1.5)
    canvas.rectangle((AXIS - 9, TOP - 18, 18, 19), S.INK, 3)
    _braid(canvas, bottom, plant, contraction, S.blend(S.COLD, S.HOT, pressure / full))
    canvas.rectangle((AXIS - 9, bottom, 18, 14), S.INK, 3)
    _weight(canvas, bottom + 14, info["state/load"])
    _ruler(canvas, highest_mm(plant), contraction, info["reference"])
    S.pressure_scale(canvas, pressure, full)


def _braid(canvas: S.Canvas, bottom: float, plant: Any, contraction: float, tint: S.Color) -> None:
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
    thread = S.blend(tint, S.PAPER, 0.42)
    for k in range(THREADS):
        for direction in (1.0, -1.0):
            angle = 2 * np.pi * (direction * turns * along + k / THREADS)
            seen = np.cos(angle) > 0
            points = list(zip(AXIS + profile * np.sin(angle), y, strict=True))
            for i in range(len(points) - 1):
                if seen[i]:
                    canvas.line(points[i : i + 2], thread, 1.5)
    for side in (left, right):
        canvas.line(side, S.blend(tint, S.INK, 0.5), 1.5)


def _weight(canvas: S.Canvas, top: float, load: float) -> None:
    """Draw the load [kg] below ``top``; its width follows the cube root of its mass."""
    if load < 0.005:
        canvas.text("no load", (AXIS, TOP + NATURAL + 24), S.MUTED, 13, "center")
        return
    rod, side = top + 18, 12 + 44 * (load / LARGEST_LOAD) ** (1 / 3)
    canvas.line([(AXIS, top), (AXIS, rod)], S.INK, 3)
    waist, foot = 0.62 * side, rod + 1.15 * side
    corners = [(AXIS - waist, rod), (AXIS + waist, rod), (AXIS + side, foot), (AXIS - side, foot)]
    canvas.polygon(corners, S.blend(S.STEEL, S.INK, 0.55))
    if side > 40:
        canvas.text(f"{load:.2f} kg", (AXIS, rod + 0.47 * side), S.PAPER, 14, "center")
    else:
        canvas.text(f"{load:.2f} kg", (AXIS, foot + 6), S.INK, 14, "center")


def _ruler(canvas: S.Canvas, highest: float, contraction: float, reference: float) -> None:
    """Draw a ruler in mm beside the lower fitting, with output and reference [m] on it."""

    def level(metres: float) -> float:
        return TOP + NATURAL + 7 - metres * PER_METRE

    for mm in range(int(highest) + 1):
        y = level(1e-3 * mm)
        canvas.line([(50, y), (62 if mm % 5 == 0 else 57, y)], S.MUTED, 1)
        if mm % 5 == 0:
            canvas.text(f"{mm}", (44, y - 6), S.MUTED, 11, "right")
    canvas.line([(50, level(0.0)), (50, level(1e-3 * highest))], S.MUTED, 1)
    canvas.text("mm", (50, level(1e-3 * highest) - 22), S.MUTED, 11, "center")
    y = level(contraction)
    canvas.polygon([(66, y), (77, y - 6), (77, y + 6)], S.OUTPUT)
    y = level(reference)
    canvas.dashed((84, y), (208, y), S.REFERENCE)
    canvas.text("reference", (214, y - 8), S.REFERENCE, 12)


class InverseFeedforward:
    """Setpoint from the exact inverse of static law and hysteresis."""

    def __init__(self, env: Any) -> None:
        self.plant, self.signals = env.plant, env.signals
        self.action = env.action_signals[0]
        self.inverse: Any = None
        self.state: Any = None

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        load = float(self.signals.decode(observation, "load"))
        if self.inverse is None:
            self.inverse = self.plant.hysteresis_inverse(load)
            self.state = self.inverse.initial_state((1,))
        reference = self.signals.decode(observation, "reference")
        drive = np.atleast_1d(self.plant.drive_for(reference, load))
        pressure, self.state = self.inverse.pressure(drive, self.state)
        return np.asarray(self.action.encode(pressure), np.float32)


STRIP = S.Strip(
    "contraction",
    "mm",
    1e3,
    S.LINES,
    350,
    116,
    lambda plant: (LOWEST_MM, highest_mm(plant)),
    lambda plant: range(0, int(highest_mm(plant)) + 1, 5),
)
VIEW = S.View(muscle_scene, (STRIP, S.pressure_strip(498, 60)), InverseFeedforward)
