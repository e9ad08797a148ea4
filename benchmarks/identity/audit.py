"""Audit rounds: seeds drawn once for all controllers of a track, after these are frozen.

Controllers are compared on episodes whose seeds were unknown before. A seed is the first eight
bytes (less their last eleven bits, so that every JSON reader represents the number exactly) of

    sha256(frozen | salt | scenario | number)

where *frozen* is the digest of the task and of all artefacts of the track, and the salt is drawn
after them. Rounds are only added to ``rounds.json``; a controller or task that changed since the
last round is self-reported until the next one.

The last round of a track holds the frozen identities whole, because changes are told from them. Of
an earlier one the file keeps their digests, from which the entries are counted; the commit that
added the round holds them whole.
"""

import datetime
import hashlib
import json
import math
import secrets
import subprocess
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from filelock import FileLock

from benchmarks.identity import artefacts, tasks, trainings
from benchmarks.identity.hashing import digest
from benchmarks.runs import provenance
from benchmarks.runs.controllers import Entrant
from benchmarks.scenarios.scenario import ScenarioSet
from pam_envs.files import write_text

FILE = Path(__file__).resolve().parents[1] / "rounds.json"
EPISODES = 30  # smallest number of audit episodes of a row
PER_SCENARIO = 2
"""Smallest number of audit episodes per scenario: an interval needs the scatter within one."""
KEPT = ("frozen", "salt", "drawn")
"""Entries of a round, from which its seeds follow, that no commit may change."""
DIGEST = "digest"


@dataclass(frozen=True)
class Round:
    """One salt for all controllers of a track, from which the seeds are derived."""

    track: str
    number: int  # from 1 in each track
    task: Mapping[str, Any]  # frozen identity of the task
    entrants: Mapping[str, Mapping[str, Any]]  # frozen identity of each controller
    frozen: str  # digest of the frozen identities
    salt: str
    drawn: str
    commit: str  # a note

    def seeds(self, names: Sequence[str]) -> dict[str, tuple[int, ...]]:
        """Return the audit seeds of each of a track's scenarios."""
        each = max(PER_SCENARIO, math.ceil(EPISODES / len(names)))
        return {
            name: tuple(self._seed(f"{self.frozen}|{self.salt}|{name}|{k}") for k in range(each))
            for name in names
        }

    @staticmethod
    def _seed(text: str) -> int:
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big") >> 11

    def replaced(self) -> "Round":
        """Return the round as it is kept after a later one of its track: with digests alone."""
        entrants = {name: {DIGEST: held[DIGEST]} for name, held in self.entrants.items()}
        return replace(self, task={DIGEST: self.task[DIGEST]}, entrants=entrants)

    def changes(self, entrant: Entrant, track: ScenarioSet) -> list[str]:
        """Return the differences of the present task and controller from the frozen ones."""
        if entrant.name not in self.entrants:
            return [f"no entrant of round {self.number}"]
        found = tasks.of(track).identity.changes(self.task)
        return found + artefacts.of(entrant, track).changes(self.entrants[entrant.name])


@dataclass(frozen=True)
class Audit:
    """Place of a controller in the last round of a track."""

    round: Round
    artefact: str  # its artefact there
    entry: int  # number of different artefacts of the controller's name in the track's rounds
    seeds: Mapping[str, tuple[int, ...]]

    def record(self) -> dict[str, Any]:
        """Return the audit in the form of a row, without its scores."""
        return {
            "round": self.round.number,
            "salt": self.round.salt,
            "drawn": self.round.drawn,
            "commit": self.round.commit,
            "entry": self.entry,
            "seeds": {name: list(seeds) for name, seeds in self.seeds.items()},
        }


def rounds() -> list[Round]:
    """Return the rounds in the order of their drawing; none without a file."""
    if not FILE.exists():
        return []
    try:
        found = list(_parsed(FILE.read_text("utf-8")))
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{FILE}: not a list of rounds ({error}); restore it from git") from error
    seen: Counter[str] = Counter()
    for entry in found:
        seen[entry.track] += 1
        if entry.number != seen[entry.track]:
            raise ValueError(
                f"{FILE}: round {entry.number} of {entry.track} in place of round "
                f"{seen[entry.track]}; restore the file from git"
            )
    return found


@lru_cache(maxsize=2)
def _parsed(text: str) -> tuple[Round, ...]:
    return tuple(Round(**entry) for entry in json.loads(text)["rounds"])


def altered() -> list[str]:
    """Return the rounds of any earlier commit that the file lacks or states otherwise.

    A clone without history, or a folder without git, has no earlier commit to compare with.
    """
    try:
        name = f"./{FILE.name}"
        commits = provenance.git("log", "--format=%H", "--", name, folder=FILE.parent).split()
        texts = {c: provenance.git("show", f"{c}:{name}", folder=FILE.parent) for c in commits}
    except (OSError, subprocess.SubprocessError):
        return []
    present = {(entry.track, entry.number): entry for entry in rounds()}
    found = {}
    for commit, text in texts.items():
        numbers: Counter[str] = Counter()
        for entry in json.loads(text)["rounds"]:
            track = str(entry["track"])
            numbers[track] += 1
            now = present.get((track, numbers[track]))
            if now is None or any(getattr(now, k) != entry.get(k, getattr(now, k)) for k in KEPT):
                place = f"round {numbers[track]} of {track}"
                found[place] = f"{place} is not that of commit {commit[:12]}; restore {FILE.name}"
    return list(found.values())


def last(track: str) -> Round | None:
    """Return the last round of a track, ``None`` if there is none."""
    return next((entry for entry in rounds()[::-1] if entry.track == track), None)


def find(entrant: Entrant, track: ScenarioSet) -> Audit | None:
    """Return the audit of a controller, ``None`` unless it and the task are those of the round."""
    found = last(track.name)
    if found is None or entrant.name not in found.entrants:  # avoids building controllers
        return None
    if found.changes(entrant, track):
        return None
    names = [scenario.name for scenario in track.scenarios()]
    own = [entry.entrants.get(entrant.name) for entry in rounds() if entry.track == track.name]
    different = {record["digest"] for record in own if record}
    artefact = str(found.entrants[entrant.name]["digest"])
    return Audit(found, artefact, len(different), found.seeds(names))


def in_last_round(row: Mapping[str, Any]) -> bool:
    """Return whether task, controller and salt of a row are those of its track's last round."""
    found, said, about = last(row["scenarios"]["name"]), row["audit"], row["controller"]
    if found is None or said is None:
        return False
    entry = found.entrants.get(about["name"], {})
    mine = (row["task"], about["artefact"]["digest"], said["round"], said["salt"])
    return mine == (found.task["digest"], entry.get("digest"), found.number, found.salt)


def draw(track: ScenarioSet, entrants: Sequence[Entrant]) -> Round:
    """Draw a round of a track and add it to the file; keep the last one if nothing has changed."""
    with FileLock(FILE.with_name(f".{FILE.name}.lock")):
        for entrant in entrants:
            trainings.check_files(entrant)
        task = tasks.of(track).identity
        here = {entrant.name: artefacts.of(entrant, track) for entrant in entrants}
        there = last(track.name)
        if (
            there is not None
            and not task.changes(there.task)
            and set(there.entrants) == set(here)
            and not any(made.changes(there.entrants[name]) for name, made in here.items())
        ):
            return there
        records = {name: made.record() for name, made in here.items()}
        drawn = Round(
            track=track.name,
            number=1 if there is None else there.number + 1,
            task=task.record(),
            entrants=records,
            frozen=digest({"task": task.digest, "entrants": records}),
            salt=secrets.token_hex(16),
            drawn=datetime.datetime.now(datetime.UTC).date().isoformat(),
            commit=provenance.commit(),
        )
        write_text(FILE, text_of([*rounds(), drawn]))
    return drawn


def text_of(all_rounds: Sequence[Round]) -> str:
    """Return the content of the file: a line for each round, those that were replaced reduced."""
    final = {entry.track: entry for entry in all_rounds}.values()
    kept = [entry if entry in final else entry.replaced() for entry in all_rounds]
    lines = ",\n".join(json.dumps(asdict(entry), separators=(",", ":")) for entry in kept)
    return f'{{"rounds": [\n{lines}\n]}}\n'
