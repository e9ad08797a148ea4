"""Tutorials run as plain Python; `make docs` executes them as notebooks."""

import re
from pathlib import Path

import pytest

pyplot = pytest.importorskip("matplotlib.pyplot")
ROOT = Path(__file__).parents[2]
PAGES = {path.stem: path for path in (ROOT / "docs/tutorials").glob("*.md")}
CELL = re.compile(r"^```\{code-cell\}[^\n]*\n(?::[^\n]*\n)*(.*?)^```$", re.MULTILINE | re.DOTALL)
NEEDED = {
    "export": ["fmpy", "ziglang"],
    "linear_design": ["control"],
    "robust": ["torch", "stable_baselines3", "onnxruntime"],
    "train": ["torch", "stable_baselines3", "onnxruntime"],
}


@pytest.mark.parametrize("name", sorted(PAGES.keys() - {"index"}))
def test_tutorial_runs(name, monkeypatch):
    for package in NEEDED.get(name, []):
        pytest.importorskip(package)
    monkeypatch.chdir(ROOT)
    page = PAGES[name]
    text = page.read_text()
    names: dict[str, object] = {"__name__": name}
    cells = list(CELL.finditer(text))
    assert len(cells) >= 3
    for cell in cells:
        line = text.count("\n", 0, cell.start(1))
        exec(compile("\n" * line + cell[1], page.name, "exec"), names)
    pyplot.close("all")
