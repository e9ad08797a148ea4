"""Adaptation of a policy to the plant: a student with a history imitates a teacher.

The teacher is the PPO policy of the run, which sees the drawn parameters
(:class:`agents.settings.parts.Adaptation`). The student has the run's history in their place. It
learns online from the states that it visits itself: in each round all rows advance by ``n_steps``
control periods and the student fits the teacher's actions there.

The result is a function of the teacher's checkpoint and the seed. A run that is killed in this
phase repeats it from the beginning.
"""

import dataclasses
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from torch import Tensor

from agents.export.export import layer
from agents.settings.parts import Adaptation, Privileged, Widening
from agents.settings.presets import Config
from agents.training.building import make_model
from agents.vec_envs.privileged import PrivilegedVecEnv
from sweeps.progress import Advance


def student_config(config: Config) -> Config:
    """Return the settings of the student's network: those of the run without hidden inputs."""
    return dataclasses.replace(
        config, adaptation=Adaptation(), privileged=Privileged(), widening=Widening()
    )


def untrained(teacher: Any, config: Config, seed: int) -> PPO:
    """Return an untrained student in the environment of its teacher."""
    student: Any = make_model(student_config(config), seed, teacher.get_env(), teacher.device.type)
    student.set_logger(teacher.logger)
    return student  # type: ignore[no-any-return]


def learn(
    student: Any, teacher: Any, settings: Adaptation, seed: int, advance: Advance
) -> list[float]:
    """Let a student learn from its teacher; return its mean squared error in each round.

    The error is that of the actions, in [-1, 1], on the states of the round before the student has
    learned from them.
    """
    env = teacher.get_env()
    hidden = layer(env, PrivilegedVecEnv)
    assert hidden is not None
    space: Any = hidden.venv.observation_space
    seen = space.shape[0]
    random = np.random.default_rng([seed, 1])
    policy = student.policy
    optimiser = torch.optim.Adam(policy.parameters(), settings.learning_rate[0])
    observation = np.asarray(env.reset())
    per_round = settings.n_steps * env.num_envs
    rounds = max(-(-settings.steps // per_round), 1)
    losses: list[float] = []
    for number in range(rounds):
        share = number / rounds
        first, last = settings.learning_rate
        optimiser.param_groups[0]["lr"] = last + (first - last) * (1.0 - share)
        guided = max(1.0 - share / settings.guided, 0.0) if settings.guided else 0.0
        led = random.random(env.num_envs) < guided
        inputs, targets, observation = _round(
            teacher, student, env, observation, led, settings.n_steps
        )
        batch = tuple(
            torch.from_numpy(part).to(student.device) for part in (inputs[:, :seen], targets)
        )
        with torch.no_grad():
            losses.append(float(_error(policy, *batch)))
        for _ in range(settings.n_epochs):
            order = random.permutation(len(targets))
            for at in range(0, len(order), settings.batch_size):
                rows = torch.from_numpy(order[at : at + settings.batch_size]).to(student.device)
                error: Any = _error(policy, *(part[rows] for part in batch))
                optimiser.zero_grad()
                error.backward()
                optimiser.step()
        advance(per_round, f", error {losses[-1]:.3g}")
    student.num_timesteps = teacher.num_timesteps + rounds * per_round
    return losses


def _mean(policy: Any, observations: Tensor) -> Tensor:
    """Return the mean actions of a policy."""
    made: Tensor = policy.get_distribution(observations).distribution.mean
    return made


def _error(policy: Any, observations: Tensor, targets: Tensor) -> Tensor:
    return (_mean(policy, observations) - targets).square().mean()


@torch.no_grad()
def _round(
    teacher: Any,
    student: Any,
    env: Any,
    observation: NDArray[np.float32],
    led: NDArray[np.bool_],
    steps: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Advance all rows; return observations, the teacher's actions, and the last observation.

    Rows ``led`` follow the teacher, the others the student.
    """
    inputs, targets = [], []
    space = teacher.action_space
    for _ in range(steps):
        at = torch.from_numpy(observation).to(student.device)
        wanted = np.clip(_mean(teacher.policy, at).cpu().numpy(), space.low, space.high)
        own = np.clip(_mean(student.policy, at).cpu().numpy(), space.low, space.high)
        inputs.append(observation)
        targets.append(wanted)
        observation = np.asarray(env.step(np.where(led[:, None], wanted, own))[0])
    return np.concatenate(inputs), np.concatenate(targets), observation
