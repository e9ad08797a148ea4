"""Verification record beside the rows: reproduced rows, date, and exactness."""

import datetime
import json
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from filelock import FileLock

from benchmarks.runs import provenance, rows
from benchmarks.runs.store import CHECKSUM
from pam_envs.files import write_text

FILE = "verified.json"
"""Beside the rows: of each row ``checksum``, ``date``, ``mode``, ``commit`` and ``packages``."""
BITS, ELSEWHERE = "bits", "elsewhere"
"""Reproduced to the last bit; within tolerance, with other packages or on another processor."""

Found = Mapping[str, Mapping[str, Any]]


def read(folder: Path) -> Found:
    """Return the verifications of a folder of rows; none without the file."""
    path = folder / FILE
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        return {}
    except (ValueError, TypeError) as error:
        raise ValueError(f"{path}: {error}; restore it from git, or verify again") from error


def committed(folder: Path) -> Found:
    """Return the verifications that the last commit of this checkout holds for a folder of rows.

    Those of another folder, or written since, were not made by its history.
    """
    if folder.resolve() != rows.RESULTS.resolve():
        return {}
    try:
        text = provenance.git("show", f"HEAD:./{FILE}", folder=folder)
    except (OSError, subprocess.SubprocessError):
        return {}
    kept, present = json.loads(text), read(folder)
    return {name: entry for name, entry in present.items() if kept.get(name) == entry}


def of(row: Mapping[str, Any], found: Found) -> Mapping[str, Any] | None:
    """Return the verification of a row, ``None`` without one for its present content."""
    entry = found.get(row["row"])
    return entry if entry and entry["checksum"] == row.get(CHECKSUM) else None


def note(path: Path, checksum: str, mode: str) -> None:
    """Record how a row was reproduced (bits stay bits); remove its entry without a checksum."""
    folder, name = path.parents[1], rows.name_of(path)
    with FileLock(folder / f".{FILE}.lock"):
        before = read(folder)
        old = before.get(name, {})
        if mode == ELSEWHERE and (old.get("checksum"), old.get("mode")) == (checksum, BITS):
            return
        known = {row: entry for row, entry in before.items() if row != name}
        if checksum:
            known[name] = {
                "checksum": checksum,
                "commit": provenance.commit(),
                "packages": provenance.packages(),
                "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
                "mode": mode,
            }
        if known != before:
            write_text(folder / FILE, json.dumps(known, indent=1, sort_keys=True) + "\n")
