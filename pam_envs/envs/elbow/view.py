"""View of the elbow orthosis: arm, bundles, object, reachable torque and stiffness."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.rendering import scene as S
from pam_envs.tasks.torque_stiffness import WALL, WEIGHT

ELBOW: S.Point = (92.0, 300.0)
"""Position of the elbow [pixels], at the lower end of the upper arm."""
PER_METRE = 470.0
PULLEY = 30.0
SCALE: S.Point = (262.0, 100.0)
"""Position of the colour scale of pressures [pixels]."""
PULL_A, PULL_B = (170, 90, 160), (0, 140, 100)
"""Colours of bundle a and of bundle b."""
TORQUE_SPAN = 12.0
"""Torque [N m] at the end of a bar."""


def bent(angle: float, length: float) -> S.Point:
    """Return the end of a line from the elbow, ``angle`` [rad] ahead of straight down."""
    return ELBOW[0] + length * math.sin(angle), ELBOW[1] + length * math.cos(angle)


def _bundle(canvas: S.Canvas, side: float, share: float, contracted: float, muscles: float) -> None:
    """Draw a bundle beside the upper arm, ``side`` 1 in front; it bulges as it contracts."""
    x, top = ELBOW[0] + side * PULLEY, 96.0
    end = top + 128.0 * (1.0 - 0.9 * contracted)
    wide = (4.0 + 1.3 * muscles) * (1.0 + 1.6 * contracted)
    bulge = [wide * min(1.0, math.sin(math.pi * k / 16) * 2.0 + 0.25) for k in range(17)]
    canvas.line([(x, top - 10), (x, top)], S.STEEL, 5)
    canvas.line([(x, end), (x, ELBOW[1])], S.STEEL, 3)
    S.muscle(canvas, (x, top), (x, end), bulge, S.blend(S.COLD, S.HOT, share), 2)


def _object(canvas: S.Canvas, info: Any, hand: S.Point) -> None:
    """Draw the weight in the hand, or name the object."""
    kind, torque = info["state/object"], info["state/object_torque"]
    words = "free motion"
    if kind == WEIGHT:
        canvas.line([hand, (hand[0], hand[1] + 26.0)], S.INK, 2)
        canvas.rectangle((hand[0] - 13.0, hand[1] + 26.0, 26.0, 22.0), S.REFERENCE, 4)
        words = "a weight in the hand"
    if kind == WALL:
        words = "in the wall" if torque < 0.0 else "before the wall"
    canvas.text(words, (20, 24), S.REFERENCE, 14)


def elbow_scene(canvas: S.Canvas, env: Any, info: Any) -> None:
    """Draw the arm with the orthosis, the virtual object and torques."""
    plant, angle = env.plant, info["state/angle"]
    length = plant.wearer.handle * PER_METRE
    hand = bent(angle, length)
    S.limb(canvas, (ELBOW[0], 84.0), ELBOW, 23.0, 18.0, S.SKIN)
    S.limb(canvas, ELBOW, hand, 17.0, 11.0, S.SKIN)
    canvas.dashed(ELBOW, bent(info["state/intent"], length + 22.0), S.MUTED)
    stroke, full = plant.pulley.stroke, plant.full_pressure
    bent_by = plant.pulley.radius * (angle - plant.pulley.lowest)
    for side, name, bundle, contraction in (
        (-1.0, "a", plant.bundle_a, stroke - bent_by),
        (1.0, "b", plant.bundle_b, bent_by),
    ):
        share = info[f"state/pressure_{name}"] / full
        _bundle(canvas, side, share, contraction / bundle.nominal_length, bundle.muscles)
    canvas.disc(ELBOW, PULLEY, S.STEEL)
    canvas.disc(ELBOW, PULLEY - 5.0, S.PAPER)
    canvas.line([ELBOW, bent(angle, 0.72 * length)], S.STEEL, 7)
    canvas.line([ELBOW, bent(angle, PULLEY - 5.0)], S.INK, 4)
    canvas.disc(ELBOW, 5.0, S.INK)
    canvas.disc(hand, 9.0, S.blend(S.SKIN, S.INK, 0.35))
    _object(canvas, info, hand)
    S.pressure_scale(canvas, info["state/pressure_a"], full, *SCALE, PULL_A)
    S.pressure_pointer(canvas, info["state/pressure_b"], full, *SCALE, PULL_B)
    for x, name, color in ((46.0, "a", PULL_A), (138.0, "b", PULL_B)):
        canvas.text(f"bundle {name}", (x, 62), color, 11, "center")
    bars = [
        ("object", info["state/object_torque"], S.REFERENCE),
        ("hand", info["state/felt"], S.INK),
        ("orthosis", info["state/torque"], S.OUTPUT),
        ("wearer", info["state/wearer"], S.MUTED),
    ]
    S.torque_bars(canvas, bars, TORQUE_SPAN, 492.0, "N m, flexion to the right")


def _reach(canvas: S.Canvas, env: Any, info: Any, points: S.Trace) -> None:
    """Draw torque and stiffness within the reach of the pressures at this angle."""
    axes = S.Axes(canvas, S.PANEL, (-15.0, 30.0), (0.0, 15.0))
    axes.frame(range(-10, 31, 10), range(0, 16, 5), "torque [N m]", "stiffness [N m/rad]")
    torque, stiffness = env.plant.corners(info["state/angle"])
    corners = [axes.at(q, s) for q, s in zip(torque.tolist(), stiffness.tolist(), strict=True)]
    canvas.polygon(corners, S.blend(S.PAPER, S.OUTPUT, 0.12))
    canvas.line([*corners, corners[0]], S.blend(S.PAPER, S.OUTPUT, 0.5), 1.5)
    desired = axes.at(info["reference"], info["state/stiffness_reference"])
    canvas.disc(desired, 6.0, S.REFERENCE)
    canvas.disc(desired, 3.5, S.PAPER)
    S.draw_loop(canvas, points, axes)


class ElbowAllocation:
    """Pressures that give torque and stiffness at the present angle, or pulses towards them."""

    pulse_gain = 2e-6
    """Width of a pulse over the pressure error [s/Pa]."""

    def __init__(self, env: Any) -> None:
        self.plant, self.signals, self.actions = env.plant, env.signals, env.action_signals

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        names = ("angle", "reference", "stiffness_reference")
        angle, torque, stiffness = (float(self.signals.decode(observation, n)) for n in names)
        values = [torque, stiffness]
        if self.actions[0].unit != "N m":
            pressures = self.plant.allocate(angle, torque, stiffness)
            values = [min(max(0.0, float(p)), self.plant.full_pressure) for p in pressures]
        if self.actions[0].unit == "s":
            present = [float(self.signals.decode(observation, f"pressure_{k}")) for k in "ab"]
            values = [self.pulse_gain * (p - q) for p, q in zip(values, present, strict=True)]
        encoded = [s.encode(v) for s, v in zip(self.actions, values, strict=True)]
        return np.asarray(encoded, np.float32)


STIFFNESS = (("state/stiffness_reference", S.REFERENCE, 1.5), ("state/stiffness", S.OUTPUT, 2.0))
PRESSURES = (("state/pressure_a", PULL_A, 1.5), ("state/pressure_b", PULL_B, 2.0))
VIEW = S.View(
    elbow_scene,
    (
        S.Strip("torque", "N m", 1.0, S.LINES, 350, 56, (-8.0, 8.0), range(-8, 9, 4)),
        S.Strip("stiffness", "N m/rad", 1.0, STIFFNESS, 442, 46, (0.0, 12.0), range(0, 13, 4)),
        S.pressure_strip(520, 40, "pressures, a and b", PRESSURES),
    ),
    ElbowAllocation,
    number=("torque at the hand", "N m", lambda info: info["state/felt"]),
    number_color=S.INK,
    trace=lambda info: (info["state/torque"], info["state/stiffness"]),
    panel=_reach,
)
