"""Tutorials: each runs without an error, and its notebook holds the same cells."""

import importlib.util
from pathlib import Path

import pytest

from sweeps.limits import scaled

jupytext = pytest.importorskip("jupytext")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

ROOT = Path(__file__).parents[2]
NEEDED = {
    "diagnose": ["matplotlib"],
    "export": ["fmpy", "ziglang"],
    "linear_design": ["control", "matplotlib"],
    "robust": ["torch", "stable_baselines3", "onnxruntime"],
    "train": ["torch", "stable_baselines3", "onnxruntime"],
}


def load_maker():
    """Return the module that writes the notebooks."""
    spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs/make_notebooks.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


PAGES = {page.stem: page for page in load_maker().pages()}


@pytest.mark.parametrize("name", PAGES)
def test_tutorial_runs(name):
    for package in NEEDED.get(name, ["matplotlib"]):
        pytest.importorskip(package)
    notebook = jupytext.read(PAGES[name])
    client = nbclient.NotebookClient(
        notebook,
        timeout=int(scaled(600)),
        kernel_name="python3",
        resources={"metadata": {"path": str(ROOT)}},
    )
    client.execute()  # raises CellExecutionError with the failing cell
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert len(code) >= 3 and all(cell.execution_count for cell in code)


@pytest.mark.parametrize("name", PAGES)
def test_notebook_is_that_of_the_page(name):
    maker = load_maker()
    written = (maker.NOTEBOOKS / f"{name}.ipynb").read_text()
    assert written == maker.notebook(PAGES[name]), "run python docs/make_notebooks.py"
