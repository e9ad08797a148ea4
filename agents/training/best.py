"""The best policy that was looked at during a training: what is shipped in place of the last."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

UNTRAINED = "nothing that was looked at later beat the untrained policy"


@dataclass
class Best:
    """Weights and normaliser at the best of the evaluations so far.

    Attributes
    ----------
    steps : int
        Control periods of training at that evaluation; -1 before the first.
    value : float
        What it was chosen by (see :func:`agents.training.evaluation.value_of`): less is better.
    weights : dict of Tensor
        The policy's.
    moments : dict of ndarray
        The observation's normaliser's; empty without one.
    """

    steps: int = -1
    value: float = math.inf
    weights: dict[str, torch.Tensor] = field(default_factory=dict)
    moments: dict[str, Any] = field(default_factory=dict)

    def offer(self, model: BaseAlgorithm, value: float) -> None:
        """Keep the model as it is now, if its value is less or none was known."""
        if value < self.value or math.isinf(self.value):
            state = model.policy.state_dict()
            self.steps, self.value = model.num_timesteps, value
            self.weights = {name: tensor.detach().clone() for name, tensor in state.items()}
            normaliser = _normaliser(model)
            names = () if normaliser is None else ("mean", "var")
            self.moments = {name: np.array(getattr(normaliser, name)) for name in names}

    def restore(self, model: BaseAlgorithm) -> None:
        """Give the model these weights, and its environment this normaliser: to ship it."""
        if self.steps < 0:
            return
        model.policy.load_state_dict(self.weights)
        normaliser = _normaliser(model)
        if normaliser is not None:
            for name, moment in self.moments.items():
                setattr(normaliser, name, np.array(moment))

    def chosen(self, looks: int) -> dict[str, Any]:
        """Return what a card says of the choice among so many evaluations."""
        made: dict[str, Any] = {"steps": self.steps, "of": looks}
        if math.isfinite(self.value):
            made["value"] = self.value
        return made if self.steps else {**made, "note": UNTRAINED}


def _normaliser(model: BaseAlgorithm) -> Any:
    env = model.get_vec_normalize_env()
    return env.obs_rms if env is not None and env.norm_obs else None
