"""Notebooks of the tutorials hold the cells of their pages."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("jupytext")

ROOT = Path(__file__).parents[2]


def load_maker():
    """Return the module that writes the notebooks."""
    spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs/make_notebooks.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


PAGES = {page.stem: page for page in load_maker().pages()}


@pytest.mark.parametrize("name", PAGES)
def test_notebook_is_that_of_the_page(name):
    maker = load_maker()
    written = (maker.NOTEBOOKS / f"{name}.ipynb").read_text()
    assert written == maker.notebook(PAGES[name]), "run python docs/make_notebooks.py"
