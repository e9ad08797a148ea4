"""What a plant gets wrong on a recording, why, the better plant, and what it gains."""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.data.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import gain as loops
from pam_envs.diagnosis.audit import audit, undecidable
from pam_envs.diagnosis.calibrate import calibrate
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.experiment import propose
from pam_envs.diagnosis.fitting import Fit, Problem, column_of
from pam_envs.diagnosis.held_out import HeldOut, choose
from pam_envs.diagnosis.isolability import Isolability, isolability
from pam_envs.diagnosis.noise import ChannelFloor, Floor, noise_floor
from pam_envs.diagnosis.rule import Rule
from pam_envs.diagnosis.search import Blocks, Candidate, refit
from pam_envs.diagnosis.single_muscle import KELVIN, MuscleFamily, inputs_of, start_plant
from pam_envs.diagnosis.structure import Regressors
from pam_envs.diagnosis.summary import report_of
from pam_envs.diagnosis.verdict import Decision, decide, traces_of
from pam_envs.mechanics.hanging_mass import GRAVITY
from pam_envs.plants.single_muscle import SingleMuscle

Array = NDArray[np.float64]

UNDECLARED, BELIEVED = 1.15, 1.5
"""Noise over what repeats or holds show: where none is declared, and the most that is believed."""
LEAST_SIZE = 1.0
"""A cause that cannot reach this size over the noise within its bounds is not testable."""
LEAST_TESTABLE = 5
"""With fewer testable causes a recording decides nothing."""


@dataclass(frozen=True)
class Traces:
    """What a report draws; arrays of shape (T,) in SI.

    Attributes
    ----------
    time, command, load : ndarray
        [s], [Pa], [N].
    segment : ndarray of int
        Index into ``segments``.
    segments : tuple of str
        Labels.
    held_out : ndarray of bool
        Samples of the kinds of experiment that the reported errors are of.
    temperature : ndarray or None
        [deg C].
    measured, base, extended : dict of str to ndarray
        By output.
    effects : dict of str to dict of str to ndarray
        Contribution of each named cause, by output.
    """

    time: Array
    segment: NDArray[np.int64]
    segments: tuple[str, ...]
    held_out: NDArray[np.bool_]
    command: Array
    load: Array
    temperature: Array | None
    measured: dict[str, Array]
    base: dict[str, Array]
    extended: dict[str, Array]
    effects: dict[str, dict[str, Array]]


@dataclass(frozen=True)
class Diagnosis:
    """The outcome.

    Attributes
    ----------
    verdict : {"adequate", "named", "ambiguous", "unexplained", "insufficient"}
        In a word.
    text : str
        In a few sentences.
    causes : tuple of str
        Names of the causes, in the order of evidence.
    report : dict
        All that ``report.json`` holds (``docs/diagnosis_report.md``).
    base, plant : SingleMuscle
        The refitted plant, and that with the causes in it; the same where there are none.
    traces : Traces
        What the figures draw.
    """

    verdict: str
    text: str
    causes: tuple[str, ...]
    report: dict[str, Any]
    base: SingleMuscle
    plant: SingleMuscle
    traces: Traces
    models: dict[str, Any] = field(default_factory=dict, repr=False)

    def write(self, folder: str | Path) -> None:
        """Write ``report.json``, ``report.html`` and ``plant.yaml``."""
        from pam_envs.diagnosis.report import write

        write(self, Path(folder))


@contextmanager
def _steps(progress: bool) -> Iterator[Callable[[str], None]]:
    """Give a function that shows what is being done."""
    if not progress:
        yield lambda text: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, transient=True) as bar:
        task = bar.add_task("reading", total=7)

        def step(text: str) -> None:
            bar.update(task, description=text, advance=1)

        yield step


def diagnose(
    recording: Recording,
    plant: SingleMuscle | None = None,
    *,
    rig: Rig | None = None,
    design: Callable[..., Any] | None = None,
    causes: Sequence[Cause] | None = None,
    seed: int = 0,
    progress: bool = True,
    simulated: Any = None,
    oracle: Any = None,
    rule: Rule | None = None,
    closed_loop: bool = True,
) -> Diagnosis:
    """Replay a recording through a plant and say what the plant gets wrong.

    Parameters
    ----------
    recording : Recording
        See :func:`pam_envs.data.recording.load_recording`.
    plant : SingleMuscle, optional
        Whose present parameters are refitted; what is not neutral in it counts as present.
        Default: the shipped muscle, scaled to the rig's, without any effect.
    rig : Rig, optional
        What is known of the rig; see :class:`pam_envs.data.rig_file.Rig`.
    design : callable, optional
        From a plant to a controller, for the comparison in closed loop
        (:mod:`pam_envs.diagnosis.gain`).
    causes : sequence of Cause, optional
        Default: :func:`pam_envs.diagnosis.causes.catalogue`.
    seed : int
        Of all draws.
    progress : bool
        Show a bar.
    simulated : object, optional
        The rig itself, where it can be run (:class:`pam_envs.diagnosis.gain.Rig`).
    oracle : SingleMuscle or Simulated, optional
        What the rig really is, where that is known.
    rule : Rule, optional
        Numbers of the decision.
    closed_loop : bool
        Whether to compare controllers.

    Returns
    -------
    Diagnosis

    Raises
    ------
    ValueError
        If the data cannot be used; the sentences name rows and remedies.
    """
    started = clock.perf_counter()
    rule, sheet = rule or Rule(), rig or Rig()
    if causes is None:
        from pam_envs.diagnosis.causes import catalogue

        causes = catalogue()
    with _steps(progress) as step:
        step("checking the data")
        checked = audit(recording, sheet)
        if checked.problems:
            raise ValueError("the recording cannot be used: " + " ".join(checked.problems))
        floor = noise_floor(recording, sheet)
        step("refitting the plant")
        start = plant if plant is not None else start_plant(sheet)
        study = Study.begin(recording, sheet, start, floor)
        step("which causes can be told apart")
        study.exclude(list(causes), recording, sheet)
        step("fitting rival causes")
        study.decide(rule, seed)
        step("held-out experiments")
        study.hold_out()
        step("the next experiment, and closed loop")
        study.experiment(sheet)
        if closed_loop:
            study.close_loop(design, simulated, oracle, seed)
        report = report_of(study, rule, seed, (*checked.warnings, *floor.warnings))
    report["runtime_s"] = clock.perf_counter() - started
    return Diagnosis(
        verdict=report["verdict"],
        text=report["text"],
        causes=tuple(c["name"] for c in report["causes"]),
        report=report,
        base=study.plant_of(study.base),
        plant=study.plant_of(study.model),
        traces=study.traces(),
        models={"study": study},
    )


def _noise(floor: ChannelFloor) -> float:
    """Return the noise that residuals are weighed by.

    Repeats and holds are short: they miss its slow part. What is declared counts as long as the
    data do not contradict it.
    """
    if floor.declared is None:
        return UNDECLARED * floor.value
    return float(np.clip(floor.declared, floor.value, BELIEVED * floor.value))


@dataclass
class Study:
    """A diagnosis on its way: each stage adds its part."""

    recording: Recording
    sheet: Rig
    start: SingleMuscle
    floor: Floor
    family: MuscleFamily
    problem: Problem
    blocks: Blocks
    base: Candidate
    regressors: Regressors
    causes: list[Cause] = field(default_factory=list)
    not_testable: dict[str, str] = field(default_factory=dict)
    isolability: Isolability | None = None
    decision: Decision | None = None
    held: HeldOut | None = None
    proposal: dict[str, Any] | None = None
    loop: dict[str, Any] | None = None

    @classmethod
    def begin(cls, recording: Recording, sheet: Rig, plant: SingleMuscle, floor: Floor) -> Study:
        """Refit the plant's present parameters."""
        family = MuscleFamily(plant, inputs_of(recording, sheet))
        measured = np.full((len(family.channels), len(recording.time)), np.nan)
        noise = np.empty(len(family.channels))
        for k, (channel, fallback) in enumerate(
            zip(family.channels, family.fallback_noise, strict=True)
        ):
            values = getattr(recording, channel)
            noise[k] = fallback
            if values is not None:
                measured[k] = np.where(recording.filled, np.nan, values)
                noise[k] = max(_noise(floor[channel]), 1e-3 * fallback)
        ticks = np.asarray(np.arange(len(recording.time)) * recording.period, np.float64)
        blocks = Blocks.make(ticks, measured)
        family, problem, base = calibrate(family, measured, noise, blocks, ticks)
        column = column_of(base.fit, base.fit.z)[None]
        problem.tie(column)
        outputs = family.simulate(column)[:, :, 0]
        regressors = Regressors.make(
            ticks, recording.command, outputs, recording.load, recording.temperature
        )
        return cls(recording, sheet, plant, floor, family, problem, blocks, base, regressors)

    def floor_of(self, channel: str) -> tuple[float, str]:
        """Return the error [m], [Pa] of a perfect model, and what says so."""
        floor = self.floor[channel]
        believed = floor.declared is not None and floor.declared > floor.value
        return (_noise(floor), "declared") if believed else (floor.value, floor.source)

    @property
    def model(self) -> Candidate:
        """The base with what was decided to be missing."""
        return self.base if self.decision is None else self.decision.model

    def plant_of(self, candidate: Candidate) -> SingleMuscle:
        """Return a candidate's plant."""
        return self.family.plant_of(self.column(candidate.fit))

    def column(self, fit: Fit) -> Array:
        """Return a fit's parameters, tied."""
        columns = column_of(fit, fit.z)[None]
        self.problem.tie(columns)
        return np.asarray(columns[0])

    def outputs(self, candidate: Candidate) -> Array:
        """Return what the sensors would show, shape (channels, T)."""
        return self.family.simulate(self.column(candidate.fit)[None])[:, :, 0]

    def exclude(self, causes: list[Cause], recording: Recording, sheet: Rig) -> None:
        """Leave out what the recording cannot show."""
        reasons = undecidable(recording, sheet)
        present = {f.name for f in self.base.fit.frees}
        for cause in causes:
            if all(any(t.name in present for t in form.terms) for form in cause.forms):
                reasons[cause.name] = "it is a parameter of the plant already: see calibration"
        left = [c for c in causes if c.name not in reasons]
        self.isolability = isolability(self.problem, self.family, self.base.fit, left)
        reach = dict(zip(self.isolability.names, self.isolability.reach, strict=True))
        for cause in left:
            if cause.once and cause.forms[0].seeds is not None:
                continue
            if reach.get(cause.name, 0.0) < LEAST_SIZE:
                reasons[cause.name] = (
                    f"within its bounds it shows at most {reach.get(cause.name, 0.0):.2g} times "
                    "the noise here, once the plant is refitted"
                )
        self.not_testable = {c.name: reasons[c.name] for c in causes if c.name in reasons}
        self.causes = [c for c in causes if c.name not in reasons]

    def decide(self, rule: Rule, seed: int) -> None:
        """Compare rival causes."""
        moving = np.bincount(self.blocks.of, np.abs(np.diff(self.recording.command, prepend=0.0)))
        if (
            len(self.causes) < min(LEAST_TESTABLE, len(self.causes) + len(self.not_testable))
            or int(np.sum(self.blocks.held_out & (moving > 0.0))) < rule.least_blocks
        ):
            self.decision = Decision("insufficient", self.base)
            return
        self.decision = decide(
            self.problem,
            self.family,
            self.blocks,
            self.base,
            self.causes,
            self.regressors,
            rule,
            seed,
        )

    def hold_out(self) -> None:
        """Fit base and model again without some kinds of experiment."""
        once = any(c.once for c, _ in self.model.causes)
        rows = choose(self.recording, self.blocks) if not once else ~self.blocks.train
        problem = dataclasses.replace(self.problem, train=~rows)
        base = refit(problem, self.blocks, self.base)
        model = refit(problem, self.blocks, self.model) if self.model.causes else base
        self.held = HeldOut(rows, problem, base, model, "blocks" if once else "kinds")

    def experiment(self, sheet: Rig) -> None:
        """Look for the experiment that tells the open rivals apart."""
        decision = self.decision
        if decision is not None and decision.verdict == "ambiguous" and decision.open_rivals:
            self.proposal = propose(
                self.plant_of(decision.model),
                self.plant_of(decision.open_rivals[0]),
                ("+".join(decision.model.names), "+".join(decision.open_rivals[0].names)),
                self.problem.noise,
                self.causes,
            )

    def close_loop(
        self, design: Callable[..., Any] | None, simulated: Any, oracle: Any, seed: int
    ) -> None:
        """Compare controllers designed on the base and on the extended plant."""
        if not any(name in loops.COMPENSABLE for name in self.model.names):
            return
        held = self.held
        residuals = None
        if simulated is None and held is not None and np.isfinite(self.problem.measured[0]).any():
            rows = held.rows & np.isfinite(self.problem.measured[0])
            left = -held.problem.rows(held.model.fit.residual)[0][rows] * self.problem.noise[0]
            residuals = loops.Residuals(np.ascontiguousarray(left), self.recording.period)
        loads = self.recording.load[self.recording.load > 0.0]
        load = float(np.median(loads)) / GRAVITY if len(loads) else 0.0
        self.loop = loops.closed_loop(
            self.plant_of(self.base),
            self.plant_of(self.model),
            design,
            rig=simulated,
            oracle=oracle,
            residuals=residuals,
            load=load,
            kelvin=self._far_from_room(),
            seed=seed,
        )

    def _far_from_room(self) -> float | None:
        """Return the temperature [K] of the recording that is furthest from 20 deg C."""
        celsius = self.recording.temperature
        if celsius is None:
            return None
        return float(celsius[np.argmax(np.abs(celsius - 20.0))]) + KELVIN

    def traces(self) -> Traces:
        """Return what a report draws."""
        r, channels = self.recording, self.family.channels

        def split(values: Array) -> dict[str, Array]:
            return {
                c: np.asarray(v)
                for c, v, m in zip(channels, values, self.problem.measured, strict=True)
                if np.isfinite(m).any()
            }

        effects = traces_of(self.problem, self.family, self.base, self.model)
        return Traces(
            self.problem.time,
            r.segment,
            r.segments,
            self.held.rows if self.held is not None else np.zeros(len(r.time), bool),
            r.command,
            r.load,
            r.temperature,
            split(self.problem.measured),
            split(self.outputs(self.base)),
            split(self.outputs(self.model)),
            {name: split(trace) for name, trace in effects.items()},
        )
