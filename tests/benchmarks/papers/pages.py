"""Figures of a paper, and pages of the documentation, whose numbers the tests compute again."""

import re
from functools import cache
from pathlib import Path

from benchmarks.papers.figures import all_figures
from benchmarks.papers.published import Figure


@cache
def figures_of(paper: str) -> dict[str, Figure]:
    """Return the computed figures of a paper by their names, of which none is there twice."""
    made = [figure for figure in all_figures([paper]) if figure.ours is not None]
    assert len({figure.name for figure in made}) == len(made)
    return {figure.name: figure for figure in made}


class Page:
    """A page: its path, its text in one line without bold type, and its tables."""

    def __init__(self, name: str) -> None:
        self.path = Path(__file__).parents[3] / "docs" / name
        self.text = self.path.read_text()
        self.flat = " ".join(self.text.replace("**", "").split())

    def rows(self, first: str) -> list[list[str]]:
        """Return the cells of the table lines that begin so, without the first one."""
        lines = re.findall(rf"^\| {re.escape(first)} \|(.*)\|$", self.text, re.MULTILINE)
        return [[cell.strip() for cell in line.split("|")] for line in lines]

    def row(self, first: str) -> list[str]:
        """Return the cells of the only such line."""
        (line,) = self.rows(first)
        return line
