"""Which rows have been run again and came out the same: what ``verify`` leaves beside the rows."""

from __future__ import annotations

import datetime
import json
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from filelock import FileLock

from benchmarks.identity import artefacts
from benchmarks.runs import cells, provenance, rows
from benchmarks.runs.controllers import Entrant
from benchmarks.runs.store import CHECKSUM, write_text

FILE = "verified.json"
"""Beside the rows: of each row ``checksum``, ``date``, ``mode``, and what it was run again with."""
BITS, ELSEWHERE = "bits", "elsewhere"
OLDER = "older"
"""Key under which :func:`of` puts whether the code is another one since."""

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


def of(
    row: Mapping[str, Any], found: Found, entrants: Mapping[str, Entrant]
) -> Mapping[str, Any] | None:
    """Return the verification of a row as it is, ``None`` where there is none since it changed.

    ``older`` says whether it was of other code, data or policies than are here now, those of the
    entrants by their names.
    """
    entry = found.get(row["row"])
    if not entry or entry["checksum"] != row.get(CHECKSUM):
        return None
    return {**entry, OLDER: _is_older(row, entry, entrants)}


def _is_older(
    row: Mapping[str, Any], entry: Mapping[str, Any], entrants: Mapping[str, Entrant]
) -> bool:
    about = row["controller"]
    entrant = entrants.get(about["name"])
    if entrant is None or cells.sources(entrant) != entry.get("sources"):
        return True
    policies = [artefacts.file_record(path, seed)["sha256"] for seed, path in entrant.files]
    return policies != [file["sha256"] for file in about["artefact"]["files"]]


def refusal() -> str:
    """Return why nothing can be noted in this checkout, empty where it can.

    A note names the code by its commit: none does that is changed since.
    """
    try:
        changed = provenance.changed()
    except (OSError, subprocess.SubprocessError):  # no checkout: the digests of sources tell
        return ""
    if not changed:
        return ""
    return (
        f"not noted in {FILE}, since {provenance.listed(changed)} is not as in the last commit: "
        "commit or stash it and verify again"
    )


def note(path: Path, checksum: str, mode: str, sources: Mapping[str, str]) -> None:
    """Note beside a row that it held, or take out what was noted where it did not.

    That it held to the last bit stays noted where it holds elsewhere, too, with the same sources.

    Parameters
    ----------
    path : Path
        Of the row.
    checksum : str
        Of what was verified; empty where it did not hold.
    mode : {"bits", "elsewhere"}
        How it was compared.
    sources : mapping of str
        Digests of what it was run again with; see :func:`benchmarks.runs.cells.sources`.
    """
    folder, name = path.parents[1], rows.name_of(path)
    with FileLock(folder / f".{FILE}.lock"):
        before = read(folder)
        if _is_stronger(before.get(name), checksum, mode, sources):
            return
        known = {row: entry for row, entry in before.items() if row != name}
        if checksum:
            known[name] = {
                "checksum": checksum,
                "commit": provenance.commit(),
                "sources": dict(sources),
                "packages": provenance.packages(),
                "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
                "mode": mode,
            }
        if known != before:
            write_text(folder / FILE, json.dumps(known, indent=1, sort_keys=True) + "\n")


def _is_stronger(
    entry: Mapping[str, Any] | None, checksum: str, mode: str, sources: Mapping[str, str]
) -> bool:
    """Return whether a note says more than that the same row held elsewhere."""
    return (
        entry is not None
        and mode == ELSEWHERE
        and entry["mode"] == BITS
        and entry["checksum"] == checksum
        and entry.get("sources") == dict(sources)
    )
