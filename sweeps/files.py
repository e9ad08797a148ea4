"""Digests of source files, and errors of database files."""

import errno
import hashlib
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

SOURCES = {".py", ".yaml", ".yml", ".csv", ".json", ".npz", ".onnx", ".safetensors"}


def sources_digest(paths: Iterable[Path], kinds: Collection[str] = SOURCES) -> str:
    """Return the SHA-256 of files and of folders' code and data by relative name, 16 digits."""
    state = hashlib.sha256()
    for root in paths:
        files = sorted(root.rglob("*")) if root.is_dir() else [root]
        for file in files:
            if file.is_file() and file.suffix in kinds:
                state.update(file.relative_to(root.parent).as_posix().encode())
                state.update(file.read_bytes())
    return state.hexdigest()[:16]


@contextmanager
def database_named(path: Path) -> Iterator[None]:
    """Turn an error of the database in a file, as of a full disk, into an OSError that names it."""
    try:
        yield
    except Exception as error:
        for cause in (error, error.__cause__, error.__context__):
            if type(cause).__module__.startswith(("sqlalchemy.", "sqlite3")):
                reason = str(getattr(cause, "orig", cause))
                raise OSError(errno.EIO, reason, str(path)) from error
        raise
