"""Canvas in CSS pixels and its export to the page; the only module here that imports matplotlib.

The page is 900 pixels wide. The SVG takes fonts and colours from the page, in its light or dark
theme.
"""

import io
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.arrays import Array

WIDTH, LEFT, RIGHT = 900.0, 62.0, 18.0  # width of a figure, and its margins for ticks and labels
INSIDE = WIDTH - LEFT - RIGHT
LEGEND = 36.0  # height of the legend at the top

INK, MUTED, RULE, PAPER = "#1a1c20", "#646b75", "#dfe2e7", "#fefefe"
MEASURED, BASE, EXTENDED, FLOOR = "#9aa1ab", "#d55e00", "#0072b2", "#009e73"
HELD, RISING, FALLING, GREY = "#eef1f6", "#b8860b", "#6a4c93", "#b9bec6"
_NAMES = "ink muted rule paper measured base extended floor held rising falling grey"
_COLOURS = (INK, MUTED, RULE, PAPER, MEASURED, BASE, EXTENDED, FLOOR, HELD, RISING, FALLING, GREY)
VARIABLES = dict(zip(_COLOURS, _NAMES.split(), strict=True))
"""Colours for colour-blind readers (after Okabe and Ito), with their names on the page."""

STYLE = Path(__file__).with_name("page.mplstyle")
COLOURS = {
    **dict.fromkeys(("axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"), MUTED),
    **{"grid.color": RULE, "text.color": INK},
}
DASHES = (0, (5, 3))
Entry = tuple[str, str, dict[str, Any]]
"""Kind ("line", "dot" or "area"), label and style in a legend."""


@dataclass(frozen=True)
class Picture:
    """A figure of the page: unique name, ``<svg>`` element, text alternative and caption."""

    name: str
    svg: str
    alt: str
    caption: str


@contextmanager
def drawing() -> Iterator[None]:
    """Configure matplotlib while drawing; ModuleNotFoundError without it."""
    import matplotlib

    with matplotlib.rc_context(COLOURS, STYLE), warnings.catch_warnings():
        # the page's own fonts have the glyphs that the measuring font lacks
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield


class Canvas:
    """A figure with a layout in pixels from its upper left corner."""

    def __init__(self, height: float) -> None:
        import matplotlib.figure

        self.height = height
        self.figure = matplotlib.figure.Figure(figsize=(WIDTH / 72.0, height / 72.0), dpi=72)
        self.figure.patch.set_visible(False)

    def axes(self, left: float, top: float, width: float, height: float, share: Any = None) -> Any:
        """Add axes."""
        low = self.height - top - height
        box = (left / WIDTH, low / self.height, width / WIDTH, height / self.height)
        ax = self.figure.add_axes(box, sharex=share)
        ax.locator_params(nbins=5)
        return ax

    def row(
        self, n: int, top: float, height: float, gap: float, slots: int = 0, own: bool = False
    ) -> list[tuple[float, Any]]:
        """Add ``n`` axes side by side; return the left edge of each, and the axes.

        Only the first has labels on the left unless each has its ``own``; ``slots`` is the least
        number of axes for which there is room.
        """
        slots, made = max(n, slots), []
        width = (INSIDE - gap * (slots - 1)) / slots
        for i in range(n):
            left = LEFT + i * (width + gap)
            ax = self.axes(left, top, width, height)
            ax.tick_params(labelleft=own or i == 0)
            made.append((left, ax))
        return made

    def text(self, x: float, y: float, text: str, **style: Any) -> None:
        """Write with the baseline at y."""
        style = {"fontsize": 12.0, "color": INK, **style}
        figure: Any = self.figure
        figure.text(x / WIDTH, 1.0 - y / self.height, text, **style)

    def title(self, x: float, y: float, text: str) -> None:
        """Write the title of a panel."""
        self.text(x, y, text, fontweight="bold")

    def legend(self, entries: Sequence[Entry], x: float = LEFT) -> None:
        """Put a line of entries at the top."""
        import matplotlib.lines
        import matplotlib.patches

        handles: list[Any] = []
        for kind, label, style in entries:
            if kind == "area":
                handles.append(matplotlib.patches.Patch(linewidth=0, label=label, **style))
                continue
            shape: dict[str, Any] = {"linestyle": "none", "marker": "o"} if kind == "dot" else {}
            handles.append(matplotlib.lines.Line2D([], [], label=label, **(shape | style)))
        if not handles:
            return
        self.figure.legend(
            handles=handles,
            loc="upper left",
            bbox_to_anchor=(x / WIDTH, 1.0 - 2.0 / self.height),
            ncols=len(handles),
            handlelength=1.5,
            handletextpad=0.6,
            columnspacing=1.6,
            borderpad=0.0,
            borderaxespad=0.0,
        )

    def picture(self, name: str, alt: str, caption: str) -> Picture:
        """Return the finished figure."""
        from matplotlib.backends.backend_svg import FigureCanvasSVG

        self.figure.align_ylabels()
        buffer = io.StringIO()
        FigureCanvasSVG(self.figure).print_svg(buffer, metadata={"Date": None})
        return Picture(name, for_page(buffer.getvalue(), name, alt, self.height), alt, caption)


def legend_of(both: bool, alone: str, before: str, after: str, kind: str = "line") -> list[Entry]:
    """Return the legend of the simulation before and after the extension, or ``alone``."""
    labels = ((before if both else alone, BASE), (after, EXTENDED))[: 1 + both]
    key = "facecolor" if kind == "area" else "color"
    size = {"line": {"linewidth": 1.8}, "dot": {"markersize": 9.0}, "area": {}}[kind]
    return [(kind, label, {key: colour, **size}) for label, colour in labels]


def dots(ax: Any, x: Array, y: Array, colour: str) -> None:
    """Draw points as one path of strokes without length: a fifth of the bytes of markers."""
    import matplotlib.patches
    import matplotlib.path

    if not len(x):
        return
    points = np.repeat(np.column_stack([x, y]), 2, axis=0)
    codes = np.tile([matplotlib.path.Path.MOVETO, matplotlib.path.Path.LINETO], len(x))
    path = matplotlib.path.Path(points, codes)
    style = {"edgecolor": colour, "linewidth": 2.6, "capstyle": "round", "alpha": 0.45}
    ax.add_artist(matplotlib.patches.PathPatch(path, fill=False, **style))


def square(ax: Any, column: int, row: int, colour: str, alpha: float) -> None:
    """Fill a cell of a matrix."""
    import matplotlib.patches

    corner = (column + 0.03, row + 0.03)
    ax.add_artist(
        matplotlib.patches.Rectangle(corner, 0.94, 0.94, linewidth=0, facecolor=colour, alpha=alpha)
    )


def for_page(svg: str, name: str, alt: str, height: float) -> str:
    """Return matplotlib's SVG as an element of the page: unique ids, the page's colours, fonts."""
    body = svg[svg.index("<svg") :]
    body = body[body.index(">") + 1 :]
    for tag in ("metadata", "style"):
        body = re.sub(rf"<{tag}.*?</{tag}>", "", body, count=1, flags=re.DOTALL)
    body = re.sub(r"<[^>]+>", lambda found: _tag(found[0], name), body)
    body = re.sub(r">\s+<", "><", body)
    head = f'<svg viewBox="0 0 {WIDTH:g} {height:g}" role="img" aria-label="{escape(alt)}">'
    return head + body.strip()


def _tag(tag: str, name: str) -> str:
    if tag.startswith("<g "):
        tag = re.sub(r' id="[^"]*"', "", tag)
    tag = tag.replace(' id="', f' id="{name}-').replace("url(#", f"url(#{name}-")
    tag = tag.replace(' xlink:href="#', f' href="#{name}-')
    tag = re.sub(r' style="[^"]*"', lambda found: _style(found[0]), tag)
    return re.sub(r' d="[^"]*"', lambda found: _path(found[0]), tag)


def _path(text: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"(\.\d\d)\d+", r"\1", text))


def _style(text: str) -> str:
    text = re.sub(r"font: (\w+) ([\d.]+px)", r"font-weight: \1; font: \2", text)
    text = re.sub(r"font: ([\d.]+px) [^;\"]*", r"font-size: \1", text)
    names = {colour: f"var(--{name})" for colour, name in VARIABLES.items()}
    return re.sub(r"#[0-9a-f]{6}", lambda found: names.get(found[0], found[0]), text)
