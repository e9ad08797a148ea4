"""Environment and untrained model of a run, from its settings."""

import random
from collections.abc import Callable
from functools import partial
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv, VecMonitor, VecNormalize

from agents.export.export import ALGORITHMS, layer
from agents.policies.networks import difference, kept_inputs, policy_arguments, silence
from agents.settings import seeds
from agents.settings.parts import Cost, Widening
from agents.settings.presets import ON_POLICY, Config
from agents.settings.schema import SettingsError
from agents.vec_envs.batch import make_batch_vec_env, nominal_plant
from agents.vec_envs.cost import CostVecEnv
from agents.vec_envs.gauge import ErrorMean, error_mean
from agents.vec_envs.history import HistoryVecEnv
from agents.vec_envs.privileged import PrivilegedVecEnv
from agents.vec_envs.residual import ResidualVecEnv
from agents.vec_envs.widening import WideningVecEnv
from baselines.core.catalogue import CONTROLLERS, make_controller
from pam_envs.wording import near

OWN = ("learning_rate", "lstm_size", "critic_lstm", "warm_up")
"""Settings that are converted before the algorithm gets them."""


def make_env(config: Config) -> VecEnv:
    """Return the environment of a run: the batch and its wrappers, the normaliser outermost."""
    corrected, scale = config.residual.controller, config.residual.scale
    if corrected and corrected not in CONTROLLERS:
        hint = near(corrected, [*CONTROLLERS])
        raise SettingsError(f"residual.controller = {corrected!r} is not known{hint}")
    kinds = config.kinds()
    rows = config.num_envs // len(kinds)
    env: VecEnv = make_batch_vec_env(config.env, rows, *kinds)
    signals, actions = signals_of(env)
    if config.cost != Cost():
        env = CostVecEnv(env, config.cost)
    env = VecMonitor(env)
    if config.widening != Widening():
        env = WideningVecEnv(env, config.widening)
    if corrected:
        made = partial(make_controller, corrected, signals=signals, action_signals=actions)
        plants, gauge = controller_plants(config, env), _gauge(config, env)
        env = ResidualVecEnv(env, corrected, made, scale, plants, gauge)
    if config.history.frames:
        past = config.history
        kept = kept_inputs(config, signals, actions)
        env = HistoryVecEnv(env, kept, past.frames, past.stride)
    if config.sees_parameters:
        env = PrivilegedVecEnv(env)
    normalize = config.normalize
    if not (normalize.observation or normalize.reward):
        return env
    return VecNormalize(
        env,
        norm_obs=normalize.observation,
        norm_reward=normalize.reward,
        clip_obs=normalize.clip_observation,
        clip_reward=normalize.clip_reward,
        gamma=config.chosen.gamma,
    )


def _gauge(config: Config, env: VecEnv) -> ErrorMean | None:
    """Return the mean error to which a residual's correction is proportional, if it is."""
    gauge = config.residual.gauge
    if not gauge.errors:
        return None
    names, where = tuple(signals_of(env)[0].names()), "residual.gauge.errors"
    matrix = tuple(difference(text, names, 1.0, where) for text in gauge.errors)
    return error_mean(gauge, matrix, env.get_attr("control_period")[0])


def controller_plants(config: Config, env: VecEnv) -> list[Any]:
    """Return the nominal plant of the corrected controller, one for each batch of rows."""
    batches: Any = env.unwrapped
    return [
        nominal_plant(config.env, model) if model else batch.unwrapped.plant
        for batch, model in zip(batches.batches, config.models(), strict=True)
    ]


def make_model(config: Config, seed: int, env: VecEnv, device: str = "cpu") -> BaseAlgorithm:
    """Return the untrained model of a run, with all random generators seeded.

    Its networks are on ``device``, "cpu" or "cuda"; the environment runs on the processor. A
    SettingsError says that PyTorch finds no GPU.
    """
    if device != "cpu" and not torch.cuda.is_available():
        raise SettingsError(
            f"device = {device!r}, but PyTorch {torch.__version__} finds no GPU; install its build "
            "for CUDA and the GPU's driver, or leave --device out"
        )
    torch.set_num_threads(1)
    random.seed(seed)
    arguments = {k: v for k, v in vars(config.chosen).items() if k not in OWN}
    hidden = layer(env, PrivilegedVecEnv)
    widths = (0, 0) if hidden is None else (len(hidden.names), len(hidden.states))
    arguments |= policy_arguments(config, *signals_of(env), widths)
    rate = learning_rate(config)
    made = ALGORITHMS[config.algo]
    model = made(env=env, learning_rate=rate, seed=seed, device=device, **arguments)
    if config.residual.controller:
        silence(model.policy)
    env.seed(seeds.first_training(seed))
    return model


def warm_up_steps(config: Config) -> int:
    """Return the number of control periods in which the critic learns alone."""
    chosen = config.chosen
    return chosen.warm_up * chosen.n_steps * config.num_envs if config.algo in ON_POLICY else 0


def learning_rate(config: Config) -> Callable[[float], float]:
    """Return the learning rate as a function of the remaining share of the training."""
    start, end = config.chosen.learning_rate
    alone = warm_up_steps(config)
    if alone >= config.steps:
        raise SettingsError(
            f"{config.algo}.warm_up = {config.chosen.warm_up} rollouts are {alone} steps of "
            f"{config.steps}, and the policy would never learn; choose fewer, or more steps"
        )

    def rate(remaining: float) -> float:
        usual = max(end + (start - end) * remaining, 0.0)  # the last rollout may end beyond 0
        done = round((1.0 - remaining) * config.steps)
        return usual * min((done - alone) / alone, 1.0) if done > alone > 0 else usual

    return rate


def signals_of(env: VecEnv) -> tuple[Any, Any]:
    """Return the signals of the environment's observation and action."""
    return env.get_attr("signals")[0], env.get_attr("action_signals")[0]
