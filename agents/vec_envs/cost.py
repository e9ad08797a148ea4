"""Environment with another reward: quadratic cost of errors, cost of changes of the action."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.settings.parts import Cost

EFFORT, ENDED = "reward/effort", "reward/ended"
SMALLEST = 1e-6
"""Least mean cost that a reward is divided by."""


class CostVecEnv(VecEnvWrapper):
    """Replace the reward by that of :class:`agents.settings.parts.Cost`.

    A term of the environment is ``-t`` with ``t = weight * |error| / scale``. Here it is ``-t**2``
    up to ``t = quadratic = d``, and ``-(2 d t - d**2)`` beyond, which is never below ``-2 d t``.
    ``reward/ended``, the sum of the lowest possible rewards of the remaining periods, is therefore
    multiplied by ``2 d``. ``venv`` is a :class:`agents.vec_envs.batch.BatchVecEnv`.

    With ``cost.relative`` the costs of errors and ``reward/ended`` are divided by the mean cost of
    the errors of the same kind of rows so far.
    """

    def __init__(self, venv: VecEnv, cost: Cost) -> None:
        super().__init__(venv)
        self.cost = cost
        base: Any = venv.unwrapped
        self.base = base
        terms = [name for name in base.reported() if name.startswith("reward/")]
        self.errors = [name for name in terms if name not in (EFFORT, ENDED)]
        self.has_end = ENDED in terms
        base.watch([*terms, "time"])
        space: Any = venv.action_space
        self.low, self.high = space.low, space.high
        setups = [(batch.unwrapped.setup, batch.num_envs) for batch in base.batches]
        self.episode = np.repeat([s.episode_seconds for s, _ in setups], [n for _, n in setups])
        self.period = setups[0][0].control_period
        self.action = np.zeros((venv.num_envs, *space.shape), np.float32)
        self.before = np.zeros_like(self.action)
        self.started = np.zeros(venv.num_envs, np.bool_)  # whether ``before`` is of this episode
        self.totals = np.zeros(len(base.slices))  # cost of the errors, by kind of rows
        self.periods = np.zeros(len(base.slices))

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        self.started = np.zeros(self.num_envs, np.bool_)
        return np.asarray(self.venv.reset())

    def step_async(self, actions: NDArray[Any]) -> None:
        """Apply the actions."""
        self.action = np.clip(np.asarray(actions, np.float32), self.low, self.high)
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        observation, _, done, infos = self.venv.step_wait()
        last = self.base.last
        errors = np.sum([self._error_cost(-last[name]) for name in self.errors], axis=0)
        errors = np.where(last["time"] > self.cost.settle_seconds, errors, 0.0)
        share = self._mean(errors) if self.cost.relative else 1.0
        made = last[EFFORT] - errors / share
        change = (self.action - self.before) / (self.high - self.low)
        moved = np.square(change, dtype=np.float64).sum(axis=1)
        made = made - self.cost.action_rate * np.where(self.started, moved, 0.0)
        if self.has_end:
            made = made + max(2.0 * self.cost.quadratic, 1.0) * last[ENDED] / share
        elif self.cost.ended:
            made = made - self.cost.ended * self._cut_off(done, infos)
        self.before, self.started = self.action, ~done
        return observation, made.astype(np.float32), done, infos

    def _mean(self, errors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean cost of the errors of each row's kind, with the present period."""
        sizes = [rows.stop - rows.start for rows in self.base.slices]
        self.totals += [errors[rows].sum() for rows in self.base.slices]
        self.periods += sizes
        return np.repeat(np.maximum(self.totals / self.periods, SMALLEST), sizes)

    def _error_cost(self, size: NDArray[np.float64]) -> NDArray[np.float64]:
        limit = self.cost.quadratic
        if not limit:
            return size
        return np.where(size <= limit, size * size, limit * (2.0 * size - limit))

    def _cut_off(self, done: NDArray[np.bool_], infos: list[dict[str, Any]]) -> NDArray[np.float64]:
        """Return the number of control periods that a limit has cut off in each row."""
        left = np.zeros(self.num_envs)
        for row in np.flatnonzero(done).tolist():
            if not infos[row]["TimeLimit.truncated"]:
                left[row] = (self.episode[row] - self.base.last["time"][row]) / self.period + 1.0
        return left
