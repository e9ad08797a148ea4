"""Folder of compiled code, and files in it that are whole, unchanged and of this user.

Each file begins with the SHA-256 of its content, which finds accidental damage. A folder that
another user owns, or that everyone may write to, is neither read nor written: its code would run
with the rights of this process.
"""

import hashlib
import os
from functools import cache
from pathlib import Path

from pam_envs.kernels.notice import announce

_BASE = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
FOLDER = Path(os.environ.get("PAM_ENVS_CACHE") or Path(_BASE) / "pam_envs")
"""Folder of compiled code (``PAM_ENVS_CACHE``)."""
SIZE = hashlib.sha256().digest_size


def make_folder(folder: Path) -> None:
    """Make the folder where it is missing; OSError if it belongs to others."""
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    if not is_own(folder):
        raise PermissionError(f"{folder} belongs to another user, or everyone may write to it")


def is_own(folder: Path) -> bool:
    """Return whether only this user, or the user's group, writes to a folder."""
    if not hasattr(os, "getuid"):
        return True
    found = folder.stat()
    return found.st_uid == os.getuid() and not found.st_mode & 0o002


def read_whole(path: Path) -> bytes | None:
    """Return the content of a file of :func:`write_whole`; None where it cannot be trusted."""
    try:
        if not is_own(path.parent):
            complain(path.parent, "belongs to another user, or everyone may write to it")
            return None
        data = path.read_bytes()
    except OSError:
        return None
    content = data[SIZE:]
    if hashlib.sha256(content).digest() == data[:SIZE]:
        return content
    complain(path.parent, "has damaged files, which are replaced")
    return None


def write_whole(path: Path, data: bytes) -> None:
    """Write a file through a temporary one beside it; OSError where nothing can be written."""
    make_folder(path.parent)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(hashlib.sha256(data).digest() + data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@cache
def complain(folder: Path, why: str) -> None:
    """Warn, once in a process, that code is compiled in spite of a folder of compiled code."""
    announce(f"{folder} {why}: code is compiled again (set PAM_ENVS_CACHE to use another folder)")
