"""Synthetic diagnoses of every verdict, as input of the report."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

SEGMENTS = ("holds", "staircase", "sine", "ramp", "steps_held", "sine_held")
HELD = ("steps_held", "sine_held")
LOADS = (25.0, 25.0, 25.0, 45.0, 45.0, 25.0)
_NAMES = (
    "creep leak valve_dead_band dead_time sensor_drift sensor_delay viscous_loss temperature "
    "first_cycle_softening load_dependent_hysteresis stick_slip threshold_pressure slip_step "
    "wire_slack"
)
CAUSES = _NAMES.split()
VARIABLES = ("direction", "rate", "pressure", "load", "time_since_reversal", "time", "cycle")


class Plant:
    """Writes a fixed text."""

    def __init__(self, text: str = "schema: 1\n") -> None:
        self.text = text

    def to_yaml(self, path: str | Path) -> None:
        Path(path).write_text(self.text, encoding="utf-8")


def command_of(t: np.ndarray, kind: int) -> np.ndarray:
    """Return a commanded pressure [bar] over one segment."""
    rng = np.random.default_rng(5)
    levels = {
        0: np.array([0.5, 2.5, 4.5, 2.0, 1.0]),
        1: np.array([1.0, 2, 3, 4, 5, 4, 3, 2, 1]),
        4: rng.uniform(0.5, 5.0, 14),
    }
    if kind in (2, 5):
        f = 0.1 if kind == 2 else 0.07
        return 2.5 + 2.0 * np.sin(2 * np.pi * f * t - np.pi / 2)
    if kind == 3:
        return 0.3 + 5.0 * (1 - np.abs(2 * t / t[-1] - 1))
    return levels[kind][(np.arange(len(t)) * len(levels[kind])) // len(t)]


def lag(u: np.ndarray, period: float, tau: float) -> np.ndarray:
    out = np.empty_like(u)
    y, a = u[0], 1.0 - np.exp(-period / tau)
    for k, v in enumerate(u):
        y += a * (v - y)
        out[k] = y
    return out


def play(u: np.ndarray, width: float) -> np.ndarray:
    out = np.empty_like(u)
    y = u[0]
    for k, v in enumerate(u):
        y = min(max(y, v - width), v + width)
        out[k] = y
    return out


def traces(rows: int = 1200, period: float = 0.1, extended: bool = True) -> SimpleNamespace:
    """Return six segments of a muscle that creeps, and two replays of it."""
    rng = np.random.default_rng(3)
    n = rows // len(SEGMENTS)
    segment = np.repeat(np.arange(len(SEGMENTS)), n)
    t = np.arange(n) * period
    command = np.concatenate([command_of(t, k) for k in range(len(SEGMENTS))])
    load = np.repeat(np.array(LOADS), n)
    pressure = lag(command, period, 0.25)
    inner = play(pressure, 0.35)
    base = 3.0 * inner - 0.12 * inner**2 - 0.05 * (load - 25.0)
    creep = 0.25 * (lag(base, period, 6.0) - base) + 0.18 * lag(base, period, 30.0)
    creep -= 0.1 * base
    true = base + creep
    fitted = base + 0.06 * base
    noise = rng.normal(0.0, 0.05, len(segment)), rng.normal(0.0, 0.012, len(segment))
    small = 0.1 * (lag(creep, period, 1.0) - creep)
    contraction = {"contraction": true + noise[0], "pressure": pressure + noise[1]}
    models = (
        {"contraction": fitted, "pressure": pressure},
        {"contraction": true + small, "pressure": pressure},
    )
    si = [
        {"contraction": 1e-3 * m["contraction"], "pressure": 1e5 * m["pressure"]}
        for m in (contraction, *models)
    ]
    return SimpleNamespace(
        time=np.arange(len(segment)) * period,
        segment=segment,
        segments=SEGMENTS,
        held_out=np.isin(segment, [SEGMENTS.index(h) for h in HELD]),
        command=1e5 * command,
        load=load,
        temperature=21.0 + np.arange(len(segment)) * 2e-4 + rng.normal(0, 0.05, len(segment)),
        measured=si[0],
        base=si[1],
        extended=si[2] if extended else None,
        effects={"creep": {"contraction": 1e-3 * creep, "pressure": 0.0 * creep}}
        if extended
        else {},
    )


def error(value: float, unit: str, floor: float, share: float) -> dict[str, Any]:
    return {
        "value": value,
        "unit": unit,
        "interval": [0.92 * value, 1.09 * value],
        "times_floor": value / floor,
        "kinds": {"steps_held": value * (1 + share), "sine_held": value * (1 - share)},
    }


def structure(scale: float) -> dict[str, Any]:
    shares = (0.06, 0.11, 0.31, 0.02, 0.52, 0.23, 0.14)
    return {
        "ljung_box_p": 3e-9 if scale > 0.5 else 0.21,
        "r2": {v: scale * s for v, s in zip(VARIABLES, shares, strict=True)},
        "flexible_r2": 0.84 * scale,
        "peak": {"frequency_hz": 0.31, "ratio": 4.0 * scale + 2.0},
    }


def rivals(verdict: str) -> list[dict[str, Any]]:
    gains = [2.9, 2.41, 1.12, 0.83, 0.61, 0.4, 0.22, 0.1, 0.06, 0.02, 0.01, 0.0, -0.01, -0.04]
    if verdict == "ambiguous":
        gains[1] = 2.78
    names = list(dict.fromkeys(["creep", "first_cycle_softening", "sensor_drift", *CAUSES]))
    return [
        {
            "name": name,
            "title": name.replace("_", " "),
            "form": "three Kelvin-Voigt elements" if name == "creep" else "linear",
            "gain": {"value": g, "interval": [g - 0.1 * abs(g) - 0.02, g + 0.1 * abs(g) + 0.02]},
            "behind": {
                "value": gains[0] - g,
                "interval": [0.8 * (gains[0] - g), 1.2 * (gains[0] - g)],
            },
            "held_out": "blocks" if name == "slip_step" else "kinds",
            "judged": {"gain": g - 0.01, "better": 0.0 if i else 1.0},
            "why": why(name, i, verdict),
            "excluded": why(name, i, verdict) == "surely worse",
        }
        for i, (name, g) in enumerate(zip(names, gains, strict=True))
    ]


def why(name: str, place: int, verdict: str) -> str:
    """Return what becomes of a rival."""
    if verdict not in ("named", "ambiguous"):
        return "surely worse"
    if name == "sensor_drift":
        return "imitates it"
    still = "not excluded" if verdict == "ambiguous" and place == 1 else "surely worse"
    return still if place else "the best"


def isolability() -> dict[str, Any]:
    rng = np.random.default_rng(8)
    rows = rng.normal(size=(len(CAUSES), 6))
    rows[1] = rows[0] + 0.4 * rows[1]
    rows[10] = rows[6] + 0.2 * rows[10]
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    return {
        "names": list(CAUSES),
        "cosine": np.abs(rows @ rows.T),
        "absorbed": {c: float(rng.uniform(0.1, 0.98)) for c in CAUSES},
    }


def parameter(name: str, unit: str, **values: Any) -> dict[str, Any]:
    flags = {"at_bound": False, "not_identified": False}
    return {"name": name, "unit": unit, **values, **flags}


CREEP = {
    "name": "creep",
    "title": "creep of the muscle",
    "form": "three Kelvin-Voigt elements",
    "parameters": [
        parameter("muscle.creep_fast", "1", value=0.031, interval=[0.027, 0.035], neutral=0.0),
        parameter("muscle.creep_slow", "1", value=0.092, interval=[None, 0.104], neutral=0.0)
        | {"at_bound": True, "not_identified": np.bool_(True)},
    ],
    "gain": {"value": 2.9, "interval": [2.6, 3.1]},
    "effect": {
        "contraction": {"value": 0.31, "unit": "mm"},
        "pressure": {"value": 0.0, "unit": "bar"},
    },
    "size": 4.1,
}
TEXTS = {
    "named": "The muscle creeps: every step continues for tens of seconds, 0.31 mm RMS. "
    "With creep in the plant the held-out error falls from 0.214 mm to 0.054 mm.",
    "ambiguous": "Creep and first-cycle softening explain the error equally well.",
    "adequate": "The simulation is as good as the noise allows: 1.03 times the noise floor.",
    "unexplained": "The residual goes with time since reversal; no candidate carries it.",
    "insufficient": "The pressure hardly moves, so this recording cannot decide.",
}
EXPERIMENT = {
    "between": ["creep", "first_cycle_softening"],
    "name": "rest_then_staircase",
    "description": "Rest for two minutes, then climb a staircase of five levels, 30 s each.",
    "segments": ["rest 120 s at 0.3 bar", "staircase 0.5 to 5 bar, 30 s a level"],
    "separation": 3.4,
    "enough": True,
    "sensor": "a second encoder at the muscle's fitting",
}
CLOSED_LOOP = {
    "controller": "inverse feed-forward with PI",
    "where": "the extended plant with held-out residuals",
    "unit": "mm",
    "before": {"value": 0.31, "interval": [0.29, 0.33]},
    "after": {"value": 0.18, "interval": [0.17, 0.2]},
    "oracle": None,
    "better_percent": {"value": 42.0, "interval": [36.0, 47.0]},
    "recovered": None,
    "text": "The controller designed on the extended plant follows the reference 42 % better.",
}


def report(verdict: str = "named") -> dict[str, Any]:
    """Return the report of a verdict as an engine makes it, numpy scalars and all."""
    fixed = verdict in ("named", "ambiguous")
    before = {
        "contraction": error(0.214, "mm", 0.05, 0.3),
        "pressure": error(0.0124, "bar", 0.012, 0.02),
    }
    after = {
        "contraction": error(0.054, "mm", 0.05, 0.1),
        "pressure": error(0.0123, "bar", 0.012, 0.02),
    }
    return {
        "runtime_s": np.float64(6.123456789),
        "verdict": verdict,
        "text": TEXTS[verdict],
        "causes": [CREEP] if fixed else [],
        "rivals": [] if verdict == "insufficient" else rivals(verdict),
        "noise_floor": {
            "contraction": {"value": np.float64(0.05), "unit": "mm", "from": "repeats"},
            "pressure": {"value": np.float32(0.012), "unit": "bar", "from": "holds"},
        },
        "held_out": {"by": "kinds", "kinds": list(HELD), "share": np.float64(1.0 / 3.0)},
        "error_before": before,
        "error_after": after if fixed else before,
        "residual_structure": {
            "before": {"contraction": structure(1.0), "pressure": structure(0.05)},
            "after": {
                "contraction": structure(0.08 if fixed else 1.0),
                "pressure": structure(0.05),
            },
        },
        "isolability": isolability(),
        "experiment": EXPERIMENT if verdict == "ambiguous" else None,
        "closed_loop": CLOSED_LOOP if fixed else None,
        "closed_loop_reason": None if fixed else "no cause was added to the plant",
        "calibration": [
            parameter("muscle.area", "m2", before=8.7e-4, after=8.83e-4, interval=[8.8e-4, 8.9e-4])
            | {"outside_tolerance": np.bool_(False)},
            parameter("regulator.time_constant", "s", before=0.08, after=0.25, interval=[0.2, 0.3])
            | {"outside_tolerance": True},
            parameter("mass.moving_mass", "kg", before=0.5, after=0.1, interval=[None, 3.0])
            | {"at_bound": True, "not_identified": True, "outside_tolerance": False},
        ],
        "not_testable": [
            {"name": "supply_droop", "reason": "the recording has no column supply_pressure_bar"},
            {"name": "sensor_bias", "reason": "the rest length is fitted, which absorbs it"},
        ],
        "warnings": ["rows 3120 to 3188: pressure_bar does not change (stuck sensor?)"],
        "rule_version": "1",
        "provenance": {
            "recording": {"source": "rig_7.csv", "digest": "9f86d081884c7d65"},
            "rig": {"source": "rig.yaml", "digest": "0d8f4c21aa37be59"},
            "plant_before": "d2a84f4b8b650937",
            "plant_after": "8f434346648f6b96",
            "package": "pam-envs 0.1.0",
            "seed": np.int64(0),
        },
    }


def diagnosis(verdict: str = "named", plant: bool = True, **size: Any) -> SimpleNamespace:
    """Return a diagnosis of a verdict; settled readings have no plant."""
    fixed = verdict in ("named", "ambiguous")
    return SimpleNamespace(
        report=report(verdict),
        traces=traces(extended=fixed, **size),
        plant=Plant() if plant else None,
    )
