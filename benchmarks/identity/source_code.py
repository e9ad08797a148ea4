"""What code says, without what only readers see of it: comments, docstrings and blank lines."""

from __future__ import annotations

import ast
import hashlib
import io
import tokenize
from collections.abc import Iterable, Iterator
from pathlib import Path

Place = tuple[int, int]
"""Line and byte in it, both from 0."""


def code_text(source: str) -> str:
    """Return Python code without comments, docstrings and blank lines."""
    lines = source.splitlines()
    docstrings, comments, empty = list(_docstrings(source)), [], set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        line = token.start[0] - 1
        if token.type == tokenize.COMMENT:
            comments.append((line, token.start[1]))
        if token.type == tokenize.NL:
            empty.add(line)
    for line, column in comments:
        lines[line] = lines[line][:column].rstrip()
    for start, stop in docstrings:
        _blank(lines, start, stop)
        empty |= set(range(start[0], stop[0] + 1))
    kept = [text for k, text in enumerate(lines) if text.strip() or k not in empty]
    return "\n".join(kept) + "\n"


def _docstrings(source: str) -> Iterator[tuple[Place, Place]]:
    """Yield where each string that is a statement begins and ends."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
            continue
        if isinstance(node.value.value, str):
            last = node.end_lineno or node.lineno
            yield (node.lineno - 1, node.col_offset), (last - 1, node.end_col_offset or 0)


def _blank(lines: list[str], start: Place, stop: Place) -> None:
    """Remove what stands between two places, lines and all that is before them kept."""
    for number in range(start[0], stop[0] + 1):
        raw = lines[number].encode()
        first = start[1] if number == start[0] else 0
        last = stop[1] if number == stop[0] else len(raw)
        lines[number] = (raw[:first] + raw[last:]).decode().rstrip()


def code_digest(files: Iterable[Path], root: Path) -> str:
    """Return the SHA-256 of what Python files say, by their names relative to a folder."""
    state = hashlib.sha256()
    for file in sorted(files):
        state.update(file.relative_to(root).as_posix().encode())
        state.update(code_text(file.read_text(encoding="utf-8")).encode())
    return state.hexdigest()


def needed(files: Iterable[Path], root: Path) -> set[Path]:
    """Return files and all that they import from their own packages under a folder.

    The pages of the packages that they are in are imported with them.

    Parameters
    ----------
    files : iterable of Path
    root : Path
        Folder that holds the packages; imports of other packages are not followed.
    """
    left, found = {file.resolve() for file in files}, set[Path]()
    tops = {file.relative_to(root).parts[0].removesuffix(".py") for file in left}
    while left:
        file = left.pop()
        found.add(file)
        names = _imports(ast.parse(file.read_text(encoding="utf-8")))
        own = {name for name in names if name.partition(".")[0] in tops}
        left |= {path for name in own if (path := _file(name, root)) is not None} - found
        left |= _packages(file, root) - found
    return found


def _packages(file: Path, root: Path) -> set[Path]:
    """Return the ``__init__.py`` of each package that a file is in."""
    folders = [folder for folder in file.parents if folder.is_relative_to(root) and folder != root]
    return {page for folder in folders if (page := folder / "__init__.py").is_file()}


def _imports(tree: ast.AST) -> set[str]:
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def _file(module: str, root: Path) -> Path | None:
    path = root.joinpath(*module.split("."))
    choices = (path.with_suffix(".py"), path / "__init__.py")
    return next((choice.resolve() for choice in choices if choice.is_file()), None)
