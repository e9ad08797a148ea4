"""Selection of the best evaluated policy of a training, for export instead of the last one."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

UNTRAINED = "no later evaluation was better than the untrained policy's"


@dataclass
class Best:
    """Weights and normaliser at the best of the evaluations so far."""

    steps: int = -1  # control periods of training at that evaluation, -1 before the first
    # criterion of the choice (agents.training.evaluation.value_of), less is better
    value: float = math.inf
    weights: dict[str, torch.Tensor] = field(default_factory=dict)
    # of the observation's normaliser, empty without one
    moments: dict[str, Any] = field(default_factory=dict)

    def offer(self, model: BaseAlgorithm, value: float) -> None:
        """Keep the model's present weights if its value is less, or none is finite yet."""
        if value < self.value or math.isinf(self.value):
            state = model.policy.state_dict()
            self.steps, self.value = model.num_timesteps, value
            self.weights = {name: tensor.detach().clone() for name, tensor in state.items()}
            normaliser = _normaliser(model)
            names = () if normaliser is None else ("mean", "var")
            self.moments = {name: np.array(getattr(normaliser, name)) for name in names}

    def restore(self, model: BaseAlgorithm) -> None:
        """Load weights and normaliser into the model, for its export."""
        if self.steps < 0:
            return
        model.policy.load_state_dict(self.weights)
        normaliser = _normaliser(model)
        if normaliser is not None:
            for name, moment in self.moments.items():
                setattr(normaliser, name, np.array(moment))

    def chosen(self, evaluations: int) -> dict[str, Any]:
        """Return the card's entry on the choice among ``evaluations`` evaluations."""
        made: dict[str, Any] = {"steps": self.steps, "of": evaluations}
        if math.isfinite(self.value):
            made["value"] = self.value
        return made if self.steps else {**made, "note": UNTRAINED}


def _normaliser(model: BaseAlgorithm) -> Any:
    env = model.get_vec_normalize_env()
    return env.obs_rms if env is not None and env.norm_obs else None
