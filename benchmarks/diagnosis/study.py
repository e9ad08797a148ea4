"""Study of one benchmark case: diagnosis, ground truth, closed loop, next experiment."""

import time as clock
from collections.abc import Collection
from typing import Any

import numpy as np

from benchmarks.diagnosis.cases import NOISE, Case, Made, Unmade, make
from benchmarks.diagnosis.next import DrivenRig, OracleRig, again
from benchmarks.diagnosis.sources import BENT, HOME, deserved
from benchmarks.identity.hashing import plain
from benchmarks.runs import provenance
from benchmarks.scoring.group import rms
from pam_envs.constants import CELSIUS, GRAVITY
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.closed_loop.gain import COMPENSABLE, closed_loop
from pam_envs.diagnosis.diagnosis import diagnose
from pam_envs.diagnosis.report.outcome import Diagnosis

STAGES = ("verdict", "loop", "next", "oracle")
"""Diagnosis; controllers on the hidden rig; execution of the proposed experiment; diagnosis with
the hidden causes and the common ones alone."""
COMMON = tuple(cause.name for cause in catalogue() if cause.common)
"""Causes of the flexible base, which the oracle keeps."""
OUTPUTS = ("contraction", "pressure")
MOST_RIVALS = 6


def study(case: Case, stages: Collection[str] = ("verdict",)) -> dict[str, Any]:
    """Generate a case and diagnose it; return result, truth and ``failure`` as plain types."""
    unknown = sorted(set(stages) - set(STAGES))
    if unknown:
        raise ValueError(f"no stage is called {unknown[0]!r}; there are {', '.join(STAGES)}")
    started = clock.perf_counter()
    record: dict[str, Any] = {"schema": 1, "case": case.record(), "failure": None}
    spent = record["volatile"] = provenance.occasion() | {"make_s": 0.0, "runtime_s": None}
    try:
        made = make(case)
        record["truths"] = truths_of(case, made)
        spent["make_s"] = clock.perf_counter() - started
        started = clock.perf_counter()
        found = diagnosed(made.recording, made.sheet)
        spent["runtime_s"] = clock.perf_counter() - started
        record |= outcome(found) | {"traces": trace_errors(made, found)}
        record["nature"] = deserved(made.ground.base)
        models = (found.study.model, *found.study.decision.open_rivals)
        if any(c.name == BENT and f.name != "pressure" for m in models for c, f in m.causes):
            record["nature"] = [name for name in record["nature"] if name != BENT]
        if "loop" in stages and loops(case):
            record["loop"] = loop_of(made, found)
        if "next" in stages and promised(record):
            plan = record["experiment"]["name"]
            said = outcome(diagnosed(*again(case, made, plan)))
            kept = ("verdict", "names", "open", "rivals")
            record["next"] = {"plan": plan, **{key: said[key] for key in kept}}
        if "oracle" in stages and needs_oracle(record):
            known = outcome(diagnosed(made.recording, made.sheet, {*case.names, *COMMON}))
            record["oracle"] = {key: known[key] for key in ("verdict", "names", "held_out")}
    except Exception as error:
        record["unmade"] = isinstance(error, Unmade)
        record["failure"] = f"{type(error).__name__}: {error}"
    return dict(plain(record))


def diagnosed(recording: Any, sheet: Any, causes: Collection[str] | None = None) -> Diagnosis:
    """Return the diagnosis of a recording with its rig file, of all causes by default."""
    asked = None if causes is None else sorted(causes)
    return diagnose(recording, rig=sheet, causes=asked, closed_loop=False, progress=False)


def loops(case: Case) -> bool:
    """Return whether controllers are compared on a case: one compensable hidden effect."""
    return case.kind == "single" and case.world == HOME and case.names[0] in COMPENSABLE


def promised(record: dict[str, Any]) -> bool:
    """Return whether a record proposes an experiment that should separate its rivals.

    An untestable cause is separated by what its recording lacks, which no further rows replace.
    """
    plan, testable = record.get("experiment"), record["case"]["kind"] != "untestable"
    doubt = testable and record.get("verdict") == "ambiguous"
    return doubt and plan is not None and bool(plan["enough"])


def needs_oracle(record: dict[str, Any]) -> bool:
    """Return whether a record names other causes than an oracle may, which knows the hidden ones.

    With the same names the oracle is the same model. There is none where the catalogue has no cause
    of the hidden effect.
    """
    known = record["case"]["kind"] != "unknown"
    hidden = set(record["case"]["names"])
    others = set(record.get("names", ())) - {*hidden, *COMMON}
    missing = hidden - set(record.get("names", ()))
    return bool(hidden and known and record.get("verdict") == "named" and (others or missing))


def truths_of(case: Case, made: Made) -> list[dict[str, Any]]:
    """Return the hidden effects."""
    return [
        {
            "name": truth.name,
            "target": target,
            "size": truth.size,
            "raw": truth.raw,
            "amplitude": truth.amplitude,
        }
        for truth, target in zip(made.truths, case.sizes, strict=True)
    ]


def outcome(found: Diagnosis) -> dict[str, Any]:
    """Return the summary of a diagnosis."""
    report, decision = found.report, found.study.decision
    plan = report["experiment"]
    return {
        "verdict": found.verdict,
        "names": list(found.causes),
        "rivals": [
            {"name": rival["name"], "gain": rival["gain"]["value"]}
            for rival in report["rivals"][:MOST_RIVALS]
        ],
        "open": ["+".join(rival.names) for rival in decision.open_rivals],
        "evidence": getattr(decision, "evidence", None),
        "held_out": {
            when: {name: error["times_floor"] for name, error in (report[when] or {}).items()}
            for when in ("error_before", "error_after")
        },
        "calibration": {
            flag: [entry["name"] for entry in report["calibration"] if entry[flag]]
            for flag in ("at_bound", "outside_tolerance")
        },
        "not_testable": [entry["name"] for entry in report["not_testable"]],
        "experiment": plan and {key: plan[key] for key in ("name", "separation", "enough")},
        "rule_version": report["rule_version"],
    }


def trace_errors(made: Made, found: Diagnosis) -> dict[str, dict[str, Any]]:
    """Return the trace error of every correctly named cause.

    The error is the RMS of the difference over that of the truth, both without the part that a
    refit of the base absorbs, on the output where the truth is largest. The RMS of found and true
    trace over the usual noise is also returned.
    """
    errors = {}
    for truth in made.truths:
        if truth.name not in found.causes:
            continue
        shown = found.traces.effects[truth.name]
        trace = np.stack([shown[name] for name in OUTPUTS])
        true, ours = (made.ground.left(one, truth.name) for one in (truth.trace, trace))
        k = int(np.argmax((true**2).mean(axis=1)))
        size = rms(true[k])
        errors[truth.name] = {
            "output": OUTPUTS[k],
            "error": rms(ours[k] - true[k]) / size,
            "found": rms(ours[k]),
            "true": size,
            "found_raw": rms(trace[k]) / NOISE[k],
            "true_raw": rms(truth.trace[k]) / NOISE[k],
        }
    return errors


def loop_of(made: Made, found: Diagnosis) -> dict[str, Any] | None:
    """Return the closed-loop comparison on the hidden rig, of wrong verdicts too, errors [mm]."""
    load = float(np.median(made.recording.load))
    celsius = float(made.ground.campaign.temperature_C[-1])
    loop = closed_loop(
        found.base,
        found.plant,
        rig=DrivenRig(made, load, celsius),
        oracle=OracleRig(made, load, celsius),
        load=load / GRAVITY,
        kelvin=celsius + CELSIUS,
    )
    if loop is None:
        return None
    before, after = loop["before"]["value"], loop["after"]["value"]
    best = loop["oracle"]["value"]
    gap = before - best
    return {
        "before_mm": before,
        "after_mm": after,
        "oracle_mm": best,
        "gap": gap / before,
        "recovered": (before - after) / gap if gap > 0.0 else None,
        "better_percent": loop["better_percent"],
        "references": loop["references"],
    }
