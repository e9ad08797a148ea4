"""Digests of source files."""

import hashlib
from collections.abc import Collection, Iterable
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
