"""What scenes are drawn with: colours, a box with ticks, a scale of pressures, what a view shows.

A view says what the pictures of an environment show; the frame around it is common. Scenes read
the plant and ``info`` and change neither; they draw in the left 320 pixels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pam_envs.envs.rendering.renderer import Canvas

Color = tuple[int, int, int]
Box = tuple[int, int, int, int]
Point = tuple[float, float]

PAPER, INK, MUTED, GRID = (250, 250, 248), (38, 42, 48), (112, 118, 126), (226, 228, 230)
OUTPUT, REFERENCE, PRESSURE = (0, 114, 178), (213, 94, 0), (0, 140, 100)
STEEL, COLD, HOT = (150, 156, 164), (88, 96, 108), (222, 92, 58)


def blend(a: Color, b: Color, share: float) -> Color:
    """Return the colour that is ``share`` of the way from ``a`` to ``b``."""
    s = min(1.0, max(0.0, share))
    red, green, blue = (round(x + s * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue


@dataclass(frozen=True)
class Strip:
    """A plot of the last seconds.

    Attributes
    ----------
    name, unit : str
        Of the axis.
    scale : float
        The unit's number over the SI number.
    lines : tuple of (str, Color, float)
        Key of ``info``, colour and width of each line.
    top, height : int
        Where it stands [pixels].
    span : callable
        Lowest and highest value on the axis, in the unit, from the plant.
    ticks : callable
        Values with a line across, from the plant.
    """

    name: str
    unit: str
    scale: float
    lines: tuple[tuple[str, Color, float], ...]
    top: int
    height: int
    span: Callable[[Any], Point]
    ticks: Callable[[Any], Iterable[float]]


Trace = Sequence[tuple[float, ...]]
Panel = Callable[["Canvas", Any, Any, Trace], None]


@dataclass(frozen=True)
class View:
    """What the pictures of a family of environments show.

    Attributes
    ----------
    scene : callable
        ``draw(canvas, env, info)``: the plant at work.
    strips : tuple of Strip
        From top to bottom; the first one holds output and reference.
    number : tuple of str, str, callable
        Name, unit and value (from ``info``) of what stands beside time and error.
    trace : callable
        ``trace(info)``: what a step adds to the panel.
    panel : callable, optional
        ``panel(canvas, env, info, points)``: the plot above the strips, from all that was traced;
        default: the loop of the output over the pressure.
    """

    scene: Callable[[Canvas, Any, Any], None]
    strips: tuple[Strip, ...]
    number: tuple[str, str, Callable[[Any], float]] = (
        "pressure",
        "bar",
        lambda info: 1e-5 * info["state/pressure"],
    )
    trace: Callable[[Any], tuple[float, ...]] = lambda info: (
        1e-5 * info["state/pressure"],
        info["output"],
    )
    panel: Panel | None = None


def full_bar(plant: Any) -> float:
    """Return the largest set-point [bar]."""
    return 1e-5 * float(plant.regulator.max_pressure)


def pressure_strip(top: int, height: int) -> Strip:
    """Return the strip of the pressure."""
    return Strip(
        "pressure",
        "bar",
        1e-5,
        (("state/pressure", PRESSURE, 2.0),),
        top,
        height,
        lambda plant: (0.0, full_bar(plant)),
        lambda plant: (0.0, 0.5 * full_bar(plant), full_bar(plant)),
    )


PANEL: Box = (360, 88, 410, 200)
"""Where the plot above the strips stands."""


def draw_loop(
    canvas: Canvas,
    points: Trace,
    axes: Axes,
    scale: float,
) -> None:
    """Draw a path of points whose second coordinate is SI: old ones pale, a disc at the present."""
    places, step = [axes.at(x, scale * y) for x, y in points], 12
    for i in range(0, len(places) - 1, step):
        age = i / len(places)
        canvas.line(places[i : i + step + 1], blend(GRID, OUTPUT, 0.15 + 0.85 * age), 2)
    if places:
        canvas.disc(places[-1], 4.5, OUTPUT)


def pressure_loop(canvas: Canvas, plant: Any, first: Strip, points: Trace) -> None:
    """Draw the output, as the first strip has it, over the pressure [bar]."""
    full = full_bar(plant)
    axes = Axes(canvas, PANEL, (0.0, full), first.span(plant))
    ticks = range(0, int(full) + 1, max(1, round(full / 6)))
    across = tuple(first.ticks(plant))
    axes.frame(ticks, across, "pressure [bar]", f"{first.name} [{first.unit}]")
    draw_loop(canvas, points, axes, first.scale)


class Axes:
    """A box with ticks, into which curves are drawn."""

    def __init__(self, canvas: Canvas, box: Box, x: Point, y: Point) -> None:
        self.canvas, self.box, self.x, self.y = canvas, box, x, y

    def at(self, x: float, y: float) -> Point:
        """Return where a point stands in the picture; what is outside stands on the edge."""
        left, top, width, height = self.box
        across = min(1.0, max(0.0, (x - self.x[0]) / (self.x[1] - self.x[0])))
        up = min(1.0, max(0.0, (y - self.y[0]) / (self.y[1] - self.y[0])))
        return left + across * width, top + (1.0 - up) * height

    def frame(
        self,
        x_ticks: Iterable[float],
        y_ticks: Iterable[float],
        x_name: str,
        y_name: str,
        numbers: bool = True,
    ) -> None:
        """Draw grid, ticks and names; ``numbers=False`` leaves out those below the box."""
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
    canvas: Canvas, pressure: float, full: float, left: float = 262.0, top: float = 100.0
) -> None:
    """Draw the colours of the pressures [Pa] from 0 to ``full``, with a pointer at the present."""
    height = 120.0
    for i in range(60):
        color = blend(HOT, COLD, i / 59)
        canvas.rectangle((left, top + i * height / 60, 12, height / 60 + 0.5), color)
    for bar in (0.0, 0.5e-5 * full, 1e-5 * full):
        y = top + height * (1.0 - 1e5 * bar / full)
        canvas.text(f"{bar:g}", (left + 18, y - 6), MUTED, 11)
    canvas.text("bar", (left + 6, top - 22), MUTED, 11, "center")
    y = top + height * (1.0 - min(1.0, max(0.0, pressure / full)))
    canvas.polygon([(left - 2, y), (left - 12, y - 6), (left - 12, y + 6)], PRESSURE)
