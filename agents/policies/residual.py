"""Residual policy and the controller that it corrects, combined into one controller."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import PolicyFileError
from baselines.core.catalogue import make_controller
from baselines.core.recorded_answers import RecordedAnswers

TOLERANCE = 1e-3
"""Tolerance of the controller's actions, as a share of the policy's largest correction."""


class ResidualState(NamedTuple):
    """States of the controller, and of the policy, shape (n_env, memory), if it has one."""

    controller: Any
    policy: NDArray[np.float32] | None


class ResidualPolicy:
    """Controller with the action ``controller's action + scale * policy``, clipped to its range."""

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
        """Output of the controller's model by state; an attribute if the controller has it."""
        output = self.controller.model_output
        return lambda state: output(state.controller)


def with_controller(policy: OnnxPolicy, plant: Any) -> OnnxPolicy | ResidualPolicy:
    """Return a policy combined with the controller that it corrects, if any.

    The controller is built from the nominal plant. A PolicyFileError reports a controller that,
    built from a plant of the training, does not reproduce its recorded actions.
    """
    if not policy.corrects:
        return policy
    controller = make_controller(policy.corrects, plant, policy.signals, policy.action_signals)
    recorded, tolerance = _recorded(policy)
    if plant.digest() in recorded:
        deviation = recorded[plant.digest()].deviation(controller)
        if deviation > tolerance:
            raise PolicyFileError(
                f"{policy.name} was trained on the controller {policy.corrects!r}, which now "
                f"deviates from its recorded actions by {deviation:.2g}, more than "
                f"{tolerance:.2g}; train the policy anew, or use the version of baselines of its "
                "training"
            )
    return ResidualPolicy(policy, controller)


def _recorded(policy: OnnxPolicy) -> tuple[dict[str, RecordedAnswers], float]:
    """Return the controller's recorded actions by the plant's digest, and their tolerance."""
    widths = len(policy.signals), len(policy.action_signals)
    try:
        held = policy.card["baseline"]
        found = {e["plant"]: RecordedAnswers.from_dict(e, *widths) for e in held["recorded"]}
        return found, TOLERANCE * float(held["scale"])
    except (KeyError, TypeError, ValueError) as error:
        raise PolicyFileError(
            f"{policy.name}: its card has no valid record of the controller {policy.corrects!r} "
            f"({error}); export it with this version"
        ) from error
