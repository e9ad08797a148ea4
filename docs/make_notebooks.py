"""Write the tutorials as Jupyter notebooks, without outputs (``python docs/make_notebooks.py``).

The source of a tutorial is its page, ``docs/tutorials/NAME.md`` (MyST Markdown); the notebook is
``docs/tutorials/notebooks/NAME.ipynb``. ``--check`` writes nothing and fails if they differ.
"""

import os
import re
import sys
from pathlib import Path

import jupytext
import nbformat

TUTORIALS = Path(__file__).parent / "tutorials"
NOTEBOOKS = TUTORIALS / "notebooks"
LINK = re.compile(r"\]\((?!https?:|#)([^)\s]+)\)")


def pages() -> list[Path]:
    """Return the pages of the tutorials."""
    return [path for path in sorted(TUTORIALS.glob("*.md")) if path.name != "index.md"]


def notebook(page: Path) -> str:
    """Return the notebook of a page as JSON, the same at every call."""
    made = jupytext.read(page)
    made.metadata = nbformat.from_dict({"kernelspec": made.metadata["kernelspec"]})
    for number, cell in enumerate(made.cells):
        cell.id = f"cell-{number}"
        cell.metadata = nbformat.from_dict({})
        if cell.cell_type == "markdown":
            cell.source = LINK.sub(_from_folder, cell.source)
    nbformat.validate(made)
    return nbformat.writes(made) + "\n"


def _from_folder(link: re.Match[str]) -> str:
    """Return a link of a page, relative to the folder of the notebooks."""
    return f"]({os.path.join('..', link[1])})"


def main() -> None:
    """Write or check all notebooks."""
    NOTEBOOKS.mkdir(exist_ok=True)
    for page in pages():
        path = NOTEBOOKS / f"{page.stem}.ipynb"
        if "--check" not in sys.argv:
            path.write_text(notebook(page))
        elif not path.exists() or path.read_text() != notebook(page):
            sys.exit(f"{path} differs from {page}: run python docs/make_notebooks.py")


if __name__ == "__main__":
    main()
