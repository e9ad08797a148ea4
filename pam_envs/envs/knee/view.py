"""Views of the knee orthosis: leg, brace, muscle, torques, phase of the stride."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.rendering import scene as S

KNEE: S.Point = (172.0, 243.0)
"""Position of the knee's axis [pixels]."""
PER_METRE = 355.0
GROUND = 420.0
TORQUE_SPAN = 30.0
"""Torque [N m] at the end of a bar."""


def along(start: S.Point, angle: float, length: float) -> S.Point:
    """Return the end of a line of ``length`` [pixels], ``angle`` [rad] ahead of straight down."""
    return start[0] + length * math.sin(angle), start[1] + length * math.cos(angle)


def _brace(
    canvas: S.Canvas,
    env: Any,
    knee: S.Point,
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
        canvas.line(zigzag, S.STEEL, 3 * thick)
    tint = S.blend(S.COLD, S.HOT, info["state/pressure"] / full)
    width = thick * (5.0 + 16.0 * max(0.0, 1.0 - info["state/length"] / 0.27))
    S.limb(canvas, upper, lower, width, width, tint)
    for end in (upper, lower):
        canvas.disc(end, 4.0 * thick, S.INK)
    canvas.disc(knee, 6.0 * thick, S.INK)


def gait_scene(canvas: S.Canvas, env: Any, info: Any) -> None:
    """Draw the wearer's leg with the orthosis on it, torques and the phase of the stride."""
    leg, stance = env.plant.leg, info["state/stance"] > 0.5
    off = info["state/deviation"]
    shank = -info["state/shank"] - 0.5 * off
    thigh = shank + info["state/knee"] + off
    hip = along(KNEE, thigh + math.pi, leg.thigh * PER_METRE)
    ankle = along(KNEE, shank, leg.shank * PER_METRE)
    foot = -info["state/shank"] + 0.5 * math.pi + info["state/ankle"]
    heel, toe = along(ankle, foot - 2.4, 34.0), along(ankle, foot - 0.32, 76.0)
    canvas.line([(20, GROUND), (250, GROUND)], S.GRID, 2)
    S.limb(canvas, hip, KNEE, 36.0, 24.0, S.SKIN)
    S.limb(canvas, KNEE, ankle, 24.0, 14.0, S.SKIN)
    canvas.polygon([ankle, heel, toe], S.blend(S.SKIN, S.INK, 0.55 if stance else 0.25))
    path = along(KNEE, shank + off, leg.shank * PER_METRE)
    canvas.dashed(KNEE, path, S.REFERENCE)
    _brace(canvas, env, KNEE, 0.5 * (thigh + math.pi + shank), info)
    if info["state/ground_force"] > 1.0:
        _ground_force(canvas, ankle, info)
    S.pressure_scale(canvas, info["state/pressure"], env.plant.regulator.max_pressure)
    _phase(canvas, info["state/phase"], stance)
    reference = info["state/torque_reference"] if stance else 0.0
    bars = [
        ("demand", info["state/demand"], S.INK),
        ("reference", reference, S.REFERENCE),
        ("orthosis", info["state/torque"], S.OUTPUT),
    ]
    S.torque_bars(canvas, bars, TORQUE_SPAN, 512.0, "N m, extension to the right")


def _ground_force(canvas: S.Canvas, ankle: S.Point, info: Any) -> None:
    """Draw the ground's force at the centre of pressure."""
    foot = (ankle[0] + info["state/cop"] * PER_METRE, GROUND)
    tip = (
        foot[0] + 0.1 * info["state/ground_force_ahead"],
        foot[1] - 0.1 * info["state/ground_force"],
    )
    canvas.line([foot, tip], S.PRESSURE, 2.5)
    canvas.disc(foot, 3.0, S.PRESSURE)


def _phase(canvas: S.Canvas, phase: float, stance: bool) -> None:
    """Draw a ring with the phase of the stride, and whether it is stance or swing."""
    centre, radius = (280.0, 290.0), 20.0
    ring = [
        (centre[0] + radius * math.sin(a), centre[1] - radius * math.cos(a))
        for a in (2 * math.pi * k / 40 for k in range(41))
    ]
    canvas.line(ring, S.GRID, 3)
    canvas.line(ring[: 1 + round(40 * phase)], S.OUTPUT, 4)
    canvas.text(f"{100 * phase:.0f} %", (centre[0], centre[1] - 7), S.INK, 11, "center")
    word, color = ("stance", S.INK) if stance else ("swing", S.MUTED)
    canvas.text(word, (centre[0], centre[1] + 28), color, 13, "center")


def brace_scene(canvas: S.Canvas, env: Any, info: Any) -> None:
    """Draw the brace alone."""
    half, knee, middle = 0.5 * info["state/angle"], (60.0, 250.0), 0.5 * math.pi
    for way in (1.0, -1.0):
        canvas.line([knee, along(knee, middle + way * half, 200.0)], S.GRID, 26)
    _brace(canvas, env, knee, middle, info, per_metre=1000.0)
    S.pressure_scale(canvas, info["state/pressure"], env.plant.regulator.max_pressure)
    rows = [
        ("tension", f"{info['state/tension']:.1f} N"),
        ("stiffness", f"{1e-2 * info['state/stiffness']:.1f} N/cm"),
        ("angle", f"{math.degrees(info['state/angle']):.1f} deg"),
        ("length", f"{1e2 * info['state/length']:.2f} cm"),
    ]
    S.table(canvas, rows, 150, 480)


class BraceFeedforward:
    """Setpoint from the inverse of spring and lever, then of the hysteresis."""

    def __init__(self, env: Any) -> None:
        self.plant, self.signals = env.plant, env.signals
        self.action = env.action_signals[0]
        self.operator: Any = env.plant.hysteresis.scaled
        self.state: Any = None if self.operator is None else self.operator.initial_state((1,))

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        stiffness = self.signals.decode(observation, "reference")
        if self.signals["reference"].unit == "N":
            angle = self.signals.decode(observation, "angle")
            stiffness = self.plant.stiffness_for(stiffness, angle)
        pressure = np.atleast_1d(stiffness / self.plant.muscle.gain)
        if self.operator is None:
            pressure = pressure / self.plant.muscle.stiffness_ratio
        else:
            held, _ = self.operator.inverse_step(pressure, self.state)
            pressure = np.clip(held, 0.0, self.plant.regulator.max_pressure)
            _, self.state = self.operator.step(pressure, self.state)
        return np.asarray(self.action.encode(pressure), np.float32)


ANGLES = (("state/angle_reference", S.REFERENCE, 1.5), ("state/angle", S.OUTPUT, 2.0))
ANGLE = S.Strip("angle", "deg", 180.0 / math.pi, ANGLES, 440, 54, (80.0, 180.0), (80, 130, 180))
PRESSURE = S.pressure_strip(498, 60)
TENSION = S.Strip("tension", "N", 1.0, S.LINES, 350, 116, (0.0, 360.0), range(0, 361, 100))
STIFFNESS = S.Strip("stiffness", "N/cm", 1e-2, S.LINES, 350, 116, (0.0, 80.0), range(0, 81, 20))
GAIT = S.Strip("tension", "N", 1.0, S.LINES, 350, 60, (0.0, 400.0), range(0, 401, 200))
TENSION_VIEW = S.View(brace_scene, (TENSION, PRESSURE), BraceFeedforward)
STIFFNESS_VIEW = S.View(brace_scene, (STIFFNESS, PRESSURE), BraceFeedforward)
GAIT_VIEW = S.View(gait_scene, (GAIT, ANGLE, S.pressure_strip(524, 36)), BraceFeedforward)
