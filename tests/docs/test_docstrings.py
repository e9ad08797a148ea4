"""Docstrings: every public name has one, its numbers have units, and its markup is valid."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("pam_envs", "baselines", "agents", "sweeps")
SECTION = re.compile(
    r"^(?:Parameters|Attributes|Returns)\n-+\n(.*?)(?=^\w[\w ]*\n-{3,}|\Z)", re.M | re.S
)
NUMBERS = re.compile(r"^[^:\n]+ : (?:float|array|array_like|ndarray|Array)(?! of (?:bool|int))\b")
UNIT = re.compile(
    r"\[[^\]]+\]|``[^`]+``"  # a unit in brackets, or values in their notation
    r"|\b(?:share|factor|ratio|weights?|model of one input|returned by)\b",  # without a unit
    re.IGNORECASE,
)


def public(tree: ast.Module) -> Iterator[tuple[str, ast.AST]]:
    """Yield the public names of a module with their nodes, the module itself first."""
    yield "", tree
    nodes: list[tuple[str, ast.AST]] = [("", tree)]
    while nodes:
        prefix, node = nodes.pop()
        for child in getattr(node, "body", []):
            if not isinstance(child, ast.FunctionDef | ast.ClassDef) or child.name.startswith("_"):
                continue
            marks = [ast.unparse(mark) for mark in child.decorator_list]
            if any(mark.endswith((".setter", "overload")) for mark in marks):
                continue
            yield prefix + child.name, child
            if isinstance(child, ast.ClassDef):
                nodes.append((f"{prefix}{child.name}.", child))


LITERAL = re.compile(r"``.*?``", re.S)
STAR = re.compile(r"(?<![\w*\\])\*(?=\w)(?![^*\n]+\*(?!\w)).*")
"""A star that begins emphasis and is not closed on its line: a warning stops the site's build."""


def numbers_without_unit(docstring: str) -> list[str]:
    """Return the numpydoc entries of a docstring whose number has no unit."""
    entries = [
        entry
        for section in SECTION.findall(docstring)
        for entry in re.split(r"^(?=\S)", section, flags=re.MULTILINE)
        if NUMBERS.match(entry)
    ]
    return [" ".join(entry.split()) for entry in entries if not UNIT.search(entry)]


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_have_docstrings_with_units_and_closed_emphasis(package):
    missing, without_unit, open_stars = [], [], []
    for path in sorted((ROOT / package).rglob("*.py")):
        for name, node in public(ast.parse(path.read_text())):
            shown = f"{path.relative_to(ROOT)}: {name}"
            text = ast.get_docstring(node)
            if not text:
                missing.append(shown)
            without_unit += [f"{shown}: {entry}" for entry in numbers_without_unit(text or "")]
            open_stars += [f"{shown}: {star}" for star in STAR.findall(LITERAL.sub("", text or ""))]
    assert open_stars == []
    assert missing == []
    assert without_unit == []


def test_number_without_unit_is_found():
    text = "Parameters\n----------\nload : float\n    Mass{}.\nflags : ndarray of bool\n    x\n"
    assert numbers_without_unit(text.format("")) == ["load : float Mass."]
    assert numbers_without_unit(text.format(" [kg]")) == []


def test_open_emphasis_is_found():
    assert STAR.findall("Return an array (T, *batch).") == ["*batch)."]
    assert STAR.findall("*Ratio* and 2 * width of p*_k; **both** as") == []
