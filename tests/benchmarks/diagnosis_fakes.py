"""Records of the diagnosis benchmark, made by hand."""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any

from benchmarks.diagnosis.cases import Case


def record(
    kind: str = "single",
    truth: dict[str, float] | None = None,
    verdict: str = "named",
    names: Collection[str] = (),
    others: Collection[str] = (),
    **more: Any,
) -> dict[str, Any]:
    """Return a record as a study makes it."""
    truth = {"creep": 2.0} if truth is None else truth
    case = Case(kind, more.pop("seed", 1), tuple(truth), tuple(truth.values()))
    made = {
        "case": case.record(),
        "failure": None,
        "verdict": verdict,
        "names": list(names),
        "open": list(others),
        "traces": {},
        "held_out": {"error_before": {}, "error_after": {}},
        "experiment": None,
        "evidence": None,
        "rule_version": "7",
        "stage": "verdict",
        "volatile": {"runtime_s": more.pop("seconds", 5.0), "date": more.pop("date", "2026")},
    }
    return json.loads(json.dumps(made | more))


def failed(kind: str = "single", truth: dict[str, float] | None = None) -> dict[str, Any]:
    whole = record(kind, truth)
    return {
        **{key: whole[key] for key in ("case", "stage")},
        "failure": "ValueError: no use",
        "volatile": {"runtime_s": None},
    }


def trace(error: float, found: float = 1.0, true: float = 1.0) -> dict[str, Any]:
    return {"output": "contraction", "error": error, "found": found, "true": true}


def counted(found: dict[str, Any]) -> tuple[int, int]:
    return found["count"], found["n"]


def loop(before: float, after: float, oracle: float) -> dict[str, Any]:
    return {
        "before_mm": before,
        "after_mm": after,
        "oracle_mm": oracle,
        "gap": (before - oracle) / before,
        "recovered": (before - after) / (before - oracle),
        "better_percent": {"value": 100.0 * (1.0 - after / before), "interval": [0.0, 0.0]},
    }


def sample() -> list[dict[str, Any]]:
    """Return hand-made records of every kind."""
    plan = {"name": "long_hold", "separation": 4.0, "enough": True}
    held = {"error_before": {}, "error_after": {"contraction": 1.05, "pressure": 1.2}}
    good = {"error_before": {}, "error_after": {"contraction": 1.05, "pressure": 1.0}}
    return [
        record(names=["creep"], traces={"creep": trace(0.1, 1.8, 2.0)}, held_out=good, seconds=3.0),
        record(
            truth={"creep": 1.5},
            names=["creep", "leak"],
            traces={"creep": trace(0.3, 1.5, 1.5)},
            held_out=held,
        ),
        record(truth={"leak": 1.2}, names=["creep"], held_out=good, seconds=9.0),
        record(
            truth={"leak": 3.0},
            verdict="ambiguous",
            names=["leak"],
            others=["creep", "slip_step"],
            traces={"leak": trace(0.2, 3.6, 3.0)},
            experiment=plan,
            next={"plan": "long_hold", "verdict": "named", "names": ["leak"]},
        ),
        record(
            truth={"stick_slip": 4.0},
            verdict="ambiguous",
            names=["viscous_loss"],
            others=["stick_slip"],
            experiment=plan,
            next={"plan": "long_hold", "verdict": "named", "names": ["viscous_loss"]},
        ),
        record("weak", {"creep": 0.2}, "adequate"),
        record("weak", {"creep": 0.5}, names=["creep"], traces={"creep": trace(0.4, 0.4, 0.5)}),
        record("weak", {"leak": 0.25}, names=["slip_step"]),
        record(
            "weak",
            {"leak": 0.9},
            "ambiguous",
            ["slip_step"],
            ["creep"],
            experiment={**plan, "enough": False},
        ),
        record("loud", {"creep": 4.0}, names=["creep"]),
        record("loud", {"leak": 4.0}, names=["creep"]),
        record("clean", {}, "adequate"),
        record("clean", {}, "unexplained"),
        record("decoy", {}, "adequate"),
        record("decoy", {}, names=["temperature"]),
        record("unknown", {"vibration": 2.0}, "unexplained"),
        record("unknown", {"vibration": 1.0}, names=["resonance"]),
        record("pair", {"creep": 2.0, "leak": 1.0}, names=["leak", "creep"]),
        record("pair", {"creep": 2.0, "leak": 1.0}, "ambiguous", ["creep", "leak"], ["creep"]),
        record("pair", {"creep": 2.0, "leak": 1.0}, names=["creep"]),
        record("pair", {"creep": 2.0, "leak": 1.0}, names=["creep", "slip_step"]),
        record("idle", {}, "insufficient"),
        record("idle", {}, "adequate"),
    ]
