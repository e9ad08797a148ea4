"""Pictures of an environment: the plant, its loop, and the last seconds.

Drawn with pygame-ce on a plain surface, so that ``rgb_array`` needs no display. Drawing reads the
``info`` of the steps and does not change the simulation.
"""

import math
import os
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.rendering import scene

SIZE = (800, 600)
SCALE = 2  # everything is drawn this many times larger and smoothed down, for anti-aliased edges
FINE = 3  # text is drawn this many times larger still, so that gaps between letters are even
LABELS = 300  # texts that are kept: most are those of the last picture
STRIP_SECONDS = 8.0
LOOP_SAMPLES = 1500
WINDOW_FPS = 50  # pictures per second in the window, at the pace of the plant


def _pygame() -> Any:
    """Import the drawing library, and remove the environment variables that its import sets."""
    before = dict(os.environ)
    try:
        import pygame
    except ImportError as error:
        raise ImportError(
            'rendering needs pygame-ce, which is not installed: pip install "pam-envs[plot]"'
        ) from error
    for name in set(os.environ) - set(before):
        del os.environ[name]
    return pygame


class Canvas:
    """A surface with lines, polygons and text in the coordinates of the final picture."""

    def __init__(self) -> None:
        self.pygame = _pygame()
        self.pygame.font.init()
        self.surface = self.pygame.Surface((SIZE[0] * SCALE, SIZE[1] * SCALE))
        self._fonts: dict[int, Any] = {}
        self._label = lru_cache(maxsize=LABELS)(self._drawn)

    def clear(self) -> None:
        """Start a new picture."""
        self.surface.fill(scene.PAPER)

    def line(self, points: Iterable[scene.Point], color: scene.Color, width: float = 1.5) -> None:
        """Draw a line through points."""
        scaled = [(x * SCALE, y * SCALE) for x, y in points]
        if len(scaled) > 1:
            self.pygame.draw.lines(self.surface, color, False, scaled, max(1, round(width * SCALE)))

    def polygon(self, points: Iterable[scene.Point], color: scene.Color) -> None:
        """Fill a polygon."""
        self.pygame.draw.polygon(self.surface, color, [(x * SCALE, y * SCALE) for x, y in points])

    def rectangle(
        self, box: tuple[float, float, float, float], color: scene.Color, round_: int = 0
    ) -> None:
        """Fill a rectangle given by left, top, width and height."""
        self.pygame.draw.rect(
            self.surface, color, [v * SCALE for v in box], border_radius=round_ * SCALE
        )

    @contextmanager
    def within(self, box: tuple[int, int, int, int]) -> Iterator[None]:
        """Clip drawing to a box given by left, top, width and height."""
        self.surface.set_clip(self.pygame.Rect([v * SCALE for v in box]))
        yield
        self.surface.set_clip(None)

    def disc(self, centre: scene.Point, radius: float, color: scene.Color) -> None:
        """Fill a circle."""
        middle = (centre[0] * SCALE, centre[1] * SCALE)
        self.pygame.draw.circle(self.surface, color, middle, radius * SCALE)

    def dashed(self, a: scene.Point, b: scene.Point, color: scene.Color) -> None:
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
        place: scene.Point,
        color: scene.Color = scene.INK,
        size: int = 13,
        align: str = "left",
    ) -> None:
        """Write text, with ``place`` at the left, centre or right of their upper edge."""
        drawn = self._label(words, color, size)
        shift = {"left": 0.0, "center": 0.5, "right": 1.0}[align] * drawn.get_width()
        self.surface.blit(drawn, (place[0] * SCALE - shift, place[1] * SCALE))

    def _drawn(self, words: str, color: scene.Color, size: int) -> Any:
        """Return a surface with a text."""
        if size not in self._fonts:
            self._fonts[size] = self.pygame.font.Font(None, round(1.45 * size * SCALE * FINE))
        fine = self._fonts[size].render(words, True, color)
        pixels = [round(length / FINE) for length in fine.get_size()]
        return self.pygame.transform.smoothscale(fine, pixels)

    def picture(self) -> Any:
        """Return the surface in its final size."""
        return self.pygame.transform.smoothscale(self.surface, SIZE)


class Renderer:
    """Record of the recent past of one environment, and its pictures; batches share a canvas."""

    def __init__(self, env: Any, canvas: Canvas | None = None) -> None:
        self.env = env
        self.canvas = Canvas() if canvas is None else canvas
        self.view = scene.view_of(env)
        strips = self.view.strips
        self._keys = ("time", *dict.fromkeys(key for strip in strips for key, _, _ in strip.lines))
        self.strip: deque[tuple[float, ...]] = deque(
            maxlen=round(STRIP_SECONDS / env.control_period) + 1
        )
        self.loop: deque[tuple[float, ...]] = deque(maxlen=LOOP_SAMPLES)
        self.info: Any = None
        self._window: Any = None
        self._clock: Any = None
        self._dismissed = False

    def record(self, info: Any, start: bool) -> None:
        """Record a step; at the start of an episode, discard the previous episode."""
        if start:
            self.strip.clear()
            self.loop.clear()
        self.info = info
        self.strip.append(tuple([info[key] for key in self._keys]))
        self.loop.append(self.view.trace(info))

    def _draw(self) -> Any:
        self.canvas.clear()
        self.view.scene(self.canvas, self.env, self.info)
        self._draw_numbers()
        points, first = list(self.loop), self.view.strips[0]
        if self.view.panel is None:
            scene.pressure_loop(self.canvas, self.env.plant, first, points)
        else:
            self.view.panel(self.canvas, self.env, self.info, points)
        shown = min(STRIP_SECONDS, self.env.setup.episode_seconds)
        start = max(0.0, self.strip[-1][0] - shown)
        for strip in self.view.strips:
            self._draw_strip(strip, (start, start + shown))
        self.canvas.text("reference", (712, first.top - 21), scene.REFERENCE, 12, "right")
        self.canvas.text("output", (770, first.top - 21), scene.OUTPUT, 12, "right")
        return self.canvas.picture()

    def _draw_numbers(self) -> None:
        info, text, first = self.info, self.canvas.text, self.view.strips[0]
        error = first.scale * (info["output"] - info["reference"])
        name, unit, number = self.view.number
        for x, title, value, color in (
            (360, "time", f"{info['time']:.2f} s", scene.INK),
            (475, "error", f"{scene.signed(error, 2)} {first.unit}", scene.INK),
            (600, name, f"{number(info):.2f} {unit}", self.view.number_color),
        ):
            text(title, (x, 14), scene.MUTED, 11)
            text(value, (x, 29), color, 16)
        if info["saturated"]:
            text("action", (770, 14), scene.REFERENCE, 11, "right")
            text("clipped", (770, 29), scene.REFERENCE, 16, "right")

    def _draw_strip(self, strip: scene.Strip, seconds: scene.Point) -> None:
        """Draw one plot of the last seconds; the lowest one has the time axis."""
        lowest, (span, across, name) = strip is self.view.strips[-1], strip.axis(self.env.plant)
        axes = scene.Axes(self.canvas, (360, strip.top, 410, strip.height), seconds, span)
        axes.frame(
            scene.round_ticks(*seconds), across, "time [s]" if lowest else "", name, numbers=lowest
        )
        for key, color, width in strip.lines:
            k = self._keys.index(key)
            points = [(past[0], strip.scale * past[k]) for past in self.strip]
            axes.curve(points, color, width)

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture, shape (600, 800, 3)."""
        array = self.canvas.pygame.surfarray.array3d(self._draw())
        return np.ascontiguousarray(np.transpose(array, (1, 0, 2)))

    def show(self) -> None:
        """Show the picture in a window, at the pace of the plant, until the window is closed."""
        if self._dismissed:
            return
        pygame = self.canvas.pygame
        if self._window is None:
            pygame.display.init()
            self._window = pygame.display.set_mode(SIZE)
            pygame.display.set_caption(str(getattr(self.env.spec, "id", "pam-envs")))
            self._clock = pygame.time.Clock()
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self._dismissed = True
            self.close()
            return
        period, fps = self.env.control_period, WINDOW_FPS
        if round(self.info["time"] / period) % max(1, round(1.0 / (period * fps))) == 0:
            self._window.blit(self._draw(), (0, 0))
            pygame.display.flip()
            self._clock.tick(fps)

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self.canvas.pygame.display.quit()
            self._window = None


def write_film(path: Path, pictures: Iterable[NDArray[np.uint8]], fps: int) -> None:
    """Write pictures of equal size to a ``.mp4`` or ``.gif`` file."""
    try:
        import imageio.v2 as imageio
    except ImportError as error:
        raise ImportError(
            'films need imageio, which is not installed: pip install "pam-envs[plot]"'
        ) from error
    settings: dict[str, Any] = {"fps": fps, "macro_block_size": 8}
    if path.suffix == ".gif":
        settings = {"duration": 1000.0 / fps, "loop": 0}
    film: Any = imageio.get_writer(path, **settings)
    try:
        for picture in pictures:
            film.append_data(picture)
    finally:
        film.close()
