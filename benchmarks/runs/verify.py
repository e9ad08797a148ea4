"""Verification of rows: validity for the present task and controller, and reproducibility.

Only a row's packages, processor and commit are trusted: environment, scenarios, policy files, salt
and the set of episodes are those of this checkout, and every number is computed again. A row that
states others may differ by rounding, and is recorded as verified within tolerance: a controller may
have been rewritten since with actions that are equal within 1e-6.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.identity import artefacts, audit, tasks
from benchmarks.identity.audit import Audit
from benchmarks.identity.hashing import plain
from benchmarks.runs import cells, rows, runner, traces, verified
from benchmarks.runs.cells import Cell
from benchmarks.runs.controllers import Entrant, find
from benchmarks.runs.store import CHECKSUM, comparable, fault, read_json
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet
from sweeps import engine

Record = Mapping[str, Any]

DESCRIPTION = ("summary", "citation", "author")
"""Entries of a row's controller that describe it, in the words of the catalogue."""
ROUNDING = 1e-4
"""Relative difference of a score of one episode between two machines.

Between Zen 5 and Rocket Lake, in all episodes of the board, 1.4e-7 was the largest.
"""
SLACK = 1e-6  # share of the worst case that counts as equal, for scores near zero
DRAWN = 1e-3
"""Largest deviation of a plotted signal, as a share of its range: two steps of its grid."""
ROUNDED = ("scores", "trajectory", "saturated")
"""Entries of an episode that rounding changes; a signal may just reach its bound."""


@dataclass
class Verdict:
    """Result of computing a row again; plotted curves are always compared to DRAWN."""

    row: str
    mode: str = verified.BITS  # compared to the last bit, or within the rounding of another machine
    drifted: list[str] = field(default_factory=list)  # fields that differ, with both values
    # differences that are no drift by themselves: versions, commit, description
    notes: list[str] = field(default_factory=list)
    checksum: str = ""  # of the row's file

    @property
    def holds(self) -> bool:
        """True if nothing has drifted."""
        return not self.drifted


def void(row: Record) -> list[str]:
    """Return the reasons why a row is void for the present task and controller, without a run."""
    about, name = row["controller"], row["scenarios"]["name"]
    try:
        tasks.check_version(row["env"]["id"], row["row"])
        entrant, track = find(about["name"]), _track(row)
    except (OSError, ValueError) as error:
        return [str(error)]
    found = audit.last(name)
    if row["audit"] and found:
        drawn = found.changes(entrant, track)
        return drawn or ([] if audit.in_last_round(row) else [f"not of round {found.number}"])
    changes = [] if row["task"] == tasks.of(track).identity.digest else ["task changed"]
    made = artefacts.of(entrant, track)
    if about["artefact"]["files"] != plain([dict(file) for file in made.files]):
        changes.append("policy files changed")
    return changes + differences(about["artefact"]["knobs"], dict(made.knobs), "knobs")


def verify(path: Path) -> Verdict:
    """Compute the row of a file again in this process, and compare."""
    ((_, verdict),) = verify_all([path], engine.Cluster())
    return verdict


def verify_all(paths: Iterable[Path], cluster: engine.Cluster) -> Iterator[tuple[Path, Verdict]]:
    """Compute the rows of files again and yield their verdicts as they complete."""
    groups, asked = list[cells.Group](), defaultdict[str, list[_Check]](list)
    for path in paths:
        check = _opened(path)
        if check.plan is None:
            yield path, check.verdict
            continue
        for group in cells.grouped(check.plan.cells.values()):
            groups.append(group)
            asked[group.key].append(check)  # two files may hold one row
            check.left.add(group.key)
    for done in engine.run(cells.compute, groups, cluster):
        for check in asked[done.key]:
            check.left.discard(done.key)
            if done.error is None:
                check.records |= done.value
            else:
                check.verdict.drifted.append(f"cannot be run again: {done.error}")
            if not check.left:
                check.finish()
                yield check.path, check.verdict


@dataclass
class _Check:
    """Row of a file, while it is computed again."""

    path: Path
    verdict: Verdict
    stored: Record = field(default_factory=dict)
    plan: runner.Plan | None = None  # missing if the row cannot be computed again
    left: set[str] = field(default_factory=set)  # groups that are not computed yet
    records: dict[str, Any] = field(default_factory=dict)

    def finish(self) -> None:
        """Compare the row with what was computed, if all of it was."""
        plan, verdict = self.plan, self.verdict
        if plan is None or not plan.cells.keys() <= self.records.keys():
            return
        with _drift(verdict):
            records = [self.records[key] for key in plan.cells]
            made = rows.assemble(plan.entrant, plan.track, records, plan.found)
            _compare(self.stored, plain(made), verdict)


def _opened(path: Path) -> _Check:
    """Return the check of a file, with what is found before anything is computed."""
    verdict = Verdict(rows.name_of(path))
    try:
        stored = read_json(path)
        rows.check_schema(stored, path)
    except (OSError, ValueError, AttributeError, TypeError) as error:
        verdict.drifted.append(f"the file cannot be read: {error}")
        return _Check(path, verdict)
    verdict.checksum = str(stored.get(CHECKSUM))
    wrong = fault(stored)
    if wrong:
        verdict.drifted.append(f"file: {wrong}")
    check = _Check(path, verdict, stored)
    with _drift(verdict):
        check.plan = _plan(stored, verdict)
    return check


@contextmanager
def _drift(verdict: Verdict) -> Iterator[None]:
    """Note an error as drift."""
    try:
        yield
    except KeyError as error:
        verdict.drifted.append(f"cannot be run again: there is no {error}")
    except Exception as error:
        verdict.drifted.append(f"cannot be run again: {type(error).__name__}: {error}")


def _track(row: Record) -> ScenarioSet:
    return scenarios.load(scenarios.FOLDER / f"{row['scenarios']['name']}.yaml")


def _plan(stored: Record, verdict: Verdict) -> runner.Plan | None:
    """Return what has to be computed again, if the row is of the present scenarios."""
    tasks.check_version(stored["env"]["id"], stored["row"])
    entrant, track = find(stored["controller"]["name"]), _track(stored)
    content = (stored["scenarios"]["content"], track.content)
    theirs, ours = (plain(scenarios.identifying(each)) for each in content)
    if theirs != ours:  # other scenarios are not run
        verdict.drifted.append(
            f"scenarios: the content is not that of {track.name}.yaml, version "
            f"{track.content['version']}; run the row again"
        )
        return None
    (plan,) = runner.plans([(entrant, track)])
    verdict.drifted += _other_audit(stored, entrant, track, plan.found)
    verdict.drifted += _other_episodes(stored, plan.cells.values())
    return plan


def _other_audit(
    stored: Record, entrant: Entrant, track: ScenarioSet, found: Audit | None
) -> list[str]:
    """Return the reason why a row's audit is inadmissible or missing."""
    if found is not None and stored["audit"] is None:
        return [
            f"audit: left out, though round {found.round.number} was drawn on {found.round.drawn}; "
            "run the row again"
        ]
    if found is None and stored["audit"] is not None:
        there = audit.last(track.name)
        why = "; ".join(there.changes(entrant, track)) if there else "no round was drawn"
        return [
            f"audit: task and controller are not those of the last round of {track.name} ({why}); "
            f"run `python -m benchmarks audit {track.name}`"
        ]
    return []


def _other_episodes(stored: Record, requested: Iterable[Cell]) -> list[str]:
    """Return which episodes are missing or superfluous."""
    recorded = Counter(
        (e["split"], e["training_seed"], e["scenario"], e["seed"]) for e in stored["episodes"]
    )
    needed = Counter(
        (c.split, c.training_seed, c.scenario.name, seed) for c in requested for seed in c.seeds
    )
    found = []
    for what, which in (("missing", needed - recorded), ("superfluous", recorded - needed)):
        if which:
            split, run, scenario, seed = next(iter(which))
            where = f"{split}, {scenario}, seed {seed}"
            where += "" if run is None else f", training seed {run}"
            found.append(f"episodes: {which.total()} {what}, the first: {where}")
    return found


def _compare(stored: Record, again: Record, verdict: Verdict) -> None:
    before, after = ({**comparable(row), "schema": rows.SCHEMA} for row in (stored, again))
    made, here = (row.pop("made_with", {}) for row in (before, after))
    verdict.notes += differences(made, here, "made_with")
    verdict.notes += differences(_described(before), _described(after), "description")
    curves = list(_other_curves(before.pop("traces"), after.pop("traces")))
    drifted = differences(before, after)
    if drifted and any(made.get(key) != here.get(key) for key in ("packages", "cpu", "commit")):
        verdict.mode = verified.ELSEWHERE
        verdict.notes.append(f"{len(drifted)} fields differ in bits, the first: {drifted[0]}")
        drifted = beyond_rounding(before, after)
    verdict.drifted += drifted + curves


def _described(row: dict[str, Any]) -> dict[str, Any]:
    """Remove the description from a row and return it."""
    controller, scenario = dict(row["controller"]), dict(row["scenarios"])
    found = {key: controller.pop(key, None) for key in DESCRIPTION}
    content = dict(scenario["content"])
    found["title"] = content.pop("title", None)
    row["controller"], row["scenarios"] = controller, {**scenario, "content": content}
    return found


def beyond_rounding(before: Record, after: Record) -> list[str]:
    """Return a line for every difference beyond rounding between machines, of any episode."""
    found = differences(_exact(before), _exact(after))
    old, new = (
        [_without(episode, *ROUNDED) for episode in row["episodes"]] for row in (before, after)
    )
    found += differences(old, new, "episodes")
    worst = after["scenarios"]["content"]["worst_case"]
    episodes = zip(before["episodes"], after["episodes"], strict=False)
    for k, (old, new) in enumerate(episodes):
        for metric, value in new["scores"].items():
            where, slack = f"episodes[{k}].scores.{metric}", SLACK * float(worst[metric])
            found += differences(old["scores"].get(metric), value, where, ROUNDING, slack)
    return found


def _exact(row: Record) -> dict[str, Any]:
    """Return the part of a row that is independent of rounding.

    Without recorded actions in a round, the digest of a controller depends on rounding.
    """
    kept, about = _without(row, "episodes", "controller"), row["controller"]
    artefact = about["artefact"] if row["audit"] else _without(about["artefact"], "digest")
    return {**kept, "controller": {**about, "artefact": artefact}}


def _without(record: Record, *keys: str) -> dict[str, Any]:
    return {key: value for key, value in record.items() if key not in keys}


def _other_curves(old: list[Any], new: list[Any]) -> Iterator[str]:
    """Yield which plotted signals differ by more than ``DRAWN``."""
    before, after = ([{**t, "signals": sorted(t["signals"])} for t in both] for both in (old, new))
    other = differences(before, after, "traces")
    yield from other
    for k, trace in enumerate(() if other else new):
        for name, packed in trace["signals"].items():
            first, second = (traces.unpack(p) for p in (old[k]["signals"][name], packed))
            near = DRAWN * (packed["high"] - packed["low"]) + 1e-9 * abs(packed["high"])
            if first.shape != second.shape or not np.allclose(
                first, second, rtol=0.0, atol=near, equal_nan=True
            ):
                yield f"traces[{k}].signals.{name}: another curve now"


def differences(
    old: Any, new: Any, where: str = "", tolerance: float = 0.0, slack: float = 0.0
) -> list[str]:
    """Return a line for every leaf in which two values differ by more than the tolerances."""
    return list(_differences(old, new, where, tolerance, slack))


def _differences(old: Any, new: Any, where: str, *near: float) -> Iterator[str]:
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*old, *new]):
            place = f"{where}.{key}" if where else str(key)
            yield from _differences(old.get(key), new.get(key), place, *near)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from _differences(*pair, f"{where}[{i}]", *near)
    elif not _alike(old, new, *near):
        yield f"{where}: {_short(old)} recorded, {_short(new)} now"


def _alike(old: Any, new: Any, tolerance: float, slack: float) -> bool:
    if type(old) is not type(new):
        return False
    if isinstance(old, float) and (tolerance or slack):
        return abs(new - old) <= tolerance * max(abs(old), abs(new)) + slack
    return bool(old == new)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
