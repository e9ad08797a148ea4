"""Compare two rows of one controller from two machines, whose last digits differ.

Numbers in between are compared one by one, not only their means: a forger who is free in single
episodes makes any interval and any probability of improvement out of an honest mean.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.identity import artefacts
from benchmarks.identity.hashing import plain
from benchmarks.runs import cells, provenance, rows, traces
from benchmarks.scoring.metrics import headline_of, of_track


@dataclass(frozen=True)
class Near:
    """How near is near.

    Attributes
    ----------
    episode : float
        Relative difference that a score of one episode may have.
    summary : float
        That a mean and an interval may have.
    """

    episode: float
    summary: float


DIGITS = Near(1e-4, 1e-5)
"""For what is made on another processor.

Between Zen 5 and Rocket Lake, in all episodes of the board, 1.4e-7 was found at most.
"""
FAR = Near(1e-2, 1e-3)
"""For whoever asks for it, with other packages say."""
DRAWN = 1e-3
"""Part of its range by which a drawn signal may differ."""
OWN = 1e-9
"""That a summary may have from what the row's own episodes give."""
SLACK = 1e-6
"""Parts of the worst case that are no difference, for scores near zero."""
_NEARLY = ("episodes", "aggregate", "by", "audit", "traces", "actions")
_NUMBERS = ("controller.digest:", "controller.parameters.", "controller.artefact.digest:")

Row = Mapping[str, Any]


def compare(
    before: Row, after: Row, drifted: list[str], notes: list[str], near: Near = FAR
) -> None:
    """Add what of two rows differs by more than machines do, and what was let through.

    Parameters
    ----------
    before, after : mapping
        As recorded and as run again, in plain types.
    drifted, notes : list of str
    near : Near
    """
    lines, computed = _exact(before, after)
    drifted += lines
    drifted += _artefact(before["controller"])
    if computed:
        notes.append(f"computed a little otherwise here: {provenance.listed(computed)}")
    drifted += differences(*(_frame(row) for row in (before, after)), "episodes")
    drifted += _scores(before, after, near)
    drifted += _runs(before, after, near)
    drifted += _summaries(before, after, near)
    drifted += _pictures(before["traces"], after["traces"])
    notes.append(
        f"compared as of another machine: scores to {100 * near.episode:g} %, means and intervals "
        f"to {100 * near.summary:g} %, bits not"
    )


def _exact(before: Row, after: Row) -> tuple[list[str], list[str]]:
    """Return in what parts differ that no rounding changes, and which numbers were let through.

    The numbers of a controller that is designed on the spot may differ, where its code and files
    are the same; those of a policy are its file.
    """
    old, new = ({k: v for k, v in row.items() if k not in _NEARLY} for row in (before, after))
    lines = differences(old, new)
    if new["controller"]["kind"] == "learned":
        return lines, []
    let = [line for line in lines if line.startswith(_NUMBERS)]
    return [line for line in lines if line not in let], [line.partition(":")[0] for line in let]


def _artefact(about: Mapping[str, Any]) -> list[str]:
    """Return whether an artefact's digest is that of the files, numbers and code that are told."""
    told = about["artefact"]
    own = artefacts.digest_of(told["files"], about["parameters"].values(), told["code"])
    return differences(told["digest"], own, "controller.artefact.digest, of its own parts")


def _frame(row: Row) -> list[Any]:
    """Return what of each episode no rounding changes (a signal may just touch its bound)."""
    rounded = ("scores", "trajectory", "saturated")
    return [{k: v for k, v in e.items() if k not in rounded} for e in row["episodes"]]


def slack_of(row: Row) -> dict[str, float]:
    """Return below which difference each score of a track is the same: near zero, say."""
    worst = row["scenarios"]["content"]["worst_case"]
    return {metric: SLACK * float(value) for metric, value in worst.items()}


def _scores(before: Row, after: Row, near: Near) -> Iterator[str]:
    slack = slack_of(after)
    for k, (old, new) in enumerate(zip(before["episodes"], after["episodes"], strict=False)):
        for metric, value in new["scores"].items():
            where = f"episodes[{k}].scores.{metric}"
            yield from differences(
                old["scores"].get(metric), value, where, near.episode, slack[metric]
            )


def _runs(before: Row, after: Row, near: Near) -> Iterator[str]:
    """Yield in which means of a training seed two rows differ."""
    slack = slack_of(after)
    for split in (cells.PUBLIC, cells.AUDIT):
        for run in after["training_seeds"]:
            for metric, allowed in slack.items():
                pair = [_mean(row, split, run, metric) for row in (before, after)]
                where = f"{split} mean of {metric}, training seed {run}"
                yield from differences(*pair, where, near.summary, allowed)


def _mean(row: Row, split: str, run: int, metric: str) -> float | None:
    chosen = [e for e in rows.episodes_of(row, split) if e["training_seed"] == run]
    values = rows.scores_of(chosen, metric)
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def _summaries(before: Row, after: Row, near: Near) -> Iterator[str]:
    """Yield in which means and intervals two rows differ, or the first from its own episodes."""
    slack = slack_of(after)
    old, new, own = _tables(before), _tables(after), _own(before)
    for name, table in new.items():
        for metric, scores in table.items():
            given = old.get(name, {}).get(metric)
            where = f"{name}.{metric}"
            yield from differences(given, scores, where, near.summary, slack[metric])
            followed = plain(own.get(name, {}).get(metric))
            yield from differences(given, followed, where, OWN, SLACK * slack[metric])
    headline = slack[headline_of(after["scenarios"]["content"])]
    yield from differences(before["by"], after["by"], "by", near.summary, headline)
    if after["audit"] and before["audit"]:
        gaps = plain(rows.gap(own["audit.aggregate"], own["aggregate"]))
        for metric, gap in gaps.items():
            given = before["audit"]["gap"].get(metric)
            yield from differences(given, gap, f"audit.gap.{metric}", OWN, SLACK * slack[metric])
        scored = ("aggregate", "gap")
        kept = [{k: v for k, v in r["audit"].items() if k not in scored} for r in (before, after)]
        yield from differences(*kept, "audit")
    elif before["audit"] or after["audit"]:
        yield from differences(before["audit"], after["audit"], "audit")


def _tables(row: Row) -> dict[str, Any]:
    """Return the summaries of a row."""
    found = {"aggregate": row["aggregate"]}
    return found | ({"audit.aggregate": row["audit"]["aggregate"]} if row["audit"] else {})


def _own(row: Row) -> dict[str, Any]:
    """Return the summaries of a row's own episodes."""
    wanted = of_track(row["scenarios"]["content"])
    splits = {"aggregate": cells.PUBLIC, "audit.aggregate": cells.AUDIT}
    scored = {name: rows.episodes_of(row, split) for name, split in splits.items()}
    return {name: rows.aggregate(found, wanted) for name, found in scored.items() if found}


def _pictures(old: list[Any], new: list[Any]) -> Iterator[str]:
    """Yield which drawn signals differ by more than a thousandth of their range."""

    def frames(found: list[Any]) -> list[Any]:
        named = [{**trace, "signals": sorted(trace["signals"])} for trace in found]
        return list(named)

    other = differences(frames(old), frames(new), "traces")
    yield from other
    for k, trace in enumerate(() if other else new):
        for name, packed in trace["signals"].items():
            if not _drawn_alike(old[k]["signals"][name], packed):
                yield f"traces[{k}].signals.{name}: another curve now"


def _drawn_alike(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    first, second = traces.unpack(old), traces.unpack(new)
    if first.shape != second.shape:
        return False
    span = new["high"] - new["low"]
    near = DRAWN * span + OWN * max(abs(new["low"]), abs(new["high"]))
    return bool(np.allclose(first, second, rtol=0.0, atol=near, equal_nan=True))


def differences(
    old: Any, new: Any, where: str = "", tolerance: float = 0.0, slack: float = 0.0
) -> list[str]:
    """Return a line for every leaf in which two plain values differ, with both values.

    Parameters
    ----------
    old, new : plain values
    where : str
        What they are.
    tolerance, slack : float
        Relative and absolute difference of numbers that is none.
    """
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
