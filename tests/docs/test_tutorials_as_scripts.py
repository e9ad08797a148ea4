"""The quickest tutorials run as plain Python; all of them run as notebooks (test_tutorials.py)."""

import re
from pathlib import Path

import pytest

pyplot = pytest.importorskip("matplotlib.pyplot")
TUTORIALS = Path(__file__).parents[2] / "docs/tutorials"
CELL = re.compile(r"^```\{code-cell\}[^\n]*\n(?::[^\n]*\n)*(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", ["controller", "figure", "linear_design"])
def test_quick_tutorial_runs(name):
    if name == "linear_design":
        pytest.importorskip("control")
    page = TUTORIALS / f"{name}.md"
    text = page.read_text()
    names: dict[str, object] = {"__name__": name}
    cells = list(CELL.finditer(text))
    assert len(cells) >= 3
    for cell in cells:
        line = text.count("\n", 0, cell.start(1))
        exec(compile("\n" * line + cell[1], page.name, "exec"), names)
    pyplot.close("all")
