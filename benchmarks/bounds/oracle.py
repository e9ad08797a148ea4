"""Clairvoyant predictive control: bound on the error that any controller can reach.

The oracle knows the true plant with its drawn parameters, the state without noise, and the whole
future of the references: it predicts with copies of the environment itself, noise included. It is
no controller, has no place in a ranking, and is never the best: it says which part of an error is
due to actuation (dead time, rate limit, range), whatever a controller knows.

At every control period the actions of the next ``horizon`` periods minimise

    sum of squared errors / scale^2  +  penalty * sum of squared changes of the actions

by Gauss-Newton steps (nocedal2006). Sensitivities are finite differences: one copy per unknown, its
actions raised from one period on. A step is the best of several lengths, so that the predicted cost
never increases. The plan of the last period, shifted, is the next starting point.

A receding horizon is optimal but for its end, and Gauss-Newton finds a local minimum: the figure is
an upper bound of the optimum, and with a short horizon other controllers may pass it. In swing,
where the tension of a gait is not scored, its error has the weight ``UNTRACKED``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.bounds.copies import Copies
from benchmarks.scoring.groups.elbow import NEAR
from pam_envs.arrays import Array
from pam_envs.envs.core.vector_env import PlantVectorEnv

UNTRACKED = 0.02
"""Weight of a squared error outside of the gate of a track."""
DIFFERENCE = 2e-3
"""Finite difference of a normalised action."""
LENGTHS = (1.0, 0.6, 0.3, 0.1, 0.02, 0.0)
"""Lengths of a step that are tried, relative to the Gauss-Newton step."""
Target = tuple[str, str, float]
"""Names of an output and its reference in ``info``, and the factor of their difference."""
PLAIN: tuple[Target, ...] = (("output", "reference", 1.0),)
TARGETS: Mapping[str, tuple[Target, ...]] = {
    "tool_rms_error": tuple((f"state/{a}", f"state/reference_{a}", 1.0) for a in "xyz"),
    "impedance_rms": (*PLAIN, ("state/stiffness", "state/stiffness_reference", NEAR)),
}
"""Differences whose sum of squares is the square of a headline; others: ``PLAIN``."""


@dataclass
class Oracle:
    """Predictive controller with copies of a batch of environments.

    Attributes
    ----------
    env : PlantVectorEnv
        Normalised batch, whose environments the actions are for.
    scale : float
        Error [SI] of cost 1.
    targets : sequence of (str, str, float)
        Differences that are minimised.
    gate : sequence of str
        Signals that are 1 where the error is scored.
    horizon : int
        Control periods.
    steps : int
        Gauss-Newton steps a period.
    penalty : float
        Cost of a squared change of a normalised action.
    """

    env: PlantVectorEnv
    scale: float
    targets: Sequence[Target] = PLAIN
    gate: Sequence[str] = ()
    horizon: int = 30
    steps: int = 1
    penalty: float = 1e-2

    def __post_init__(self) -> None:
        """Make the copies; the first plan holds the setpoints of the start."""
        self.width = len(self.env.action_signals)
        unknowns = self.horizon * self.width
        self._tangent = Copies(self.env, unknowns + 1)
        self._trial = Copies(self.env, len(LENGTHS))
        self._raises = np.kron(np.tri(self.horizon), np.eye(self.width))
        self.start(np.zeros((self.env.num_envs, self.width)))

    @property
    def keys(self) -> tuple[str, ...]:
        """Signals of ``info``."""
        return self.env.setup.info_keys

    def start(self, last: Array) -> None:
        """Begin with constant actions, shape (rows, n_act)."""
        self.last = np.asarray(last, float)
        self.plan = np.repeat(self.last[None], self.horizon, axis=0)

    def act(self) -> Array:
        """Return the actions of all environments in their present state, shape (rows, n_act)."""
        for _ in range(self.steps):
            self._improve()
        action = self.plan[0].copy()
        self.last = action
        self.plan = np.concatenate([self.plan[1:], self.plan[-1:]])
        return action

    def _improve(self) -> None:
        rows, unknowns = self.env.num_envs, self.horizon * self.width
        spread = np.vstack([np.zeros(unknowns), DIFFERENCE * self._raises.T])
        moved = spread.reshape(unknowns + 1, self.horizon, self.width).swapaxes(0, 1)
        ahead = self.plan[:, :, None] + moved[:, None] * self._inwards()[None, :, None]
        self._tangent.take(self.env)
        errors = self._errors(self._tangent.run(ahead))  # (rows, copies, residuals)
        base, signs = errors[:, 0], np.tile(self._inwards(), self.horizon)
        slopes = (errors[:, 1:] - base[:, None]) / (DIFFERENCE * signs)[..., None]
        changes = self._changes(self.plan)
        normal = slopes @ slopes.swapaxes(1, 2) + self.penalty * np.eye(unknowns)
        force = (slopes @ base[..., None])[..., 0] + self.penalty * changes
        step = -np.linalg.solve(normal, force[..., None])[..., 0]
        self._search(step.reshape(rows, self.horizon, self.width).cumsum(axis=1))

    def _inwards(self) -> Array:
        """Return the direction of differences: away from the nearer end of the range."""
        return np.where(self.plan.mean(axis=0) > 0.0, -1.0, 1.0)

    def _search(self, step: Array) -> None:
        lengths = np.array(LENGTHS)[:, None]
        moved = self.plan[:, :, None] + lengths * step.swapaxes(0, 1)[:, :, None]
        trials = np.clip(moved, -1.0, 1.0)
        self._trial.take(self.env)
        costs = np.sum(self._errors(self._trial.run(trials)) ** 2, axis=-1)
        for k in range(len(LENGTHS)):
            costs[:, k] += self.penalty * np.sum(self._changes(trials[:, :, k]) ** 2, axis=1)
        best = np.argmin(costs, axis=1)
        self.plan = trials[:, np.arange(len(best)), best]

    def _changes(self, plan: Array) -> Array:
        """Return the changes of the actions of a plan, shape (rows, horizon * n_act)."""
        whole = np.concatenate([self.last[None], plan])
        return np.diff(whole, axis=0).swapaxes(0, 1).reshape(plan.shape[1], -1)

    def _errors(self, info: Mapping[str, Any]) -> Array:
        """Return weighted errors, shape (rows, copies, periods * targets)."""
        weight = np.ones_like(info["time"])
        for name in self.gate:
            weight = weight * (info[name] > 0.5)
        weight = np.sqrt(np.where(weight > 0.0, 1.0, UNTRACKED)) / self.scale
        errors = [weight * factor * (info[y] - info[r]) for y, r, factor in self.targets]
        return np.concatenate(errors).transpose(1, 2, 0)
