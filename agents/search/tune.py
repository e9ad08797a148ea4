"""Hyper-parameter search with Optuna on tuning seeds, resumable.

A trial trains with two seeds that no reported policy has. Its value is the mean over both of the
best evaluation (:mod:`agents.training.evaluation`); trials behind the median are pruned. The first
trial is the preset itself, so the result is not worse on the tuning seeds. A proposal depends on
the finished trials, its number and the seed alone: a killed search resumes with the same
proposals, and parallel searches propose different settings.
"""

import dataclasses
import hashlib
import io
import json
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import optuna
from optuna.samplers import TPESampler
from optuna.storages import RDBStorage, RetryHeartbeatStaleTrialCallback
from optuna.trial import TrialState
from rich.console import Console
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedSeq
from stable_baselines3.common.logger import Logger

from agents.search.spaces import as_settings, common, from_settings, suggest, with_settings
from agents.settings import presets as configs
from agents.settings.parts import Search
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from agents.training.building import make_env, make_model
from agents.training.callbacks import PeriodicCallback, WarmUp, score_of
from agents.training.evaluation import value_of
from pam_envs.files import write_text

HEARTBEAT = 60
"""Heartbeat interval of a trial [s]; a trial is repeated after three missed heartbeats."""
RETRIES = 2
REPORTS = 5  # number of evaluations of a training before its end
DONE = (TrialState.COMPLETE, TrialState.PRUNED)
EARLIER = "earlier"  # study attribute: number of trials of earlier searches that led to its preset
TRAINING_SEEDS = (10_000, 10_001)  # apart from those of reported policies


@dataclass(frozen=True)
class Job:
    """A hyper-parameter search."""

    config: Config  # the initial preset
    trials: int  # number of settings to try, including those of earlier calls
    steps: int  # control periods of each training
    seed: int  # of the sampler
    storage: Path  # SQLite file, which several processes may share

    @property
    def name(self) -> str:
        """Name of the study; it identifies every setting that affects a trial's value."""
        config = self.config
        kind = f"{config.algo}-{config.residual.controller}" if config.residual.controller else ""
        what = f"{config.env} {kind or config.algo} {self.steps} steps, seed {self.seed}"
        return f"{what}, {self.fixed()}"

    def fixed(self) -> str:
        """Return a digest of the settings outside the search space."""
        point = as_settings(self.config, common(self.config))
        plain = with_settings(self.config, point).as_dict()
        for name in ("steps", "checkpoint_steps", "search"):
            plain.pop(name, None)
        first, last = plain[self.config.algo].pop("learning_rate")
        plain["last_rate"] = f"{last / first:.1g}"
        return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:12]


def search(job: Job, console: Console) -> optuna.Study:
    """Run trials until ``job.trials`` are finished; SettingsError without evaluations."""
    if not job.config.evaluation.episodes:
        raise SettingsError(
            "evaluation.episodes = 0: a search needs episodes on tuning seeds; set it above 0"
        )
    if job.config.adaptation.steps:
        raise SettingsError(
            "adaptation.steps > 0: a search evaluates PPO, not the student; search the preset "
            "without adaptation, for example robust"
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
    """Return the study in the storage, created if missing."""
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
    """Return the number of finished trials."""
    return len(study.get_trials(deepcopy=False, states=DONE))


def _best(study: optuna.Study) -> str:
    whole = study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
    return f"{study.best_value:.4g} in trial {study.best_trial.number}" if whole else "none"


def objective(job: Job, trial: optuna.Trial) -> float:
    """Return the value of a trial: less is better."""
    values = suggest(trial, job.config)
    config = dataclasses.replace(
        with_settings(job.config, as_settings(job.config, values)), steps=job.steps
    )
    return statistics.fmean(
        _trained(config, seed, Reports(config, trial, turn * job.steps))
        for turn, seed in enumerate(TRAINING_SEEDS)
    )


def _trained(config: Config, seed: int, reports: "Reports") -> float:
    """Train and return the value of the best evaluation."""
    env = make_env(config)
    model = make_model(config, seed, env)
    model.set_logger(Logger(None, []))
    model.learn(config.steps, callback=[WarmUp(config), reports])
    reports.evaluate()
    env.close()
    return min(reports.values)


class Reports(PeriodicCallback):
    """Report a trial's evaluations to Optuna, and stop a pruned trial."""

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

    def evaluate(self) -> None:
        """Evaluate now."""
        score = score_of(self.model, self.config)
        self.values.append(value_of(score, self.config, self.travel))

    def act(self) -> None:
        """Evaluate and report now."""
        self.evaluate()
        self.trial.report(self.values[-1], self.before + self.model.num_timesteps)
        if self.trial.should_prune():
            raise optuna.TrialPruned


def write(job: Job, study: optuna.Study, path: Path) -> Config:
    """Write the best settings and the budget into the preset's file; return the new preset."""
    search_part = Search(
        trials=finished(study),
        earlier=study.user_attrs.get(EARLIER, 0),
        steps=job.steps,
        seed=job.seed,
        note=f"Optuna TPE, {len(TRAINING_SEEDS)} trainings a trial, each evaluated in "
        f"{job.config.evaluation.episodes} episodes on tuning seeds",
    )
    changes = as_settings(job.config, study.best_params)
    changes |= {f"search.{name}": value for name, value in vars(search_part).items()}
    preset = with_settings(job.config, changes)
    text = edited(path.read_text(encoding="utf-8"), changes)
    if configs.from_text(text) != preset:
        raise SettingsError(
            f"{path.name} has a layout that this cannot edit; change it by hand: {changes}"
        )
    write_text(path, text)
    return preset


def edited(text: str, changes: Mapping[str, Any]) -> str:
    """Return YAML text with values changed by ``"section.entry"`` or ``"entry"``; keep comments."""
    file = YAML()
    file.indent(mapping=2, sequence=4, offset=2)
    file.width = 10**6
    file.preserve_quotes = True
    file.representer.add_representer(float, _float)
    held = file.load(text)
    for name, value in changes.items():
        section, _, entry = name.rpartition(".")
        part = held.setdefault(section, {}) if section else held
        part[entry] = _on_one_line(value) if isinstance(value, (list, tuple)) else value
    made = io.StringIO()
    file.dump(held, made)
    return made.getvalue()


def _on_one_line(values: Any) -> CommentedSeq:
    made = CommentedSeq(values)
    made.fa.set_flow_style()
    return made


def _float(representer: Any, value: float) -> Any:
    """Write floats with a decimal point, without which YAML 1.1 reads text."""
    digits = repr(value)
    text = digits.replace("e", ".0e") if "e" in digits and "." not in digits else digits
    return representer.represent_scalar("tag:yaml.org,2002:float", text)
