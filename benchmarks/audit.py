"""Audit seeds: derived from task, artefact and a salt that is drawn after the artefact is fixed.

Whoever makes a controller can try it on the public seeds as often as he likes. The published score
is therefore of episodes whose seeds nobody could know: the first eight bytes of

    sha256(task | artefact | salt | scenario | number)

less their last eleven bits, so that every reader of JSON holds the number exactly. The maintainer
draws the salt once for a task and an artefact that git has as committed; salts are only ever added
to ``salts.json``.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import math
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import artefacts, provenance, tasks
from benchmarks.controllers import Entrant
from benchmarks.scenarios import ScenarioSet
from benchmarks.store import write_text

FILE = Path(__file__).resolve().parent / "salts.json"
EPISODES = 30
"""Audit episodes that a row has at least."""
PER_SCENARIO = 2
"""And at least so many of each scenario, since an interval needs the scatter within one."""

Entry = dict[str, Any]


@dataclass(frozen=True)
class Audit:
    """A salt and what follows from it.

    Attributes
    ----------
    salt, drawn : str
        ``drawn`` is the day.
    draw : int
        How many salts the controller of this name has had in this task, this one included.
    seeds : mapping of tuple
        Seeds of each scenario.
    """

    salt: str
    drawn: str
    draw: int
    seeds: Mapping[str, tuple[int, ...]]


def seed_of(task: str, artefact: str, salt: str, scenario: str, number: int) -> int:
    """Return a seed, 53 bits."""
    text = "|".join((task, artefact, salt, scenario, str(number)))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big") >> 11


def seeds_of(
    task: str, artefact: str, salt: str, scenarios: Sequence[str]
) -> dict[str, tuple[int, ...]]:
    """Return the audit seeds of each scenario."""
    each = max(PER_SCENARIO, math.ceil(EPISODES / len(scenarios)))
    return {
        name: tuple(seed_of(task, artefact, salt, name, k) for k in range(each))
        for name in scenarios
    }


def entries(file: Path | None = None) -> list[Entry]:
    """Return the salts in the order of their drawing; none where there is no file.

    Raises
    ------
    ValueError
        If the file is damaged, or one task and artefact has two salts.
    """
    path = FILE if file is None else file
    if not path.exists():
        return []
    try:
        found = list(json.loads(path.read_text(encoding="utf-8"))["salts"])
        keys = [(entry["task"], entry["artefact"]) for entry in found]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path}: not a list of salts ({error}); restore it from git") from error
    if len(set(keys)) != len(keys):
        raise ValueError(f"{path}: a task and artefact has two salts; restore the file from git")
    return found


def find(entrant: Entrant, track: ScenarioSet, file: Path | None = None) -> Audit | None:
    """Return the audit of a controller as it is now, ``None`` where no salt was drawn for it."""
    known = entries(file)
    named = [e for e in known if (e["controller"], e["track"]) == (entrant.name, track.name)]
    if not named:  # saves building all controllers
        return None
    task = tasks.task_digest(track)
    return of(known, task, artefacts.of(entrant, track, task).digest, track)


def of(known: Sequence[Entry], task: str, artefact: str, track: ScenarioSet) -> Audit | None:
    """Return the audit of a task and an artefact by their digests."""
    for entry in known:
        if (entry["task"], entry["artefact"]) == (task, artefact):
            names = [scenario.name for scenario in track.scenarios()]
            seeds = seeds_of(task, artefact, entry["salt"], names)
            return Audit(entry["salt"], entry["drawn"], entry["draw"], seeds)
    return None


def draw(entrant: Entrant, track: ScenarioSet, file: Path | None = None) -> Audit:
    """Draw the salt of a controller in a track and add it to the file; one that is there stays.

    Raises
    ------
    ValueError
        If the artefact is not what the last commit holds, or an older salt was changed.
    """
    path = FILE if file is None else file
    task = tasks.task_digest(track)
    artefact = artefacts.of(entrant, track).digest
    known = entries(path)
    there = of(known, task, artefact, track)
    if there is not None:
        return there
    check_only_added(path)
    changed = artefacts.uncommitted(artefacts.files_of(entrant, track))
    if changed:
        raise ValueError(
            f"{entrant.name}: not as in the last commit: {', '.join(f.name for f in changed)}; "
            "commit the artefact first, the salt is drawn after it"
        )
    before = [e for e in known if (e["task"], e["controller"]) == (task, entrant.name)]
    entry = {
        "task": task,
        "artefact": artefact,
        "salt": secrets.token_hex(16),
        "controller": entrant.name,
        "track": track.name,
        "draw": len(before) + 1,
        "drawn": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "commit": provenance.commit(),
    }
    write_text(path, json.dumps({"salts": [*known, entry]}, indent=1) + "\n")
    made = of([entry], task, artefact, track)
    assert made is not None
    return made


def check_only_added(file: Path | None = None) -> None:
    """Raise if a salt that the last commit holds was changed, moved or taken out.

    Raises
    ------
    ValueError
        Naming the file. A file outside of a checkout has no history to compare with.
    """
    path = FILE if file is None else file
    try:
        committed = artefacts.committed_bytes(path)
    except ValueError:
        return
    old = json.loads(committed)["salts"] if committed else []
    if entries(path)[: len(old)] != old:
        raise ValueError(f"{path}: salts of the last commit were changed; restore it from git")
