"""How fast training runs: the preset over the batch, beside a plain default of the field."""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.settings.presets import preset
from agents.training.building import make_env, make_model

ENV = "PAM/MusclePositioning-v0"
ROUNDS = 3


def measure(seconds: float = 20.0) -> dict[str, Any]:
    """Return training steps a second, rollouts and updates together, and their ratio.

    Per second of one core's time, so that other work on the machine does not count; both run with
    one torch thread, by turns.

    Parameters
    ----------
    seconds : float
        Duration [s] of the whole measurement, about.

    Returns
    -------
    dict
        ``ppo_batched`` and ``ppo_default_pendulum`` [steps per CPU second], ``ratio``,
        ``num_envs``, ``rounds``.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        turn = seconds / (2 * ROUNDS)
        ours, theirs = ppo_chunk(preset(ENV, "ppo").num_envs), stepper(_default_model())
        rates = [(_rate(ours, turn), _rate(theirs, turn)) for _ in range(ROUNDS)]
    finally:
        torch.set_num_threads(before)
    batched = statistics.median(rate for rate, _ in rates)
    default = statistics.median(rate for _, rate in rates)
    return {
        "ppo_batched": round(batched),
        "ppo_default_pendulum": round(default),
        "ratio": round(batched / default, 1),
        "num_envs": preset(ENV, "ppo").num_envs,
        "rounds": ROUNDS,
    }


def ppo_chunk(num_envs: int = 256) -> Callable[[], int]:
    """Return a function that trains the preset for one rollout and returns its steps.

    Parameters
    ----------
    num_envs : int
        Rows of the batched environment.
    """
    config = dataclasses.replace(preset(ENV, "ppo"), num_envs=num_envs)
    return stepper(make_model(config, 0, make_env(config)))


def _default_model() -> BaseAlgorithm:
    return PPO("MlpPolicy", gym.make("Pendulum-v1"), seed=0, device="cpu")


def stepper(model: Any) -> Callable[[], int]:
    """Return a function that trains for one rollout and returns its steps, after a first one."""
    size = model.n_steps * model.n_envs

    def once() -> int:
        model.learn(size, reset_num_timesteps=model.num_timesteps == 0)
        return int(size)

    once()
    return once


def _rate(once: Callable[[], int], seconds: float) -> float:
    steps, began, cpu = 0, time.perf_counter(), time.process_time()
    while time.perf_counter() - began < seconds:
        steps += once()
    return steps / (time.process_time() - cpu)
