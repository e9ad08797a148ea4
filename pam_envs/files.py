"""Files and folders, replaced atomically.

A reader, a killed process and a full disk find the old content or the new, never a part. Temporary
files carry the host and the process that write them; the next writer removes those of a process
that has ended.
"""

import ctypes
import os
import shutil
import socket
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

TEMPORARY = ".tmp"
"""Suffix of files and folders that are being written."""
_EXCHANGE, _HERE = 2, -100  # RENAME_EXCHANGE and AT_FDCWD of Linux


def write_text(path: Path, text: str) -> None:
    """Replace a text file (UTF-8) atomically; see :func:`write_bytes`."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Replace a file atomically; an OSError names the file, which a full disk does not."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = _temporary(path)
    try:
        with open(temporary, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        temporary.unlink(missing_ok=True)
    _flush(path.parent)


@contextmanager
def fresh_folder(folder: Path, owned: Collection[str] = ()) -> Iterator[Path]:
    """Yield an empty folder that takes the place of ``folder`` at the end, if nothing fails.

    Other entries of the old folder are kept, except those named in ``owned``.

    Raises
    ------
    ValueError
        If ``folder`` contains the working folder.
    OSError
        Names ``folder`` where it cannot be written.
    """
    target = folder.resolve()
    if Path.cwd().is_relative_to(target):
        raise ValueError(f"{folder} contains the working folder; give a folder of its own")
    target.parent.mkdir(parents=True, exist_ok=True)
    fresh = _temporary(target)
    try:
        fresh.mkdir()
        yield fresh
        for old in target.iterdir() if target.is_dir() else ():
            if old.name not in owned and not (fresh / old.name).exists():
                _link(old, fresh / old.name)
        _swap(fresh, target)
    except OSError as error:
        place = fresh if error.filename is None else Path(str(error.filename))
        if error.errno is None or not place.is_relative_to(fresh):
            raise
        named = str(folder / place.relative_to(fresh))
        raise OSError(error.errno, error.strerror, named) from error
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def _temporary(path: Path) -> Path:
    """Return this process's temporary name of a path; remove those of ended processes."""
    start = f".{path.name}.{socket.gethostname()}."
    for entry in os.listdir(path.parent):
        if entry.startswith(start) and entry.endswith(TEMPORARY):
            number, stale = entry.removeprefix(start).removesuffix(TEMPORARY), path.parent / entry
            if not number.isdigit() or _runs(int(number)):
                continue
            if stale.is_dir():
                shutil.rmtree(stale, ignore_errors=True)
            else:
                stale.unlink(missing_ok=True)
    return path.with_name(f"{start}{os.getpid()}{TEMPORARY}")


def _runs(process: int) -> bool:
    """Return whether a process of this machine may still run."""
    if os.name != "posix":  # os.kill ends a process there
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _link(old: Path, new: Path) -> None:
    """Let a file or folder appear in a second folder too, without a copy where that is possible."""

    def link(source: str, destination: str) -> None:
        try:
            os.link(source, destination, follow_symlinks=False)
        except OSError:
            shutil.copy2(source, destination, follow_symlinks=False)

    if old.is_dir() and not old.is_symlink():
        shutil.copytree(old, new, symlinks=True, copy_function=link)
    else:
        link(str(old), str(new))


def _swap(fresh: Path, target: Path) -> None:
    """Let ``fresh`` take the place of ``target``."""
    try:
        os.rename(fresh, target)  # missing or empty
    except OSError:
        if not target.is_dir():
            raise
        if not _exchanged(fresh, target):  # a kill between these two leaves both side by side
            aside = fresh.with_suffix(".old")
            os.rename(target, aside)
            os.rename(fresh, target)
            shutil.rmtree(aside, ignore_errors=True)
    _flush(target.parent)


def _exchanged(first: Path, second: Path) -> bool:
    """Exchange two folders in one step; return False where the system has no such call."""
    if sys.platform != "linux":
        return False
    try:
        exchange = ctypes.CDLL(None).renameat2
    except AttributeError:  # an older C library
        return False
    return bool(exchange(_HERE, os.fsencode(first), _HERE, os.fsencode(second), _EXCHANGE) == 0)


def _flush(folder: Path) -> None:
    """Write the entries of a folder to the disk, where the system can."""
    with suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
