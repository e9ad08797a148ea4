"""Differences of two rows: exact, or within the rounding of another processor."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from benchmarks.runs import traces

ROUNDING = 1e-4
"""Relative difference of a score of one episode between two machines.

Between Zen 5 and Rocket Lake, in all episodes of the board, 1.4e-7 was the largest.
"""
SLACK = 1e-6
"""Shares of the worst case that are no difference, for scores near zero."""
DRAWN = 1e-3
"""Share of its range by which a drawn signal may differ."""
ROUNDED = ("scores", "trajectory", "saturated")
"""Entries of an episode that rounding changes; a signal may just reach its bound."""

Row = Mapping[str, Any]


def beyond_rounding(before: Row, after: Row) -> list[str]:
    """Return a line for everything in which two rows differ by more than machines do.

    Every episode is compared, not their mean: free episodes would allow any interval.
    """
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
    return found + list(_other_curves(before["traces"], after["traces"]))


def _exact(row: Row) -> dict[str, Any]:
    """Return the part of a row that no rounding changes.

    Where no round holds a controller's answers, their digest follows from the digits of its design.
    """
    kept, about = _without(row, "episodes", "traces", "controller"), row["controller"]
    artefact = about["artefact"] if row["audit"] else _without(about["artefact"], "digest")
    return {**kept, "controller": {**about, "artefact": artefact}}


def _without(record: Row, *keys: str) -> dict[str, Any]:
    return {key: value for key, value in record.items() if key not in keys}


def _other_curves(old: list[Any], new: list[Any]) -> Iterator[str]:
    """Yield which drawn signals differ by more than a thousandth of their range."""
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
    """Return a line for every leaf in which two plain values differ, with both values.

    ``tolerance`` and ``slack`` are the relative and absolute difference that is none.
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
