"""What a score is of: environment, scenarios, plants and metrics, in one digest."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import gymnasium as gym

from benchmarks.canonical import digest
from benchmarks.making import make_env
from benchmarks.scenarios import ScenarioSet
from benchmarks.source_code import code_digest

HERE = Path(__file__).resolve().parent


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


def plants_of(track: ScenarioSet) -> dict[str, str]:
    """Return the digest of each scenario's plant."""
    found = {}
    for scenario in track.scenarios():
        env = make_env(track.env, scenario.kwargs)
        found[scenario.name] = env.unwrapped.plant.digest()
        env.close()
    return found


@lru_cache(maxsize=1)
def metrics_digest() -> str:
    """Return the digest of what the metrics' code says."""
    return code_digest(HERE.glob("metrics*.py"), HERE)


def task_digest(track: ScenarioSet, plants: dict[str, str] | None = None) -> str:
    """Return the SHA-256 of environment, scenarios, metrics and plants.

    Parameters
    ----------
    track : ScenarioSet
    plants : mapping of str, optional
        Digest of each scenario's plant, where it is known.
    """
    return digest(
        {
            "env": [track.env, env_version(track.env)],
            "scenarios": track.content,
            "metrics": metrics_digest(),
            "plants": plants_of(track) if plants is None else plants,
        }
    )
