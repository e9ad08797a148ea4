"""A policy together with the controller that it corrects, as one controller."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.export.onnx_file import PolicyFileError
from agents.policies import controllers, probe
from agents.policies.policy import OnnxPolicy


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
        Of :data:`baselines.core.catalogue.CONTROLLERS`, told the nominal plant.
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

    @property
    def model_output(self) -> Callable[[ResidualState], Any]:
        """What the controller's model should do, from the state; there if the controller has it."""
        told = self.controller.model_output
        return lambda state: told(state.controller)


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
        If the controller has other numbers than in training, or answers otherwise, although it is
        told the same plant.
    """
    if not policy.corrects:
        return policy
    controller = controllers.make(policy.corrects, plant, policy.signals, policy.action_signals)
    told = _told(policy)
    if plant.digest() in told:
        _check(policy, controller, told[plant.digest()])
    return ResidualPolicy(policy, controller)


def _told(policy: OnnxPolicy) -> dict[str, Any]:
    """Return what the card says of the controller by the plant that it was told."""
    try:
        return {entry["plant"]: entry for entry in policy.card["baseline"]["told"]}
    except (KeyError, TypeError) as error:
        raise PolicyFileError(
            f"{policy.name}: its card does not say how the controller {policy.corrects!r} answered "
            "in training; export it with this version"
        ) from error


def _check(policy: OnnxPolicy, controller: Any, known: Any) -> None:
    """Raise unless a controller is the one of the training, told the same plant."""
    try:
        then = probe.Probe.of(known["probe"], len(policy.signals))
        parameters, scale = known["parameters"], float(policy.card["baseline"]["scale"])
    except (KeyError, TypeError, ValueError) as error:
        raise PolicyFileError(
            f"{policy.name}: its card has no sound record of the controller {policy.corrects!r} "
            f"({error}); export it with this version"
        ) from error
    changed = probe.difference(parameters, controllers.parameters(controller))
    if changed or not probe.answers_alike(then, controller, scale):
        raise PolicyFileError(
            f"{policy.name} was trained on the controller {policy.corrects!r}, which is another "
            f"one now: {changed or 'it answers otherwise'}; train it anew, or go back to the "
            "version of baselines that it was trained with"
        )
