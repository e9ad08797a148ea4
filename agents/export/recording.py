"""Recorded actions, in tuning episodes, of the controller that a residual policy corrects."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np

import pam_envs  # noqa: F401  (registers the environments)
from agents.settings import seeds
from agents.settings.schema import SettingsError
from baselines.core.recorded_answers import Array, RecordedAnswers

STEPS = 48
EPISODES = 8  # number of tuning episodes; the one with the largest travel is recorded
MOST_AT_LIMIT = 0.1  # largest share of saturated actions, which can hide a change of the controller


def record(
    env: str, kinds: Sequence[Mapping[str, Any]], controller: Any, name: str
) -> RecordedAnswers:
    """Return a controller's actions in the tuning episode with the largest travel.

    ``kinds`` are arguments of the environment whose nominal plant the controller was built from. A
    SettingsError with the controller's name says that it saturates too often in every episode.
    """
    found = [episode for kind in kinds for episode in _episodes(env, kind, controller)]
    if not found:
        raise SettingsError(
            f"residual.controller = {name!r} is saturated in more than {MOST_AT_LIMIT:.0%} of the "
            "periods of every tuning episode, which leaves little to correct; choose another "
            "controller, or references that it can follow"
        )
    return max(found, key=lambda episode: episode.travel)


def _episodes(env: str, kind: Mapping[str, Any], controller: Any) -> list[RecordedAnswers]:
    """Return the first periods of the tuning episodes in which the controller seldom saturates."""
    arguments = {**kind, "info": False}
    made: Any = gym.make_vec(env, EPISODES, vectorization_mode="vector_entry_point", **arguments)
    space = made.single_action_space
    observation, _ = made.reset(seed=seeds.tuning(EPISODES))
    observations: list[Array] = []
    actions: list[Array] = []
    state, over = None, False
    while len(observations) < STEPS and not over:
        action, state = controller.predict(observation, state, np.full(EPISODES, not observations))
        observations.append(observation.copy())
        actions.append(np.array(action, np.float32))
        observation, _, terminated, truncated, _ = made.step(action)
        over = bool((terminated | truncated).any())
    made.close()
    answers = np.stack(actions, 1)
    at_limit = ((answers <= space.low) | (answers >= space.high)).mean(axis=(1, 2))
    rows = zip(np.stack(observations, 1), answers, at_limit, strict=True)
    return [RecordedAnswers(seen, made) for seen, made, share in rows if share <= MOST_AT_LIMIT]
