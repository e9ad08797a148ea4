"""Search over the knobs of a paper's controller, its free parameters, on tuning seeds.

Classical controllers are searched as learned ones are, by the same sampler, on the same seeds
(:mod:`agents.search.tune`, :mod:`agents.settings.seeds`), which no score is ever taken from. The
episodes are those of an environment's nominal track but for the seeds, or, on drawn plants, those
of its track with drawn plants.

The objective is the track's headline, a failed episode at the worst case, averaged over episodes
and geometrically over kinds of reference, whose errors may differ a hundredfold. A trial that
exceeds the controller as published counts as worse than it: a higher mean over all episodes, more
failures, or more than 1.1 times a cost, as for learned controllers. The first trial has all knobs
at 1, so the result is never worse on the tuning seeds.

A trial's proposal depends on the finished trials and the seed alone, so that an interrupted search
is resumed by the same command. One process at a time works on a search.
"""

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
from baselines.core.entry import Bounds, Knobs, Plants
from baselines.core.tuned import Tuned, tuned_name
from benchmarks.identity.hashing import digest
from benchmarks.runs import cells, controllers
from benchmarks.runs.controllers import Controller
from benchmarks.scenarios import kinds
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet
from benchmarks.scoring.metrics import COST_FLOOR, COST_RATIO, COSTS, headline_of
from pam_envs.envs.registration import full_id
from pam_envs.files import write_text
from sweeps.files import SOURCES, sources_digest
from sweeps.progress import Start

TRIALS = 20
EPISODES = 30
STARTUP = 8  # initial trials, drawn uniformly before the sampler uses their results
MOST_RATIO = 100.0  # upper limit of the excess of one cost
STORAGE = controllers.ROOT / "runs" / "tuning.db"
UNTUNED = "untuned"
SPLIT = "tuning"
DIGITS = 4  # significant digits of a factor


@dataclass(frozen=True)
class Job:
    """A search."""

    controller: str
    env: str
    trials: int = TRIALS  # settings to try, those of earlier calls counted in
    seed: int = 0  # of the sampler
    episodes: int = EPISODES  # of each trial, rounded up to as many for each scenario
    plants: Plants = "nominal"  # of the episodes
    storage: Path = STORAGE  # SQLite file, which may hold searches of other controllers

    @property
    def bounds(self) -> Bounds:
        """Lowest and highest factor of each knob."""
        return catalogue.PUBLISHED[self.controller].knobs

    @property
    def command(self) -> str:
        """Command that repeats the search."""
        said = f"python -m benchmarks tune {self.controller} --env {self.env}"
        more = "" if self.episodes == EPISODES else f" --episodes {self.episodes}"
        more += "" if self.plants == "nominal" else f" --plants {self.plants}"
        return f"{said} --trials {self.trials} --seed {self.seed}{more} --write"


def job_of(controller: str, env: str = "", **how: Any) -> Job:
    """Return a checked search; ``env`` may be short, or left out if there is only one."""
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


def track_of(env: str, plants: Plants = "nominal") -> ScenarioSet:
    """Return the track of an environment whose plant is the nominal model, or drawn around it."""
    made, kind = scenarios.available().values(), kinds.TUNED_ON[plants]
    found = [track for track in made if track.env == env and kinds.is_of(track.name, kind)]
    if len(found) != 1:
        raise ValueError(f"{env} has {len(found)} tracks named ..._{kind}; it needs one to tune on")
    return found[0]


@dataclass(frozen=True)
class Measured:
    """Result of a controller in the tuning episodes."""

    error: float  # headline's geometric mean over kinds of reference [SI]
    mean: float  # headline's mean over all episodes [SI]
    failures: int
    costs: Mapping[str, float]  # means over all episodes


class Course:
    """The tuning episodes of a controller in a track, equally many for each scenario."""

    def __init__(self, controller: str, track: ScenarioSet, episodes: int = EPISODES) -> None:
        entrant = controllers.find(controller)
        self.track, self.controller = track, controller
        shared = seeds_of(track, episodes)
        self.scenes = cells.scenes_of(
            cells.Cell(entrant, track, scenario, None, SPLIT, shared[scenario.name])
            for scenario in track.scenarios()
        )

    def measure(self, knobs: Knobs) -> Measured:
        """Run all episodes with the controller's knobs at these factors."""

        def design(scene: cells.Scene) -> Controller:
            model, base = scene.model, scene.env.unwrapped
            given = (model, base.signals, base.action_signals)
            return catalogue.make_controller(self.controller, *given, knobs=knobs)

        found = {}
        for scene, _, episodes in cells.run_scenes(self.scenes, design):
            (cell,) = scene.cells
            found[cell.scenario.name] = [
                cells.episode_record(cell, seed, episode)
                for seed, episode in zip(cell.seeds, episodes, strict=True)
            ]
        kinds: dict[str, list[Mapping[str, Any]]] = defaultdict(list)
        for scenario in self.track.scenarios():
            kinds[str(scenario.kwargs.get("reference", ""))] += found[scenario.name]
        return measured(kinds, headline_of(self.track.content))


def seeds_of(track: ScenarioSet, episodes: int) -> dict[str, tuple[int, ...]]:
    """Return the tuning seeds of each scenario: equally many for each, and none twice."""
    names = [scenario.name for scenario in track.scenarios()]
    each = -(-episodes // len(names))
    shared = tuning(each * len(names))
    return {name: tuple(shared[i :: len(names)]) for i, name in enumerate(names)}


def measured(kinds: Mapping[str, Sequence[Mapping[str, Any]]], headline: str) -> Measured:
    """Return the result of episodes, by kind of reference."""
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


def search(job: Job, measure: Callable[[Knobs], Measured], start: Start | None = None) -> Tuned:
    """Try settings until ``job.trials`` are done by :meth:`Course.measure`; return the best."""
    study = open_study(job)
    if UNTUNED not in study.user_attrs:  # the published controller, measured once in a search
        study.set_user_attr(UNTUNED, dataclasses.asdict(measure({})))
    untuned = Measured(**study.user_attrs[UNTUNED])
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
    code = [
        sources_digest([controllers.ROOT / "baselines"], SOURCES - {tuned.FILE.suffix}),
        sources_digest([controllers.ROOT / "pam_envs"], SOURCES),
    ]
    bounds = {name: list(ends) for name, ends in job.bounds.items()}
    content = track_of(job.env, job.plants).content
    task = digest([content, bounds, code])  # excluding results of searches
    entry = tuned_name(job.controller, job.env, job.plants)
    name = f"{entry}, {job.episodes} episodes, seed {job.seed}"
    study = optuna.create_study(
        storage=RDBStorage(url, engine_kwargs=patience),
        study_name=f"{name}, {task[:12]}",
        load_if_exists=True,
    )
    for lost in study.get_trials(deepcopy=False, states=(TrialState.RUNNING,)):
        study.tell(lost.number, state=TrialState.FAIL)  # otherwise the sampler would count it
    return study


def _finished(study: optuna.Study) -> list[optuna.trial.FrozenTrial]:
    return study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))


def _proposed(trial: Any, bounds: Bounds) -> dict[str, float]:
    """Return the factors that a trial proposes: log-uniform, rounded."""
    drawn = {name: trial.suggest_float(name, *ends, log=True) for name, ends in bounds.items()}
    return {name: float(f"{value:.{DIGITS}g}") for name, value in drawn.items()}


def _found(job: Job, study: optuna.Study) -> Tuned:
    best = min(_finished(study), key=lambda trial: (trial.value, trial.number))
    return Tuned(
        controller=job.controller,
        env=job.env,
        knobs=_proposed(optuna.trial.FixedTrial(best.params), job.bounds),
        bounds=dict(job.bounds),
        trials=len(_finished(study)),
        seed=job.seed,
        before=float(f"{study.user_attrs[UNTUNED]['error']:.6g}"),
        after=float(f"{best.value:.6g}"),
        command=job.command,
        plants=job.plants,
    )


def sentence(found: Tuned) -> str:
    """Return the result of a search in one line."""
    turned = ", ".join(f"{name} {value:g}" for name, value in found.knobs.items())
    change = f"{found.before:.4g} to {found.after:.4g} in {found.trials} trials"
    edge = f"; on a bound: {', '.join(found.on_bounds)}: widen it" if found.on_bounds else ""
    return f"{found.name}: {change}, with {turned}{edge}"


def _record(found: Tuned) -> dict[str, Any]:
    """Return the entry of a result, without the plants if they are nominal."""
    record = dataclasses.asdict(found)
    return record if found.plants != "nominal" else {k: record[k] for k in record if k != "plants"}


def write(found: Tuned, file: Path = tuned.FILE) -> None:
    """Write the result of a search into the catalogue's file, in place of an older one."""
    with FileLock(file.with_name(f".{file.name}.lock")):
        text = file.read_text(encoding="utf-8")
        entries = tuned.read(file) | {found.name: found}
        tuned.entries(catalogue.PUBLISHED, entries)  # raises if one is invalid
        head = [line for line in text.splitlines() if line.startswith("#")]
        plain = {name: _record(entries[name]) for name in sorted(entries)}
        content = {"schema": tuned.SCHEMA, "tuned": plain}
        body = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=1000)
        write_text(file, "\n".join([*head, body]))
