"""Wrappers: ``info`` as a plain dict, and the cost of safe reinforcement learning.

``info`` reports by how much each limit is exceeded, in SI units (``cost/pressure`` in Pa). Methods
of safe reinforcement learning expect one number, ``info["cost"]``: here the number of limits that
are exceeded after the step.
"""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import VectorEnv, VectorWrapper

PREFIX = "cost/"


class PlainInfo(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """``info`` as a plain dict, for recorders that ask for this type, such as Minari's."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)
        gym.Wrapper.__init__(self, env)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; see Gymnasium."""
        observation, info = self.env.reset(seed=seed, options=options)
        return observation, self.info(info)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Apply an action for one control period; see Gymnasium."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated, truncated, self.info(info)

    def info(self, info: dict[str, Any]) -> dict[str, Any]:
        """Return ``info`` as a plain dict."""
        return {**info}


class Cost(PlainInfo):
    """``info["cost"]``, the number of exceeded limits; ``info`` is a plain dict."""

    def info(self, info: dict[str, Any]) -> dict[str, Any]:
        """Return ``info`` as a plain dict with its cost."""
        return {**info, "cost": float(_cost(info))}


class VectorCost(VectorWrapper):
    """``infos["cost"]``, the number of exceeded limits of each row, also in ``final_info``.

    Raises
    ------
    ValueError
        If the batch reports no ``info`` (``info=False``).
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        if not getattr(env.unwrapped, "with_info", True):
            raise ValueError("info = False reports no limits; make the batch with info=True")
        super().__init__(env)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start episodes; see Gymnasium."""
        observations, infos = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        return observations, _with_costs(infos)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Apply one action a row; see Gymnasium."""
        *outcome, infos = self.env.step(actions)
        observations, rewards, terminated, truncated = outcome
        return observations, rewards, terminated, truncated, _with_costs(infos)


def _cost(info: dict[str, Any]) -> Any:
    """Return how many limits an ``info`` reports as exceeded; an array for those of a batch."""
    return sum(np.asarray(info[key]) > 0.0 for key in info if key.startswith(PREFIX))


def _with_costs(infos: dict[str, Any]) -> dict[str, Any]:
    made = {**infos, "cost": np.asarray(_cost(infos), np.float64)}
    if "final_info" in infos:
        made["final_info"] = _with_costs(infos["final_info"])
    return made
