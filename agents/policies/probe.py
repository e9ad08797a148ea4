"""How a policy knows the controller that it corrects: by what it answers, recorded in training.

A controller alone follows a fixed tuning episode. What it read and what it answered stand on the
policy's card, for every plant that it was told. Given the same again, it has to answer the same:
else it is another controller than the one whose errors the policy has learned.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import pam_envs  # noqa: F401  (registers the environments)
from agents.settings.settings import SettingsError
from agents.training import seeds

Array = NDArray[np.float32]
STEPS = 48
EPISODES = 8
"""Tuning seeds that are looked at for one in which the controller has something to do."""
MOST_AT_LIMIT = 0.1
"""Share of answers that may lie at an end of the range, where they say nothing."""
SAME = 1e-3
"""Answers may differ by this share of what the policy can add: machines round differently."""
CLOSE = 1e-5
"""Relative difference of a controller's numbers that is rounding, as of a design by iteration."""


@dataclass(frozen=True)
class Probe:
    """An episode of a controller alone.

    Attributes
    ----------
    observations : array, shape (steps, n_signals)
    answers : array, shape (steps, n_actions)
    """

    observations: Array
    answers: Array

    @property
    def travel(self) -> float:
        """How far the answers move in all."""
        return float(np.abs(np.diff(self.answers, axis=0)).sum())

    def as_dict(self) -> dict[str, Any]:
        """Return the probe as a card holds it."""
        text = base64.b64encode(self.observations.astype("<f4").tobytes()).decode()
        return {"observations": text, "answers": self.answers.tolist()}

    @classmethod
    def of(cls, said: Mapping[str, Any], width: int) -> Probe:
        """Return the probe on a card.

        Parameters
        ----------
        said : mapping
        width : int
            Numbers in an observation.

        Raises
        ------
        ValueError, KeyError, TypeError
            If it is none.
        """
        data = base64.b64decode(said["observations"], validate=True)
        observations = np.frombuffer(data, "<f4").reshape(-1, width)
        answers = np.array(said["answers"], np.float32)
        if not len(observations) or answers.ndim != 2 or len(answers) != len(observations):
            raise ValueError("as many answers as observations are needed")
        return cls(observations, answers)


def answers(controller: Any, observations: Array) -> Array:
    """Return what a controller answers to the observations of an episode, one after the other."""
    made, state = [], None
    for step, observation in enumerate(observations):
        action, state = controller.predict(observation, state, step == 0)
        made.append(np.asarray(action, np.float32))
    return np.array(made)


def record(env: str, kinds: Sequence[Mapping[str, Any]], controller: Any, name: str) -> Probe:
    """Return the probe of a controller: of the tuning episodes the one in which it moves most.

    Parameters
    ----------
    env : str
        Id of the environment.
    kinds : sequence of mapping
        Arguments of the environment that give the plant that the controller is told.
    controller : Controller
    name : str
        The controller's.

    Raises
    ------
    SettingsError
        If it is at an end of its range too often in all of them.
    """
    found = [probe for kind in kinds for probe in _episodes(env, kind, controller)]
    if not found:
        raise SettingsError(
            f"residual.controller = {name!r} is at a limit in more than {MOST_AT_LIMIT:.0%} of its "
            "answers in every tuning episode, so that a change of it would not be noticed, and has "
            "little left to correct; choose another controller, or references that it can follow"
        )
    return max(found, key=lambda probe: probe.travel)


def _episodes(env: str, kind: Mapping[str, Any], controller: Any) -> list[Probe]:
    """Return the starts of tuning episodes in which the controller is seldom at a limit."""
    arguments = {**kind, "info": False}
    made: Any = gym.make_vec(env, EPISODES, vectorization_mode="vector_entry_point", **arguments)
    space = made.single_action_space
    observation, _ = made.reset(seed=seeds.tuning(EPISODES))
    seen: list[Array] = []
    given: list[Array] = []
    state, over = None, False
    while len(seen) < STEPS and not over:
        action, state = controller.predict(observation, state, np.full(EPISODES, not seen))
        seen.append(observation.copy())
        given.append(np.array(action, np.float32))
        observation, _, terminated, truncated, _ = made.step(action)
        over = bool((terminated | truncated).any())
    made.close()
    rows = zip(np.stack(seen, 1), np.stack(given, 1), strict=True)
    probes = [Probe(observations, answers) for observations, answers in rows]
    return [probe for probe in probes if _at_limit(probe, space) <= MOST_AT_LIMIT]


def _at_limit(probe: Probe, space: Any) -> float:
    return float(((probe.answers <= space.low) | (probe.answers >= space.high)).mean())


def answers_alike(probe: Probe, controller: Any, scale: float) -> bool:
    """Return whether a controller still answers as recorded.

    Parameters
    ----------
    probe : Probe
    controller : Controller
    scale : float
        What the policy can add.
    """
    now = answers(controller, probe.observations)
    if now.shape != probe.answers.shape:
        return False
    return bool(np.abs(now - probe.answers).max() <= SAME * scale)


def difference(then: Any, now: Any, name: str = "") -> str:
    """Return the first number that differs among those that both have, "" if none does.

    Parameters
    ----------
    then, now : plain values
        See :func:`agents.policies.controllers.parameters`.
    name : str
        Where they stand, for the sentence.
    """
    if isinstance(then, Mapping) and isinstance(now, Mapping):
        pairs = [(then[key], now[key], f"{name}.{key}".strip(".")) for key in then if key in now]
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        pairs = [(a, b, f"{name}[{i}]") for i, (a, b) in enumerate(zip(then, now, strict=True))]
    else:
        return "" if _same(then, now) else f"{name} was {then!r} and is {now!r}"
    return next(filter(None, (difference(*pair) for pair in pairs)), "")


def _same(then: Any, now: Any) -> bool:
    numbers = all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in (then, now))
    return then == now or (numbers and math.isclose(then, now, rel_tol=CLOSE, abs_tol=1e-12))
