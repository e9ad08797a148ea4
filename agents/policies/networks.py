"""The policy's network: fixed differences of named signals, layers, and a linear path beside them.

With hysteresis the set-point that holds a contraction depends on the past, so the policy must
correct what it sees rather than know the answer: "the last set-point plus something of the error".
The linear path says that from the first step on, and the layers learn the rest.
"""

from __future__ import annotations

from typing import Any

import torch
from gymnasium import spaces
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn

from agents.policies import inputs
from agents.settings.parts import Network
from agents.settings.presets import ON_POLICY, Config
from agents.settings.schema import SettingsError
from pam_envs.parameters import Signals

ACTIVATIONS: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU}
Matrix = tuple[tuple[float, ...], ...]
CRITIC = ("value_net.", "mlp_extractor.value_net.", "lstm_critic.", "critic.")
"""What names of the critic's parameters begin with, in policies of stable-baselines3."""


def input_matrix(network: Network, names: tuple[str, ...]) -> Matrix:
    """Return the fixed map from what is observed to the inputs, shape (n_inputs, n_names).

    What is observed itself, then ``gain * (a - b)`` for each of ``network.differences``.
    """
    n = len(names)
    rows = [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]
    for difference in network.differences:
        a, minus, b = difference.partition(" - ")
        if not minus:
            raise SettingsError(f"network.differences: {difference!r} must read 'a - b'")
        row = [0.0] * n
        row[inputs.index(names, a, "network.differences")] += network.gain
        row[inputs.index(names, b, "network.differences")] -= network.gain
        rows.append(row)
    return tuple(tuple(row) for row in rows)


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
        if self.hold:
            _hold(self.action_net, self.mlp_extractor.latent_dim_pi - self.features_dim, self.hold)


class MemoryAndInputs(nn.Module):
    """Layers behind a memory; the policy's output is joined by the inputs beside the memory.

    Parameters
    ----------
    memory, inputs : int
        Widths; the policy reads both.
    critic : int
        Width of what the critic reads.
    """

    def __init__(
        self, memory: int, inputs: int, critic: int, hidden: list[int], activation: type[nn.Module]
    ) -> None:
        super().__init__()
        self.memory = memory
        self.policy_net = _layers(memory + inputs, hidden, activation)
        self.value_net = _layers(critic, hidden, activation)
        self.latent_dim_pi = hidden[-1] + inputs
        self.latent_dim_vf = hidden[-1]

    def forward_actor(self, latent: Tensor) -> Tensor:
        """Return layers and inputs side by side, shape (batch, latent_dim_pi)."""
        return torch.cat([self.policy_net(latent), latent[:, self.memory :]], 1)

    def forward_critic(self, latent: Tensor) -> Tensor:
        """Return the critic's layers, shape (batch, latent_dim_vf)."""
        made: Tensor = self.value_net(latent)
        return made


class RecurrentStructuredPolicy(RecurrentActorCriticPolicy):
    """A recurrent actor-critic in which the inputs also pass beside the memory.

    Parameters
    ----------
    hold : tuple of int
        As in :class:`StructuredPolicy`.
    """

    def __init__(self, *args: Any, hold: tuple[int, ...] = (), **kwargs: Any) -> None:
        self.hold = hold
        self.critic_remembers = bool(kwargs.get("enable_critic_lstm", True))
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self) -> None:
        hidden = [int(width) for width in self.net_arch]
        memory, seen = self.lstm_output_dim, self.features_dim
        critic = memory + (seen if self.critic_remembers else 0)
        self.mlp_extractor = MemoryAndInputs(  # type: ignore[assignment]
            memory, seen, critic, hidden, self.activation_fn
        )

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        if self.hold:
            _hold(self.action_net, self.mlp_extractor.latent_dim_pi - self.features_dim, self.hold)

    @staticmethod
    def _process_sequence(
        features: Tensor, lstm_states: Any, episode_starts: Tensor, lstm: nn.LSTM
    ) -> tuple[Tensor, Any]:
        output, after = RecurrentActorCriticPolicy._process_sequence(
            features, lstm_states, episode_starts, lstm
        )
        return torch.cat([output, features], 1), after


def _hold(last: Any, beside: int, hold: tuple[int, ...]) -> None:
    """Let the untrained action be the held inputs, which begin at ``beside`` in the latent."""
    with torch.no_grad():
        last.weight.zero_()
        last.bias.zero_()
        for action, held in enumerate(hold):
            last.weight[action, beside + held] = 1.0


def silence(policy: Any) -> None:
    """Let the untrained policy answer 0: a residual begins as its controller."""
    last = policy.action_net if isinstance(policy, ActorCriticPolicy) else policy.actor.mu
    with torch.no_grad():
        last.weight.zero_()
        last.bias.zero_()


def critic_alone(policy: Any, alone: bool) -> None:
    """Let the critic of an actor-critic learn alone, or both again."""
    for name, parameter in policy.named_parameters():
        parameter.requires_grad_(not alone or name.startswith(CRITIC))


def policy_arguments(config: Config, signals: Signals, actions: Signals) -> dict[str, Any]:
    """Return ``policy`` and ``policy_kwargs`` for stable-baselines3.

    Raises
    ------
    SettingsError
        If a name is not that of a signal, or a held signal has another range than the action.
    """
    network = config.network
    names = inputs.names(config, signals, actions)
    kwargs: dict[str, Any] = {
        "net_arch": list(network.hidden),
        "activation_fn": ACTIVATIONS[network.activation],
    }
    if network.differences:
        kwargs["features_extractor_class"] = LinearFeatures
        kwargs["features_extractor_kwargs"] = {"matrix": input_matrix(network, names)}
    if config.algo not in ON_POLICY:
        return {"policy": "MlpPolicy", "policy_kwargs": kwargs}
    kwargs["log_std_init"] = network.log_std_init
    recurrent = config.algo == "recurrent_ppo"
    if recurrent:
        own = config.recurrent_ppo
        kwargs |= {"lstm_hidden_size": own.lstm_size, "enable_critic_lstm": own.critic_lstm}
    if not network.linear:
        return {"policy": "MlpLstmPolicy" if recurrent else "MlpPolicy", "policy_kwargs": kwargs}
    kwargs["hold"] = _held(config, signals, actions)
    policy = RecurrentStructuredPolicy if recurrent else StructuredPolicy
    return {"policy": policy, "policy_kwargs": kwargs}


def _held(config: Config, signals: Signals, actions: Signals) -> tuple[int, ...]:
    network = config.network
    if not network.hold:
        return ()
    if len(network.hold) != len(actions):
        raise SettingsError(f"network.hold must name {len(actions)} signals, one for each action")
    found = []
    for name, action in zip(network.hold, actions, strict=True):
        found.append(inputs.index(tuple(signals.names()), name, "network.hold"))
        held = signals[found[-1]]
        scaled = config.normalize.observation
        if scaled or (held.low, held.high) != (action.low, action.high):
            raise SettingsError(
                f"network.hold: {name!r} must have the scale of {action.name!r} "
                f"({action.low:g} to {action.high:g} {action.unit}), and "
                "normalize.observation must be false"
            )
    return tuple(found)
