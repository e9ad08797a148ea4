"""Files: written atomically, and their digests."""

import hashlib
import os
import socket
from collections.abc import Collection, Iterable
from pathlib import Path

SOURCES = {".py", ".yaml", ".yml", ".csv", ".json", ".npz", ".onnx", ".safetensors"}
TEMPORARY = ".tmp"  # suffix of files that are being written


def write_bytes(path: Path, content: bytes) -> None:
    """Replace a file atomically: a reader finds the old bytes or the new ones, never a part."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.parent / f".{path.name}.{socket.gethostname()}.{os.getpid()}{TEMPORARY}"
    try:
        with open(temporary, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:  # a full disk names no file
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        temporary.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


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
