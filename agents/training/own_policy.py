"""Film and scores of a policy file, in the environment of its training."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym

import pam_envs  # noqa: F401  (registers the environments)
from agents.policies.policy import OnnxPolicy
from agents.policies.residual import with_controller
from agents.settings import presets as configs
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from agents.training.evaluation import Score, evaluate
from baselines.core.catalogue import CONTROLLERS
from pam_envs.envs.rendering import film
from pam_envs.wording import near


def watch(file: Path, video: Path, seconds: float | None, seed: int, fps: int) -> dict[str, Any]:
    """Write the film of an episode; return the arguments of the environment.

    The environment is that of the first kind of rows of the training; ``seconds`` is the length of
    the episode [s], by default that of the training, at most 10 s.
    """
    film.check(video, fps)
    policy = OnnxPolicy.load(file)
    config = settings(policy)
    arguments = dict(config.kinds()[0])
    length = seconds or min(10.0, float(arguments.get("episode_seconds", 10.0)))
    arguments["episode_seconds"] = length
    env: Any = gym.make(config.env, render_mode="rgb_array", **arguments)
    base = env.unwrapped
    policy.check(base.signals, base.action_signals)
    acting, state = with_controller(policy, base.plant), None

    def act(observation: Any) -> Any:
        nonlocal state
        start = None if state is not None else True
        action, state = acting.predict(observation, state, start)
        return action

    film.write(env, act, video, length, seed, fps)
    env.close()
    return arguments


def scores(
    files: Sequence[Path], controllers: Sequence[str], episodes: int | None
) -> Iterator[tuple[str, Score]]:
    """Yield the score of each policy, then of each classical controller, on the same episodes.

    The policies must be of one environment; its episodes are those of the first policy's settings,
    with tuning seeds. ``episodes`` is their number, by default that of the settings.
    """
    policies = [OnnxPolicy.load(file) for file in files]
    config = settings(policies[0])
    for policy in policies[1:]:
        if settings(policy).env != config.env:
            raise SettingsError(
                f"{policy.name} is for {settings(policy).env}, the first policy for {config.env}; "
                "compare policies of one environment"
            )
    own = [name for name, entry in CONTROLLERS.items() if config.env in entry.envs]
    for name in controllers:
        if name not in own:
            raise SettingsError(f"no controller named {name!r} for {config.env}{near(name, own)}")
    for file, policy in zip(files, policies, strict=True):
        yield str(file), evaluate(policy, config, episodes)
    for name in controllers:
        yield name, evaluate(name, config, episodes)


def settings(policy: OnnxPolicy) -> Config:
    """Return the settings of a policy's training, from its card."""
    return configs.from_mapping(policy.card.get("config"))
