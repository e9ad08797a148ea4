"""Synthetic diagnoses of every verdict, as input of the report."""

import copy
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import jsonschema
import numpy as np
import yaml

from pam_envs.diagnosis.report.report import report_json

HERE = Path(__file__)
SCHEMA = json.loads((HERE.parents[2] / "schemas/diagnosis.schema.json").read_text(encoding="utf-8"))
MADE = yaml.safe_load(HERE.with_name("report.yaml").read_text(encoding="utf-8"))
CREEP = MADE["report"]["causes"][0]
SEGMENTS = ("holds", "staircase", "sine", "ramp", "steps_held", "sine_held")
FIXED = ("named", "ambiguous")
"""Verdicts with a cause."""


class Plant:
    """Writes a fixed text."""

    def to_yaml(self, path: str | Path) -> None:
        Path(path).write_text("schema: 1\n", encoding="utf-8")


def traces(rows: int = 1200, period: float = 0.1, extended: bool = True) -> SimpleNamespace:
    """Return six segments of a muscle that creeps, and two replays of it, the last two held out."""
    rng = np.random.default_rng(3)
    n = rows // len(SEGMENTS)
    time, segment = np.arange(n * len(SEGMENTS)) * period, np.repeat(np.arange(len(SEGMENTS)), n)
    pressure = 2.5 + 2.0 * np.sin(0.3 * (1.0 + 0.2 * segment) * (time - time[n * segment]))
    load = np.where(np.isin(segment, (3, 4)), 45.0, 25.0)
    base = 3.0 * pressure - 0.12 * pressure**2 - 0.05 * (load - 25.0)
    creep = 0.4 * np.sin(0.05 * time) - 0.1 * base
    noise = rng.normal(0.0, 0.05, len(time)), rng.normal(0.0, 0.012, len(time))

    def outputs(contraction: np.ndarray, more: Any = 0.0) -> dict[str, np.ndarray]:
        return {"contraction": 1e-3 * contraction, "pressure": 1e5 * (pressure + more)}

    return SimpleNamespace(
        time=time,
        segment=segment,
        segments=SEGMENTS,
        held_out=segment >= 4,
        command=1e5 * np.round(pressure),
        load=load,
        temperature=21.0 + 2e-3 * time + rng.normal(0, 0.05, len(time)),
        measured=outputs(base + creep + noise[0], noise[1]),
        base=outputs(1.06 * base),
        extended=outputs(base + 0.95 * creep) if extended else None,
        effects={"creep": {"contraction": 1e-3 * creep, "pressure": 0.0 * creep}}
        if extended
        else {},
    )


def rivals(verdict: str) -> list[dict[str, Any]]:
    gains = [2.9, 2.41, 1.12, 0.83, 0.61, 0.4, 0.22, 0.1, 0.06, 0.02, 0.01, 0.0, -0.01, -0.04]
    whys = ["surely worse"] * len(gains)
    if verdict in FIXED:
        whys[0], whys[2] = "the best", "imitates it"
    if verdict == "ambiguous":
        gains[1], whys[1] = 2.78, "not excluded"

    def spread(value: float, width: float) -> dict[str, Any]:
        return {"value": value, "interval": [value - width, value + width]}

    return [
        {
            "name": name,
            "title": name.replace("_", " "),
            "form": "three Kelvin-Voigt elements" if name == "creep" else "linear",
            "gain": spread(gain, 0.1 * abs(gain) + 0.02),
            "behind": spread(gains[0] - gain, 0.2 * (gains[0] - gain)),
            "held_out": "blocks" if name == "slip_step" else "kinds",
            "judged": {"gain": gain - 0.01, "better": 0.0 if i else 1.0},
            "why": why,
            "excluded": why == "surely worse",
        }
        for i, (name, gain, why) in enumerate(zip(MADE["candidates"], gains, whys, strict=True))
    ]


def isolability() -> dict[str, Any]:
    names, rng = list(MADE["candidates"]), np.random.default_rng(8)
    rows = rng.normal(size=(len(names), 6))
    rows[1] = rows[0] + 0.4 * rows[1]
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    absorbed = dict(zip(names, rng.uniform(0.1, 0.98, len(names)), strict=True))
    return {"names": names, "cosine": np.abs(rows @ rows.T), "absorbed": absorbed}


def report(verdict: str = "named") -> dict[str, Any]:
    """Return the report of a verdict as an engine makes it, numpy scalars and all."""
    made: dict[str, Any] = copy.deepcopy(MADE["report"])
    made |= {"runtime_s": np.float64(6.123456789), "closed_loop_reason": None}
    made |= {"verdict": verdict, "text": MADE["texts"][verdict], "isolability": isolability()}
    made["rivals"] = [] if verdict == "insufficient" else rivals(verdict)
    if verdict != "ambiguous":
        made["experiment"] = None
    if verdict not in FIXED:
        made |= {"causes": [], "error_after": made["error_before"], "closed_loop": None}
        made["residual_structure"]["after"] = made["residual_structure"]["before"]
        made["closed_loop_reason"] = "no cause was added to the plant"
    return made


def diagnosis(verdict: str = "named", plant: bool = True, **size: Any) -> SimpleNamespace:
    """Return a diagnosis of a verdict; settled readings have no plant."""
    return SimpleNamespace(
        report=report(verdict),
        traces=traces(extended=verdict in FIXED, **size),
        plant=Plant() if plant else None,
    )


def stored(made: dict[str, Any]) -> dict[str, Any]:
    """Return a report as it is read from its file."""
    return dict(json.loads(report_json(made)))


def checked(made: dict[str, Any]) -> dict[str, Any]:
    """Return a stored report that satisfies the schema."""
    found = stored(made)
    jsonschema.validate(found, SCHEMA)
    return found
