"""Run a row again from its own record and say what differs.

Nothing of a row is believed: environment, policy files, salt and the set of episodes are
looked up, and every number is computed again.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks import audit, cells, provenance, replay, rows, scenarios, tasks
from benchmarks.canonical import plain
from benchmarks.cells import cells_of
from benchmarks.controllers import Entrant, find
from benchmarks.metrics import of_track
from benchmarks.scenarios import ScenarioSet
from benchmarks.store import comparable, fault
from sweeps import engine

REPLAYED = 1e-3
"""Relative difference of means that a learned row may have with other versions."""

_NOTED = ("made_with",)


@dataclass
class Verdict:
    """What a row gave when it was run again.

    Attributes
    ----------
    row : str
    drifted : list of str
        Every field that differs, with both values; empty if the row holds.
    notes : list of str
        Differences that are no drift by themselves (versions, commit).
    """

    row: str
    drifted: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """Whether nothing has drifted."""
        return not self.drifted


def verify(
    path: Path,
    jobs: int = 1,
    folder: Path = scenarios.FOLDER,
    cluster: engine.Cluster | None = None,
) -> Verdict:
    """Run the row of a file again and compare.

    Rows must come out equal to the last bit. Where versions or processor are others, a learned row
    may differ a little: then its recorded actions are replayed as well, which has to give the
    recorded scores, and its policy has to answer with them.

    Parameters
    ----------
    path : Path
    jobs : int
        Processes.
    folder : Path
        Where the checkout's scenario files lie.
    cluster : Cluster, optional
        Where to compute in place of ``jobs`` processes here.
    """
    try:
        stored = json.loads(path.read_bytes())
        rows.check_schema(stored, path)
    except (OSError, ValueError, AttributeError) as error:
        return Verdict(path.stem, [f"the file cannot be read: {error}"])
    verdict = Verdict(path.stem)
    wrong = fault(stored)
    if wrong:
        verdict.drifted.append(f"file: {wrong}")
    try:
        tasks.check_version(stored["env"]["id"], stored["row"])
        track = ScenarioSet(stored["scenarios"]["content"])
        entrant = find(stored["controller"]["name"])
        _compare_scenarios(stored, track, folder, verdict)
        _compare_audit(stored, track, verdict)
        _compare_episodes(stored, entrant, track, verdict)
        again = _run_again(entrant, track, cluster or engine.Cluster(jobs))
        _compare(stored, again, entrant, track, verdict)
    except Exception as error:
        verdict.drifted.append(f"cannot be run again: {type(error).__name__}: {error}")
    return verdict


def _compare_scenarios(
    stored: Mapping[str, Any], track: ScenarioSet, folder: Path, verdict: Verdict
) -> None:
    """Compare the row's scenarios with their digest and with the file of that name."""
    if stored["scenarios"]["digest"] != track.digest:
        verdict.drifted.append(
            f"scenarios.digest: {stored['scenarios']['digest'][:16]} recorded, "
            f"{track.digest[:16]} of the recorded content"
        )
    if stored["env"]["id"] != track.env:
        verdict.drifted.append(f"env.id: {stored['env']['id']} recorded, scenarios of {track.env}")
    files = scenarios.available(folder)
    if track.name not in files:
        verdict.drifted.append(f"scenarios: there is no file {track.name}.yaml")
    elif files[track.name].digest != track.digest:
        verdict.drifted.append(
            f"scenarios: the content is not that of {track.name}.yaml, version "
            f"{files[track.name].content['version']}; run the row again"
        )


def _compare_audit(stored: Mapping[str, Any], track: ScenarioSet, verdict: Verdict) -> None:
    """Compare the row's salt with the one that was drawn, and its seeds with what follows."""
    audit.check_only_added()
    artefact = stored["controller"]["artefact"]["digest"]
    drawn = audit.of(audit.entries(), stored["task"], artefact, track)
    recorded = stored["audit"]
    if recorded is None and drawn is not None:
        verdict.drifted.append(
            f"audit: left out, though a salt was drawn on {drawn.drawn}; run the row again"
        )
    if recorded is None:
        return
    if drawn is None:
        verdict.drifted.append(
            "audit: no salt was drawn for this task and artefact; run "
            f"`python -m benchmarks audit {stored['row']}`"
        )
    elif recorded["salt"] != drawn.salt:
        verdict.drifted.append(
            f"audit.salt: {recorded['salt'][:12]} recorded, {drawn.salt[:12]} was drawn"
        )
    names = [scenario.name for scenario in track.scenarios()]
    derived = audit.seeds_of(stored["task"], artefact, recorded["salt"], names)
    if recorded["seeds"] != {name: list(seeds) for name, seeds in derived.items()}:
        verdict.drifted.append("audit.seeds: not those of task, artefact and salt")


def _compare_episodes(
    stored: Mapping[str, Any], entrant: Entrant, track: ScenarioSet, verdict: Verdict
) -> None:
    """Compare which episodes there are with which there must be."""
    recorded = Counter(
        (e["split"], e["training_seed"], e["scenario"], e["seed"]) for e in stored["episodes"]
    )
    wanted = Counter(
        (cell.split, cell.training_seed, cell.scenario.name, seed)
        for cell in cells_of(entrant, track)
        for seed in cell.seeds
    )
    for what, which in (("missing", wanted - recorded), ("not to be there", recorded - wanted)):
        if which:
            split, run, scenario, seed = next(iter(which))
            trained = "" if run is None else f", training seed {run}"
            verdict.drifted.append(
                f"episodes: {which.total()} {what}, the first: {split}, {scenario}, seed {seed}"
                + trained
            )


def _run_again(entrant: Entrant, track: ScenarioSet, cluster: engine.Cluster) -> dict[str, Any]:
    wanted = cells_of(entrant, track)
    records = {}
    for done in engine.run(cells.compute, wanted, cluster):
        if done.error is not None:
            raise ValueError(done.error)
        records[done.key] = done.value
    return dict(plain(rows.assemble(entrant, track, [records[cell.key] for cell in wanted])))


def _compare(
    stored: Mapping[str, Any],
    again: dict[str, Any],
    entrant: Entrant,
    track: ScenarioSet,
    verdict: Verdict,
) -> None:
    before, after = comparable(stored), comparable(again)
    for name in _NOTED:
        verdict.notes += differences(before.pop(name, None), after.pop(name, None), name)
    if not entrant.files or before == after or not _elsewhere(verdict.notes):
        verdict.drifted += differences(before, after)
        return
    _compare_nearly(before, after, verdict)
    verdict.drifted += replay.differences(stored, entrant, track)
    verdict.notes.append("other versions: not compared to the last bit; recorded actions replayed")


def _elsewhere(notes: list[str]) -> bool:
    """Return whether packages or processor are others than recorded."""
    return any(note.startswith(("made_with.packages", "made_with.cpu")) for note in notes)


_ROUNDED = ("aggregate", "by", "audit", "episodes", "actions", "traces")


def _compare_nearly(before: dict[str, Any], after: dict[str, Any], verdict: Verdict) -> None:
    """Compare a learned row whose policy may answer a little otherwise in the last digits."""
    for name in (name for name in after if name not in _ROUNDED):
        verdict.drifted += differences(before.get(name), after[name], name)
    kept, seen = ([_coarse(episode) for episode in row["episodes"]] for row in (before, after))
    verdict.drifted += differences(kept, seen, "episodes")
    verdict.drifted += differences(before["by"], after["by"], "by", REPLAYED)
    verdict.drifted += _means_differ(before, before["aggregate"], after["aggregate"], "aggregate")
    if before["audit"] and after["audit"]:
        old, new = before["audit"], after["audit"]
        place = "audit.aggregate"
        verdict.drifted += _means_differ(before, old["aggregate"], new["aggregate"], place)
        for name in (name for name in new if name not in ("aggregate", "gap")):
            verdict.drifted += differences(old.get(name), new[name], f"audit.{name}")
    verdict.drifted += _own_sums(before)


def _coarse(episode: Mapping[str, Any]) -> dict[str, Any]:
    """Return what of an episode no rounding changes."""
    rounded = ("scores", "trajectory", "saturated")
    return {name: value for name, value in episode.items() if name not in rounded}


def _means_differ(
    row: Mapping[str, Any], old: Mapping[str, Any], new: Mapping[str, Any], where: str
) -> list[str]:
    """Return in which metrics two rows differ by more than rounding of the answers does."""
    lines = []
    for metric, worst in row["scenarios"]["content"]["worst_case"].items():
        pair = [_mean(scores.get(metric)) for scores in (old, new)]
        if not math.isclose(*pair, rel_tol=REPLAYED, abs_tol=REPLAYED**2 * worst):
            lines.append(f"{where}.{metric}.mean: {pair[0]!r} recorded, {pair[1]!r} now")
    return lines


def _mean(scores: Mapping[str, Any] | None) -> float:
    """Return a mean, a number that equals no other one where there is none."""
    if scores is None:
        return math.nan
    return -1.0 if scores["mean"] is None else float(scores["mean"])


def _own_sums(row: Mapping[str, Any]) -> list[str]:
    """Return what of a row's scores does not follow from its own episodes."""
    wanted = of_track(row["scenarios"]["content"])
    found: dict[str, Any] = {"aggregate": rows.aggregate(rows.episodes_of(row), wanted)}
    recorded: dict[str, Any] = {"aggregate": row["aggregate"]}
    if row["audit"]:
        scores = rows.aggregate(rows.episodes_of(row, cells.AUDIT), wanted)
        found["audit"] = {"aggregate": scores, "gap": rows.gap(scores, found["aggregate"])}
        recorded["audit"] = {name: row["audit"][name] for name in ("aggregate", "gap")}
    return differences(recorded, plain(found), tolerance=replay.EQUAL)


def differences(old: Any, new: Any, where: str = "", tolerance: float = 0.0) -> list[str]:
    """Return a line for every leaf in which two plain values differ, with both values.

    Parameters
    ----------
    old, new : plain values
    where : str
        What they are.
    tolerance : float
        Relative difference of numbers that is none.
    """
    return list(_differences(old, new, where, tolerance))


def _differences(old: Any, new: Any, where: str, tolerance: float) -> Iterator[str]:
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*old, *new]):
            place = f"{where}.{key}" if where else str(key)
            yield from _differences(old.get(key), new.get(key), place, tolerance)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from _differences(*pair, f"{where}[{i}]", tolerance)
    elif not _alike(old, new, tolerance):
        yield f"{where}: {_short(old)} recorded, {_short(new)} now"


def _alike(old: Any, new: Any, tolerance: float) -> bool:
    if type(old) is not type(new):
        return False
    if isinstance(old, float) and tolerance:
        return abs(new - old) <= tolerance * max(abs(old), abs(new))
    return bool(old == new)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def environment_note() -> str:
    """Return the versions that the comparison was made with, in one line."""
    return ", ".join(f"{name} {version}" for name, version in provenance.packages().items())
