"""Results on disk that are either whole or absent.

A file is written under a temporary name, flushed to the disk and renamed, so that a process that
is killed leaves the old file or the new one. Every file carries a checksum over what is compared
(all but ``volatile``); one that does not match is set aside and computed again.
"""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.identity.hashing import digest, plain

VOLATILE = "volatile"
CHECKSUM = "checksum"
_SUFFIX = ".tmp"


def comparable(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record without times, host, date and checksum: what is hashed and compared."""
    return {key: value for key, value in record.items() if key not in (VOLATILE, CHECKSUM)}


def write_text(path: Path, text: str) -> None:
    """Replace a file by ``text``, atomically."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Replace a file by ``content``, atomically: temporary file, fsync, rename."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.parent / f".{path.name}.{socket.gethostname()}.{os.getpid()}{_SUFFIX}"
    with open(temporary, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(temporary, path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def seal(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the record in plain JSON types, with the checksum of its comparable part."""
    sealed: dict[str, Any] = plain({k: v for k, v in record.items() if k != CHECKSUM})
    sealed[CHECKSUM] = digest(comparable(sealed))
    return sealed


def write_record(path: Path, record: Mapping[str, Any]) -> None:
    """Write a record as JSON with its checksum."""
    write_text(path, json.dumps(seal(record), indent=1, sort_keys=True, allow_nan=False) + "\n")


def fault(record: Any) -> str | None:
    """Return what is wrong with a record that was read, ``None`` if nothing."""
    if not isinstance(record, dict):
        return "not a JSON object"
    if CHECKSUM not in record:
        return "no checksum"
    if record[CHECKSUM] != digest(comparable(record)):
        return "the checksum does not match the content"
    return None


def read_record(path: Path) -> dict[str, Any]:
    """Return a record whose checksum matches.

    Raises
    ------
    ValueError
        If the file is not JSON, or is not what was written.
    """
    try:
        record = json.loads(path.read_bytes())
    except (ValueError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not JSON ({error})") from error
    wrong = fault(record)
    if wrong:
        raise ValueError(f"{path}: {wrong}; run the row again")
    return dict(record)


@dataclass(frozen=True)
class Store:
    """A folder of records, each named by the digest of what it is the result of."""

    folder: Path

    def path(self, key: str) -> Path:
        """Return where the record ``key`` lies."""
        return self.folder / f"{key}.json"

    def load(self, key: str) -> dict[str, Any] | None:
        """Return a record, ``None`` if it is missing; a corrupt one is set aside first."""
        try:
            return self._read(key)
        except FileNotFoundError:
            return None
        except ValueError:
            self.quarantine(self.path(key))
            return None

    def sound(self, key: str) -> bool:
        """Return whether the record ``key`` is there and whole; nothing is changed."""
        try:
            self._read(key)
        except (FileNotFoundError, ValueError):
            return False
        return True

    def _read(self, key: str) -> dict[str, Any]:
        record = read_record(self.path(key))
        if record.get("key") != key:
            raise ValueError(f"{self.path(key)}: holds the record {record.get('key')!r}")
        return record

    def save(self, key: str, record: Mapping[str, Any]) -> None:
        """Write a record under its key."""
        write_record(self.path(key), {**record, "key": key})

    def quarantine(self, path: Path) -> Path:
        """Move a corrupt file into ``quarantine`` and return its new place."""
        aside = self.folder / "quarantine"
        aside.mkdir(parents=True, exist_ok=True)
        number = len(list(aside.iterdir()))
        target = aside / f"{path.stem}.{number}{path.suffix}"
        with suppress(FileNotFoundError):  # another run was faster
            os.replace(path, target)
        return target

    def quarantined(self) -> list[str]:
        """Return the names of the files that were set aside."""
        aside = self.folder / "quarantine"
        return sorted(file.name for file in aside.iterdir()) if aside.is_dir() else []

    def sweep(self) -> int:
        """Remove temporary files of processes that are gone, and return how many."""
        return sweep(self.folder)


def sweep(folder: Path) -> int:
    """Remove what processes of this machine left half-written in ``folder``."""
    removed = 0
    for file in folder.glob(f".*{_SUFFIX}") if folder.is_dir() else ():
        *_, host, process = file.name[: -len(_SUFFIX)].rsplit(".", 2)
        if host == socket.gethostname() and not _alive(process):
            file.unlink(missing_ok=True)
            removed += 1
    return removed


def _alive(process: str) -> bool:
    try:
        os.kill(int(process), 0)
    except (ValueError, ProcessLookupError):
        return False
    except PermissionError:
        return True
    return True
