"""Identity of a task: scenarios, parameters of plants and models, trajectories and scores."""

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
    """Nominal plant and named signals from which the controllers of a track are built."""

    model: Any
    env: Any
    # each of shape (n, n_signals); the actions for them identify controllers
    observations: behaviour.Sequences


@dataclass(frozen=True)
class Identity:
    """Digests of a task, by scenario."""

    scenarios: str  # of the file's content
    plants: Mapping[str, str]  # of the parameters
    models: Mapping[str, str]  # of the parameters
    trajectories: Mapping[str, str]  # under fixed actions
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
        found = []
        for part, value in asdict(self).items():
            old = record[part]
            if old != value and not isinstance(value, Mapping):
                found.append(f"{part} changed")
            elif old != value:
                names = [n for n in {**old, **value} if old.get(n) != value.get(n)]
                found.append(f"{part} changed: {', '.join(names)}")
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
    version = int(gym.envs.registration.parse_env_id(track.env)[2] or 0)
    made = (Setting(*settings[key], _spread(found)) for key, found in observed.items())
    return Task({"id": track.env, "version": version}, identity, tuple(made))


def _spread(found: Sequence[behaviour.Sequences]) -> behaviour.Sequences:
    """Return one episode's observations, each part from a different scenario if possible."""
    parts = len(found[0])
    return tuple(found[k * len(found) // parts][k] for k in range(parts))


def check_version(env: str, row: str) -> None:
    """Raise unless this checkout has the environment version of a row."""
    import pam_envs  # noqa: F401  registers the ids

    space, name, _ = gym.envs.registration.parse_env_id(env)
    specs = gym.envs.registration.registry.values()
    there = sorted(spec.id for spec in specs if (spec.namespace, spec.name) == (space, name))
    if env not in there:
        here = ", ".join(there) or "no such environment"
        raise ValueError(
            f"{row} is of {env}, and this checkout has {here}: results of different versions are "
            "not compared; run the controller again here, or check out the commit of the row"
        )
