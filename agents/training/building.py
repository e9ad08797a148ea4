"""From settings to the environment and the untrained model."""

from __future__ import annotations

import functools
import random
from collections.abc import Callable
from typing import Any

import torch
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from agents.policies import controllers, inputs
from agents.policies.networks import policy_arguments, silence
from agents.settings import seeds
from agents.settings.presets import ON_POLICY, Config
from agents.settings.schema import SettingsError
from agents.vec_envs.batch import make_batch_vec_env
from agents.vec_envs.history import HistoryVecEnv
from agents.vec_envs.mixed import MixedVecEnv
from agents.vec_envs.residual import ResidualVecEnv

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "ppo": PPO,
    "sac": SAC,
    "tqc": TQC,
    "recurrent_ppo": RecurrentPPO,
}
OWN = ("learning_rate", "lstm_size", "critic_lstm", "warm_up")
"""Settings that are not handed to the algorithm as they stand."""


def make_env(config: Config) -> VecEnv:
    """Return the environment of a run: batched, monitored, corrected, with history, normalised."""
    kinds = config.kinds()
    rows = config.num_envs // len(kinds)
    batches = [make_batch_vec_env(config.env, rows, **kind) for kind in kinds]
    env: VecEnv = VecMonitor(batches[0] if len(batches) == 1 else MixedVecEnv(batches))
    signals, actions = signals_of(env)
    wanted = config.residual
    if wanted.controller:
        make = functools.partial(_controller, wanted.controller, signals, actions)
        env = ResidualVecEnv(env, wanted.controller, make, wanted.scale)
    if config.history.frames:
        env = HistoryVecEnv(env, inputs.kept(config, signals, actions), config.history.frames)
    return _normalized(env, config)


def _controller(name: str, signals: Any, actions: Any, plant: Any) -> Any:
    return controllers.make(name, plant, signals, actions)


def _normalized(env: VecEnv, config: Config) -> VecEnv:
    wanted = config.normalize
    if not (wanted.observation or wanted.reward):
        return env
    return VecNormalize(
        env,
        norm_obs=wanted.observation,
        norm_reward=wanted.reward,
        clip_obs=wanted.clip_observation,
        clip_reward=wanted.clip_reward,
        gamma=config.chosen.gamma,
    )


def make_model(config: Config, seed: int, env: VecEnv) -> BaseAlgorithm:
    """Return the untrained model of a run, with all random numbers seeded."""
    torch.set_num_threads(1)
    random.seed(seed)
    chosen = config.chosen
    arguments = {k: v for k, v in vars(chosen).items() if k not in OWN}
    arguments |= policy_arguments(config, *signals_of(env))
    model = ALGORITHMS[config.algo](
        env=env,
        learning_rate=learning_rate(config),
        seed=seed,
        device="cpu",
        **arguments,
    )
    if config.residual.controller:
        silence(model.policy)
    env.seed(seeds.first_training(seed))
    return model


def warm_up_steps(config: Config) -> int:
    """Return how many control periods the critic learns alone."""
    chosen = config.chosen
    return chosen.warm_up * chosen.n_steps * config.num_envs if config.algo in ON_POLICY else 0


def learning_rate(config: Config) -> Callable[[float], float]:
    """Return the learning rate as a function of the share of the training that is left.

    Raises
    ------
    SettingsError
        If the critic would learn alone to the end.
    """
    start, end = config.chosen.learning_rate
    alone = warm_up_steps(config)
    if alone >= config.steps:
        raise SettingsError(
            f"{config.algo}.warm_up = {config.chosen.warm_up} rollouts are {alone} steps of "
            f"{config.steps}: nothing else would be learnt; choose fewer, or more steps"
        )

    def rate(remaining: float) -> float:
        usual = max(end + (start - end) * remaining, 0.0)  # the last rollout may end beyond 0
        done = round((1.0 - remaining) * config.steps)
        return usual * min((done - alone) / alone, 1.0) if done > alone > 0 else usual

    return rate


def signals_of(env: VecEnv) -> tuple[Any, Any]:
    """Return the signals of the environment's observation and action."""
    return env.get_attr("signals")[0], env.get_attr("action_signals")[0]


def logs_each_rollout(config: Config) -> bool:
    """Return whether a rollout is long enough for a line in the log."""
    return config.algo in ON_POLICY
