"""Comparison of a controller of the catalogue in an environment of the plant's family.

The controller is designed from the plant before and from the extended plant. Both run in the same
episodes of the environment, whose plant is the true plant of the rig, if that is known, otherwise
the extended plant with its sensor noise.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np

from pam_envs.arrays import Array, Flags
from pam_envs.checkout import catalogue
from pam_envs.diagnosis.closed_loop.gain import NOISY, name_of, scores, segment_squares, sentence
from pam_envs.diagnosis.plant_protocol import Loop
from pam_envs.envs.episodes import run_episodes

EPISODES = 8
"""Number of episodes, which differ in reference and sensor noise."""
FEWEST = 3
"""Smallest number of complete episodes for a comparison."""

Design = Callable[[Any, Any, Any], Any]
"""From a plant, and signals and action signals of an environment, to a controller."""


def environments(loop: Loop, plant: Any) -> list[Any]:
    """Return an environment for each episode; ValueError if it takes no such plant."""
    given: dict[str, Any] = {} if loop.reference is None else {"reference": loop.reference}
    return [
        gym.make(loop.env, plant=plant, disable_env_checker=True, **given).unwrapped
        for _ in range(EPISODES)
    ]


def errors_of(envs: list[Any], controller: Any, seed: int) -> tuple[Array, Flags]:
    """Return tracking errors [SI], (T, episodes), NaN after the end, and which ended early."""

    def read(info: Any) -> list[float]:
        return [float(np.linalg.norm(np.subtract(info["output"], info["reference"])))]

    kept, ended = run_episodes(envs, controller, read, seed)
    return kept[0], ended


def compare(
    loop: Loop,
    before: Any,
    after: Any,
    design: Design | None = None,
    oracle: Any = None,
    seed: int = 0,
) -> tuple[dict[str, Any] | None, str]:
    """Compare a controller designed from two plants in the same episodes.

    Parameters
    ----------
    loop : Loop
        Environment, and the controller where no ``design`` is given.
    before, after : Plant
        Plants of the family.
    design : callable, optional
        See :data:`Design`.
    oracle : Plant, optional
        True plant of the rig: the episodes are on it, and a third controller is designed from it.
    seed : int
        Of the first episode; the others follow.

    Returns
    -------
    found : dict or None
        ``closed_loop`` of the report; None if there is no comparison.
    reason : str
        Why there is none.

    Raises
    ------
    ValueError
        If a controller cannot be designed from a plant.
    """
    try:
        make = design or partial(catalogue().make_controller, loop.controller)
    except ModuleNotFoundError as error:
        return None, f"the controllers need {error.name}: pip install 'pam-envs[baselines]'"
    try:
        envs = environments(loop, after if oracle is None else oracle)
    except ValueError as error:
        return None, f"{loop.env} does not take this plant: {error}"
    period = float(envs[0].control_period)
    runs = [
        errors_of(envs, make(plant, envs[0].signals, envs[0].action_signals), seed)
        for plant in (before, after, oracle)
        if plant is not None
    ]
    whole = ~np.any([ended for _, ended in runs], axis=0)
    if whole.sum() < FEWEST:
        return None, f"a limit of {loop.env} ended {EPISODES - whole.sum()} of {EPISODES} episodes"
    kept = np.flatnonzero(whole)
    squares = np.array(
        [[segment_squares(errors[:, k], period) for k in kept] for errors, _ in runs]
    )
    names = [f"episode {k}" for k in kept]
    found = scores(squares, names, seed, loop.unit, loop.scale)
    found["controller"] = loop.controller if design is None else name_of(design)
    found["where"] = f"{NOISY if oracle is None else 'the rig'} in {loop.env}"
    text = sentence(found)
    if not whole.all():
        text += f" A limit ended {(~whole).sum()} of {EPISODES} episodes, which are left out."
    return {**found, "text": text}, ""
