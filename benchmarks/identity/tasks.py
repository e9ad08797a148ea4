"""Identity of a task: scenarios, parameters of plants and models, trajectories and scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from typing import Any

import gymnasium as gym

from benchmarks.identity import behaviour
from benchmarks.identity.hashing import digest
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scenarios.scenario_env import make_env, model_of


@dataclass(frozen=True)
class Setting:
    """Nominal plant and named signals from which the controllers of a track are built.

    Their answers to ``observations``, each of shape (n, n_signals), identify them.
    """

    model: Any
    env: Any
    observations: behaviour.Sequences


@dataclass(frozen=True)
class Identity:
    """Digests by scenario: of the plant's and the model's parameters, trajectory and scores.

    The trajectory is that of fixed actions; ``scenarios`` is the digest of the file's content.
    """

    scenarios: str
    plants: Mapping[str, str]
    models: Mapping[str, str]
    trajectories: Mapping[str, str]
    scores: Mapping[str, str]

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all parts."""
        return digest(asdict(self))

    def record(self) -> dict[str, Any]:
        """Return the parts and their digest in JSON's types."""
        return {"digest": self.digest, **asdict(self)}

    def changes(self, record: Mapping[str, Any]) -> list[str]:
        """Return a sentence for every part that differs from a recorded identity."""
        if record["digest"] == self.digest:
            return []
        own, found = asdict(self), []
        for part, value in own.items():
            old = record.get(part)
            if not isinstance(value, Mapping) or not isinstance(old, Mapping):
                found += [f"{part} changed"] if value != old else []
                continue
            names = [n for n in {**old, **value} if old.get(n) != value.get(n)]
            found += [f"{part} changed: {', '.join(names)}"] if names else []
        return found


@dataclass(frozen=True)
class Task:
    """Track with its environments built once, and each nominal model and set of signals once."""

    env: dict[str, Any]
    identity: Identity
    settings: tuple[Setting, ...]


@lru_cache(maxsize=64)
def of(track: ScenarioSet) -> Task:
    """Return a track's task; every environment runs one episode, once in a process."""
    plants, models, trajectories, scores = ({} for _ in range(4))
    settings: dict[Any, tuple[Any, Any]] = {}
    observed: dict[Any, list[behaviour.Sequences]] = {}
    for scenario in track.scenarios():
        env = make_env(track.env, scenario.kwargs)
        model, base = model_of(track.env, scenario, env), env.unwrapped
        plants[scenario.name], models[scenario.name] = base.plant.digest(), model.digest()
        found = behaviour.of_environment(env, track.content, scenario.rests)
        trajectories[scenario.name] = found.trajectory
        scores[scenario.name] = digest(found.scores)[:16]
        key = (model.digest(), *base.signals, *base.action_signals)
        settings.setdefault(key, (model, env))
        observed.setdefault(key, []).append(found.observations)
        env.close()
    identity = Identity(track.digest, plants, models, trajectories, scores)
    about = {"id": track.env, "version": env_version(track.env)}
    made = (Setting(*settings[key], _spread(found)) for key, found in observed.items())
    return Task(about, identity, tuple(made))


def _spread(found: Sequence[behaviour.Sequences]) -> behaviour.Sequences:
    """Return one episode's observations, each part from another scenario as far as there are."""
    parts = len(found[0])
    return tuple(found[k * len(found) // parts][k] for k in range(parts))


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
    """Raise unless this checkout has the version of an environment that a row is of."""
    there = versions(env)
    if env not in there:
        here = ", ".join(there) or "no such environment"
        raise ValueError(
            f"{row} is of {env}, and this checkout has {here}: results of different versions are "
            "not compared; run the controller again here, or check out the commit of the row"
        )
