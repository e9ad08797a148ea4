"""Run a row again from its own record and say what differs.

Nothing of a row is believed but where it was made: environment, scenarios, policy files, salt and
the set of episodes are those of this checkout, and every number is computed again. A row that says
that it was made elsewhere may differ in last digits, and can at best be verified "elsewhere".
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.identity import audit, tasks, verified
from benchmarks.identity import tolerance as nearly
from benchmarks.identity.audit import Audit
from benchmarks.identity.hashing import plain
from benchmarks.identity.tolerance import differences
from benchmarks.runs import cells, replay, rows
from benchmarks.runs.cells import Cell, cells_of
from benchmarks.runs.controllers import Entrant, find
from benchmarks.runs.store import CHECKSUM, comparable, fault, read_json
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet
from sweeps import engine

Record = Mapping[str, Any]

EITHER = "either"
"""To the last bit, or nearly where a row says that it was made elsewhere."""
COMPARISONS = (verified.BITS, verified.ELSEWHERE, EITHER)
DIGITS = (
    "only last digits differ, as another processor, library of linear algebra or package has them: "
    "`verify --compare elsewhere` allows for that; what it finds is no proof of equal bits"
)


@dataclass
class Verdict:
    """What a row gave when it was run again.

    Attributes
    ----------
    row : str
    mode : {"bits", "elsewhere"}
        How it was compared: to the last bit, or as of another machine.
    drifted : list of str
        Every field that differs, with both values; empty if the row holds.
    notes : list of str
        Differences that are no drift by themselves (versions, commit).
    checksum : str
        Of the row that was read.
    sources : mapping of str
        Digests of what it was run again with, none if it was not.
    """

    row: str
    mode: str = verified.BITS
    drifted: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    checksum: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)

    @property
    def holds(self) -> bool:
        """Whether nothing has drifted."""
        return not self.drifted


def verify(
    path: Path, cluster: engine.Cluster | None = None, compare: str = verified.BITS
) -> Verdict:
    """Run the row of a file again and compare.

    Parameters
    ----------
    path : Path
    cluster : Cluster, optional
        Where to compute; in this process by default.
    compare : {"bits", "elsewhere", "either"}
        To the last bit; or as of another machine, where packages or processor round otherwise,
        see :mod:`benchmarks.identity.tolerance`; or the latter, and much nearer, where the row is
        not equal and says that it was made with others. That, it may have made up: its verdict's
        ``mode`` is "elsewhere" then, and never "bits".

    Raises
    ------
    ValueError
        If there is no such comparison.
    """
    if compare not in COMPARISONS:
        raise ValueError(f"compare: {compare!r} is none of {', '.join(COMPARISONS)}")
    verdict = Verdict(
        rows.name_of(path), verified.ELSEWHERE if compare == verified.ELSEWHERE else verified.BITS
    )
    try:
        stored = read_json(path)
        rows.check_schema(stored, path)
    except (OSError, ValueError, AttributeError, TypeError) as error:
        verdict.drifted.append(f"the file cannot be read: {error}")
        return verdict
    verdict.checksum = str(stored.get(CHECKSUM))
    wrong = fault(stored)
    if wrong:
        verdict.drifted.append(f"file: {wrong}")
    try:
        _check(stored, cluster or engine.Cluster(), verdict, compare)
    except KeyError as error:
        verdict.drifted.append(f"cannot be run again: there is no {error}")
    except Exception as error:
        verdict.drifted.append(f"cannot be run again: {type(error).__name__}: {error}")
    return verdict


def _check(stored: Record, cluster: engine.Cluster, verdict: Verdict, compare: str) -> None:
    tasks.check_version(stored["env"]["id"], stored["row"])
    entrant = find(stored["controller"]["name"])
    track = scenarios.load(scenarios.FOLDER / f"{stored['scenarios']['name']}.yaml")
    other = _other_scenarios(stored, track)
    if other:  # and nothing of it is run
        verdict.drifted += other
        return
    found = audit.of_row(stored, entrant, track)
    wanted = cells_of(entrant, track, found)
    _compare_audit(stored, entrant, track, found, verdict)
    _compare_episodes(stored, wanted, verdict)
    again = _run_again(entrant, track, found, wanted, cluster)
    verdict.sources = again["made_with"]["sources"]
    _compare(stored, again, entrant, track, verdict, compare)


def _other_scenarios(stored: Record, track: ScenarioSet) -> list[str]:
    """Return in what the recorded scenarios are not those of the checkout's file."""
    said, file = stored["scenarios"], f"{track.name}.yaml, version {track.content['version']}"
    found = []
    if plain(track.content) != said["content"]:
        found.append(f"scenarios: the content is not that of {file}; run the row again")
    if said["digest"] != track.digest:
        found.append(
            f"scenarios.digest: {str(said['digest'])[:16]} recorded, {track.digest[:16]} of {file}"
        )
    if stored["env"]["id"] != track.env:
        found.append(f"env.id: {stored['env']['id']} recorded, {track.env} of {file}")
    return found


def _compare_audit(
    stored: Record,
    entrant: Entrant,
    track: ScenarioSet,
    found: Audit | None,
    verdict: Verdict,
) -> None:
    """Compare the row's audit with the last round of its track, and the round with git."""
    audit.check_only_added()
    recorded = stored["audit"]
    if found is None and recorded is not None:
        verdict.drifted.append(
            f"audit: its task and artefact are not in the last round of {track.name}; run "
            f"`python -m benchmarks audit {track.name}`"
        )
    if found is None:
        return
    if recorded is None:
        verdict.drifted.append(
            f"audit: left out, though round {found.round.number} was drawn on "
            f"{found.round.drawn}; run the row again"
        )
        return
    for name, value in plain(found.record()).items():
        verdict.drifted += differences(recorded.get(name), value, f"audit.{name}")
    said = audit.history(found.round, entrant, track)
    verdict.drifted += said.wrong
    verdict.notes += [said.unknown] if said.unknown else []


def _compare_episodes(stored: Record, wanted: Sequence[Cell], verdict: Verdict) -> None:
    """Compare which episodes there are with which there must be."""
    recorded = Counter(
        (e["split"], e["training_seed"], e["scenario"], e["seed"]) for e in stored["episodes"]
    )
    needed = Counter(
        (cell.split, cell.training_seed, cell.scenario.name, seed)
        for cell in wanted
        for seed in cell.seeds
    )
    for what, which in (("missing", needed - recorded), ("not to be there", recorded - needed)):
        if which:
            split, run, scenario, seed = next(iter(which))
            trained = "" if run is None else f", training seed {run}"
            verdict.drifted.append(
                f"episodes: {which.total()} {what}, the first: {split}, {scenario}, seed {seed}"
                + trained
            )


def _run_again(
    entrant: Entrant,
    track: ScenarioSet,
    found: Audit | None,
    wanted: Sequence[Cell],
    cluster: engine.Cluster,
) -> dict[str, Any]:
    keys, records = [cell.key for cell in wanted], {}
    for done in engine.run(cells.compute, cells.grouped(wanted), cluster):
        if done.error is not None:
            raise ValueError(done.error)
        records |= done.value
    return dict(plain(rows.assemble(entrant, track, [records[key] for key in keys], found)))


def _compare(
    stored: Record,
    again: dict[str, Any],
    entrant: Entrant,
    track: ScenarioSet,
    verdict: Verdict,
    compare: str,
) -> None:
    before, after = comparable(stored), comparable(again)
    made = [row.pop("made_with", None) for row in (before, after)]
    verdict.notes += differences(*made, "made_with")
    near = nearly.FAR
    if compare != verified.ELSEWHERE:
        drifted, near = differences(before, after), nearly.DIGITS
        made_elsewhere = bool(drifted) and _other_machine(verdict.notes)
        if not made_elsewhere or compare == verified.BITS:
            verdict.drifted += drifted
            verdict.notes += _hints(before, after) if drifted else []
            return
        verdict.mode = verified.ELSEWHERE
        verdict.notes.append(f"{len(drifted)} fields differ in bits, the first: {drifted[0]}")
    nearly.compare(before, after, verdict.drifted, verdict.notes, near)
    if entrant.files:
        verdict.drifted += replay.differences(stored, entrant, track)


def _hints(before: Record, after: Record) -> list[str]:
    """Return what to do about a row that is not equal, where only last digits differ."""
    drifted: list[str] = []
    try:
        nearly.compare(before, after, drifted, [], nearly.DIGITS)
    except (ArithmeticError, LookupError, TypeError, ValueError):  # it is not even a row
        return []
    return [] if drifted else [DIGITS]


def _other_machine(notes: Sequence[str]) -> bool:
    return any(note.startswith(("made_with.packages", "made_with.cpu")) for note in notes)
