"""Search for settings: Optuna on tuning seeds, resumable, its budget written into the preset.

Each trial trains for a while and is scored as :mod:`agents.evaluation` does; trials that lag
behind the median of the others are stopped. The first trial is the preset as it stands, so that
what comes out is not worse where it was looked at. What a trial proposes depends on the finished
trials and the seed alone: a search that was killed and resumed goes the same way.
"""

from __future__ import annotations

import dataclasses
import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import optuna
from optuna.samplers import TPESampler
from optuna.storages import RDBStorage, RetryHeartbeatStaleTrialCallback
from optuna.trial import TrialState
from rich.console import Console
from stable_baselines3.common.logger import Logger

from agents import configs, preset_text
from agents.building import make_env, make_model
from agents.callbacks import Now, score_of
from agents.configs import Config
from agents.evaluation import Score
from agents.parts import Search
from agents.search_spaces import as_settings, from_settings, space_of, with_settings
from agents.settings import SettingsError

HEARTBEAT = 60
"""Seconds between the signs of life of a trial; after three without, it is given to another."""
RETRIES = 2
REPORTS = 5
"""How often a trial is looked at before its end."""
DONE = (TrialState.COMPLETE, TrialState.PRUNED)
TRAINING_SEED = 0


@dataclass(frozen=True)
class Job:
    """A search.

    Attributes
    ----------
    config : Config
        The preset that it starts from.
    trials : int
        Settings to try, those of earlier calls counted in.
    steps : int
        Control periods of each.
    seed : int
        Of the sampler.
    storage : Path
        SQLite file; several processes may work on one.
    """

    config: Config
    trials: int
    steps: int
    seed: int
    storage: Path

    @property
    def name(self) -> str:
        """Name of the study: of everything that decides what a value means."""
        config = self.config
        kind = f"{config.algo}-{config.residual.controller}" if config.residual.controller else ""
        return f"{config.env} {kind or config.algo} {self.steps} steps, seed {self.seed}"


def search(job: Job, console: Console) -> optuna.Study:
    """Try settings until ``job.trials`` are done; return the study.

    Raises
    ------
    SettingsError
        If the preset has no evaluation to search by.
    """
    if not job.config.evaluation.episodes:
        raise SettingsError(
            "evaluation.episodes = 0: a search needs episodes on tuning seeds; set it above 0"
        )
    study = open_study(job)
    while (done := finished(study)) < job.trials:
        study.sampler = TPESampler(seed=1000 * job.seed + done, n_startup_trials=8)
        study.optimize(lambda trial: objective(job, trial), n_trials=1)
        console.print(f"{finished(study)} of {job.trials} trials, best {_best(study)}")
    return study


def open_study(job: Job) -> optuna.Study:
    """Return the study, made or found in the storage."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    job.storage.parent.mkdir(parents=True, exist_ok=True)
    storage = RDBStorage(
        f"sqlite:///{job.storage}",
        engine_kwargs={"connect_args": {"timeout": 60}},
        heartbeat_interval=HEARTBEAT,
        grace_period=3 * HEARTBEAT,
        heartbeat_stale_trial_callback=RetryHeartbeatStaleTrialCallback(max_retry=RETRIES),
    )
    study = optuna.create_study(
        storage=storage,
        study_name=job.name,
        load_if_exists=True,
        pruner=optuna.pruners.MedianPruner(n_startup_trials=8, n_warmup_steps=job.steps // 3),
    )
    if not study.trials:
        study.enqueue_trial(from_settings(job.config))
    return study


def finished(study: optuna.Study) -> int:
    """Return how many trials are done."""
    return len(study.get_trials(deepcopy=False, states=DONE))


def _best(study: optuna.Study) -> str:
    whole = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    return f"{study.best_value:.4g} in trial {study.best_trial.number}" if whole else "none"


def objective(job: Job, trial: optuna.Trial) -> float:
    """Return what a trial is worth: less is better."""
    values = {name: range_.suggest(trial, name) for name, range_ in space_of(job.config).items()}
    config = dataclasses.replace(
        with_settings(job.config, as_settings(job.config, values)), steps=job.steps
    )
    env = make_env(config)
    model = make_model(config, TRAINING_SEED, env)
    model.set_logger(Logger(None, []))
    model.learn(job.steps, callback=Reports(config, trial.report, trial.should_prune))
    worth = value_of(score_of(model, config), config)
    env.close()
    return worth


def value_of(score: Score, config: Config) -> float:
    """Return what is to be small, as ``evaluation.objective`` says; infinite if unknown.

    Every episode that a limit ended adds the whole error again; in a return it shows as it is.
    """
    objective = config.evaluation.objective
    if objective == "return":
        return -score.mean_return if math.isfinite(score.mean_return) else math.inf
    worth = statistics.geometric_mean(score.kinds) if objective == "geometric" else score.rms
    worth *= 1.0 + score.failures
    return worth if math.isfinite(worth) else math.inf


class Reports(Now):
    """Tells the search how a trial does, and stops it if it is told to."""

    def __init__(
        self, config: Config, report: Callable[[float, int], None], stop: Callable[[], bool]
    ) -> None:
        super().__init__(max(config.steps // REPORTS, 1))
        self.config = config
        self.report = report
        self.stop = stop

    def act(self) -> None:
        """Evaluate and report now."""
        worth = value_of(score_of(self.model, self.config), self.config)
        self.report(worth, self.model.num_timesteps)
        if self.stop():
            raise optuna.TrialPruned


def write(job: Job, study: optuna.Study, path: Path) -> Config:
    """Write the best settings and the budget into the preset's file; return the new preset.

    Raises
    ------
    SettingsError
        If the file would not say what it should; it is left as it was.
    """
    search_part = Search(
        trials=finished(study),
        steps=job.steps,
        seed=job.seed,
        note=f"Optuna TPE, {job.config.evaluation.episodes} episodes on tuning seeds",
    )
    best = as_settings(job.config, _chosen(job, study))
    changes: dict[str, Any] = {**best}
    changes |= {f"search.{name}": value for name, value in vars(search_part).items()}
    wanted = with_settings(job.config, changes)
    text = preset_text.edited(path.read_text(encoding="utf-8"), changes)
    if configs.from_text(text) != wanted:
        raise SettingsError(
            f"{path.name} is laid out otherwise than this can edit; put in by hand: {changes}"
        )
    path.write_text(text, encoding="utf-8")
    return wanted


def _chosen(job: Job, study: optuna.Study) -> dict[str, Any]:
    """Return the best trial's values, choices as values again."""
    fixed = optuna.trial.FixedTrial(study.best_params)
    return {name: range_.suggest(fixed, name) for name, range_ in space_of(job.config).items()}
