"""Search for settings: Optuna on tuning seeds, resumable, its budget written into the preset.

Each trial trains for a while with two seeds, which no policy that is reported has, and is scored
as :mod:`agents.training.evaluation` does, by the best policy of each training, as it would be
shipped; trials that lag behind the median of the others are stopped. The first trial is the preset
as it stands, so that what comes out is not worse where it was looked at. What a trial proposes
depends on the finished trials, its number and the seed alone: a search that was killed and resumed
goes the same way, and searches side by side propose different settings.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import statistics
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import optuna
from optuna.samplers import TPESampler
from optuna.storages import RDBStorage, RetryHeartbeatStaleTrialCallback
from optuna.trial import TrialState
from rich.console import Console
from stable_baselines3.common.logger import Logger

from agents.search import preset_text
from agents.search.spaces import as_settings, from_settings, space_of, with_settings
from agents.settings import presets as configs
from agents.settings.parts import Search
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from agents.training.building import make_env, make_model
from agents.training.callbacks import PeriodicCallback, WarmUp, score_of
from agents.training.evaluation import value_of

HEARTBEAT = 60
"""Seconds between the signs of life of a trial; after three without, it is given to another."""
RETRIES = 2
REPORTS = 5
"""How often a training is looked at before its end."""
DONE = (TrialState.COMPLETE, TrialState.PRUNED)
EARLIER = "earlier"
"""What a study keeps the trials under that led to the preset it began from."""
TRAINING_SEEDS = (10_000, 10_001)
"""Far from those that are reported: settings that suit one seed's luck win nothing there."""


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
        Control periods of each training.
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
        what = f"{config.env} {kind or config.algo} {self.steps} steps, seed {self.seed}"
        return f"{what}, {self.fixed()}"

    def fixed(self) -> str:
        """Return a digest of the settings that are not searched."""
        common = {name: range_.common for name, range_ in space_of(self.config).items()}
        plain = with_settings(self.config, as_settings(self.config, common)).as_dict()
        for name in ("steps", "checkpoint_steps", "search"):
            plain.pop(name, None)
        first, last = plain[self.config.algo].pop("learning_rate")
        plain["last_rate"] = f"{last / first:.1g}"
        return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:12]


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

    def one(trial: optuna.Trial) -> float:
        study.sampler = TPESampler(seed=1000 * job.seed + trial.number, n_startup_trials=8)
        return objective(job, trial)

    while finished(study) < job.trials:
        study.optimize(one, n_trials=1)
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
        before = job.config.search
        study.set_user_attr(EARLIER, (before.trials or 0) + before.earlier)
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
    worth = []
    for turn, seed in enumerate(TRAINING_SEEDS):
        reports = Reports(config, trial, turn * job.steps)
        worth.append(_trained(config, seed, reports))
    return statistics.fmean(worth)


def _trained(config: Config, seed: int, reports: Reports) -> float:
    """Train and return what the best policy that was looked at is worth."""
    env = make_env(config)
    model = make_model(config, seed, env)
    model.set_logger(Logger(None, []))
    model.learn(config.steps, callback=[WarmUp(config), reports])
    reports.look()
    env.close()
    return min(reports.values)


class Reports(PeriodicCallback):
    """Tells the search how a trial does, and stops it if it is told to.

    Parameters
    ----------
    config : Config
    trial : optuna.Trial
    before : int
        Control periods of the trial's trainings before this one.

    Attributes
    ----------
    values : list of float
        What the policies were worth that were looked at.
    """

    def __init__(self, config: Config, trial: optuna.Trial, before: int) -> None:
        super().__init__(max(config.steps // REPORTS, 1))
        self.config = config
        self.trial = trial
        self.before = before
        self.values: list[float] = []
        self.travel: float | None = None

    def _on_training_start(self) -> None:
        super()._on_training_start()
        if self.config.residual.controller:
            self.travel = score_of(self.model, self.config).travel

    def look(self) -> None:
        """Evaluate now."""
        score = score_of(self.model, self.config)
        self.values.append(value_of(score, self.config, self.travel))

    def act(self) -> None:
        """Evaluate and report now."""
        self.look()
        self.trial.report(self.values[-1], self.before + self.model.num_timesteps)
        if self.trial.should_prune():
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
        earlier=study.user_attrs.get(EARLIER, 0),
        steps=job.steps,
        seed=job.seed,
        note=f"Optuna TPE, {len(TRAINING_SEEDS)} trainings a trial, each looked at in "
        f"{job.config.evaluation.episodes} episodes on tuning seeds",
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
