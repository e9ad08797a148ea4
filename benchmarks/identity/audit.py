"""Audit rounds: seeds from the task, all artefacts of a track, and a salt drawn after them.

Whoever makes a controller can try it on the public seeds as often as he likes. What the board
compares is therefore episodes whose seeds nobody could know: the first eight bytes of

    sha256(task | entrants | salt | scenario | number)

less their last eleven bits, so that every reader of JSON holds the number exactly. *Entrants* is
the digest of all artefacts of the track by their controllers' names. The maintainer draws one salt
for all of them, once git has them as committed, so that all are compared on the same episodes.
Rounds are only ever added to ``rounds.json``; what has changed since the last one is self-reported
until the next.

A controller that is designed when it is built, by a Riccati equation say, holds other last digits
on another processor, and its artefact is another by its digest. It is in the round all the same if
git says that what it is made of is, byte by byte, what it was when the salt was drawn.
"""

from __future__ import annotations

import datetime
import hashlib
import importlib
import inspect
import json
import math
import secrets
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import yaml
from filelock import FileLock

from benchmarks.identity import artefacts, tasks, trainings
from benchmarks.identity.hashing import digest
from benchmarks.identity.source_code import code_text
from benchmarks.runs import provenance
from benchmarks.runs.controllers import Entrant
from benchmarks.runs.store import write_text
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet

FILE = Path(__file__).resolve().parents[1] / "rounds.json"
EPISODES = 30
"""Audit episodes that a row has at least."""
PER_SCENARIO = 2
"""And at least so many of each scenario, since an interval needs the scatter within one."""


@dataclass(frozen=True)
class Round:
    """One salt for all controllers of a track.

    Attributes
    ----------
    track : str
    number : int
        From 1 in each track.
    task : str
        Digest of the task.
    entrants : mapping of str
        Digest of the artefact of each controller.
    salt, drawn : str
        ``drawn`` is the day.
    commit : str
        In which all of it was committed.
    """

    track: str
    number: int
    task: str
    entrants: Mapping[str, str]
    salt: str
    drawn: str
    commit: str

    def seeds(self, names: Sequence[str]) -> dict[str, tuple[int, ...]]:
        """Return the audit seeds of each of a track's scenarios."""
        each = max(PER_SCENARIO, math.ceil(EPISODES / len(names)))
        all_artefacts = digest(self.entrants)
        return {
            name: tuple(seed_of(self.task, all_artefacts, self.salt, name, k) for k in range(each))
            for name in names
        }


@dataclass(frozen=True)
class Audit:
    """A controller's place in the last round of a track.

    Attributes
    ----------
    round : Round
    entry : int
        How many different artefacts the controller's name has had in the rounds of the track.
    seeds : mapping of tuple
        Seeds of each scenario.
    artefact : str
        Digest that the round has of it, where it is another here since it is designed here; empty
        otherwise.
    """

    round: Round
    entry: int
    seeds: Mapping[str, tuple[int, ...]]
    artefact: str = ""

    def record(self) -> dict[str, Any]:
        """Return the audit as a row holds it, less its scores; ``artefact`` where it is another."""
        drawn_as = {"artefact": self.artefact} if self.artefact else {}
        return drawn_as | {
            "round": self.round.number,
            "salt": self.round.salt,
            "drawn": self.round.drawn,
            "commit": self.round.commit,
            "entry": self.entry,
            "seeds": {name: list(seeds) for name, seeds in self.seeds.items()},
        }


def seed_of(task: str, entrants: str, salt: str, scenario: str, number: int) -> int:
    """Return a seed, 53 bits."""
    text = "|".join((task, entrants, salt, scenario, str(number)))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big") >> 11


def rounds(file: Path | None = None) -> list[Round]:
    """Return the rounds in the order of their drawing; none where there is no file.

    Raises
    ------
    ValueError
        If the file is damaged, or the rounds of a track are not numbered one after another.
    """
    path = FILE if file is None else file
    if not path.exists():
        return []
    try:
        found = [Round(**entry) for entry in json.loads(path.read_text("utf-8"))["rounds"]]
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path}: not a list of rounds ({error}); restore it from git") from error
    for number, entry in _numbered(found):
        if entry.number != number:
            raise ValueError(
                f"{path}: round {entry.number} of {entry.track} stands where round {number} has "
                "to be; restore the file from git"
            )
    return found


def _numbered(found: Iterable[Round]) -> Iterable[tuple[int, Round]]:
    """Yield rounds with the numbers that they have to have."""
    seen: dict[str, int] = {}
    for entry in found:
        seen[entry.track] = seen.get(entry.track, 0) + 1
        yield seen[entry.track], entry


def last(track: str, file: Path | None = None) -> Round | None:
    """Return the last round of a track, ``None`` where there was none."""
    return next((entry for entry in rounds(file)[::-1] if entry.track == track), None)


def find(entrant: Entrant, track: ScenarioSet) -> Audit | None:
    """Return the audit of a controller as it is now, ``None`` where it is in no last round.

    It is in the round if its artefact is, or if it is what was drawn but for last digits.
    """
    found = last(track.name)
    if found is None or entrant.name not in found.entrants:  # saves building controllers
        return None
    artefact = artefacts.of(entrant, track).digest
    return _place(found, entrant, track, tasks.task_digest(track), artefact)


def of_row(row: Mapping[str, Any], entrant: Entrant, track: ScenarioSet) -> Audit | None:
    """Return the audit of the artefact that a row says it is of.

    Whether the controller is what was drawn is told by :func:`history`. One whose digest the round
    does not know may have been designed on another machine; then it has to be.
    """
    found, artefact = last(track.name), row["controller"]["artefact"]["digest"]
    if found is None or entrant.name not in found.entrants:
        return None
    return _place(found, entrant, track, row["task"], artefact)


def _place(
    found: Round, entrant: Entrant, track: ScenarioSet, task: str, artefact: str
) -> Audit | None:
    """Return the audit of an artefact in a round that knows its controller."""
    if found.task != task or not _is_of(found, entrant, track, artefact):
        return None
    name, drawn_as = entrant.name, found.entrants[entrant.name]
    mine = [entry for entry in rounds() if entry.track == track.name]
    had = {entry.entrants[name] for entry in mine if name in entry.entrants}
    seeds = found.seeds([scenario.name for scenario in track.scenarios()])
    return Audit(found, len(had), seeds, "" if artefact == drawn_as else drawn_as)


def _is_of(found: Round, entrant: Entrant, track: ScenarioSet, artefact: str) -> bool:
    """Return whether a round is of an artefact, or of what it is but for last digits.

    Of the latter it is if git knows that its commit holds all that the controller is made of.
    """
    if artefact == found.entrants[entrant.name]:
        return True
    said = history(found, entrant, track)
    return said.complete and not said.wrong


def _designer(entrant: Entrant) -> Path | None:
    """Return the package that designs a controller: its own, or that of what it corrects.

    A policy is designed by none: it is a file.
    """
    name = entrant.source.partition(".")[0]
    if entrant.files:
        name = artefacts.BASELINES if entrant.kind == artefacts.RESIDUAL else ""
    if not name:
        return None
    page = Path(inspect.getfile(importlib.import_module(name))).resolve()
    return page.parent if page.name == "__init__.py" else page


def artefact_of(row: Mapping[str, Any]) -> str:
    """Return the digest of a row's artefact, that of its round where it was designed elsewhere."""
    own = row["controller"]["artefact"]["digest"]
    return str((row["audit"] or {}).get("artefact", own))


def in_last_round(row: Mapping[str, Any]) -> bool:
    """Return whether a row's audit is of the last round of its track; if not, it reports itself."""
    found, said, name = last(row["scenarios"]["name"]), row["audit"], row["controller"]["name"]
    if found is None or said is None:
        return False
    mine = (row["task"], artefact_of(row), said["round"], said["salt"])
    return mine == (found.task, found.entrants.get(name), found.number, found.salt)


def draw(track: ScenarioSet, entrants: Sequence[Entrant]) -> Round:
    """Draw a round of a track and add it to the file; the last one stays if nothing has changed.

    Raises
    ------
    ValueError
        If something is not as in the last commit, an older round was changed, or policies are not
        of different training seeds.
    """
    with FileLock(FILE.with_name(f".{FILE.name}.lock")):
        for entrant in entrants:
            trainings.check_files(entrant)
        task = tasks.task_digest(track)
        here = {entrant.name: artefacts.of(entrant, track).digest for entrant in entrants}
        there = last(track.name)
        same = there is not None and (there.task, set(there.entrants)) == (task, set(here))
        if same and all(_is_of(there, one, track, here[one.name]) for one in entrants):
            return there
        check_only_added()
        _check_committed(track, entrants)
        made = Round(
            track=track.name,
            number=1 if there is None else there.number + 1,
            task=task,
            entrants=here,
            salt=secrets.token_hex(16),
            drawn=datetime.datetime.now(datetime.UTC).date().isoformat(),
            commit=provenance.git("rev-parse", "HEAD", folder=FILE.parent),
        )
        text = json.dumps({"rounds": [asdict(entry) for entry in [*rounds(), made]]}, indent=1)
        write_text(FILE, text + "\n")
    return made


def _check_committed(track: ScenarioSet, entrants: Sequence[Entrant]) -> None:
    """Raise unless artefacts, task and code are as in the last commit."""
    files = {scenarios.FOLDER / f"{track.name}.yaml"}
    files = files.union(*(artefacts.files_of(entrant, track) for entrant in entrants))
    names = [file.name for file in artefacts.uncommitted(files)] or provenance.changed()
    if names:
        raise ValueError(
            f"{track.name}: not as in the last commit: {provenance.listed(names)}; commit it "
            "first, the salt is drawn after it"
        )


def check_only_added() -> None:
    """Raise if a round that the last commit holds was changed, moved or taken out.

    Raises
    ------
    ValueError
        Naming the file. A file outside of a checkout has no history to compare with.
    """
    try:
        committed = artefacts.committed_bytes(FILE)
    except ValueError:
        return
    old = [Round(**entry) for entry in json.loads(committed)["rounds"]] if committed else []
    if rounds()[: len(old)] != old:
        raise ValueError(f"{FILE}: rounds of the last commit were changed; restore it from git")


@dataclass(frozen=True)
class History:
    """What git says of a round.

    Attributes
    ----------
    wrong : tuple of str
        What contradicts it.
    unknown : str
        Why something could not be looked up, empty if all could.
    complete : bool
        Whether all was looked up that a controller is made of, the package that designs it too.
    """

    wrong: tuple[str, ...] = ()
    unknown: str = ""
    complete: bool = False


def history(found: Round, entrant: Entrant, track: ScenarioSet) -> History:
    """Return whether the commit of a round is one of this checkout, and holds artefact and task.

    Where the artefact is another by its digest, its last digits may differ and nothing that makes
    them: all files of the package that designs it are compared byte by byte.
    """
    try:
        top = artefacts.top_of(FILE.parent)
        shallow = provenance.git("rev-parse", "--is-shallow-repository", folder=top) == "true"
    except (OSError, subprocess.SubprocessError):
        return History(unknown="this is no git checkout: the commit of the round was not looked up")
    try:
        provenance.git("merge-base", "--is-ancestor", found.commit, "HEAD", folder=top)
    except subprocess.CalledProcessError:
        if shallow:
            return History(
                unknown="this clone is shallow: the commit of the round was not looked up; "
                "`git fetch --unshallow` gets it"
            )
        return History((f"audit.commit: {found.commit[:12]} is none of the present commit's past",))
    files = sorted(artefacts.files_of(entrant, track) | tasks.files_of(track))
    inside = [file for file in files if file.is_relative_to(top)]
    touched = _touched(found.commit, inside, top)
    other = [file.name for file in touched if not _same(entrant, found.commit, file, top)]
    designer = _designer(entrant)
    complete = designer is not None and designer.is_relative_to(top)
    if complete and artefacts.of(entrant, track).digest != found.entrants.get(entrant.name):
        other += _other_bytes(found.commit, designer, top)
    outside = provenance.listed([file.name for file in files if not file.is_relative_to(top)])
    return History(
        tuple(f"audit.commit: {found.commit[:12]} has another {name}" for name in other),
        f"not looked up in the round's commit, as outside of its checkout: {outside}"
        if outside
        else "",
        complete,
    )


def _other_bytes(commit: str, place: Path, top: Path) -> list[str]:
    """Return the files under a folder that are not as in a commit, also those that git ignores not.

    What docstrings say may be read as data, and so may files of any kind.
    """
    commands = (
        ("diff", "--no-renames", "--name-only", commit),
        ("ls-files", "--others", "--exclude-standard"),
    )
    said = [provenance.git(*command, "--", str(place), folder=top) for command in commands]
    return sorted({name for lines in said for name in lines.splitlines()})


def _touched(commit: str, files: Sequence[Path], top: Path) -> list[Path]:
    """Return the files that are not, byte by byte, those of a commit."""

    def names(*command: str) -> set[str]:
        said = provenance.git(*command, "-z", "--name-only", commit, folder=top)
        return set(said.split("\0"))

    there, changed = names("ls-tree", "-r"), names("diff", "--no-renames")
    placed = {file: file.relative_to(top).as_posix() for file in files}
    return [file for file, name in placed.items() if name in changed or name not in there]


def _same(entrant: Entrant, commit: str, file: Path, top: Path) -> bool:
    """Return whether a file says the same in a commit: policies to the byte, code as code.

    Of the knobs those of the controller count, since searches for others add to their file.
    """
    then, now = artefacts.bytes_at(commit, file, top), file.read_bytes()
    if then is not None and file == artefacts.TUNED:
        said = (yaml.safe_load(then) or {}).get("tuned") or {}
        return said.get(entrant.tuned, {}).get("knobs") == dict(entrant.knobs)
    if then is None or file.suffix != ".py":
        return then == now
    return code_text(then.decode()) == code_text(now.decode())
