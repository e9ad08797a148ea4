"""What a score is of: environment, scenarios, plants, models and scoring, in one digest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import gymnasium as gym

from benchmarks.identity.hashing import SOURCES, digest, sources_digest
from benchmarks.identity.source_code import code_digest
from benchmarks.runs.provenance import HERE, ROOT, SCORING
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scenarios.scenario_env import make_env, model_of

GROUPS_OF = {
    "metrics_knee.py": {"range", "gait"},
    "metrics_elbow.py": {"elbow"},
    "metrics_joint.py": {"joint", "chain"},
}
"""Pages of metrics that only tracks with one of these groups are scored by."""
ENVIRONMENTS = ROOT / "pam_envs"
"""Package of the environments, whose code is of every task."""


@dataclass(frozen=True)
class Built:
    """What is known of a track once its environments were built.

    Attributes
    ----------
    env : dict
        Id, version and digest.
    plants, models : dict of str
        Digest of each scenario's plant, and of the model that controllers are told.
    told : tuple of (model, gymnasium.Env)
        What controllers are built from, each model and set of signals once.
    """

    env: dict[str, Any]
    plants: dict[str, str]
    models: dict[str, str]
    told: tuple[tuple[Any, Any], ...]


def env_version(env: str) -> int:
    """Return the version at the end of an id."""
    return int(gym.envs.registration.parse_env_id(env)[2] or 0)


def versions(env: str) -> list[str]:
    """Return the ids of all versions of an environment that are registered."""
    import pam_envs  # noqa: F401  registers the ids

    space, name, _ = gym.envs.registration.parse_env_id(env)
    found = gym.envs.registration.registry.values()
    return sorted(spec.id for spec in found if (spec.namespace, spec.name) == (space, name))


def check_version(env: str, row: str) -> None:
    """Raise unless this checkout has the version of an environment that a row is of.

    Raises
    ------
    ValueError
        Naming both versions.
    """
    there = versions(env)
    if env not in there:
        here = ", ".join(there) or "no such environment"
        raise ValueError(
            f"{row} is of {env}, and this checkout has {here}: results of different versions are "
            "not compared; run the controller again here, or check out the commit of the row"
        )


def describe_env(env: str) -> dict[str, Any]:
    """Return id, version and digest of an environment: its registration, signals and plant."""
    made = make_env(env, {})
    base, spec = made.unwrapped, made.spec
    about = {
        "id": env,
        "entry_point": str(spec.entry_point),
        "kwargs": dict(gym.spec(env).kwargs),
        "plant": base.plant.digest(),
        "period": base.control_period,
        "signals": [list(vars(signal).items()) for signal in base.signals],
        "actions": [list(vars(signal).items()) for signal in base.action_signals],
    }
    made.close()
    return {"id": env, "version": env_version(env), "digest": digest(about)}


@lru_cache(maxsize=64)
def built(track: ScenarioSet) -> Built:
    """Return what the environments of a track are; they are built once in a process."""
    plants, models = {}, {}
    told: dict[Any, tuple[Any, Any]] = {}
    for scenario in track.scenarios():
        env = make_env(track.env, scenario.kwargs)
        model, base = model_of(track.env, scenario, env), env.unwrapped
        plants[scenario.name], models[scenario.name] = base.plant.digest(), model.digest()
        told.setdefault((model.digest(), *base.signals, *base.action_signals), (model, env))
        env.close()
    return Built(describe_env(track.env), plants, models, tuple(told.values()))


def scoring_files(groups: frozenset[str]) -> frozenset[Path]:
    """Return the files of the code that runs and scores tracks of these groups."""
    unused = {name for name, own in GROUPS_OF.items() if not own & groups}
    return frozenset(HERE / name for name in set(SCORING) - unused)


@lru_cache(maxsize=16)
def scoring_digest(groups: frozenset[str]) -> str:
    """Return the digest of what the code says that runs and scores tracks of these groups."""
    return code_digest(scoring_files(groups), HERE)


@lru_cache(maxsize=1)
def environments_digest() -> str:
    """Return the digest of what the environments' code says, and of their data."""
    code = code_digest(ENVIRONMENTS.rglob("*.py"), ROOT)
    return digest([code, sources_digest([ENVIRONMENTS], SOURCES - {".py"})])


def files_of(track: ScenarioSet) -> frozenset[Path]:
    """Return every file of code and data that a track's scores depend on, controllers aside."""
    environments = (file for file in ENVIRONMENTS.rglob("*") if file.suffix in SOURCES)
    return scoring_files(_groups(track)).union(environments)


def _groups(track: ScenarioSet) -> frozenset[str]:
    return frozenset(track.content.get("metrics") or ())


def task_digest(track: ScenarioSet) -> str:
    """Return the SHA-256 of environment, scenarios, plants, models, and the code that scores."""
    found = built(track)
    return digest(
        {
            "env": found.env,
            "scenarios": track.content,
            "scoring": scoring_digest(_groups(track)),
            "environments": environments_digest(),
            "plants": found.plants,
            "models": found.models,
        }
    )
