"""Scores of one episode by the rules of its scenario file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from benchmarks.scoring import metrics


def scores_of(
    episode: Any, content: Mapping[str, Any], rests: bool, failed: bool | None = None
) -> dict[str, float]:
    """Return the scores of an episode; one that did not reach its end gets the worst case.

    Parameters
    ----------
    episode : Episode
    content : mapping
        Of the scenario file.
    rests : bool
        Whether the reference rests; otherwise the steady-state error is NaN.
    failed : bool, optional
        Whether it counts as failed; by default whether it did.

    Raises
    ------
    ValueError
        If an episode that did not fail has nothing left to score after settling.
    """
    failed = episode.failed if failed is None else failed
    scores = _measured(episode, content)
    if failed:
        scores = metrics.worst_of(scores, content["worst_case"])
    if not rests:
        scores["steady_state_error"] = float("nan")
    return scores


def _measured(episode: Any, content: Mapping[str, Any]) -> dict[str, float]:
    """Return what can be measured: nothing, if it failed before there was anything."""
    if episode.failed and not len(episode.actions):
        return {}
    signals = {**episode.signals}
    signals["sensed"] = signals[content["sensed"]]
    try:
        return metrics.score(
            signals,
            episode.period,
            float(content["settle_seconds"]),
            float(content["hold_seconds"]),
            content["cost_scales"],
            content.get("gate") or (),
            content.get("metrics") or (),
            content.get("activity", ""),
            content.get("half_range"),
            content.get("tool_length"),
        )
    except ValueError:
        if not episode.failed:
            raise
        return {}
