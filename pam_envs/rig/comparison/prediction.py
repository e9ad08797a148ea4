"""Prediction of closed-loop figures by simulated runs, with prediction intervals.

A controller of the catalogue runs in ``PAM/MusclePositioning-v0``, from rest, in several runs that
differ in sensor noise, in random levels, and in the plant, if that has equally good fits. The
interval is that of one further run: for n runs of mean m and standard deviation s it is
m +- t s sqrt(1 + 1/n), where t is the quantile of Student's t with n - 1 degrees of freedom.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from pam_envs.arrays import Array
from pam_envs.checkout import catalogue
from pam_envs.envs.episodes import run_episodes
from pam_envs.envs.positioning.env import MusclePositioningEnv
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.rig.comparison.figures import FIGURES, Run, settled_parts
from pam_envs.rig.comparison.references import Holds, check_reach
from pam_envs.rig.comparison.table import Condition, Measurement

ENV = "PAM/MusclePositioning-v0"
LEVEL = 0.95
FEWEST, MOST = 3, 1000
"""Bounds of the number of runs."""
ROOM = 0.5
"""Admissible contraction beyond the reach, over the reach."""


@dataclass(frozen=True)
class Settings:
    """Settings of the runs.

    Attributes
    ----------
    plant : SingleMuscle
        Simulated plant.
    model : SingleMuscle
        Nominal plant from which the controllers are designed.
    holds : Holds
        Reference of conditions without a file.
    settled : float
        Time at the end of each hold that counts as settled [s].
    runs : int
        Number of runs.
    seed : int
        Seed of the first run; the others follow.
    """

    plant: SingleMuscle
    model: SingleMuscle
    holds: Holds
    settled: float = 1.0
    runs: int = 8
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the numbers."""
        self.holds.check()
        if not FEWEST <= self.runs <= MOST:
            raise ValueError(
                f"runs = {self.runs} must be from {FEWEST} to {MOST}: an interval needs several"
            )
        if not 0.05 <= self.settled <= 300.0:
            raise ValueError(f"settled_seconds = {self.settled:g} must be from 0.05 to 300 s")
        if self.seed < 0:
            raise ValueError(f"seed = {self.seed} must be 0 or more")


@dataclass(frozen=True)
class Prediction:
    """Figures of the runs of a controller.

    Attributes
    ----------
    values : dict of ndarray
        By figure, shape (completed runs,).
    failed : int
        Number of runs that left the range of contractions.
    """

    values: dict[str, Array]
    failed: int = 0

    def mean(self, name: str) -> float:
        """Return the mean of a figure; infinite if a run failed."""
        return float("inf") if self.failed else float(self.values[name].mean())

    def interval(self, name: str) -> tuple[float, float]:
        """Return the prediction interval of a figure, whose lowest value is 0."""
        if self.failed:
            return float("nan"), float("nan")
        sample = self.values[name]
        n, middle = len(sample), float(sample.mean())
        t = float(stats.t.ppf(0.5 + 0.5 * LEVEL, n - 1))
        half = t * float(sample.std(ddof=1)) * math.sqrt(1.0 + 1.0 / n)
        return max(0.0, middle - half), middle + half


def entry_of(measured: Measurement) -> Any:
    """Return the catalogue entry of a controller; ValueError names those of the environment."""
    known = {n: e for n, e in catalogue().CONTROLLERS.items() if ENV in e.envs}
    if measured.controller not in known:
        raise ValueError(
            f"line {measured.line}: no controller of {ENV} is named {measured.controller!r}; "
            f"there are: {', '.join(sorted(known))}; add your own by the environment variable "
            "PAM_ENVS_CONTROLLERS (docs/tutorials/controller.md)"
        )
    return known[measured.controller]


def reach_of(plant: SingleMuscle, load: float) -> tuple[float, float]:
    """Return the contraction [m] of a plant at rest without and with full pressure."""
    low, high = plant.contraction_at(np.array([0.0, plant.regulator.max_pressure]), load)
    return float(low), float(high)


def references_of(settings: Settings, condition: Condition, given: Array | None) -> list[Array]:
    """Return the reference [m] of each run: ``given`` samples or random holds."""
    reach = reach_of(settings.plant, condition.load)
    made = [
        settings.holds.samples(reach, settings.seed + k, settings.plant.control_period)
        if given is None
        else given
        for k in range(settings.runs)
    ]
    check_reach(np.concatenate(made), reach, condition.text)
    return made


def check_holds(reference: Array, period: float, settled: float) -> None:
    """Raise ValueError if a reference has no hold for the settled bias."""
    if not settled_parts(reference, period, settled):
        raise ValueError(
            f"bias_mm needs holds of at least {2.0 * settled:g} s, and the reference has none; "
            "give a smaller --settled-seconds, or remove the column"
        )


def predict(
    settings: Settings,
    controller: str,
    condition: Condition,
    references: Sequence[Array],
    names: Sequence[str],
) -> Prediction:
    """Return figures of the runs of a controller in a condition.

    Parameters
    ----------
    settings, controller, condition
        See :class:`Settings` and :class:`~pam_envs.rig.comparison.table.Measurement`.
    references : sequence of ndarray
        Reference [m] of each run.
    names : sequence of str
        Figures to compute.
    """
    runs, failed = _runs(settings, controller, condition.load, references)
    values = {name: np.array([FIGURES[name].of(run) for run in runs]) for name in names}
    return Prediction(values, failed)


def _envs(settings: Settings, load: float, references: Sequence[Array]) -> list[Any]:
    """Return an environment per run, each with the next of the equally good fits."""
    plants, (low, high) = settings.plant.members(), reach_of(settings.plant, load)
    room = ROOM * (high - low)
    limits = {
        "lowest_contraction": max(-1.0, min(-0.01, low - room)),
        "highest_contraction": min(1.0, high + room),
    }
    return [
        MusclePositioningEnv(
            plant=plants[k % len(plants)],
            reference=reference,
            load=load,
            start="rest",
            episode_seconds=len(reference) * settings.plant.control_period,
            reward=limits,
        )
        for k, reference in enumerate(references)
    ]


def _runs(
    settings: Settings, controller: str, load: float, references: Sequence[Array]
) -> tuple[list[Run], int]:
    """Return the completed runs and the number of failed ones; the runs advance together."""
    envs = _envs(settings, load, references)
    made = catalogue().make_controller(
        controller, settings.model, envs[0].signals, envs[0].action_signals, settings.seed
    )
    names = "reference", "sensor/contraction", "effort/pressure_travel"
    record, ended = run_episodes(envs, made, lambda info: [info[n] for n in names], settings.seed)
    period = settings.plant.control_period
    whole = [
        record[:, : len(reference), k]
        for k, reference in enumerate(references)
        if np.isfinite(record[0, :, k]).sum() == len(reference)
    ]
    return [Run(x[0], x[1], x[2], period, settings.settled) for x in whole], int(ended.sum())
