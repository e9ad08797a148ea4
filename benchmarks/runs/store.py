"""Records on disk, written atomically, with a checksum over all entries except ``volatile``.

A file is written under a temporary name, flushed to the disk and renamed, so that a killed process
leaves the old file or the new one. A file that ends in ``.xz`` is compressed JSON and holds the
episodes as columns: one list of values per key, for episodes with the same keys.
"""

import json
import lzma
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.identity.hashing import digest, plain
from pam_envs.files import fresh_folder, write_bytes, write_text
from pam_envs.wording import printable, shown

VOLATILE = "volatile"
CHECKSUM = "checksum"
COMPRESSED = ".xz"
EPISODES, SCORES = "episodes", "scores"
MOST = 50_000_000
"""Largest number of bytes of a record."""


def comparable(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return a record without times, host, date and checksum, for hashes and comparisons."""
    return {key: value for key, value in record.items() if key not in (VOLATILE, CHECKSUM)}


def write_folder(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    """Replace the folders and files of texts by relative path, all at once, and return paths."""
    with fresh_folder(folder) as fresh:
        for name, text in texts.items():
            (fresh / name).parent.mkdir(parents=True, exist_ok=True)
            (fresh / name).write_text(text, encoding="utf-8", newline="\n")
    return [folder / name for name in texts]


def seal(record: Mapping[str, Any]) -> dict[str, Any]:
    """Return the record in plain JSON types, with the checksum of its comparable part."""
    sealed: dict[str, Any] = plain({k: v for k, v in record.items() if k != CHECKSUM})
    sealed[CHECKSUM] = digest(comparable(sealed))
    return sealed


def write_record(path: Path, record: Mapping[str, Any]) -> None:
    """Write a record with its checksum; see :func:`write_json`."""
    write_json(path, seal(record))


def write_json(path: Path, record: Mapping[str, Any]) -> None:
    """Write a record as JSON; compressed and with episodes as columns if the path ends in .xz."""
    if path.suffix != COMPRESSED:
        write_text(path, json.dumps(record, indent=1, sort_keys=True, allow_nan=False) + "\n")
        return
    packed = {k: columns(v) if k == EPISODES else v for k, v in record.items()}
    text = json.dumps(packed, separators=(",", ":"), sort_keys=True, allow_nan=False)
    write_bytes(path, lzma.compress(text.encode() + b"\n"))


def read_json(path: Path) -> Any:
    """Return the content of a JSON file, compressed or not; its checksum is not verified.

    A ValueError names the file: one of more than ``MOST`` bytes, unpacked, is not read, nor is one
    with a key twice in an object, or a number that is not finite.
    """
    try:
        if path.stat().st_size > MOST:
            raise ValueError(f"more than {MOST:,} bytes")
        content = path.read_bytes()
        if path.suffix != COMPRESSED:
            return _parsed(content)
        held = _parsed(_unpacked(content))
        packed = isinstance(held, dict) and EPISODES in held
        return {**held, EPISODES: from_columns(held[EPISODES])} if packed else held
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path}: not JSON ({printable(str(error)[:200])})") from error


def _unpacked(content: bytes) -> bytes:
    try:
        unpacker = lzma.LZMADecompressor(lzma.FORMAT_XZ)
        data = unpacker.decompress(content, MOST + 1)
    except lzma.LZMAError as error:
        raise ValueError(str(error)) from error
    if not unpacker.eof:
        raise ValueError(f"cut off, or more than {MOST:,} bytes")
    return data


def _parsed(content: bytes) -> Any:
    """Return parsed JSON; ValueError for a key twice in an object, or for NaN and Infinity."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            key = next(k for k, count in Counter(k for k, _ in pairs).items() if count > 1)
            raise ValueError(f"{shown(key)} is twice in an object")
        return found

    def refuse(name: str) -> Any:
        raise ValueError(f"{name} is no number")

    return json.loads(content, object_pairs_hook=unique, parse_constant=refuse)


def columns(episodes: Any) -> Any:
    """Return episodes as columns, or unchanged if their keys differ."""
    if not _alike(episodes) or not _alike([episode.get(SCORES) for episode in episodes]):
        return episodes
    found = {key: [episode[key] for episode in episodes] for key in episodes[0] if key != SCORES}
    metrics = episodes[0][SCORES]
    return found | {SCORES: {m: [episode[SCORES][m] for episode in episodes] for m in metrics}}


def from_columns(packed: Any) -> Any:
    """Return the episodes whose columns :func:`columns` made."""
    if not isinstance(packed, dict):
        return packed
    others = {key: values for key, values in packed.items() if key != SCORES}
    scores = _rows(packed[SCORES])
    return [{**episode, SCORES: s} for episode, s in zip(_rows(others), scores, strict=True)]


def _alike(records: Any) -> bool:
    """Return whether these are mappings, at least one, all with the same keys."""
    if not isinstance(records, Sequence) or not records:
        return False
    return all(isinstance(r, Mapping) and r and r.keys() == records[0].keys() for r in records)


def _rows(table: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    return [dict(zip(table, values, strict=True)) for values in zip(*table.values(), strict=True)]


def fault(record: Any) -> str | None:
    """Return the defect of a record that was read, ``None`` if it has none."""
    if not isinstance(record, dict):
        return "not a JSON object"
    if CHECKSUM not in record:
        return "no checksum"
    if record[CHECKSUM] != digest(comparable(record)):
        return "the checksum does not match the content"
    return None


def read_record(path: Path) -> dict[str, Any]:
    """Return a record; raise ValueError if it is not JSON or its checksum does not match."""
    record = read_json(path)
    wrong = fault(record)
    if wrong:
        raise ValueError(f"{path}: {wrong}; run the row again")
    return dict(record)


@dataclass(frozen=True)
class Store:
    """A folder of records, each named by the digest of its inputs."""

    folder: Path

    def path(self, key: str) -> Path:
        """Return the file of the record ``key``."""
        return self.folder / f"{key}.json"

    def load(self, key: str) -> dict[str, Any] | None:
        """Return a record, ``None`` if it is missing; a corrupt one is set aside first."""
        try:
            return self._read(key)
        except FileNotFoundError:
            return None
        except ValueError:
            aside, path = self.folder / "quarantine", self.path(key)
            aside.mkdir(parents=True, exist_ok=True)
            number = len(list(aside.iterdir()))
            with suppress(FileNotFoundError):  # another process was faster
                os.replace(path, aside / f"{path.stem}.{number}{path.suffix}")
            return None

    def sound(self, key: str) -> bool:
        """Return whether the record ``key`` exists and is whole; nothing is changed."""
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

    def quarantined(self) -> list[str]:
        """Return the names of the files that were set aside."""
        aside = self.folder / "quarantine"
        return sorted(file.name for file in aside.iterdir()) if aside.is_dir() else []
