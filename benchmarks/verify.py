"""Run a row again from its own record and say what differs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks import cells, provenance, rows, scenarios
from benchmarks.canonical import plain
from benchmarks.controllers import Entrant, find
from benchmarks.metrics import headline_of
from benchmarks.scenarios import ScenarioSet
from benchmarks.store import comparable, fault

REPLAYED = 1e-3
"""Relative difference of the headline that a learned row may have on another machine."""

_NOTED = ("made_with",)
_UNREPEATED = ("actions",)


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


def verify(path: Path, jobs: int = 1, folder: Path = scenarios.FOLDER) -> Verdict:
    """Run the row of a file again and compare.

    Classical rows must come out equal to the last bit. Learned rows replay their recorded
    actions, and their headline must come out within 0.1 %.

    Parameters
    ----------
    path : Path
    jobs : int
        Processes.
    folder : Path
        Where the checkout's scenario files lie.
    """
    try:
        stored = json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        return Verdict(path.stem, [f"the file cannot be read: {error}"])
    verdict = Verdict(path.stem)
    wrong = fault(stored)
    if wrong:
        verdict.drifted.append(f"file: {wrong}")
    try:
        track = ScenarioSet(stored["scenarios"]["content"])
        entrant = find(stored["controller"]["name"])
        _compare_scenarios(stored, track, folder, verdict)
        again = _run_again(stored, entrant, track, jobs)
    except Exception as error:
        verdict.drifted.append(f"cannot be run again: {type(error).__name__}: {error}")
        return verdict
    _compare(stored, again, entrant, verdict)
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
    files = scenarios.available(folder)
    if track.name not in files:
        verdict.drifted.append(f"scenarios: there is no file {track.name}.yaml")
    elif files[track.name].digest != track.digest:
        verdict.drifted.append(
            f"scenarios: the content is not that of {track.name}.yaml, version "
            f"{files[track.name].content['version']}; run the row again"
        )


def _run_again(
    stored: Mapping[str, Any], entrant: Entrant, track: ScenarioSet, jobs: int
) -> dict[str, Any]:
    recorded = stored.get("actions") if entrant.kind == "learned" else None
    tasks = [
        (cell, None if recorded is None else _unpacked(recorded[cell.scenario.name]))
        for cell in cells.cells_of(entrant, track)
    ]
    if jobs == 1:
        records = [cells.compute(*task) for task in tasks]
    else:
        from joblib import Parallel, delayed

        records = Parallel(n_jobs=jobs)(delayed(cells.compute)(*task) for task in tasks)
    return dict(plain(rows.assemble(entrant, track, records)))


def _unpacked(actions: Mapping[str, Any]) -> dict[int, Any]:
    return {int(seed): cells.unpack(packed) for seed, packed in actions.items()}


def _compare(
    stored: Mapping[str, Any], again: dict[str, Any], entrant: Entrant, verdict: Verdict
) -> None:
    before, after = comparable(stored), comparable(again)
    for name in _NOTED:
        verdict.notes += differences(before.pop(name, None), after.pop(name, None), name)
    if entrant.kind != "learned":
        verdict.drifted += differences(before, after)
        return
    headline = ("aggregate", headline_of(stored["scenarios"]["content"]), "mean")
    old, new = _at(before, headline), _at(after, headline)
    if not abs(new - old) <= REPLAYED * abs(old):
        verdict.drifted.append(f"{'.'.join(headline)}: {old!r} recorded, {new!r} now")
    for name in ("env", "scenarios", "plants", "models", "seeds", "failures"):
        verdict.drifted += differences(before.get(name), after.get(name), name)
    identity = ("digest", "parameters", "name", "kind", "knowledge")
    for name in identity:
        verdict.drifted += differences(
            before["controller"].get(name), after["controller"].get(name), f"controller.{name}"
        )


def _at(record: Any, place: tuple[str, ...]) -> float:
    for key in place:
        record = record[key]
    return float(record)


def differences(old: Any, new: Any, where: str = "") -> list[str]:
    """Return a line for every leaf in which two plain values differ, with both values."""
    return list(_differences(old, new, where))


def _differences(old: Any, new: Any, where: str) -> Iterator[str]:
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*old, *new]):
            place = f"{where}.{key}" if where else str(key)
            yield from _differences(old.get(key), new.get(key), place)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from _differences(*pair, f"{where}[{i}]")
    elif type(old) is not type(new) or old != new:
        yield f"{where}: {_short(old)} recorded, {_short(new)} now"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def environment_note() -> str:
    """Return the versions that the comparison was made with, in one line."""
    return ", ".join(f"{name} {version}" for name, version in provenance.packages().items())
