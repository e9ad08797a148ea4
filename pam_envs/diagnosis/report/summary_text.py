"""Verdict of a diagnosis in a few sentences."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pam_envs.diagnosis.decide.isolability import SHORT
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.fit.blocks import BLOCK_SECONDS
from pam_envs.diagnosis.report.page_parts import enumeration

Report = Mapping[str, Any]

VARIES_WITH = 0.05
"""Share of a residual explained by one variable above which the variable is named."""


def sentence(report: Report, rule: Rule) -> str:
    """Return the verdict in a few sentences."""
    verdict = report["verdict"]
    if verdict == "insufficient":
        return _insufficient(report)
    if verdict == "adequate":
        return (
            f"The plant is adequate: the held-out error is {_errors(report, 'error_before')}, "
            f"{_where(report)}, and this recording shows no remaining error."
        )
    if verdict == "unexplained":
        return _unexplained(report, rule)
    text = f"The simulation lacks {enumeration(_titles(report))}: with it {_fell(report)}."
    text += _doubts(report)
    if verdict == "ambiguous":
        text += _not_excluded(report)
    if report["closed_loop"] is not None:
        text += f" {report['closed_loop']['text']}"
    return text


def _insufficient(report: Report) -> str:
    short = [w for w in report["warnings"] if w.startswith(SHORT)]
    if short:
        return short[0]
    text = "The recording does not excite the effects in question"
    return f"{text}: {len(report['not_testable'])} causes cannot be tested."


def _titles(report: Report) -> list[str]:
    return [c["title"] for c in report["causes"]]


def _where(report: Report) -> str:
    """Return the held-out data in words."""
    held = report["held_out"]
    if held["by"] == "blocks":
        return f"on held-out blocks of {BLOCK_SECONDS:g} s"
    word = "kind" if len(held["kinds"]) == 1 else "kinds"
    return f"on held-out experiments of the {word} {enumeration(held['kinds'])}"


def _errors(report: Report, key: str) -> str:
    floors = report["noise_floor"]
    return " and ".join(
        f"{e['value']:.3g} {e['unit']} (noise floor {floors[c]['value']:.3g})"
        for c, e in report[key].items()
    )


def _fell(report: Report) -> str:
    before, after, floors = report["error_before"], report["error_after"], report["noise_floor"]
    worst = max(before, key=lambda c: before[c]["value"] / max(after[c]["value"], 1e-12))
    a, b = before[worst], after[worst]
    word = "falls" if b["value"] < a["value"] else "goes"
    return (
        f"the held-out error of the {worst} {word} from {a['value']:.3g} to {b['value']:.3g} "
        f"{a['unit']} (noise floor {floors[worst]['value']:.3g}), {_where(report)}"
    )


def _doubts(report: Report) -> str:
    """Return the causes without a significant gain on the held-out data."""
    text = ""
    for cause in report["causes"]:
        low, high = cause["gain"]["interval"] or (None, None)
        if low is not None and low <= 0.0:
            text += (
                f" The gain of {cause['title']} is not significant on the held-out data: "
                f"{cause['gain']['value']:.2g} (95 % interval {low:.2g} to {high:.2g})."
            )
    return text


def _not_excluded(report: Report) -> str:
    others = [r["name"] for r in report["rivals"] if r["why"] == "not excluded"]
    text = f" Not excluded: {', '.join(others)}." if others else ""
    plan = report["experiment"]
    if plan is None:
        return text
    if plan["enough"]:
        return f"{text} To separate them, {plan['description']}."
    return (
        f"{text} No experiment of the list separates them; "
        f"{plan['sensor'] or 'another sensor'} would."
    )


def _unexplained(report: Report, rule: Rule) -> str:
    text = (
        "The model error is not explained by any candidate: the held-out error is "
        f"{_errors(report, 'error_before')}, {_where(report)}."
    )
    if report["causes"]:
        text += (
            f" Adding {enumeration(_titles(report))} reduces it to "
            f"{_errors(report, 'error_after')}, which is not sufficient for a name."
        )
    after = report["residual_structure"]["after"]
    flexible = max((s["flexible_r2"] for s in after.values()), default=0.0)
    text += f" A flexible model explains {100 * flexible:.0f} % of the residual"
    share, name = max(
        ((v or 0.0, n) for s in after.values() for n, v in s["r2"].items()), default=(0.0, "")
    )
    text += f", which varies most with {name.replace('_', ' ')}." if share > VARIES_WITH else "."
    peaks = [(s["peak"]["ratio"], s["peak"]["frequency_hz"]) for s in after.values()]
    if peaks and max(peaks)[0] > rule.peak:
        text += f" Its spectrum has a peak at {max(peaks)[1]:.3g} Hz."
    return text
