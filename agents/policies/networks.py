"""Policy networks: fixed differences of named signals, layers, and a linear path beside them.

With hysteresis the setpoint that holds a contraction depends on the past. The linear path can
express "the last setpoint plus a gain times the error" from the first step on, and the layers learn
the rest.
"""

from typing import Any

import torch
from gymnasium import spaces
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn

from agents.settings.parts import Network
from agents.settings.presets import ON_POLICY, Config
from agents.settings.schema import SettingsError
from pam_envs.parameters import Signals
from pam_envs.wording import near

ACTIVATIONS: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU}
Matrix = tuple[tuple[float, ...], ...]
CRITIC = ("value_net.", "mlp_extractor.value_net.", "lstm_critic.", "critic.")
"""Prefixes of the critic's parameters in policies of stable-baselines3."""


def present_inputs(config: Config, signals: Signals, actions: Signals) -> tuple[str, ...]:
    """Return the names of a network's inputs, in order, without the history."""
    corrected = actions if config.residual.controller else ()
    return (*signals.names(), *(f"controller_{action.name}" for action in corrected))


def input_names(config: Config, signals: Signals, actions: Signals) -> tuple[str, ...]:
    """Return the names of the present inputs and of the history."""
    past, stride = config.history.signals, config.history.stride
    ages = range(stride, stride * config.history.frames + 1, stride)
    return (*present_inputs(config, signals, actions), *(f"{n}@{k}" for k in ages for n in past))


def kept_inputs(config: Config, signals: Signals, actions: Signals) -> tuple[int, ...]:
    """Return the indices of the inputs in the history."""
    known = present_inputs(config, signals, actions)
    return tuple(_index(known, name, "history.signals") for name in config.history.signals)


def _index(known: tuple[str, ...], name: str, where: str) -> int:
    """Return an input's index, or raise naming the nearest."""
    name = name.strip()
    if name not in known:
        raise SettingsError(f"{where}: no signal named {name!r}{near(name, known)}")
    return known.index(name)


def input_matrix(network: Network, names: tuple[str, ...]) -> Matrix:
    """Return the fixed map from the observation to the inputs, shape (n_inputs, n_names).

    Its rows are the identity, then ``gain * (a - b)`` for each of ``network.differences``.
    """
    n = len(names)
    identity = tuple(tuple(1.0 if i == j else 0.0 for j in range(n)) for i in range(n))
    where, gain = "network.differences", network.gain
    return (*identity, *(difference(text, names, gain, where) for text in network.differences))


def difference(text: str, names: tuple[str, ...], gain: float, where: str) -> tuple[float, ...]:
    """Return ``gain`` times a difference "a - b" of named inputs, as a row of a matrix.

    A SettingsError, which ``where`` begins, reports another text or an unknown name.
    """
    a, minus, b = text.partition(" - ")
    if not minus:
        raise SettingsError(f"{where}: {text!r} must read 'a - b'")
    row = [0.0] * len(names)
    row[_index(names, a, where)] += gain
    row[_index(names, b, where)] -= gain
    return tuple(row)


def extended(matrix: Matrix, names: int, hidden: int, first: int) -> Matrix:
    """Return an input matrix with ``hidden`` columns more, of which the first ``first`` are inputs.

    ``names`` is the number of columns of ``matrix``.
    """
    rows = [(*row, *(0.0,) * hidden) for row in matrix]
    width = names + hidden
    rows += [tuple(float(j == names + i) for j in range(width)) for i in range(first)]
    return tuple(rows)


class LinearFeatures(BaseFeaturesExtractor):
    """Inputs that are a fixed linear function of the observation's first columns."""

    matrix: Tensor

    def __init__(self, observation_space: spaces.Box, matrix: Matrix) -> None:
        super().__init__(observation_space, len(matrix))
        self.register_buffer("matrix", torch.tensor(matrix, dtype=torch.float32))

    def forward(self, observation: Tensor) -> Tensor:
        """Return the inputs, shape (batch, n_inputs)."""
        seen = observation[:, : self.matrix.shape[1]]
        return nn.functional.linear(seen.float(), self.matrix)


class LayersAndInputs(nn.Module):
    """Hidden layers of policy and critic; the inputs are appended to the output of the policy's.

    ``recurrent`` is the width of a recurrent layer's output before the inputs, 0 for none;
    ``critic`` the width of what the critic reads.
    """

    def __init__(
        self,
        inputs: int,
        hidden: list[int],
        activation: type[nn.Module],
        recurrent: int,
        critic: int,
    ) -> None:
        super().__init__()
        self.recurrent = recurrent
        self.policy_net = _layers(recurrent + inputs, hidden, activation)
        self.value_net = _layers(critic, hidden, activation)
        self.latent_dim_pi = hidden[-1] + inputs
        self.latent_dim_vf = hidden[-1]

    def forward(self, latent: Tensor) -> tuple[Tensor, Tensor]:
        """Return the latents of policy and critic, for stable-baselines3."""
        return self.forward_actor(latent), self.forward_critic(latent)

    def forward_actor(self, latent: Tensor) -> Tensor:
        """Return layers and inputs side by side, shape (batch, latent_dim_pi)."""
        return torch.cat([self.policy_net(latent), latent[:, self.recurrent :]], 1)

    def forward_critic(self, latent: Tensor) -> Tensor:
        """Return the critic's layers, shape (batch, latent_dim_vf)."""
        made: Tensor = self.value_net(latent)
        return made


def _layers(inputs: int, hidden: list[int], activation: type[nn.Module]) -> nn.Sequential:
    made: list[nn.Module] = []
    for width in hidden:
        made += [nn.Linear(inputs, width), activation()]
        inputs = width
    return nn.Sequential(*made)


class _LinearPath(ActorCriticPolicy):
    """Common part of the structured policies: the linear path, initialised to ``hold``.

    ``hold`` gives, for each action, the input that the untrained policy returns; empty for none.
    ``critic_matrix`` maps the observation to inputs of the critic other than the actor's.
    """

    def __init__(
        self,
        *args: Any,
        hold: tuple[int, ...] = (),
        critic_matrix: Matrix | None = None,
        **kwargs: Any,
    ) -> None:
        self.hold = hold
        self.critic_matrix = critic_matrix
        self.critic_lstm = bool(kwargs.get("enable_critic_lstm", True))
        kwargs["share_features_extractor"] = critic_matrix is None
        super().__init__(*args, **kwargs)

    @property
    def critic_inputs(self) -> int:
        """Number of inputs of the critic."""
        return len(self.critic_matrix) if self.critic_matrix else self.features_dim

    def _build_mlp_extractor(self) -> None:
        seen = self.features_dim
        recurrent = getattr(self, "lstm_output_dim", 0)
        critic = recurrent + (self.critic_inputs if self.critic_lstm else 0)
        hidden = [int(width) for width in self.net_arch]
        made: Any = LayersAndInputs(seen, hidden, self.activation_fn, recurrent, critic)
        self.mlp_extractor = made

    def _build(self, lr_schedule: Any) -> None:
        if self.critic_matrix:
            space: Any = self.observation_space
            self.vf_features_extractor = LinearFeatures(space, self.critic_matrix)
        super()._build(lr_schedule)
        if self.hold:
            beside = self.mlp_extractor.latent_dim_pi - self.features_dim
            last = _zero(self.action_net)
            with torch.no_grad():
                for action, held in enumerate(self.hold):
                    last.weight[action, beside + held] = 1.0


class StructuredPolicy(_LinearPath):
    """Actor-critic whose action has a linear path from the inputs."""


class RecurrentStructuredPolicy(_LinearPath, RecurrentActorCriticPolicy):
    """Recurrent actor-critic with a skip connection around the recurrent layer."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        if self.critic_matrix:  # the critic without an LSTM, with its own number of inputs
            self.critic = nn.Linear(self.critic_inputs, self.lstm_output_dim)
            rate = self.optimizer.param_groups[0]["lr"]
            make: Any = self.optimizer_class
            self.optimizer = make(self.parameters(), lr=rate, **self.optimizer_kwargs)

    @staticmethod
    def _process_sequence(
        features: Tensor, lstm_states: Any, episode_starts: Tensor, lstm: nn.LSTM
    ) -> tuple[Tensor, Any]:
        output, after = RecurrentActorCriticPolicy._process_sequence(
            features, lstm_states, episode_starts, lstm
        )
        return torch.cat([output, features], 1), after


def _zero(last: Any) -> Any:
    """Return a linear layer with all its parameters set to 0."""
    with torch.no_grad():
        last.weight.zero_()
        last.bias.zero_()
    return last


def silence(policy: Any) -> None:
    """Set the untrained policy's action to 0, so that a residual starts as its controller."""
    _zero(policy.action_net if isinstance(policy, ActorCriticPolicy) else policy.actor.mu)


def critic_alone(policy: Any, alone: bool) -> None:
    """Freeze all parameters except the critic's if ``alone``, otherwise none."""
    for name, parameter in policy.named_parameters():
        parameter.requires_grad_(not alone or name.startswith(CRITIC))


def policy_arguments(
    config: Config, signals: Signals, actions: Signals, privileged: tuple[int, int] = (0, 0)
) -> dict[str, Any]:
    """Return ``policy`` and ``policy_kwargs`` for stable-baselines3.

    ``privileged`` is the number of parameters and of true states in the observation. A
    SettingsError names an unknown signal, or a held signal whose range is not the action's.
    """
    network = config.network
    names = input_names(config, signals, actions)
    kwargs: dict[str, Any] = {
        "net_arch": list(network.hidden),
        "activation_fn": ACTIVATIONS[network.activation],
    }
    if network.differences or any(privileged):
        matrix = input_matrix(network, names)
        if config.sees_parameters:
            parameters, states = privileged
            first = parameters + (states if config.privileged.critic else 0)
            kwargs["critic_matrix"] = extended(matrix, len(names), parameters + states, first)
        if config.adaptation.steps:  # the teacher sees the parameters in place of the history
            present = len(present_inputs(config, signals, actions))
            matrix = (*matrix[:present], *matrix[len(names) :])
            matrix = extended(matrix, len(names), parameters, parameters)
        kwargs["features_extractor_class"] = LinearFeatures
        kwargs["features_extractor_kwargs"] = {"matrix": matrix}
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
        found.append(_index(tuple(signals.names()), name, "network.hold"))
        held = signals[found[-1]]
        scaled = config.normalize.observation
        if scaled or (held.low, held.high) != (action.low, action.high):
            raise SettingsError(
                f"network.hold: {name!r} must have the scale of {action.name!r} "
                f"({action.low:g} to {action.high:g} {action.unit}), and "
                "normalize.observation must be false"
            )
    return tuple(found)
