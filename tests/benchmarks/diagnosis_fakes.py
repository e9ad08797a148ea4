"""Records of the diagnosis benchmark, made by hand."""

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

import yaml

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
    given = yaml.safe_load(Path(__file__).with_name("diagnosis_sample.yaml").read_text("utf-8"))
    return [record(**one) for one in given]
