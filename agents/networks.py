"""The policy's network: fixed differences of named signals, layers, and a linear path beside them.

With hysteresis the set-point that holds a contraction depends on the past, so the policy must
correct what it sees rather than know the answer: "the last set-point plus something of the error".
The linear path says that from the first step on, and the layers learn the rest.
"""

from __future__ import annotations

from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn

from agents.configs import Config, Network
from agents.settings import SettingsError
from pam_envs.parameters import Signals

ACTIVATIONS: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU}
Matrix = tuple[tuple[float, ...], ...]


def input_matrix(network: Network, signals: Signals) -> Matrix:
    """Return the fixed map from the observation to the inputs, shape (n_inputs, n_signals).

    The observation itself, then ``gain * (a - b)`` for each of ``network.differences``.
    """
    n = len(signals)
    rows = [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]
    for difference in network.differences:
        a, minus, b = difference.partition(" - ")
        if not minus:
            raise SettingsError(f"network.differences: {difference!r} must read 'a - b'")
        row = [0.0] * n
        row[_index(signals, a)] += network.gain
        row[_index(signals, b)] -= network.gain
        rows.append(row)
    return tuple(tuple(row) for row in rows)


def _index(signals: Signals, name: str) -> int:
    try:
        found: int = signals[name.strip()].index
    except KeyError as error:
        raise SettingsError(f"network: {error.args[0]}") from error
    return found


class LinearFeatures(BaseFeaturesExtractor):
    """Inputs that are a fixed linear function of the observation."""

    def __init__(self, observation_space: spaces.Box, matrix: Matrix) -> None:
        super().__init__(observation_space, len(matrix))
        self.register_buffer("matrix", torch.tensor(matrix, dtype=torch.float32))

    def forward(self, observation: Tensor) -> Tensor:
        """Return the inputs, shape (batch, n_inputs)."""
        return torch.nn.functional.linear(observation.float(), self.matrix)  # type: ignore[arg-type]


class LayersAndInputs(nn.Module):
    """Layers for policy and critic; the policy's output is joined by the inputs themselves."""

    def __init__(self, inputs: int, hidden: list[int], activation: type[nn.Module]) -> None:
        super().__init__()
        self.policy_net = _layers(inputs, hidden, activation)
        self.value_net = _layers(inputs, hidden, activation)
        self.latent_dim_pi = hidden[-1] + inputs
        self.latent_dim_vf = hidden[-1]

    def forward(self, inputs: Tensor) -> tuple[Tensor, Tensor]:
        """Return what policy and critic read off, for stable-baselines3."""
        return self.forward_actor(inputs), self.forward_critic(inputs)

    def forward_actor(self, inputs: Tensor) -> Tensor:
        """Return layers and inputs side by side, shape (batch, latent_dim_pi)."""
        return torch.cat([self.policy_net(inputs), inputs], 1)

    def forward_critic(self, inputs: Tensor) -> Tensor:
        """Return the critic's layers, shape (batch, latent_dim_vf)."""
        latent: Tensor = self.value_net(inputs)
        return latent


def _layers(inputs: int, hidden: list[int], activation: type[nn.Module]) -> nn.Sequential:
    made: list[nn.Module] = []
    for width in hidden:
        made += [nn.Linear(inputs, width), activation()]
        inputs = width
    return nn.Sequential(*made)


class StructuredPolicy(ActorCriticPolicy):
    """An actor-critic whose action has a linear path; ``hold`` inputs pass through at first.

    Parameters
    ----------
    hold : tuple of int
        For each action, the input that the untrained policy returns; empty for none.
    """

    def __init__(self, *args: Any, hold: tuple[int, ...] = (), **kwargs: Any) -> None:
        self.hold = hold
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self) -> None:
        hidden = [int(width) for width in self.net_arch]
        self.mlp_extractor = LayersAndInputs(  # type: ignore[assignment]
            self.features_dim, hidden, self.activation_fn
        )

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        if not self.hold:
            return
        width = self.mlp_extractor.latent_dim_pi - self.features_dim
        last: Any = self.action_net
        with torch.no_grad():
            last.weight.zero_()
            last.bias.zero_()
            for action, held in enumerate(self.hold):
                last.weight[action, width + held] = 1.0


def policy_arguments(config: Config, signals: Signals, actions: Signals) -> dict[str, Any]:
    """Return ``policy`` and ``policy_kwargs`` for stable-baselines3.

    Raises
    ------
    SettingsError
        If a name is not that of a signal, or a held signal has another range than the action.
    """
    network = config.network
    kwargs: dict[str, Any] = {
        "net_arch": list(network.hidden),
        "activation_fn": ACTIVATIONS[network.activation],
    }
    if network.differences:
        kwargs["features_extractor_class"] = LinearFeatures
        kwargs["features_extractor_kwargs"] = {"matrix": input_matrix(network, signals)}
    if config.algo == "sac":
        return {"policy": "MlpPolicy", "policy_kwargs": kwargs}
    kwargs["log_std_init"] = network.log_std_init
    if not network.linear:
        return {"policy": "MlpPolicy", "policy_kwargs": kwargs}
    kwargs["hold"] = _held(network, signals, actions, config.normalize.observation)
    return {"policy": StructuredPolicy, "policy_kwargs": kwargs}


def _held(
    network: Network, signals: Signals, actions: Signals, normalized: bool
) -> tuple[int, ...]:
    if not network.hold:
        return ()
    if len(network.hold) != len(actions):
        raise SettingsError(f"network.hold must name {len(actions)} signals, one for each action")
    for name, action in zip(network.hold, actions, strict=True):
        held = signals[_index(signals, name)]
        if normalized or (held.low, held.high) != (action.low, action.high):
            raise SettingsError(
                f"network.hold: {name!r} must have the scale of {action.name!r} "
                f"({action.low:g} to {action.high:g} {action.unit}), and "
                "normalize.observation must be false"
            )
    return tuple(_index(signals, name) for name in network.hold)
