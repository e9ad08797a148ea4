"""Rows made by hand: scores that a test can work out, in the form that rows have."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks import traces

CONTENT: dict[str, Any] = {
    "schema": 1,
    "name": "short_nominal",
    "version": 1,
    "title": "A short track",
    "env": "PAM/MusclePositioning-v0",
    "seeds": [1, 2, 3],
    "settle_seconds": 0.5,
    "hold_seconds": 0.3,
    "sensed": "sensor/contraction",
    "rests": ["steps"],
    "cost_scales": {"cost/contraction": 0.001, "cost/pressure": 1.0e5},
    "worst_case": {
        "rms_error": 0.025,
        "p95_error": 0.025,
        "max_error": 0.025,
        "steady_state_error": 0.025,
        "sensed_rms_error": 0.025,
        "pressure_travel": 1.2e6,
        "air_use": 5.0e-5,
        "constraint_cost": 10.0,
    },
    "kwargs": {"episode_seconds": 2.0},
    "grid": {"reference": ["steps", "sines"]},
}
SIMC = "S. Skogestad, Simple analytic rules for model reduction and PID controller tuning"
SCENARIOS = ("steps", "sines")


def errors(middle: float, seeds: int = 3, spread: float = 0.01) -> np.ndarray[Any, Any]:
    """Return errors [m] of two scenarios x ``seeds``, steps twice the sines, spread evenly."""
    offsets = np.linspace(-spread, spread, seeds) if seeds > 1 else np.zeros(1)
    return np.array([middle * 4 / 3 * (1 + offsets), middle * 2 / 3 * (1 + offsets)])


def row(
    name: str,
    public: Sequence[Any] | float,
    *,
    audit: float | None = None,
    track: str = "short_nominal",
    kind: str = "classical",
    citation: str = SIMC,
    knowledge: str = "nominal model",
    travel: float = 1e5,
    failed: int = 0,
    **others: float,
) -> dict[str, Any]:
    """Return a row.

    Parameters
    ----------
    name : str
    public : float or sequence
        The mean of the error [m]; or one a training seed.
    audit : float, optional
        By how much the audit errors are the public ones.
    failed : int
        Public episodes that failed.
    """
    middles = [public] if isinstance(public, (int, float)) else list(public)
    seeds = [None] if kind == "classical" else list(range(len(middles)))
    scores = {name: 0.0 for name in CONTENT["worst_case"]} | {"pressure_travel": travel} | others
    episodes = []
    for split, factor in (("public", 1.0), ("audit", audit)):
        for training_seed, middle in zip(seeds, middles, strict=True):
            for scenario, values in zip(SCENARIOS, errors(middle), strict=True):
                for seed, value in enumerate(values, 1 if split == "public" else 1001):
                    if factor is not None:
                        episodes.append(
                            {
                                "scenario": scenario,
                                "seed": seed,
                                "training_seed": training_seed,
                                "split": split,
                                "failed": split == "public" and len(episodes) < failed,
                                "scores": scores | {"rms_error": float(value) * factor},
                            }
                        )
    content = copy.deepcopy(CONTENT) | {"name": track}
    return {
        "schema": 2,
        "row": f"{track}--{name}",
        "env": {"id": "PAM/MusclePositioning-v0", "version": 0},
        "task": f"task of {track}",
        "controller": {
            "name": name,
            "kind": kind,
            "knowledge": knowledge,
            "summary": f"what {name} is",
            "citation": citation,
            "preview_seconds": 0.0,
            "tuning": {"trials": 0, "how": "by rule"} if kind == "classical" else None,
            "artefact": {"digest": "a" * 64, "files": []},
            "training": None if kind == "classical" else [training(seed) for seed in seeds],
        },
        "scenarios": {"name": track, "version": 1, "digest": "d" * 64, "content": content},
        "plants": dict.fromkeys(SCENARIOS, "p"),
        "seeds": [1, 2, 3],
        "made_with": {"packages": {"numpy": "2"}, "sources": {}, "commit": "c" * 40},
        "episodes": episodes,
        "audit": None if audit is None else {"salt": "5a17", "drawn": "2026-01-01", "draw": 1},
        "traces": [trace(name)],
        "volatile": {
            "predict_us": {"median": 12.0, "p99": 30.0},
            "machine": "m",
            "date": "2026-01-01",
        },
    }


def training(seed: int) -> dict[str, Any]:
    """Return the record of a training."""
    return {
        "training_seed": seed,
        "steps": 1e6,
        "seconds": 300.0,
        "hardware": "2 cores",
        "tuning_trials": 40,
        "command": f"python -m agents train X --seed {seed}",
    }


def trace(name: str) -> dict[str, Any]:
    """Return a trace: a loop that a slow sine goes through."""
    time = 0.01 * np.arange(1, 501)
    pressure = 3e5 + 1e5 * np.sin(time + len(name))
    signals = {
        "time": time,
        "reference": 5e-3 * np.ones(500),
        "output": 5e-3 + 1e-3 * np.cos(time),
        "state/pressure": pressure,
    }
    return traces.of_episode("sines", 1, signals, CONTENT)


def board() -> list[dict[str, Any]]:
    """Return rows of two tracks, audited, self-reported, learned and of too few seeds."""
    good = np.linspace(0.4e-3, 0.6e-3, 10)
    first = [
        row("inverse", 1.0e-3, audit=1.0),
        row("pid", 2.0e-3, audit=1.3),
        row("zero", 8.0e-3, audit=1.0, citation="", knowledge="nothing"),
        row("told", 3.0e-3),
        row("ppo", good, audit=1.0, kind="learned"),
        row("young", [0.3e-3], audit=1.0, kind="learned"),
    ]
    other = {"track": "short_wrong_model"}
    second = [
        row("inverse", 4.0e-3, audit=1.0, **other),
        row("pid", 2.5e-3, audit=1.0, **other),
        row("zero", 8.0e-3, audit=1.0, citation="", knowledge="nothing", **other),
        row("ppo", 3 * good, audit=1.0, kind="learned", **other),
    ]
    return first + second
