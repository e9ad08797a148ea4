"""Pages of the documentation, whose numbers the tests compute again."""

import re
from pathlib import Path


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
