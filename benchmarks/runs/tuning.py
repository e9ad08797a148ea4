"""Search the knobs of a paper's controller, the numbers that it leaves free, on tuning seeds.

The settings of learned controllers are searched for; so that classical ones have the same chance,
this gives them as many trials, by the same sampler, on the same seeds
(:mod:`agents.search.tune`, :mod:`agents.settings.seeds`). The episodes are those of an
environment's nominal track but for their seeds, which no score is ever taken from, and they are
scored by the same code.

The objective is the track's headline, a failed episode at the worst case, averaged over episodes
and geometrically over kinds of reference, whose errors may differ a hundredfold. A trial that
exceeds what the controller as published needs counts as worse than that one: a higher mean over all
episodes, more failures, or more than 1.1 times a cost, which is what learned controllers are held
to. The first trial has all knobs at 1. So what is found is never worse where it was looked at.

What a trial proposes depends on the finished trials and the seed alone: a search that was
interrupted goes on with the same command, the same way. One process at a time works on a search;
those of several controllers may run side by side.
"""

from __future__ import annotations

import dataclasses
import statistics
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import optuna
import yaml
from filelock import FileLock
from optuna.samplers import TPESampler
from optuna.storages import RDBStorage
from optuna.trial import TrialState

from agents.settings.seeds import MOST_TUNING, tuning
from baselines.core import catalogue, tuned
from baselines.core.knobs import Bounds, Knobs
from baselines.core.tuned import Tuned, tuned_name
from benchmarks.identity.hashing import SOURCES, digest, sources_digest
from benchmarks.runs import cells, controllers
from benchmarks.runs.store import write_text
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scenarios.scenario_env import make_env, model_of
from benchmarks.scoring.metrics import COST_FLOOR, COST_RATIO, COSTS, headline_of
from pam_envs.envs.registration import full_id
from sweeps.progress import Start

TRIALS = 20
EPISODES = 30
STARTUP = 8
"""Trials that are drawn evenly before the sampler learns from them."""
MOST_RATIO = 100.0
"""Largest ratio of a cost that counts."""
STORAGE = controllers.ROOT / "runs" / "tuning.db"
UNTUNED = "untuned"
SPLIT = "tuning"
DIGITS = 4
"""Of a factor, as a person would write it."""


@dataclass(frozen=True)
class Job:
    """A search.

    Attributes
    ----------
    controller : str
        By its name in the catalogue, one with knobs.
    env : str
        Id of the environment.
    trials : int
        Settings to try, those of earlier calls counted in.
    seed : int
        Of the sampler.
    episodes : int
        Of each trial, rounded up to as many for each scenario.
    storage : Path
        SQLite file; searches of other controllers may be in it.
    """

    controller: str
    env: str
    trials: int = TRIALS
    seed: int = 0
    episodes: int = EPISODES
    storage: Path = STORAGE

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest factor of each knob."""
        return catalogue.PUBLISHED[self.controller].knobs

    @property
    def command(self) -> str:
        """Command that repeats the search."""
        said = f"python -m benchmarks tune {self.controller} --env {self.env}"
        more = "" if self.episodes == EPISODES else f" --episodes {self.episodes}"
        return f"{said} --trials {self.trials} --seed {self.seed}{more} --write"


def job_of(controller: str, env: str = "", **how: Any) -> Job:
    """Return a search, its arguments checked.

    Parameters
    ----------
    controller : str
    env : str
        Id of the environment, or its last part; optional if there is only one.
    **how
        The rest of :class:`Job`.

    Raises
    ------
    ValueError
        If there is no such controller, it has no knobs, the environment is not one of its own, or
        a number is out of its bounds.
    """
    entry = catalogue.PUBLISHED.get(controller)
    if entry is None or not entry.knobs:
        known = [name for name, other in catalogue.PUBLISHED.items() if other.knobs]
        what = "has no knobs" if entry else "is no controller of the catalogue"
        raise ValueError(f"{controller} {what}; choose from {', '.join(known)}")
    own = [name for name in entry.envs if not env or name == full_id(env)]
    if len(own) != 1:
        said = f"not in {env}" if env else "in several environments"
        raise ValueError(f"{controller} runs {said}; give --env as one of {', '.join(entry.envs)}")
    job = Job(controller, own[0], **how)
    if job.trials < 1 or not 1 <= job.episodes <= MOST_TUNING // 2:
        raise ValueError(
            f"trials = {job.trials} must be at least 1, and episodes = {job.episodes} from 1 to "
            f"{MOST_TUNING // 2}: --trials {TRIALS} --episodes {EPISODES} is what presets have"
        )
    return job


def nominal_track(env: str) -> ScenarioSet:
    """Return the track of an environment whose plant is the nominal model."""
    made = (track for track in scenarios.available().values() if track.env == env)
    found = [track for track in made if track.name.endswith("_nominal")]
    if len(found) != 1:
        raise ValueError(
            f"{env} has {len(found)} tracks named ..._nominal; it needs one to tune on"
        )
    return found[0]


# --- objective ------------------------------------------------------------------


@dataclass(frozen=True)
class Measured:
    """Result of a controller in the tuning episodes.

    Attributes
    ----------
    error : float
        The headline, geometric mean over kinds of reference of the mean over their episodes [SI].
    mean : float
        The headline's mean over all episodes [SI].
    failures : int
        Episodes that ended before their time.
    costs : mapping of float
        Means over all episodes of the costs that the track has.
    """

    error: float
    mean: float
    failures: int
    costs: Mapping[str, float]


class Course:
    """The tuning episodes of a controller in a track.

    Parameters
    ----------
    controller : str
        By its name in the catalogue.
    track : ScenarioSet
    episodes : int
        Rounded up to as many for each scenario.
    """

    def __init__(self, controller: str, track: ScenarioSet, episodes: int = EPISODES) -> None:
        entrant = controllers.find(controller)
        self.track, self.controller = track, controller
        shared = seeds_of(track, episodes)
        self.cells = [
            cells.Cell(entrant, track, scenario, None, SPLIT, shared[scenario.name])
            for scenario in track.scenarios()
        ]
        self.envs = [make_env(track.env, cell.scenario.kwargs) for cell in self.cells]

    def measure(self, knobs: Knobs) -> Measured:
        """Run all episodes with the controller's knobs at these factors."""
        kinds: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
        for cell, env in zip(self.cells, self.envs, strict=True):
            kind = str(cell.scenario.kwargs.get("reference", ""))
            kinds[kind] += self._run(cell, env, knobs)
        return measured(kinds, self.track)

    def _run(self, cell: cells.Cell, env: Any, knobs: Knobs) -> list[dict[str, Any]]:
        model, base = model_of(self.track.env, cell.scenario, env), env.unwrapped
        given = (model, base.signals, base.action_signals)
        made = catalogue.make_controller(self.controller, *given, knobs=knobs)
        episodes = cells.episodes_of(cells.Group((cell,)), env, made)
        return [
            cells.episode_record(cell, seed, episode)
            for seed, episode in zip(cell.seeds, episodes, strict=True)
        ]


def seeds_of(track: ScenarioSet, episodes: int) -> dict[str, tuple[int, ...]]:
    """Return the tuning seeds of each scenario: as many for each, and none twice."""
    names = [scenario.name for scenario in track.scenarios()]
    each = -(-episodes // len(names))
    shared = tuning(each * len(names))
    return {name: tuple(shared[i :: len(names)]) for i, name in enumerate(names)}


def measured(kinds: Mapping[str, Sequence[Mapping[str, Any]]], track: ScenarioSet) -> Measured:
    """Return the result of episodes, by kind of reference."""
    headline = headline_of(track.content)
    records = [record for of_kind in kinds.values() for record in of_kind]

    def mean(metric: str, chosen: Sequence[Mapping[str, Any]]) -> float:
        return float(np.mean([record["scores"][metric] for record in chosen]))

    return Measured(
        error=statistics.geometric_mean(mean(headline, of_kind) for of_kind in kinds.values()),
        mean=mean(headline, records),
        failures=sum(bool(record["failed"]) for record in records),
        costs={name: mean(name, records) for name in COSTS if name in records[0]["scores"]},
    )


def worth(found: Measured, untuned: Measured) -> float:
    """Return the objective of a search [SI]; see this module."""
    excess = max(0.0, found.mean / untuned.mean - 1.0)
    excess += max(0, found.failures - untuned.failures)
    for name, cost in found.costs.items():
        floor = COST_FLOOR.get(name, 0.0)
        allowed = COST_RATIO * max(untuned.costs[name], floor)
        if cost > max(allowed, floor):
            excess += min(cost / allowed - 1.0, MOST_RATIO) if allowed else MOST_RATIO
    return max(found.error, untuned.error) * (1.0 + excess) if excess else found.error


# --- search -------------------------------------------------------------------------------


def search(job: Job, measure: Callable[[Knobs], Measured], start: Start | None = None) -> Tuned:
    """Try settings until ``job.trials`` are done; return the best.

    Parameters
    ----------
    job : Job
    measure : callable
        From knobs to their result; :meth:`Course.measure`.
    start : callable, optional
        Of a progress bar.
    """
    study = open_study(job)
    untuned = _untuned(study, measure)
    advance: Callable[[], None] = start(job.trials) if start else lambda: None
    for _ in _finished(study)[: job.trials]:
        advance()
    while (done := len(_finished(study))) < job.trials:
        if not done and not study.get_trials(states=(TrialState.WAITING,)):
            study.enqueue_trial(dict.fromkeys(job.bounds, 1.0))
        study.sampler = TPESampler(seed=1000 * job.seed + done, n_startup_trials=STARTUP)
        trial = study.ask()
        knobs = _proposed(trial, job.bounds)
        plain = all(value == 1.0 for value in knobs.values())
        study.tell(trial, worth(untuned if plain else measure(knobs), untuned))
        advance()
    return _found(job, study)


def open_study(job: Job) -> optuna.Study:
    """Return the study, made or found in the storage: of everything that a value depends on."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    job.storage.parent.mkdir(parents=True, exist_ok=True)
    url, patience = f"sqlite:///{job.storage}", {"connect_args": {"timeout": 60}}
    name = f"{tuned_name(job.controller, job.env)}, {job.episodes} episodes, seed {job.seed}"
    study = optuna.create_study(
        storage=RDBStorage(url, engine_kwargs=patience),
        study_name=f"{name}, {_task(job)[:12]}",
        load_if_exists=True,
    )
    for lost in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        study.tell(lost.number, state=TrialState.FAIL)  # the sampler would count it
    return study


def _task(job: Job) -> str:
    """Return the digest of track, bounds and code, without the results of searches."""
    folders = [[controllers.ROOT / "baselines"], [controllers.ROOT / "pam_envs"]]
    code = [
        sources_digest(folder, kinds)
        for folder, kinds in zip(folders, (SOURCES - {tuned.FILE.suffix}, SOURCES), strict=True)
    ]
    bounds = {name: list(ends) for name, ends in job.bounds.items()}
    return digest([nominal_track(job.env).content, bounds, code])


def _untuned(study: optuna.Study, measure: Callable[[Knobs], Measured]) -> Measured:
    """Return the result of the published controller, measured once in a search."""
    if UNTUNED not in study.user_attrs:
        study.set_user_attr(UNTUNED, dataclasses.asdict(measure({})))
    return Measured(**study.user_attrs[UNTUNED])


def _finished(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    return study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))


def _proposed(trial: Any, bounds: Bounds) -> dict[str, float]:
    """Return the factors that a trial proposes: evenly by their logarithm, to some digits."""
    drawn = {name: trial.suggest_float(name, *ends, log=True) for name, ends in bounds.items()}
    return {name: float(f"{value:.{DIGITS}g}") for name, value in drawn.items()}


def _found(job: Job, study: optuna.Study) -> Tuned:
    best = min(_finished(study), key=lambda trial: (trial.value, trial.number))
    return Tuned(
        controller=job.controller,
        env=job.env,
        knobs=_proposed(optuna.trial.FixedTrial(best.params), job.bounds),
        trials=len(_finished(study)),
        seed=job.seed,
        before=float(f"{study.user_attrs[UNTUNED]['error']:.6g}"),
        after=float(f"{best.value:.6g}"),
        command=job.command,
    )


def sentence(found: Tuned) -> str:
    """Return the result of a search in one line."""
    turned = ", ".join(f"{name} {value:g}" for name, value in found.knobs.items())
    change = f"{found.before:.4g} to {found.after:.4g} in {found.trials} trials"
    return f"{found.name}: {change}, with {turned}"


def write(found: Tuned, file: Path = tuned.FILE) -> None:
    """Write the result of a search into the catalogue's file, in place of an older one."""
    with FileLock(file.with_name(f".{file.name}.lock")):
        text = file.read_text(encoding="utf-8")
        entries = tuned.read(file) | {found.name: found}
        tuned.entries(catalogue.PUBLISHED, entries)  # raises if one is invalid
        head = [line for line in text.splitlines() if line.startswith("#")]
        plain = {name: dataclasses.asdict(entries[name]) for name in sorted(entries)}
        content = {"schema": tuned.SCHEMA, "tuned": plain}
        body = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=1000)
        write_text(file, "\n".join([*head, body]))
