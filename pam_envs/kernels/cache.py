"""Folder of compiled code, and files that appear in it whole or not at all."""

import os
from pathlib import Path

_BASE = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
FOLDER = Path(os.environ.get("PAM_ENVS_CACHE") or Path(_BASE) / "pam_envs")
"""Folder of compiled code (``PAM_ENVS_CACHE``)."""


def write_whole(path: Path, data: bytes) -> None:
    """Write a file through a temporary one beside it; OSError where nothing can be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
