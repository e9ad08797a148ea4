"""What code says: comments, docstrings and blank lines aside."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from benchmarks.identity.source_code import code_digest, code_text, needed
from benchmarks.runs.provenance import ROOT

PLAIN = '''def f(x):
    y = """kept
#

    lines"""
    return x + 1
'''
TALKING = '''"""A page."""


# a comment
def f(x):  # another
    """Docstring.

    With lines, and ä # not a comment.
    """

    y = """kept
#

    lines"""

    return x + 1  # one more: ä
'''


def test_what_only_readers_see_is_left_out() -> None:
    assert code_text(TALKING) == code_text(PLAIN) == PLAIN


@pytest.mark.parametrize("change", [("x + 1", "x + 2"), ("#\n\n", "#\n"), ("y =", "z =")])
def test_all_else_counts(change: tuple[str, str]) -> None:
    assert code_text(PLAIN.replace(*change)) != PLAIN


def test_nothing_of_the_metrics_gets_lost() -> None:
    for path in (ROOT / "benchmarks").glob("metrics*.py"):
        source = path.read_text(encoding="utf-8")
        assert _statements(code_text(_passing(source))) == _statements(_passing(source)), path.name


def _passing(source: str) -> str:
    """Return code in which a docstring is never all of a body."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            node.body.append(ast.Pass())
    return ast.unparse(tree)


def _statements(source: str) -> str:
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [s for s in body if not _is_string(s)]
    return ast.dump(tree)


def _is_string(statement: ast.stmt) -> bool:
    alone = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return alone and isinstance(statement.value.value, str)


def test_imports_are_followed_within_their_package(tmp_path: Path) -> None:
    files = {
        "own/__init__.py": "from own.page import h\n",
        "own/page.py": "",
        "own/first.py": "import numpy\nfrom own.second import f\nfrom other import g\n",
        "own/second.py": "from own import third\n",
        "own/third.py": "",
        "own/alone.py": "",
        "other.py": "",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    found = needed([tmp_path / "own/first.py"], tmp_path)
    names = {path.relative_to(tmp_path).as_posix() for path in found}
    assert names == {f"own/{page}.py" for page in ("__init__", "page", "first", "second", "third")}
    before = code_digest(found, tmp_path)
    (tmp_path / "own/third.py").write_text("# said\n")
    assert code_digest(found, tmp_path) == before
    (tmp_path / "own/third.py").write_text("done = 1\n")
    assert code_digest(found, tmp_path) != before
