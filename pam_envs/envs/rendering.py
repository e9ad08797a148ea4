"""Pictures of an environment: the plant at work, its loop, and the last seconds.

Drawn with pygame-ce on a plain surface, so that ``rgb_array`` needs no display. Drawing reads what
``step`` returned and touches neither the simulation nor its random numbers. A family of plants adds
its own scene to :data:`SCENES`; the frame, the loop and the strip are common.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Color = tuple[int, int, int]
Box = tuple[int, int, int, int]

SIZE = (800, 600)
PAPER, INK, MUTED, GRID = (250, 250, 248), (38, 42, 48), (128, 134, 142), (226, 228, 230)
OUTPUT, REFERENCE, PRESSURE = (0, 114, 178), (213, 94, 0), (0, 140, 100)
STEEL, COLD, HOT = (150, 156, 164), (88, 96, 108), (222, 92, 58)
SCALE = 2
"""Everything is drawn this many times larger and smoothed down: anti-aliased edges everywhere."""
STRIP_SECONDS = 8.0
LOOP_SAMPLES = 1500


def _pygame() -> Any:
    """Import the drawing library, or say how to get it."""
    try:
        import pygame
    except ImportError as error:
        raise ImportError(
            'rendering needs pygame-ce, which is not installed: pip install "pam-envs[plot]"'
        ) from error
    return pygame


def blend(a: Color, b: Color, share: float) -> Color:
    """Return the colour that is ``share`` of the way from ``a`` to ``b``."""
    s = min(1.0, max(0.0, share))
    red, green, blue = (round(x + s * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue


class Canvas:
    """A surface with lines, polygons and text in the coordinates of the final picture."""

    def __init__(self) -> None:
        self.pygame = _pygame()
        self.pygame.font.init()
        self.surface = self.pygame.Surface((SIZE[0] * SCALE, SIZE[1] * SCALE))
        self._fonts: dict[int, Any] = {}

    def clear(self) -> None:
        """Start a new picture."""
        self.surface.fill(PAPER)

    def line(self, points: Iterable[tuple[float, float]], color: Color, width: float = 1.5) -> None:
        """Draw a line through points."""
        scaled = [(x * SCALE, y * SCALE) for x, y in points]
        if len(scaled) > 1:
            self.pygame.draw.lines(self.surface, color, False, scaled, max(1, round(width * SCALE)))

    def polygon(self, points: Iterable[tuple[float, float]], color: Color) -> None:
        """Fill a polygon."""
        self.pygame.draw.polygon(self.surface, color, [(x * SCALE, y * SCALE) for x, y in points])

    def rectangle(
        self, box: tuple[float, float, float, float], color: Color, round_: int = 0
    ) -> None:
        """Fill a rectangle given by left, top, width and height."""
        self.pygame.draw.rect(
            self.surface, color, [v * SCALE for v in box], border_radius=round_ * SCALE
        )

    def disc(self, centre: tuple[float, float], radius: float, color: Color) -> None:
        """Fill a circle."""
        middle = (centre[0] * SCALE, centre[1] * SCALE)
        self.pygame.draw.circle(self.surface, color, middle, radius * SCALE)

    def dashed(self, a: tuple[float, float], b: tuple[float, float], color: Color) -> None:
        """Draw a dashed line."""
        length = math.dist(a, b)
        for start in np.arange(0.0, length, 10.0):
            ends = [min(length, start + d) / length for d in (0.0, 6.0)]
            self.line(
                [(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])) for s in ends], color, 2
            )

    def text(
        self,
        words: str,
        place: tuple[float, float],
        color: Color = INK,
        size: int = 13,
        align: str = "left",
    ) -> None:
        """Write words, with ``place`` at the left, centre or right of their upper edge."""
        if size not in self._fonts:
            self._fonts[size] = self.pygame.font.Font(None, round(1.45 * size * SCALE))
        drawn = self._fonts[size].render(words, True, color)
        shift = {"left": 0.0, "center": 0.5, "right": 1.0}[align] * drawn.get_width()
        self.surface.blit(drawn, (place[0] * SCALE - shift, place[1] * SCALE))

    def picture(self) -> Any:
        """Return the surface in its final size."""
        return self.pygame.transform.smoothscale(self.surface, SIZE)


class Axes:
    """A box with ticks, into which curves are drawn."""

    def __init__(self, canvas: Canvas, box: Box, x: tuple[float, float], y: tuple[float, float]):
        self.canvas, self.box, self.x, self.y = canvas, box, x, y

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return where a point stands in the picture."""
        left, top, width, height = self.box
        across = (x - self.x[0]) / (self.x[1] - self.x[0])
        up = (y - self.y[0]) / (self.y[1] - self.y[0])
        return left + min(1.0, max(0.0, across)) * width, top + (
            1 - min(1.0, max(0.0, up))
        ) * height

    def frame(
        self, x_ticks: Iterable[float], y_ticks: Iterable[float], x_name: str, y_name: str
    ) -> None:
        """Draw grid, ticks and names."""
        left, top, width, height = self.box
        for value in x_ticks:
            x, _ = self.at(value, self.y[0])
            self.canvas.line([(x, top), (x, top + height)], GRID, 1)
            self.canvas.text(f"{value:g}", (x, top + height + 5), MUTED, 11, "center")
        for value in y_ticks:
            _, y = self.at(self.x[0], value)
            self.canvas.line([(left, y), (left + width, y)], GRID, 1)
            self.canvas.text(f"{value:g}", (left - 6, y - 6), MUTED, 11, "right")
        self.canvas.line(
            [(left, top), (left, top + height), (left + width, top + height)], MUTED, 1
        )
        self.canvas.text(x_name, (left + width, top + height + 20), MUTED, 12, "right")
        self.canvas.text(y_name, (left - 28, top - 20), MUTED, 12)


def muscle_scene(canvas: Canvas, env: Any, info: Any) -> None:
    """Draw a muscle that lifts a hanging load, with ruler and reference marker."""
    plant = env.plant
    axis, top, natural = 140.0, 70.0, 250.0
    per_metre = 5400.0  # the stroke is drawn larger than the muscle
    contraction = info["state/contraction"]
    bottom = top + natural - contraction * per_metre
    full = plant.regulator.max_pressure
    share = info["state/pressure"] / full
    canvas.rectangle((50, 40, 180, 12), STEEL, 3)
    for x in range(56, 230, 14):
        canvas.line([(x, 40), (x + 8, 31)], STEEL, 1.5)
    canvas.rectangle((axis - 9, 52, 18, 18), INK, 3)
    canvas.text(f"{1e-5 * info['state/pressure']:.2f} bar", (axis + 18, 54), PRESSURE, 14)
    _braid(canvas, axis, top, bottom, plant, contraction, blend(COLD, HOT, share))
    canvas.rectangle((axis - 9, bottom, 18, 14), INK, 3)
    load = info["state/load"]
    rod = bottom + 34
    canvas.line([(axis, bottom + 14), (axis, rod)], INK, 3)
    side = 26 + 30 * (max(load, 0.0) / 5.0) ** (1 / 3)
    canvas.polygon(
        [
            (axis - 0.62 * side, rod),
            (axis + 0.62 * side, rod),
            (axis + side, rod + 1.15 * side),
            (axis - side, rod + 1.15 * side),
        ],
        blend(STEEL, INK, 0.55),
    )
    canvas.text(f"{load:.2f} kg", (axis, rod + 0.45 * side), PAPER, 14, "center")
    level = top + natural - info["reference"] * per_metre + 7
    canvas.dashed((70, level), (214, level), REFERENCE)
    canvas.text("reference", (222, level - 8), REFERENCE, 12)
    for mm in range(0, 16, 1):
        y = top + natural - 1e-3 * mm * per_metre + 7
        canvas.line([(50, y), (60 if mm % 5 else 66, y)], MUTED, 1)
        if mm % 5 == 0:
            canvas.text(f"{mm}", (44, y - 6), MUTED, 11, "right")
    canvas.text("mm", (44, top + natural - 0.0172 * per_metre), MUTED, 11, "right")


def _braid(
    canvas: Canvas,
    axis: float,
    top: float,
    bottom: float,
    plant: Any,
    contraction: float,
    tint: Color,
) -> None:
    """Draw the muscle's body: threads of constant length on a tube that bulges as it shortens."""
    strain = contraction / plant.muscle.rest_length
    cosine = (1.0 - strain) * math.cos(plant.muscle.braid_angle)
    bulge = math.sqrt(max(0.0, 1.0 - cosine * cosine)) / math.sin(plant.muscle.braid_angle)
    radius, end = 21.0 * (1.0 + 3.0 * (bulge - 1.0)), 13.0
    along = np.linspace(0.0, 1.0, 60)
    profile = end + (radius - end) * np.minimum(1.0, np.sin(np.pi * along) * 2.2) ** 0.7
    y = top + along * (bottom - top)
    left = list(zip(axis - profile, y, strict=True))
    right = list(zip(axis + profile, y, strict=True))
    canvas.polygon(left + right[::-1], tint)
    thread = blend(tint, PAPER, 0.42)
    turns = 3.0
    for k in range(10):
        for way in (1.0, -1.0):
            angle = way * 2 * np.pi * turns * along + 2 * np.pi * k / 10
            seen = np.cos(angle) > 0
            points = list(zip(axis + profile * np.sin(angle), y, strict=True))
            for i in range(len(points) - 1):
                if seen[i]:
                    canvas.line(points[i : i + 2], thread, 1)
    canvas.line(left, blend(tint, INK, 0.5), 1.5)
    canvas.line(right, blend(tint, INK, 0.5), 1.5)


SCENES: dict[str, Callable[[Canvas, Any, Any], None]] = {"single_muscle": muscle_scene}
"""Scene of each family of plants: ``draw(canvas, env, info)``, in the left 280 pixels."""


class Renderer:
    """Keeps the recent past of one environment and draws it."""

    def __init__(self, env: Any) -> None:
        self.env = env
        self.canvas = Canvas()
        self.scene = SCENES[env.plant.family]
        self.strip: deque[tuple[float, float, float, float]] = deque(
            maxlen=round(STRIP_SECONDS / env.control_period) + 1
        )
        self.loop: deque[tuple[float, float]] = deque(maxlen=LOOP_SAMPLES)
        self.info: Any = None
        self._window: Any = None
        self._clock: Any = None

    def record(self, observation: NDArray[np.float32], info: Any, start: bool) -> None:
        """Take note of a step (or, at the start of an episode, forget the one before)."""
        if start:
            self.strip.clear()
            self.loop.clear()
        self.info = info
        pressure = info["state/pressure"]
        self.strip.append((info["time"], info["reference"], info["output"], pressure))
        self.loop.append((pressure, info["output"]))

    def _draw(self) -> Any:
        canvas, info = self.canvas, self.info
        canvas.clear()
        self.scene(canvas, self.env, info)
        error = 1e3 * (info["output"] - info["reference"])
        canvas.text(f"t = {info['time']:.2f} s", (300, 14), INK, 15)
        canvas.text(f"error {error:+.2f} mm", (420, 14), INK, 15)
        if info["saturated"]:
            canvas.text("action out of range", (580, 14), REFERENCE, 15)
        self._draw_loop()
        self._draw_strips()
        return canvas.picture()

    def _draw_loop(self) -> None:
        full = 1e-5 * self.env.plant.regulator.max_pressure
        axes = Axes(self.canvas, (360, 66, 410, 220), (0.0, full), (-0.5, 16.0))
        ticks = np.arange(0.0, full + 0.01, max(1.0, round(full / 6)))
        axes.frame(ticks, (0, 5, 10, 15), "pressure [bar]", "contraction [mm]")
        points = [axes.at(1e-5 * p, 1e3 * x) for p, x in self.loop]
        step = 12
        for i in range(0, len(points) - 1, step):
            age = i / max(1, len(points))
            self.canvas.line(points[i : i + step + 1], blend(GRID, OUTPUT, 0.15 + 0.85 * age), 2)
        if points:
            self.canvas.disc(points[-1], 4.5, OUTPUT)

    def _draw_strips(self) -> None:
        canvas, now = self.canvas, self.strip[-1][0]
        first = max(0.0, now - STRIP_SECONDS)
        span = (first, first + STRIP_SECONDS)
        seconds = [s for s in range(math.ceil(span[0]), math.floor(span[1]) + 1) if s % 2 == 0]
        upper = Axes(canvas, (360, 344, 410, 120), span, (-0.5, 16.0))
        upper.frame(seconds, (0, 5, 10, 15), "", "contraction [mm]")
        lower = Axes(
            canvas, (360, 502, 410, 56), span, (0.0, 1e-5 * self.env.plant.regulator.max_pressure)
        )
        lower.frame(seconds, (0, 3, 6), "time [s]", "pressure [bar]")
        canvas.line([upper.at(t, 1e3 * r) for t, r, _, _ in self.strip], REFERENCE, 1.5)
        canvas.line([upper.at(t, 1e3 * x) for t, _, x, _ in self.strip], OUTPUT, 2)
        canvas.line([lower.at(t, 1e-5 * p) for t, _, _, p in self.strip], PRESSURE, 2)
        canvas.text("reference", (610, 324), REFERENCE, 12)
        canvas.text("output", (690, 324), OUTPUT, 12)

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture, shape (600, 800, 3)."""
        array = self.canvas.pygame.surfarray.array3d(self._draw())
        return np.ascontiguousarray(np.transpose(array, (1, 0, 2)))

    def show(self) -> None:
        """Show the picture in a window, at the pace of the plant."""
        pygame = self.canvas.pygame
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode(SIZE)
            pygame.display.set_caption(str(getattr(self.env.spec, "id", "pam-envs")))
            self._clock = pygame.time.Clock()
        for event in pygame.event.get():
            if event.type == pygame.QUIT:
                self.close()
                return
        period = self.env.control_period
        every = max(1, round(1.0 / (period * self.env.metadata["render_fps"])))
        if round(self.info["time"] / period) % every == 0:
            self._window.blit(self._draw(), (0, 0))
            pygame.display.flip()
            self._clock.tick(self.env.metadata["render_fps"])

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self.canvas.pygame.display.quit()
            self._window = None


def make_renderer(env: Any) -> Renderer:
    """Return a renderer for an environment (see ``PlantEnv.render``)."""
    return Renderer(env)
