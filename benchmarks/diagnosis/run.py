"""Run of the diagnosis on drawn cases, with records on disk as checkpoints.

A record belongs to a case, a stage and the numbers of rule, causes and default plant: it is
computed again for another version of the rule. A failed case also has a record and counts as wrong.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosis import mutilated
from benchmarks.diagnosis.cases import Case, cases
from benchmarks.diagnosis.families.cases import PLACES, parts_of
from benchmarks.diagnosis.families.cases import cases as cases_of_families
from benchmarks.diagnosis.sources import WORLDS
from benchmarks.diagnosis.study import loops, needs_oracle, promised, study
from benchmarks.diagnosis.worlds import draws
from benchmarks.identity.hashing import digest
from benchmarks.runs import provenance
from benchmarks.runs.runner import Computing
from benchmarks.runs.store import Store, read_record
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.families.kinds import kind_named
from pam_envs.diagnosis.fit.single_muscle import start_plant
from sweeps import engine

HERE = Path(__file__).parents[1]
FOLDER = HERE / ".cells" / "diagnosis"
SHUFFLE = 20_260_101
ONE_JOB = Computing(jobs=1)

Study = Callable[[Case, Collection[str]], dict[str, Any]]
Advance = Callable[[], None]


@cache
def engine_digest() -> str:
    """Return the digest of the numbers that determine a diagnosis: rule, causes, default plant."""
    return digest([asdict(Rule()), _forms(catalogue()), start_plant(Rig()).digest()])


@cache
def family_digest(family: str) -> str:
    """Return the digest of the numbers that only the diagnosis of a family depends on."""
    kind = kind_named(family)
    plant = kind.start(Rig(plant=family))
    return digest([_forms(kind.causes(kind.catalogue)), plant.digest()])


def _forms(causes: Iterable[Cause]) -> list[Any]:
    return [(c.name, [[astuple(term) for term in form.terms] for form in c.forms]) for c in causes]


@dataclass(frozen=True)
class Task:
    """A stage of a case."""

    case: Case
    stage: str

    @property
    def key(self) -> str:
        """Digest of all inputs of the record; it is the record's file name."""
        parts = [self.case.record(), self.stage, engine_digest(), provenance.packages()]
        if self.case.world in PLACES:
            parts.append(family_digest(parts_of(self.case.world)[0]))
        return digest(parts)[:32]


@dataclass(frozen=True)
class Options:
    """Selection of cases to run."""

    chosen: str = "small"
    offset: int = 0
    kinds: tuple[str, ...] = ()
    names: tuple[str, ...] = ()  # of hidden effects
    loops: int = 0  # number of cases of every cause that are run in closed loop
    next: bool = False  # carry out the proposed experiments
    force: bool = False
    folder: Path = FOLDER
    computing: Computing = ONE_JOB
    worlds: tuple[str, ...] = ()
    each: Mapping[str, int] = field(default_factory=dict)  # cases of a kind in each world

    @property
    def whole(self) -> bool:
        """True if every case of the set is run."""
        return not (self.kinds or self.names or self.worlds or self.each)

    @property
    def arguments(self) -> str:
        """Arguments of the command that gives the same records."""
        given: dict[str, Any] = {"chosen": self.chosen, "offset": self.offset or None}
        given |= {"kind": " ".join(self.kinds), "name": " ".join(self.names)}
        each = " ".join(f"{kind} {number}" for kind, number in self.each.items())
        given |= {"world": " ".join(self.worlds), "each": each}
        given["loops"] = self.loops or None
        words = [f"--{name} {value}" for name, value in given.items() if value not in (None, "")]
        return " ".join(words + ["--next"] * self.next)


@dataclass
class Report:
    """Outcome of a run."""

    # one per case, with the sections of its further stages
    records: list[dict[str, Any]] = field(default_factory=list)
    computed: int = 0  # stages computed now
    found: int = 0  # stages already stored
    # failed cases, which count as wrong, with the reason
    failed: list[str] = field(default_factory=list)
    # cases of worlds whose effect does not reach its size, which are counted apart
    unmade: list[str] = field(default_factory=list)
    # corrupt records that were set aside and computed again
    quarantined: list[str] = field(default_factory=list)


def select(options: Options) -> list[Case]:
    """Return the cases to run, kinds and causes mixed."""
    drawn = _drawn(options)
    _known("kind", options.kinds, {case.kind for case in drawn})
    _known("effect", options.names, {name for case in drawn for name in case.names})
    _known("world", options.worlds, {case.world for case in drawn})
    matching = [
        case
        for case in drawn
        if (not options.kinds or case.kind in options.kinds)
        and (not options.names or set(options.names) & set(case.names))
        and (not options.worlds or case.world in options.worlds)
    ]
    order = np.random.default_rng(SHUFFLE).permutation(len(matching))
    return [matching[k] for k in order]


def _drawn(options: Options) -> list[Case]:
    """Return the cases of a set."""
    if options.chosen == "worlds":
        return draws.cases(options.offset, options.each)
    if options.chosen == "families":
        return cases_of_families(options.offset, options.each)
    if options.chosen == "mutilated":
        return mutilated.cases(options.offset)
    if options.each:
        raise ValueError("--each is for the set worlds or families; leave it out")
    return cases(options.chosen, options.offset)


def _known(what: str, given: Iterable[str], known: Collection[str]) -> None:
    for name in given:
        if name not in known:
            raise ValueError(f"no {what} is called {name!r}; there are {', '.join(sorted(known))}")


def run(
    options: Options,
    start: Callable[[int], Advance] = lambda total: lambda: None,
    act: Study = study,
) -> Report:
    """Compute the missing records by ``act``, and return all; ``start`` returns a callback."""
    store = Store(options.folder)
    chosen, report, before = select(options), Report(), set(store.quarantined())
    made = _stage("verdict", chosen, store, options, report, start, act)
    further = {
        "loop": _looped(chosen, options),
        "next": [case for case in chosen if options.next and promised(made[case])],
        "oracle": [case for case in chosen if case.world in WORLDS and needs_oracle(made[case])],
    }
    for stage, some in further.items():
        for case, record in _stage(stage, some, store, options, report, start, act).items():
            failed = record["failure"]
            made[case][stage] = {"failure": failed} if failed else record.get(stage)
    report.records = sorted(made.values(), key=lambda r: (r["case"]["seed"], r["case"]["kind"]))
    for record in filter(lambda record: record["failure"], report.records):
        apart = record.get("unmade") and record["case"]["world"]
        case = Case(**_tuples(record["case"]))
        (report.unmade if apart else report.failed).append(f"{case.title}: {record['failure']}")
    report.quarantined = sorted(set(store.quarantined()) - before)
    return report


def _tuples(case: dict[str, Any]) -> dict[str, Any]:
    return {**case, "names": tuple(case["names"]), "sizes": tuple(case["sizes"])}


def _looped(chosen: Sequence[Case], options: Options) -> list[Case]:
    """Return the first cases of every cause, in the order of the draw."""
    counts: Counter[tuple[str, ...]] = Counter()
    kept = set()
    for case in sorted(filter(loops, chosen), key=lambda case: case.seed):
        counts[case.names] += 1
        if counts[case.names] <= options.loops:
            kept.add(case)
    return [case for case in chosen if case in kept]


def _stage(
    stage: str,
    chosen: Sequence[Case],
    store: Store,
    options: Options,
    report: Report,
    start: Callable[[int], Advance],
    act: Study,
) -> dict[Case, dict[str, Any]]:
    """Return the records of a stage by case; compute the missing ones."""
    tasks = {case: Task(case, stage) for case in chosen}
    there = {} if options.force else {c: store.load(t.key) for c, t in tasks.items()}
    missing = [task for case, task in tasks.items() if there.get(case) is None]
    report.found += len(tasks) - len(missing)
    if missing:
        advance = start(len(missing))
        for _ in _computed(missing, store, options.computing.cluster, act):
            report.computed += 1
            advance()
    return {case: read_record(store.path(task.key)) for case, task in tasks.items()}


def _computed(
    missing: Sequence[Task], store: Store, cluster: engine.Cluster, act: Study
) -> Iterator[None]:
    """Compute records and store each on completion; a case whose workers die is a failed case."""
    tasks = {task.key: task for task in missing}
    for done in engine.run(partial(_made, act), missing, cluster):
        task = tasks[done.key]
        if done.lost:
            case = task.case.record()
            store.save(done.key, {"schema": 1, "case": case, "failure": done.error})
        elif done.error:
            raise ValueError(f"{task.case}: {done.error}")
        else:
            store.save(done.key, done.value)
        yield


def _made(act: Study, task: Task) -> dict[str, Any]:
    """Compute a record; called in workers."""
    return {**act(task.case, (task.stage,)), "stage": task.stage}
