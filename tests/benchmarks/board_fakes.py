"""Hand-made rows with known scores, in the format of real rows."""

import copy
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.runs import rows, traces
from benchmarks.scoring.metrics import of_track

FIXED: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("board.yaml").read_text("utf-8"))
CONTENT, ROUND = FIXED["track"], FIXED["round"]
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
    audit: Sequence[Any] | float | None = None,
    track: str = "short_nominal",
    kind: str = "classical",
    citation: str = SIMC,
    knowledge: str = "nominal model",
    travel: float = 1e5,
    failed: int = 0,
    failed_unseen: int = 0,
    unseen: Mapping[str, float] | None = None,
    **others: float,
) -> dict[str, Any]:
    """Return a row.

    Parameters
    ----------
    name : str
    public : float or sequence
        The mean of the error [m]; or one a training seed.
    audit : float or sequence, optional
        The same of the audit episodes [m]; a row outside of the round has none.
    failed, failed_unseen : int
        Public and audit episodes that failed.
    unseen, **others : float
        Metrics of the audit episodes where they differ from those of all episodes.
    """
    scores = {name: 0.0 for name in CONTENT["worst_case"]} | {"pressure_travel": travel} | others
    number = np.size(public)
    seeds = [None] if kind == "classical" else list(range(number))

    def of_split(split: str, means: Any, values: Mapping[str, float], fails: int) -> list[Any]:
        middles = dict(zip(seeds, np.broadcast_to(means, number), strict=True))
        return _episodes(split, middles, values, fails)

    episodes = of_split("public", public, scores, failed)
    if audit is not None:
        episodes += of_split("audit", audit, {**scores, **(unseen or {})}, failed_unseen)
    made = copy.deepcopy(FIXED["row"])
    made |= {
        "schema": rows.SCHEMA,
        "row": f"{track}--{name}",
        "task": f"task of {track}",
        "episodes": episodes,
    }
    made |= {"audit": None if audit is None else copy.deepcopy(ROUND), "traces": [trace(name)]}
    made["controller"] |= {"name": name, "kind": kind, "knowledge": knowledge}
    made["controller"] |= {"summary": f"what {name} is", "citation": citation}
    if kind != "classical":
        made["controller"]["tuning"] = {"trials": 40, "how": "search of 40"}
        made["controller"]["training"] = [training(seed) for seed in seeds]
    made["scenarios"] |= {"name": track, "content": copy.deepcopy(CONTENT) | {"name": track}}
    made["seeds"] = {scenario: list(_seeds("public", scenario)) for scenario in SCENARIOS}
    return made


def _seeds(split: str, scenario: str, number: int = 3) -> range:
    first = {"public": 1, "audit": 1001}[split] + 100 * SCENARIOS.index(scenario)
    return range(first, first + number)


def _episodes(
    split: str, middles: Mapping[int | None, float], scores: Mapping[str, float], failed: int
) -> list[dict[str, Any]]:
    made: list[dict[str, Any]] = []
    for training_seed, middle in middles.items():
        for scenario, values in zip(SCENARIOS, errors(middle), strict=True):
            for seed, value in zip(_seeds(split, scenario), values, strict=True):
                made.append(
                    {
                        "scenario": scenario,
                        "seed": seed,
                        "training_seed": training_seed,
                        "split": split,
                        "failed": len(made) < failed,
                        "scores": {**scores, "rms_error": float(value)},
                    }
                )
    return made


def training(seed: int) -> dict[str, Any]:
    """Return the record of a training."""
    return {
        "training_seed": seed,
        "steps": 1e6,
        "seconds": 300.0,
        "hardware": "2 cores",
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
    return traces.of_episode("sines", 101, signals, CONTENT)


def board() -> list[dict[str, Any]]:
    """Return rows of two tracks: in the round, outside of it, learned, and of too few seeds."""
    good = np.linspace(0.4e-3, 0.6e-3, 10)
    first = [
        row("inverse", 1.0e-3, audit=1.0e-3),
        row("pid", 2.0e-3, audit=2.6e-3),
        row("zero", 8.0e-3, audit=8.0e-3, citation="", knowledge="nothing"),
        row("outside", 3.0e-3),
        row("ppo", good, audit=good, kind="learned"),
        row("young", [0.3e-3], audit=0.3e-3, kind="learned"),
    ]
    other = {"track": "short_wrong_model"}
    second = [
        row("inverse", 4.0e-3, audit=4.0e-3, **other),
        row("pid", 2.5e-3, audit=2.5e-3, **other),
        row("zero", 8.0e-3, audit=8.0e-3, citation="", knowledge="nothing", **other),
        row("ppo", 3 * good, audit=3 * good, kind="learned", **other),
    ]
    for made in second:
        del made["audit"]["entrants"]["young"]
    return first + second


def gait() -> list[dict[str, Any]]:
    """Return rows of a gait: a paper controller, and a learned one with less error and effort."""
    names = of_track({"metrics": ["range", "gait"]}).keys() - CONTENT["worst_case"].keys()
    others: dict[str, Any] = dict.fromkeys(names, 0.5)
    others |= {"track": "walk_nominal", "air_use": 3e-5}
    learned = [1.5e-3] * 5
    made = [
        row("pid", 2e-3, audit=2e-3, **others),
        row("ppo", learned, audit=learned, kind="learned", **others),
    ]
    for each, effort in zip(made, (0.96, 0.92), strict=True):
        each["env"] = {"id": "PAM/KneeWalk-v0", "version": 0}
        content = each["scenarios"]["content"]
        content |= {"metrics": ["range", "gait"], "activity": "walk"}
        content["worst_case"] |= dict.fromkeys(names, 2.0)
        for episode in each["episodes"]:
            number = episode["seed"] % 100 - 2  # -1, 0 and 1 in each scenario
            episode["scores"]["emg_effort"] = effort + 0.01 * number
    return made
