"""Clairvoyant predictive control: bound on the error that any controller can reach.

The oracle knows the true plant with its drawn parameters, the state without noise, and the whole
future of the references: it predicts with copies of the environment itself, noise included. It is
no controller, has no place in a ranking, and is never the best: it says which part of an error is
due to actuation (dead time, rate limit, range), whatever a controller knows.

After every ``APPLIED`` of a horizon, the actions of the next ``horizon`` control periods minimise

    sum of squared errors / scale^2  +  PENALTY * sum of squared changes of the actions

by ``STEPS`` Gauss-Newton steps (nocedal2006). Because predictions are exact, the actions of a plan
are applied without replanning in between. Those after them change every ``BLOCK`` periods (move
blocking). Sensitivities are finite differences: one copy per unknown, its actions raised from
one period on. The differences are large and their sign alternates, since the thresholds of a
hysteresis, a rate limit or the end of the range hide a small change or one direction. A step is the
best of several lengths and dampings, so that the predicted cost never increases. The last plan,
shifted, is the next starting point. If the actions of a controller in the same episodes are given,
the shifted plan ends with them, and in every search they are one more candidate for the whole
horizon of a row. They are replayed without feedback, from the state of the oracle. Gauss-Newton
alone may stay in a local minimum that is worse than that controller.

Errors that are not scored (outside of the gate of a track, before it has settled) have the weight
``UNSCORED``: just enough to keep the plant in its usual range. With a larger weight the oracle
trades scored against unscored errors: in a gait the muscle is not vented before heel contact. The
joints of a redundant arm are held near the posture of the plan with a small weight (``POSTURE``) at
all times: without it they drift into their limits.

A receding horizon is optimal but for its end, and Gauss-Newton finds a local minimum: the figure is
an upper bound of the optimum, and with a short horizon other controllers may pass it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.bounds.copies import Copies
from benchmarks.scoring.groups.elbow import NEAR
from benchmarks.scoring.groups.joint import DIRECTION, POSITION
from benchmarks.scoring.metrics import headline_of
from pam_envs.arrays import Array
from pam_envs.envs.core.vector_env import PlantVectorEnv

UNSCORED = 1e-5
"""Weight of a squared error that is not scored."""
PENALTY = 1e-4
"""Cost of a squared change of a normalised action."""
APPLIED = 0.1
"""Time between two plans, relative to the horizon."""
BLOCK = 2
"""Control periods between two changes of a plan after the actions that are applied."""
STEPS = 4
"""Gauss-Newton steps a plan."""
POSTURE = 1e-3
"""Error [m] of a tool that weighs as much as 1 rad of a joint of a redundant arm."""
DIFFERENCES = (2e-2, -2e-2)
"""Finite differences of a normalised action, of the steps in turn."""
DAMPINGS = (0.0, 1e-3, 3e-2)
"""Dampings that are tried, relative to the mean squared sensitivity (Levenberg-Marquardt)."""
LENGTHS = (1.0, 0.3, 0.05)
"""Lengths of a step that are tried, relative to the Gauss-Newton step."""
Term = tuple[str, str, float]
"""Names of an output and its reference in ``info``, and the factor of their difference."""
Target = tuple[Term, ...]
"""Terms whose sum is minimised."""
PLAIN: tuple[Target, ...] = ((("output", "reference", 1.0),),)


def targets_of(content: Mapping[str, Any]) -> tuple[Target, ...]:
    """Return the residuals whose sum of squares gives the square of the headline of a track."""
    headline = headline_of(content)
    if headline == "impedance_rms":
        return (*PLAIN, (("state/stiffness", "state/stiffness_reference", NEAR),))
    if headline == "tool_rms_error":
        back = -float(content["tool_length"])
        tip = [(f"state/{k}", f"state/reference_{k}", 1.0) for k in POSITION]
        turn = [(f"state/{k}", f"state/reference_{k}", back) for k in DIRECTION]
        return (*((one,) for one in tip), *zip(tip, turn, strict=True))
    return PLAIN


def posture_of(keys: Sequence[str]) -> tuple[Target, ...]:
    """Return the differences of joint angles that hold a redundant arm near its planned posture."""
    stages = sum(key.startswith("state/joint_reference_") for key in keys)
    return tuple(
        ((f"state/angle_{k}", f"state/joint_reference_{k}", POSTURE),) for k in range(stages)
    )


@dataclass
class Oracle:
    """Predictive controller with copies of a batch of environments.

    Attributes
    ----------
    env : PlantVectorEnv
        Normalised batch, whose environments the actions are for.
    scale : float
        Error [SI] of cost 1.
    targets : sequence of Target
        Differences that are minimised.
    gate : sequence of str
        Signals that are 1 where the error is scored.
    settle : float
        Time [s] from which the error is scored.
    horizon : int
        Control periods.
    given : ndarray, shape (n, rows, n_act), optional
        Actions [-1 to 1] of a controller in the same episodes, held at the last one.
    """

    env: PlantVectorEnv
    scale: float
    targets: Sequence[Target] = PLAIN
    gate: Sequence[str] = ()
    settle: float = 0.0
    horizon: int = 60
    given: Array | None = None

    def __post_init__(self) -> None:
        """Make the copies; the first plan holds the setpoints of the start."""
        self.width = len(self.env.action_signals)
        self._applied = max(1, round(APPLIED * self.horizon))
        blocks = range(self._applied, self.horizon, BLOCK)
        self._blocks = np.array([*range(self._applied), *blocks])
        raised = np.arange(self.horizon) >= self._blocks[:, None]
        self._raises = np.kron(raised.astype(float), np.eye(self.width))
        self._tangent = Copies(self.env, len(self._raises) + 1)
        candidates = len(DAMPINGS) * len(LENGTHS) + 1 + (self.given is not None)
        self._trial = Copies(self.env, candidates)
        self.start(np.zeros((self.env.num_envs, self.width)))

    @property
    def keys(self) -> tuple[str, ...]:
        """Signals of ``info``."""
        return self.env.setup.info_keys

    def start(self, last: Array) -> None:
        """Begin with constant actions, shape (rows, n_act)."""
        self.last = np.asarray(last, float)
        self.plan = np.repeat(self.last[None], self.horizon, axis=0)
        self._periods = 0

    def act(self) -> Array:
        """Return the actions of all environments in their present state, shape (rows, n_act)."""
        if self._periods % self._applied == 0:
            for k in range(STEPS):
                self._improve(DIFFERENCES[k % len(DIFFERENCES)])
        self._periods += 1
        action = self.plan[0].copy()
        self.last = action
        more = self.plan[-1:] if self.given is None else self._given_ahead()[-1:]
        self.plan = np.concatenate([self.plan[1:], more])
        return action

    def _given_ahead(self) -> Array:
        """Return the given actions of the horizon, shape (horizon, rows, n_act)."""
        assert self.given is not None
        periods = self._periods + np.arange(self.horizon)
        return self.given[np.minimum(periods, len(self.given) - 1)]

    def _improve(self, difference: float) -> None:
        base, slopes = self._linearised(difference)
        rows, unknowns = base.shape[0], len(self._raises)
        changes = self._changes(self.plan).reshape(rows, self.horizon, -1)[:, self._blocks]
        square, unit = slopes @ slopes.swapaxes(1, 2), np.eye(unknowns)
        force = slopes @ base[..., None] + PENALTY * changes.reshape(rows, -1, 1)
        mean = np.trace(square, axis1=1, axis2=2)[:, None, None] / unknowns
        steps = [
            -np.linalg.solve(square + (PENALTY + damping * mean) * unit, force)[..., 0]
            for damping in DAMPINGS
        ]
        whole = np.stack(steps, axis=1) @ self._raises  # (rows, dampings, horizon * n_act)
        self._search(whole.reshape(rows, -1, self.horizon, self.width).transpose(2, 0, 1, 3))

    def _linearised(self, difference: float) -> tuple[Array, Array]:
        """Return errors, shape (rows, n), and their slopes, shape (rows, unknowns, n)."""
        moves = difference * np.vstack([np.zeros(self._raises.shape[1]), self._raises])
        moves = moves.reshape(-1, self.horizon, self.width).swapaxes(0, 1)
        signs = self._inwards()
        self._tangent.take(self.env)
        ahead = self.plan[:, :, None] + moves[:, None] * signs[None, :, None]
        errors = self._errors(self._tangent.run(ahead))
        base, moved = errors[:, 0], np.tile(difference * signs, len(self._blocks))
        return base, (errors[:, 1:] - base[:, None]) / moved[..., None]

    def _inwards(self) -> Array:
        """Return the direction of differences: away from the nearer end of the range."""
        return np.where(self.plan.mean(axis=0) > 0.0, -1.0, 1.0)

    def _search(self, steps: Array) -> None:
        """Take the best of several lengths of steps, shape (horizon, rows, dampings, n_act)."""
        moves = [length * steps for length in LENGTHS] + [np.zeros_like(steps[:, :, :1])]
        plans = [self.plan[:, :, None] + np.concatenate(moves, axis=2)]
        if self.given is not None:
            plans.append(self._given_ahead()[:, :, None])
        trials = np.clip(np.concatenate(plans, axis=2), -1.0, 1.0)
        self._trial.take(self.env)
        costs = np.sum(self._errors(self._trial.run(trials)) ** 2, axis=-1)
        for k in range(trials.shape[2]):
            costs[:, k] += PENALTY * np.sum(self._changes(trials[:, :, k]) ** 2, axis=1)
        best = np.argmin(costs, axis=1)
        self.plan = trials[:, np.arange(len(best)), best]

    def _changes(self, plan: Array) -> Array:
        """Return the changes of the actions of a plan, shape (rows, horizon * n_act)."""
        whole = np.concatenate([self.last[None], plan])
        return np.diff(whole, axis=0).swapaxes(0, 1).reshape(plan.shape[1], -1)

    def _errors(self, info: Mapping[str, Any]) -> Array:
        """Return weighted errors, shape (rows, copies, periods * targets)."""
        scored = info["time"] > self.settle
        for name in self.gate:
            scored = scored & (info[name] > 0.5)
        weight = np.sqrt(np.where(scored, 1.0, UNSCORED)) / self.scale
        errors = [
            weight * sum(factor * (info[y] - info[r]) for y, r, factor in terms)
            for terms in self.targets
        ]
        errors += [
            factor / self.scale * (info[y] - info[r])
            for terms in posture_of(self.keys)
            for y, r, factor in terms
        ]
        return np.concatenate(errors).transpose(1, 2, 0)
