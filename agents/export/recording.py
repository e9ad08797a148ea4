"""Recorded actions, in tuning episodes, of the controller that a residual policy corrects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np

import pam_envs  # noqa: F401  (registers the environments)
from agents.settings import seeds
from agents.settings.schema import SettingsError
from baselines.core.recorded_answers import Array, RecordedAnswers

STEPS = 48
EPISODES = 8
"""Number of tuning episodes; the one with the largest travel is recorded."""
MOST_AT_LIMIT = 0.1
"""Largest share of saturated actions, which can hide a change of the controller."""


def record(
    env: str, kinds: Sequence[Mapping[str, Any]], controller: Any, name: str
) -> RecordedAnswers:
    """Return a controller's actions in the tuning episode with the largest travel.

    Parameters
    ----------
    env : str
        Id of the environment.
    kinds : sequence of mapping
        Arguments of the environment whose nominal plant the controller was built from.
    controller : Controller
    name : str
        Of the controller, for the message.

    Raises
    ------
    SettingsError
        If the controller saturates too often in every episode.
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
    rows = zip(np.stack(observations, 1), np.stack(actions, 1), strict=True)
    episodes = [RecordedAnswers(*row) for row in rows]
    return [episode for episode in episodes if _at_limit(episode, space) <= MOST_AT_LIMIT]


def _at_limit(episode: RecordedAnswers, space: Any) -> float:
    return float(((episode.answers <= space.low) | (episode.answers >= space.high)).mean())
