"""A policy together with the controller that it corrects, as one controller."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents import controllers
from agents.onnx_file import PolicyFileError
from agents.policy import OnnxPolicy


class ResidualState(NamedTuple):
    """What both remember.

    Attributes
    ----------
    controller : tuple of ndarray
    policy : ndarray, shape (n_env, memory), or None
    """

    controller: Any
    policy: NDArray[np.float32] | None


class ResidualPolicy:
    """Acts as the file says: ``controller's action + scale * policy``, held within the range.

    Attributes
    ----------
    policy : OnnxPolicy
    controller : Controller
        Of :data:`baselines.catalogue.CONTROLLERS`, told the nominal plant.
    """

    def __init__(self, policy: OnnxPolicy, controller: Any) -> None:
        self.policy = policy
        self.controller = controller

    @property
    def card(self) -> dict[str, Any]:
        """The policy's card."""
        return self.policy.card

    def predict(
        self,
        observation: NDArray[Any],
        state: ResidualState | None = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], ResidualState]:
        """Return the action for an observation; see :meth:`OnnxPolicy.predict`."""
        inner, memory = (None, None) if state is None else state
        given, inner = self.controller.predict(observation, inner, episode_start)
        action, memory = self.policy.answer(observation, memory, episode_start, given)
        return action, ResidualState(inner, memory)


def with_controller(policy: OnnxPolicy, plant: Any) -> OnnxPolicy | ResidualPolicy:
    """Return the policy, with the controller that it corrects if it does.

    Parameters
    ----------
    policy : OnnxPolicy
    plant : object
        Nominal plant that the controller is told; policies alone are told nothing.

    Raises
    ------
    PolicyFileError
        If the controller answers otherwise than in training although it is told the same plant.
    """
    if not policy.corrects:
        return policy
    controller = controllers.make(policy.corrects, plant, policy.signals, policy.action_signals)
    known = policy.card["baseline"]
    if plant.digest() == known.get("plant"):
        _check_answers(policy, controller, known)
    return ResidualPolicy(policy, controller)


def _check_answers(policy: OnnxPolicy, controller: Any, known: Any) -> None:
    now = np.array(controllers.probe(controller, len(policy.signals)))
    then = np.array(known.get("probe", ()))
    if then.shape != now.shape or not np.abs(now - then).max() <= controllers.SAME:
        raise PolicyFileError(
            f"{policy.name} was trained on the controller {policy.corrects!r}, which answers "
            "otherwise now; train it anew, or go back to the version of baselines on its card"
        )
