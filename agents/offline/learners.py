"""Behaviour cloning and implicit Q-learning (Kostrikov, Nair, Levine 2021) of a policy.

Both fit the same policy: layers in parallel with a linear path of the inputs, which include the
fixed differences of the environment's preset.
"""

import copy
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from agents.offline.data import Transitions
from agents.policies.networks import Matrix

ALGORITHMS = ("bc", "iql")
REWARD_RANGE = 1000.0
"""Range to which the returns of a data set are scaled, as in the publication."""
MOST_WEIGHT = 100.0
"""Largest weight of an advantage, as in the publication."""


@dataclass(frozen=True)
class Settings:
    """Hyper-parameters."""

    algo: str = "bc"
    steps: int = 20_000  # of the gradient
    seed: int = 0
    batch: int = 256
    hidden: tuple[int, int] = (256, 256)
    learning_rate: float = 1e-3  # decays to zero by a cosine
    discount: float = 0.99  # per control period
    expectile: float = 0.7
    temperature: float = 3.0  # inverse temperature of the advantage
    target: float = 0.005  # step of the target network


class Inputs(nn.Module):
    """Standardised inputs: fixed differences, then zero mean and unit deviation on the data."""

    matrix: Tensor
    mean: Tensor
    deviation: Tensor

    def __init__(self, matrix: Matrix, observations: Tensor) -> None:
        super().__init__()
        self.register_buffer("matrix", torch.tensor(matrix, dtype=torch.float32))
        made = observations @ self.matrix.T
        self.register_buffer("mean", made.mean(0))
        self.register_buffer("deviation", made.std(0).clamp_min(1e-4))

    def forward(self, observations: Tensor) -> Tensor:
        """Return the inputs, shape (batch, n_inputs)."""
        return (observations @ self.matrix.T - self.mean) / self.deviation


class Policy(nn.Module):
    """Deterministic policy: layers in parallel with a linear path."""

    def __init__(self, inputs: Inputs, hidden: tuple[int, int], actions: int) -> None:
        super().__init__()
        self.inputs = inputs
        width = len(inputs.matrix)
        self.layers = layers(width, hidden, nn.Tanh)
        self.head = nn.Linear(hidden[-1] + width, actions)

    def forward(self, observations: Tensor) -> Tensor:
        """Return the actions before they are limited to [-1, 1], shape (batch, n_actions)."""
        seen = self.inputs(observations)
        made: Tensor = self.head(torch.cat([self.layers(seen), seen], 1))
        return made


class Critic(nn.Module):
    """Two action values and a state value."""

    def __init__(self, inputs: Inputs, hidden: tuple[int, int], actions: int) -> None:
        super().__init__()
        self.inputs = inputs
        width = len(inputs.matrix)
        self.first = self._value(width + actions, hidden)
        self.second = self._value(width + actions, hidden)
        self.state = self._value(width, hidden)

    @staticmethod
    def _value(width: int, hidden: tuple[int, int]) -> nn.Sequential:
        return nn.Sequential(*layers(width, hidden, nn.ReLU), nn.Linear(hidden[-1], 1))

    def pair(self, observations: Tensor, actions: Tensor) -> tuple[Tensor, Tensor]:
        """Return the two action values, shape (batch,) each."""
        seen = torch.cat([self.inputs(observations), actions], 1)
        return self.first(seen)[:, 0], self.second(seen)[:, 0]

    def value(self, observations: Tensor) -> Tensor:
        """Return the state value, shape (batch,)."""
        made: Tensor = self.state(self.inputs(observations))[:, 0]
        return made


def layers(width: int, hidden: tuple[int, int], activation: type[nn.Module]) -> nn.Sequential:
    """Return hidden layers."""
    made: list[nn.Module] = []
    for size in hidden:
        made += [nn.Linear(width, size), activation()]
        width = size
    return nn.Sequential(*made)


def learn(
    data: Transitions,
    matrix: Matrix,
    settings: Settings,
    advance: Callable[[int], None] = lambda count: None,
) -> Policy:
    """Return the policy that an algorithm learns from transitions.

    The result is a function of data and settings: torch uses one thread. ``matrix`` is of
    :func:`agents.policies.networks.input_matrix`.
    """
    torch.set_num_threads(1)
    torch.manual_seed(settings.seed)
    random = np.random.default_rng(settings.seed)
    seen, given, rewards, after, ended = map(
        torch.from_numpy,
        (
            data.observations,
            data.actions,
            data.rewards * (REWARD_RANGE / max(float(np.ptp(data.returns)), 1e-6)),
            data.next_observations,
            data.terminations,
        ),
    )
    inputs, actions = Inputs(matrix, seen), given.shape[1]
    policy = Policy(inputs, settings.hidden, actions)
    learner = _Iql(Critic(inputs, settings.hidden, actions), settings)
    optimiser = torch.optim.Adam(policy.parameters(), settings.learning_rate)
    decay = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, settings.steps)
    for _ in range(settings.steps):
        rows = torch.from_numpy(random.integers(len(seen), size=settings.batch))
        weights = torch.ones(len(rows))
        if settings.algo == "iql":
            weights = learner.step(*(part[rows] for part in (seen, given, rewards, after, ended)))
        errors = (policy(seen[rows]) - given[rows]).square().sum(1)
        optimiser.zero_grad()
        (weights * errors).mean().backward()
        optimiser.step()
        decay.step()
        advance(1)
    return policy


class _Iql:
    """Critic of implicit Q-learning with its target network."""

    def __init__(self, critic: Critic, settings: Settings) -> None:
        self.critic, self.settings = critic, settings
        self.target = copy.deepcopy(critic)
        self.optimiser = torch.optim.Adam(critic.parameters(), 3e-4)

    def step(
        self, seen: Tensor, given: Tensor, rewards: Tensor, after: Tensor, ended: Tensor
    ) -> Tensor:
        """Improve the critic on a batch; return the weights of its actions, shape (batch,)."""
        settings = self.settings
        with torch.no_grad():
            least = torch.minimum(*self.target.pair(seen, given))
            next_value = self.critic.value(after)
        advantage = least - self.critic.value(seen)
        shares = torch.where(advantage > 0.0, settings.expectile, 1.0 - settings.expectile)
        wanted = rewards + settings.discount * (1.0 - ended) * next_value
        loss = (shares * advantage.square()).mean()
        for one in self.critic.pair(seen, given):
            loss = loss + (one - wanted).square().mean()
        self.optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        self.optimiser.step()
        with torch.no_grad():
            for slow, fast in zip(self.target.parameters(), self.critic.parameters(), strict=True):
                slow.lerp_(fast, settings.target)
        return torch.exp(settings.temperature * advantage.detach()).clamp_max(MOST_WEIGHT)
