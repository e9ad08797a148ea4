"""View of an antagonistic joint: lever, both muscles, reference, disturbance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.rendering import scene as S

PIVOT: S.Point = (140.0, 196.0)
"""Position of the joint's axis [pixels]."""
SCALE: S.Point = (282.0, 290.0)
"""Position of the colour scale of pressures [pixels]."""
PER_METRE = 1350.0
ARM = 0.14
"""Length [m] of the arm that is drawn below the axis."""
TORQUE_PER_RADIAN = 2.5
"""Torque [N m] whose arrow spans a radian."""
PULL_A, PULL_B = (0, 114, 178), (170, 90, 160)
"""Colours of muscle A and of muscle B."""


def turned(angle: float, across: float, along: float) -> S.Point:
    """Return a point [m] of the hanging arm, which leans right by ``angle`` [rad], in pixels."""
    sine, cosine = math.sin(angle), math.cos(angle)
    x, y = across * cosine + along * sine, along * cosine - across * sine
    return PIVOT[0] + PER_METRE * x, PIVOT[1] + PER_METRE * y


def _muscle(
    canvas: S.Canvas, lower: S.Point, upper: S.Point, share: float, shortened: float
) -> None:
    """Draw a muscle between its fittings of 31 pixels; it bulges as it shortens."""
    tint, grown = S.blend(S.COLD, S.HOT, share), 2.0 + 34.0 * max(0.0, shortened)
    end = 31.0 / max(1e-9, math.dist(lower, upper))
    a, b = (
        (lower[0] + at * (upper[0] - lower[0]), lower[1] + at * (upper[1] - lower[1]))
        for at in (end, 1.0 - end)
    )
    shape = [min(1.0, math.sin(math.pi * i / 24) * 2.2) ** 0.7 for i in range(25)]
    canvas.line([lower, upper], S.STEEL, 5)
    for side in S.muscle(canvas, a, b, [6.0 + grown * part for part in shape], tint, 3):
        canvas.line(side, S.blend(tint, S.INK, 0.5), 1.5)


def _arc(canvas: S.Canvas, torque: float) -> None:
    """Draw the disturbance as an arrow around the end of the arm."""
    if abs(torque) < 1e-3:
        return
    span, radius = max(-1.2, min(1.2, torque / TORQUE_PER_RADIAN)), ARM + 0.042
    points = [turned(span * k / 20, 0.0, radius) for k in range(21)]
    canvas.line(points, S.HOT, 3)
    side = 0.011 if span > 0 else -0.011
    root = span - 2.0 * side / radius
    head = [turned(span, 0.0, radius)]
    head += [turned(root, 0.0, radius + way * abs(side)) for way in (1.0, -1.0)]
    canvas.polygon(head, S.HOT)
    canvas.text(f"{S.signed(torque, 1)} N m", (PIVOT[0], 458), S.HOT, 12, "center")


def _scale(canvas: S.Canvas, largest: float) -> None:
    """Draw a scale of degrees below the arm."""
    radius, end = ARM + 0.012, math.degrees(largest)
    canvas.line(
        [turned(math.radians(end * k / 20), 0.0, radius) for k in range(-20, 21)], S.GRID, 2
    )
    for degrees in range(-10 * int(end // 10), int(end) + 1, 10):
        angle = math.radians(degrees)
        ends = [turned(angle, 0.0, radius), turned(angle, 0.0, radius + 0.008)]
        canvas.line(ends, S.MUTED, 1)
        x, y = turned(angle, 0.0, radius + 0.019)
        canvas.text(f"{degrees}", (x, y - 7), S.MUTED, 10, "center")


def joint_scene(canvas: S.Canvas, env: Any, info: Any) -> None:
    """Draw the joint with its muscles, the reference, the disturbance and the payload."""
    plant, angle = env.plant, info["state/angle"]
    lever, full = plant.lever, plant.regulator.max_pressure
    S.pressure_scale(canvas, info["state/pressure_a"], full, *SCALE, PULL_A)
    S.pressure_pointer(canvas, info["state/pressure_b"], full, *SCALE, PULL_B)
    _scale(canvas, plant.angle_range[1])
    canvas.dashed(PIVOT, turned(info["reference"], 0.0, ARM + 0.004), S.REFERENCE)
    base = lever.l_u
    for side, letter in ((1.0, "a"), (-1.0, "b")):
        fixed = (PIVOT[0] + side * PER_METRE * lever.r_u, PIVOT[1] - PER_METRE * base)
        moved = turned(angle, side * lever.r_o, lever.l_o)
        length = math.dist(fixed, moved) / PER_METRE - lever.fittings
        share = info[f"state/pressure_{letter}"] / full
        _muscle(canvas, fixed, moved, share, 1.0 - length / plant.muscle.rest_length)
    ceiling, wide = PIVOT[1] - PER_METRE * base, lever.r_o * PER_METRE
    canvas.rectangle((PIVOT[0] - wide - 22, ceiling - 10, 2 * wide + 44, 10), S.STEEL, 3)
    canvas.line([PIVOT, (PIVOT[0], ceiling)], S.INK, 9)
    plate = [turned(angle, way * (lever.r_o + 0.012), lever.l_o) for way in (1, -1)]
    canvas.line([PIVOT, turned(angle, 0.0, ARM)], S.INK, 7)
    canvas.line(plate, S.INK, 7)
    canvas.disc(PIVOT, 8.0, S.PAPER)
    canvas.disc(PIVOT, 5.0, S.INK)
    _payload(canvas, turned(angle, 0.0, ARM), info["state/payload"])
    _arc(canvas, info["state/disturbance"])
    _numbers(canvas, info)


def _payload(canvas: S.Canvas, at: S.Point, mass: float) -> None:
    """Draw the payload [kg] at the end of the arm."""
    canvas.disc(at, 6.0 + 9.0 * max(0.0, mass) ** (1 / 3), S.blend(S.STEEL, S.INK, 0.55))
    if mass > 0.005:
        canvas.text(f"{mass:.2f} kg", (at[0] - 20, at[1] - 6), S.MUTED, 11, "right")


def _numbers(canvas: S.Canvas, info: Any) -> None:
    """Write pressures and forces of the muscles, and the stiffness of the joint."""
    for column, name, color in ((96, "muscle B", PULL_B), (176, "muscle A", PULL_A)):
        letter = name[-1].lower()
        values = (
            f"{1e-5 * info[f'state/pressure_{letter}']:.2f} bar",
            f"{info[f'state/force_{letter}']:.0f} N",
        )
        canvas.text(name, (column, 484), color, 12)
        for row, value in enumerate(values):
            canvas.text(value, (column, 504 + 20 * row), S.INK, 13)
    for row, words in enumerate(("pressure", "force")):
        canvas.text(words, (24, 504 + 20 * row), S.MUTED, 13)
    canvas.text("stiffness", (24, 548), S.MUTED, 13)
    canvas.text(f"{info['state/stiffness']:.1f} N m/rad", (96, 548), S.INK, 13)
    if info["state/slack"] > 0.0:
        canvas.text("a muscle is slack", (24, 570), S.HOT, 13)


def both_pressures(info: Any) -> float:
    """Return pressure of A minus that of B [bar]."""
    return float(1e-5 * (info["state/pressure_a"] - info["state/pressure_b"]))


def _degrees(plant: Any) -> S.Point:
    end = math.degrees(plant.angle_range[1]) + 3.0
    return -end, end


def angle_ticks(plant: Any) -> range:
    """Return the tens of degrees within the joint's range."""
    end = int(math.degrees(plant.angle_range[1]) + 1e-6) // 10 * 10
    return range(-end, end + 1, 10)


class JointIntegral:
    """Angle setpoints: reference, shift by the declared weight, integral of small errors."""

    gain = 0.03
    """Integral gain per control period."""
    band = math.radians(4.0)
    """Error [rad] above which the integral is held, so that it does not wind up at steps."""

    def __init__(self, env: Any) -> None:
        self.plant, self.signals, self.actions = env.plant, env.signals, env.action_signals
        names = [signal.name for signal in self.actions if signal.unit == "rad"]
        self.angles = [name.replace("angle_set_point", "angle") for name in names]
        word = "joint_reference" if "reference" not in set(env.signals.names()) else "reference"
        self.references = [name.replace("angle_set_point", word) for name in names]
        self.integral = np.zeros(len(names))

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the action for an observation."""
        read = self.signals.decode
        references = np.array([float(read(observation, name)) for name in self.references])
        angles = np.array([float(read(observation, name)) for name in self.angles])
        errors = references - angles
        self.integral = self.integral + np.where(np.abs(errors) < self.band, self.gain * errors, 0)
        shift = self.plant.gravity_shift(references, float(read(observation, "payload")))
        values = references + shift + self.integral
        encoded = [s.encode(v) for s, v in zip(self.actions, values, strict=True)]
        return np.asarray(encoded, np.float32)


def _difference_loop(canvas: S.Canvas, env: Any, _: Any, points: S.Trace) -> None:
    S.pressure_loop(canvas, env.plant, ANGLE, points, both=True)


ANGLE = S.Strip("angle", "deg", 180.0 / math.pi, S.LINES, 350, 116, _degrees, angle_ticks)
MUSCLES = (("state/pressure_b", PULL_B, 1.5), ("state/pressure_a", PULL_A, 2.0))
PRESSURES = S.pressure_strip(498, 60, "pressures", MUSCLES)
VIEW = S.View(
    joint_scene,
    (ANGLE, PRESSURES),
    JointIntegral,
    number=("pressures, A - B", "bar", both_pressures),
    number_color=S.INK,
    trace=lambda info: (both_pressures(info), info["output"]),
    panel=_difference_loop,
)
