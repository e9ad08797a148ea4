"""Elements of scenes: colours, plots with axes, limbs, scales, and the declaration of a view.

A view draws the plant in the left 320 pixels; the frame around it is common.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pam_envs.envs.rendering.renderer import Canvas as Canvas  # noqa: PLC0414 (for views)

Color = tuple[int, int, int]
Box = tuple[int, int, int, int]
Point = tuple[float, float]

PAPER, INK, MUTED, GRID = (250, 250, 248), (38, 42, 48), (112, 118, 126), (226, 228, 230)
OUTPUT, REFERENCE, PRESSURE = (0, 114, 178), (213, 94, 0), (0, 140, 100)
STEEL, COLD, HOT, SKIN = (150, 156, 164), (88, 96, 108), (222, 92, 58), (232, 214, 198)
LINES = (("reference", REFERENCE, 1.5), ("output", OUTPUT, 2.0))
"""Lines of the strip of output and reference."""


def signed(value: float, digits: int) -> str:
    """Return a number with its sign; one that rounds to zero has none."""
    text = f"{value:+.{digits}f}"
    return text if float(text) else text[1:]


def round_ticks(low: float, high: float) -> list[float]:
    """Return up to eight round numbers from ``low`` to ``high``."""
    least = (high - low) / 7.0
    power = 10.0 ** math.floor(math.log10(least))
    step = next(n * power for n in (1.0, 2.0, 5.0, 10.0) if n * power >= least)
    return [round(k * step, 6) for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def blend(a: Color, b: Color, share: float) -> Color:
    """Return the mixture of two colours with ``share`` of ``b``."""
    s = min(1.0, max(0.0, share))
    red, green, blue = (round(x + s * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue


@dataclass(frozen=True)
class Strip:
    """Plot of the last seconds, at a height in the picture [pixels]."""

    name: str
    unit: str
    scale: float  # value in the unit over the SI value
    lines: Sequence[tuple[str, Color, float]]  # key of info, colour and width of each
    top: int
    height: int
    # of the axis, in the unit; a constant or a function of the plant
    span: Point | Callable[[Any], Point]
    ticks: Sequence[float] | Callable[[Any], Sequence[float]]  # likewise

    def axis(self, plant: Any) -> tuple[Point, Sequence[float], str]:
        """Return lowest and highest value, the grid lines and the name."""
        span = self.span(plant) if callable(self.span) else self.span
        ticks = self.ticks(plant) if callable(self.ticks) else self.ticks
        return span, ticks, f"{self.name} [{self.unit}]"


Trace = Sequence[tuple[float, ...]]
Policy = Callable[[Any], Any]  # returns the action for an observation


@dataclass(frozen=True)
class View:
    """Declaration of the pictures of a family of environments."""

    scene: Callable[[Canvas, Any, Any], None]
    """``draw(canvas, env, info)``: the plant."""
    strips: tuple[Strip, ...]
    """From top to bottom; the first one holds output and reference."""
    demonstrator: Callable[[Any], Policy]
    """Returns the policy that moves the plant in films, from the environment."""
    number: tuple[str, str, Callable[[Any], float]] = (
        "pressure",
        "bar",
        lambda info: 1e-5 * info["state/pressure"],
    )
    """Name, unit and value (from ``info``) of the number beside time and error."""
    number_color: Color = PRESSURE
    trace: Callable[[Any], tuple[float, ...]] = lambda info: (
        1e-5 * info["state/pressure"],
        info["output"],
    )
    """``trace(info)``: the point that a step adds to the panel."""
    panel: Callable[[Canvas, Any, Any, Trace], None] | None = None
    """``panel(canvas, env, info, points)``: the plot above the strips; default: the loop of the
    output over the pressure."""


def view_of(env: Any) -> View:
    """Return the view that the setup of an environment names, or a function of the plant there."""
    module, _, name = env.setup.view.partition(":")
    if not name:
        raise ValueError("the environment has no view; name one in compose(view='module:NAME')")
    found = getattr(importlib.import_module(module), name)
    return found if isinstance(found, View) else found(env.plant)


def full_bar(plant: Any) -> float:
    """Return the largest setpoint [bar]."""
    return 1e-5 * float(plant.regulator.max_pressure)


def pressure_strip(
    top: int,
    height: int,
    name: str = "pressure",
    lines: Sequence[tuple[str, Color, float]] = (("state/pressure", PRESSURE, 2.0),),
) -> Strip:
    """Return a strip of pressures."""

    def ticks(plant: Any) -> Sequence[float]:
        return 0.0, 0.5 * full_bar(plant), full_bar(plant)

    return Strip(name, "bar", 1e-5, lines, top, height, lambda p: (0.0, full_bar(p)), ticks)


SCALE_HEIGHT = 120.0
"""Height of the colour scale of pressures [pixels]."""
FAR = 10.0
"""Distance at which the points of a curve are cut off, in boxes of its plot."""
PANEL: Box = (360, 88, 410, 200)  # position and size of the plot above the strips


def draw_loop(canvas: Canvas, points: Trace, axes: Axes, scale: float = 1.0) -> None:
    """Draw a path of points whose second coordinate is SI: pale where old, a disc at the end."""
    places, step = [(x, scale * y) for x, y in points], 12
    for i in range(0, len(places) - 1, step):
        age = i / len(places)
        axes.curve(places[i : i + step + 1], blend(GRID, OUTPUT, 0.15 + 0.85 * age), 2)
    if places:
        canvas.disc(axes.at(*places[-1]), 4.5, OUTPUT)


def pressure_loop(
    canvas: Canvas, plant: Any, first: Strip, points: Trace, both: bool = False
) -> None:
    """Draw the output, in the unit of the first strip, over the pressure or a difference of two."""
    full, (span, across, name) = full_bar(plant), first.axis(plant)
    low, ticks = (-full, full / 4) if both else (0.0, full / 6)
    axes = Axes(canvas, PANEL, (low, full), span)
    word = "pressure of A minus B [bar]" if both else "pressure [bar]"
    axes.frame(range(int(low), int(full) + 1, max(1, round(ticks))), across, word, name)
    draw_loop(canvas, points, axes, first.scale)


class Axes:
    """A plot: box, ticks and curves."""

    def __init__(self, canvas: Canvas, box: Box, x: Point, y: Point) -> None:
        self.canvas, self.box, self.x, self.y = canvas, box, x, y

    def at(self, x: float, y: float) -> Point:
        """Return the position of a point [pixels]; a point outside is moved to the edge."""
        return self._place(x, y, 0.0)

    def curve(self, points: Iterable[Point], color: Color, width: float) -> None:
        """Draw a line through points; what is outside the box is not drawn."""
        left, top, wide, high = self.box
        margin = math.ceil(0.5 * width)
        box = (left - margin, top - margin, wide + 2 * margin, high + 2 * margin)
        with self.canvas.within(box):
            self.canvas.line([self._place(x, y, FAR) for x, y in points], color, width)

    def _place(self, x: float, y: float, far: float) -> Point:
        """Return a position [pixels], at most ``far`` boxes outside the box."""
        left, top, width, height = self.box
        across = min(1.0 + far, max(-far, (x - self.x[0]) / (self.x[1] - self.x[0])))
        up = min(1.0 + far, max(-far, (y - self.y[0]) / (self.y[1] - self.y[0])))
        return left + across * width, top + (1.0 - up) * height

    def frame(
        self,
        x_ticks: Iterable[float],
        y_ticks: Iterable[float],
        x_name: str,
        y_name: str,
        numbers: bool = True,
    ) -> None:
        """Draw grid, ticks and names; ``numbers=False`` omits those below the box."""
        left, top, width, height = self.box
        bottom = top + height
        for value in x_ticks:
            x, _ = self.at(value, self.y[0])
            self.canvas.line([(x, top), (x, bottom)], GRID, 1)
            if numbers:
                self.canvas.text(f"{value:g}", (x, bottom + 5), MUTED, 11, "center")
        for value in y_ticks:
            _, y = self.at(self.x[0], value)
            self.canvas.line([(left, y), (left + width, y)], GRID, 1)
            self.canvas.text(f"{value:g}", (left - 7, y - 6), MUTED, 11, "right")
        self.canvas.line([(left, top), (left, bottom), (left + width, bottom)], MUTED, 1)
        self.canvas.text(x_name, (left + width, bottom + 20), MUTED, 12, "right")
        self.canvas.text(y_name, (left - 22, top - 21), MUTED, 12)


def pressure_scale(
    canvas: Canvas,
    pressure: float,
    full: float,
    left: float = 262.0,
    top: float = 100.0,
    color: Color = PRESSURE,
) -> None:
    """Draw the colour scale of pressures [Pa] from 0 to ``full``, and a pointer."""
    height = SCALE_HEIGHT
    for i in range(60):
        shade = blend(HOT, COLD, i / 59)
        canvas.rectangle((left, top + i * height / 60, 12, height / 60 + 0.5), shade)
    for bar in (0.0, 0.5e-5 * full, 1e-5 * full):
        y = top + height * (1.0 - 1e5 * bar / full)
        canvas.text(f"{bar:g}", (left + 18, y - 6), MUTED, 11)
    canvas.text("bar", (left + 6, top - 22), MUTED, 11, "center")
    pressure_pointer(canvas, pressure, full, left, top, color)


def pressure_pointer(
    canvas: Canvas, pressure: float, full: float, left: float, top: float, color: Color
) -> None:
    """Draw a pointer at a pressure [Pa] beside the colour scale at ``left`` and ``top``."""
    y = top + SCALE_HEIGHT * (1.0 - min(1.0, max(0.0, pressure / full)))
    canvas.polygon([(left - 2, y), (left - 12, y - 6), (left - 12, y + 6)], color)


def limb(canvas: Canvas, a: Point, b: Point, thick: float, thin: float, color: Color) -> None:
    """Fill a limb with round ends that tapers from ``a`` to ``b``."""
    length = max(1e-9, math.dist(a, b))
    x, y = (a[1] - b[1]) / length, (b[0] - a[0]) / length
    corners = [(a[0] + thick * x, a[1] + thick * y), (b[0] + thin * x, b[1] + thin * y)]
    corners += [(b[0] - thin * x, b[1] - thin * y), (a[0] - thick * x, a[1] - thick * y)]
    canvas.polygon(corners, color)
    canvas.disc(a, thick, color)
    canvas.disc(b, thin, color)


def torque_bars(
    canvas: Canvas, bars: Sequence[tuple[str, float, Color]], span: float, top: float, note: str
) -> None:
    """Draw horizontal bars of torques [N m], positive to the right, with a tip beyond ``span``."""
    zero, half = 196.0, 76.0
    for row, (name, torque, color) in enumerate(bars):
        y, end = top + 20.0 * row, zero + half * max(-1.0, min(1.0, torque / span))
        canvas.text(name, (112, y - 1), MUTED, 11, "right")
        canvas.rectangle((zero - half, y, 2 * half, 12), GRID, 2)
        canvas.rectangle((min(zero, end), y, max(1.0, abs(end - zero)), 12), color, 2)
        if abs(torque) > span:
            tip = math.copysign(5.0, torque)
            canvas.polygon([(end, y), (end + tip, y + 6), (end, y + 12)], color)
        canvas.line([(zero, y - 3), (zero, y + 15)], MUTED, 1)
        canvas.text(signed(torque, 1), (314, y - 1), color, 11, "right")
    canvas.text(note, (314, 574), MUTED, 11, "right")


def table(canvas: Canvas, rows: Iterable[tuple[str, str]], left: float, top: float) -> None:
    """Write rows of names and values."""
    for row, (name, value) in enumerate(rows):
        canvas.text(name, (left, top + 20 * row), MUTED, 12)
        canvas.text(value, (310, top + 20 * row), INK, 12, "right")


def muscle(
    canvas: Canvas, a: Point, b: Point, widths: Sequence[float], tint: Color, step: int
) -> tuple[list[Point], list[Point]]:
    """Draw a muscle from ``a`` to ``b`` with half-widths along it; return its two outlines.

    Crossing threads start at every ``step``-th width.
    """
    length, last = max(1e-9, math.dist(a, b)), len(widths) - 1
    across = ((a[1] - b[1]) / length, (b[0] - a[0]) / length)
    left, right = (
        [
            (
                a[0] + k / last * (b[0] - a[0]) + way * wide * across[0],
                a[1] + k / last * (b[1] - a[1]) + way * wide * across[1],
            )
            for k, wide in enumerate(widths)
        ]
        for way in (-1.0, 1.0)
    )
    canvas.polygon(left + right[::-1], tint)
    for k in range(step - 1, last - 1, step):
        canvas.line([left[k], right[k + 2]], blend(tint, PAPER, 0.4), 1.2)
        canvas.line([right[k], left[k + 2]], blend(tint, PAPER, 0.4), 1.2)
    return left, right
