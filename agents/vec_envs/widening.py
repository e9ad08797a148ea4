"""Environment whose ranges of drawn parameters widen with the success of the policy."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.settings.parts import Widening
from agents.settings.schema import SettingsError

LOW, HIGH = 0, 1


class WideningVecEnv(VecEnvWrapper):
    """Automatic domain randomization; see :class:`agents.settings.parts.Widening`.

    ``widths`` are the shares of the declared ranges, below and above the nominal value, shape
    (2, n_parameters); ``names`` are the parameters. ``venv`` is a ``VecMonitor``, whose episode
    returns are the negative costs.
    """

    def __init__(self, venv: VecEnv, settings: Widening) -> None:
        super().__init__(venv)
        self.settings = settings
        base: Any = venv.unwrapped
        self.base = base
        self.batches = [
            (rows, batch.unwrapped) for rows, batch in zip(base.slices, base.batches, strict=True)
        ]
        plain = [rows for rows, batch in self.batches if not batch.ranges]
        drawn = [(rows, batch) for rows, batch in self.batches if batch.ranges]
        if not plain or not drawn:
            raise SettingsError(
                "widening needs rows with nominal plants and rows with drawn ones: give mix an "
                "entry without randomize and one with it"
            )
        names = drawn[0][1].plant.names
        self.names = tuple(n for n in names if any(n in batch.ranges for _, batch in drawn))
        self.columns = [names.index(name) for name in self.names]
        self.nominal_rows = np.zeros(venv.num_envs, np.bool_)
        for rows in plain:
            self.nominal_rows[rows] = True
        # ends of each row's declared ranges and its nominal value, NaN where it is not drawn
        self.ends = np.full((3, venv.num_envs, len(self.names)), np.nan)
        for rows, batch in drawn:
            for k, name in enumerate(self.names):
                if name in batch.ranges:
                    low, high = batch.ranges[name]
                    value = batch.plant.value(name)
                    ends = (min(low, value), max(high, value), value)
                    self.ends[:, rows, k] = np.reshape(ends, (3, 1))
        count = settings.episodes
        self.widths = np.full((2, len(self.names)), settings.start)
        self.costs = np.zeros((2, len(self.names), count))
        self.seen = np.zeros((2, len(self.names)), np.int64)
        self.nominal_costs, self.nominal_seen = np.zeros(count), np.zeros(1, np.int64)
        self.parameters = np.zeros((venv.num_envs, len(self.names)))
        self._apply()

    def ranges(self) -> dict[str, list[float]]:
        """Return the widest of the present ranges [SI] of each parameter, for the record."""
        low, high = self._present()
        return {
            name: [float(np.nanmin(low[:, k])), float(np.nanmax(high[:, k]))]
            for k, name in enumerate(self.names)
        }

    def _present(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the present ends of each row's ranges, shape (n_env, n_parameters) each."""
        low, high, nominal = self.ends
        least = nominal + self.widths[LOW] * (low - nominal)
        most = nominal + self.widths[HIGH] * (high - nominal)
        return np.maximum(least, low), np.minimum(most, high)

    def _apply(self) -> None:
        """Give the batches the present ranges."""
        low, high = self._present()
        for rows, batch in self.batches:
            own = batch.ranges
            if own:
                at = rows.start or 0
                batch.ranges = {
                    name: (low[at, k], high[at, k])
                    for k, name in enumerate(self.names)
                    if name in own
                }

    def reset(self) -> NDArray[np.float32]:
        """Start all episodes; see stable-baselines3."""
        observation = np.asarray(self.venv.reset())
        self.parameters = self.base.parameters()[:, self.columns]
        return observation

    def step_wait(self) -> VecEnvStepReturn:
        """Step all rows; see stable-baselines3."""
        observation, reward, done, infos = self.venv.step_wait()
        if done.any():
            low, high = self._present()
            with np.errstate(invalid="ignore", divide="ignore"):
                places = (self.parameters - low) / (high - low)
            for row in np.flatnonzero(done).tolist():
                self._count(row, places[row], -float(infos[row]["episode"]["r"]))
            self.parameters = self.base.parameters()[:, self.columns]
            self._widen()
        return observation, reward, done, infos

    def _count(self, row: int, places: NDArray[np.float64], cost: float) -> None:
        """Count the cost of an episode at the ends of the ranges near which its parameters were.

        ``places`` are those of its parameters in their ranges, from 0 to 1, NaN if not drawn.
        """
        count, edge = self.settings.episodes, self.settings.edge
        if self.nominal_rows[row]:
            self.nominal_costs[self.nominal_seen[0] % count] = cost
            self.nominal_seen += 1
            return
        for side, near in ((LOW, places <= edge), (HIGH, places >= 1.0 - edge)):
            for k in np.flatnonzero(near).tolist():
                self.costs[side, k, self.seen[side, k] % count] = cost
                self.seen[side, k] += 1

    def _widen(self) -> None:
        """Move the ends at which enough episodes were cheap enough."""
        enough = self.settings.episodes
        if self.nominal_seen[0] < enough:
            return
        allowed = self.settings.ratio * self.nominal_costs.mean()
        moved = (self.seen >= enough) & (self.costs.mean(axis=2) <= allowed) & (self.widths < 1.0)
        if moved.any():
            self.widths[moved] = np.minimum(self.widths[moved] + self.settings.step, 1.0)
            self.seen[moved] = 0
            self._apply()

    def snapshot(self) -> dict[str, Any]:
        """Return the complete state."""
        return {name: np.array(getattr(self, name)) for name in STATE}

    def restore(self, saved: dict[str, Any]) -> None:
        """Return to a snapshot; ValueError for widths or counts that no training has."""
        widths = saved["widths"].numpy()
        if not ((widths >= self.settings.start) & (widths <= 1.0)).all():
            raise ValueError("the widths of the ranges are not from widening.start to 1")
        if min(int(saved["seen"].min()), int(saved["nominal_seen"].min())) < 0:
            raise ValueError("the number of counted episodes is negative")
        for name in STATE:
            setattr(self, name, saved[name].numpy().copy())
        self._apply()


STATE = ("widths", "costs", "seen", "nominal_costs", "nominal_seen", "parameters")
"""Arrays of the wrapper's state."""
