"""Which rows have been run again and came out the same: what ``verify`` leaves beside the rows."""

from __future__ import annotations

import datetime
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from filelock import FileLock

from benchmarks import provenance
from benchmarks.store import CHECKSUM, write_text

FILE = "verified.json"
"""Beside the rows: from row to ``checksum``, ``commit``, ``date`` and ``mode``."""
BITS, ELSEWHERE = "bits", "elsewhere"

Found = Mapping[str, Mapping[str, Any]]


def read(folder: Path) -> Found:
    """Return the verifications of a folder of rows; none where there is no such file.

    Raises
    ------
    ValueError
        If the file is damaged.
    """
    path = folder / FILE
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return {}
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {error}; restore it from git, or verify again") from error


def of(row: Mapping[str, Any], found: Found) -> Mapping[str, Any] | None:
    """Return the verification of a row as it is, ``None`` where there is none since it changed."""
    entry = found.get(row["row"])
    return entry if entry and entry["checksum"] == row.get(CHECKSUM) else None


def note(path: Path, checksum: str, mode: str) -> None:
    """Note beside a row that it held, or take out what was noted where it did not.

    Parameters
    ----------
    path : Path
        Of the row.
    checksum : str
        Of what was verified; empty where it did not hold.
    mode : {"bits", "elsewhere"}
        How it was compared.
    """
    with FileLock(path.parent / f".{FILE}.lock"):
        before = read(path.parent)
        known = {name: entry for name, entry in before.items() if name != path.stem}
        if checksum:
            known[path.stem] = {
                "checksum": checksum,
                "commit": provenance.commit(),
                "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
                "mode": mode,
            }
        if known != before:
            write_text(path.parent / FILE, json.dumps(known, indent=1, sort_keys=True) + "\n")
