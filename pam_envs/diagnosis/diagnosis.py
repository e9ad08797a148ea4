"""Diagnose model error from a recording; extend the plant; quantify the improvement."""

import time as clock
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from pam_envs.arrays import Array, Flags
from pam_envs.constants import CELSIUS, GRAVITY
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.noise import ChannelFloor, Floor, noise_floor
from pam_envs.diagnosis.cause import Cause, Form
from pam_envs.diagnosis.causes import selected
from pam_envs.diagnosis.closed_loop import gain as loops
from pam_envs.diagnosis.closed_loop import in_environment
from pam_envs.diagnosis.decide import isolability as iso
from pam_envs.diagnosis.decide.compare import p_value, possible_gain
from pam_envs.diagnosis.decide.flexible_base import FlexibleBase, shapes_of
from pam_envs.diagnosis.decide.held_out import HeldOut, choose, compared, hold_out, interleaved
from pam_envs.diagnosis.decide.isolability import not_testable, unseen_rivals
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.decide.screen import Screen
from pam_envs.diagnosis.decide.search import search
from pam_envs.diagnosis.decide.structure import Regressors
from pam_envs.diagnosis.decide.verdict import Decision, decide, effect_traces
from pam_envs.diagnosis.experiment.experiment import propose, rival_of
from pam_envs.diagnosis.families.kinds import kind_of
from pam_envs.diagnosis.fit import tolerance
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate
from pam_envs.diagnosis.fit.least_squares import Fit, Problem, column_of
from pam_envs.diagnosis.plant_protocol import Bound, Fitted, Kind
from pam_envs.diagnosis.report.outcome import Diagnosis, Traces, steps
from pam_envs.diagnosis.report.report import plain
from pam_envs.diagnosis.report.summary import report_of
from pam_envs.diagnosis.report.summary_causes import judged
from pam_envs.plants.core.plant import UnstableParameters

UNDECLARED, BELIEVED = 1.15, 1.5
"""Noise over the estimate from repeats or holds: without a declaration, and the largest declared
ratio that is accepted."""
THOROUGH = 3
"""Number of open rivals that are fitted to the training data as thoroughly as the model."""
ADVICE = (
    "the recording cannot be used: no muscle of this size moves as recorded, and the fit ended in "
    "a plant that cannot be simulated; check the units of contraction_mm, pressure_command_bar and "
    "load_N, and rest length, diameter and largest pressure in RIG.yaml"
)


def diagnose(
    recording: Recording,
    plant: Any = None,
    *,
    rig: Rig | None = None,
    design: Callable[..., Any] | None = None,
    causes: Sequence[Cause | str] | None = None,
    seed: int = 0,
    progress: bool = True,
    simulated: Any = None,
    oracle: Any = None,
    rule: Rule | None = None,
    closed_loop: bool = True,
) -> Diagnosis:
    """Replay a recording through a plant and diagnose the error of the plant.

    Parameters
    ----------
    recording : Recording
        See :func:`pam_envs.data.recording.recording.load_recording`.
    plant : Plant or Simulator, optional
        Plant to refit, of the rig's family; effects that are not neutral in it are part of the
        base. Or a simulator of any plant (:class:`pam_envs.diagnosis.Simulator`). Default: the
        shipped plant of the rig's family, scaled to the rig, without any effect.
    rig : Rig, optional
        Known properties of the rig; see :class:`pam_envs.data.rig_file.Rig`.
    design : callable, optional
        From a plant to a controller, for the comparison in closed loop
        (:mod:`pam_envs.diagnosis.closed_loop.gain`); for plants other than a single muscle from a
        plant and the signals of the environment
        (:data:`pam_envs.diagnosis.closed_loop.in_environment.Design`).
    causes : sequence of Cause or str, optional
        Causes, or names of shipped ones; :func:`pam_envs.diagnosis.causes.causes_in` reads those
        of a folder. Default: :func:`pam_envs.diagnosis.causes.catalogue`.
    seed : int
        Seed of all random draws.
    progress : bool
        Print the stages with the time since the start to stderr.
    simulated : object, optional
        The rig itself, if it can be run (:class:`pam_envs.diagnosis.closed_loop.gain.Rig`).
    oracle : Plant or Simulated, optional
        True plant of the rig, if it is known.
    rule : Rule, optional
        Thresholds of the decision.
    closed_loop : bool
        Whether to compare controllers.

    Returns
    -------
    Diagnosis
        Verdict, causes, report, refitted and extended plant.

    Raises
    ------
    ValueError
        If the data cannot be used; the sentences name rows and remedies.
    """
    started = clock.perf_counter()
    rule, sheet = rule or Rule(), rig or Rig()
    kind = kind_of(plant, sheet, declared=rig is not None)
    wanted = selected(causes, kind.catalogue)
    asked = kind.causes(wanted)
    absent = [cause.name for cause in wanted if cause.name not in {c.name for c in asked}]
    with threadpool_limits(1, "blas"), fit_failures_explained(), steps(progress) as step:
        step("checking the data")
        checked = kind.audit(recording, sheet).passed()
        floor = noise_floor(recording, sheet)
        step("refitting the plant")
        start = plant if plant is not None else kind.start(sheet)
        study = Study.begin(recording, sheet, start, floor, kind)
        study.rule, study.seed = rule, seed
        study.make_flexible(asked)
        step("isolability of causes")
        study.find_testable(asked, absent)
        step("fitting rival causes")
        study.decide()
        study.recheck_loads()
        step("held-out experiments")
        study.hold_out()
        step("next experiment, closed loop")
        optional = [("the proposal of an experiment", study.experiment)]
        if closed_loop:
            optional.append(
                (
                    "the comparison in closed loop",
                    lambda: study.close_loop(design, simulated, oracle),
                )
            )
        lost = [text for name, stage in optional if (text := failure_of(name, stage))]
        warnings = (study.short, *checked.warnings, *floor.warnings, *lost)
        report = report_of(study, rule, tuple(filter(None, warnings)))
        report = plain({**report, "runtime_s": clock.perf_counter() - started})
        return Diagnosis(
            verdict=report["verdict"],
            text=report["text"],
            causes=tuple(c["name"] for c in report["causes"]),
            report=report,
            base=study.identified(study.base),
            plant=study.identified(study.model),
            traces=study.traces(),
            study=study,
        )


def failure_of(name: str, stage: Callable[[], None]) -> str:
    """Run an optional stage; return a warning if it fails, since the verdict does not need it."""
    try:
        stage()
    except Exception as error:
        return f"{name} failed, and is missing in this report: {type(error).__name__}: {error}"
    return ""


@contextmanager
def fit_failures_explained() -> Iterator[None]:
    """Turn a fit that ends in a plant that cannot be simulated into an error on the data."""
    try:
        yield
    except (UnstableParameters, np.linalg.LinAlgError) as error:
        raise ValueError(ADVICE) from error


ORIFICES_REPLACE = "flow through the orifices of the valve is modelled instead"


def acting(causes: Sequence[Cause], plant: Any) -> tuple[list[Cause], list[str]]:
    """Return causes with the forms that act on a plant, and the names of those without any."""
    if getattr(plant, "air", "regulator") != "flow":
        return list(causes), []

    def acts(form: Form) -> bool:
        """Return whether no amount of a form is replaced."""
        return not any(term.amount and term.name in plant.inert for term in form.terms)

    made = [replace(c, forms=tuple(filter(acts, c.forms))) for c in causes]
    return [c for c in made if c.forms], [c.name for c in made if not c.forms]


LITTLE_LEFT = 0.25
"""Gain of a model that leaves only noise below which no other friction is tried."""
EXCHANGE = (0.06, 0.6)
"""Seconds before and after a change of the load that are not compared: a recording does not show
how the load was exchanged."""


def exchanges(recording: Recording) -> Flags:
    """Return the samples about a change of the load, shape (T,)."""
    n, period = len(recording.time), recording.period
    found = np.zeros(n, bool)
    for k in np.flatnonzero(np.diff(recording.load)) + 1:
        before, after = (int(np.ceil(seconds / period)) for seconds in EXCHANGE)
        found[max(0, k - before) : k + after] = True
    return found


def _noise(floor: ChannelFloor) -> float:
    """Return the noise that weights the residuals.

    Repeats and holds are short and miss the slow part of the noise, so that a declared value is
    used as long as the data do not contradict it.
    """
    if floor.declared is None:
        return UNDECLARED * floor.value
    return float(np.clip(floor.declared, floor.value, BELIEVED * floor.value))


@dataclass
class Study:
    """State of a diagnosis, completed stage by stage."""

    recording: Recording
    sheet: Rig
    kind: Kind
    start: Any
    floor: Floor
    fitted: Fitted
    blocks: Blocks
    base: Candidate
    normal: Candidate  # the base with the common differences that the recording needs
    regressors: Regressors
    driving: tuple[str, Array] | None = None  # label and values of the signal that drives loops
    rule: Rule = field(default_factory=Rule)
    seed: int = 0
    asked: list[Cause] = field(default_factory=list)
    causes: list[Cause] = field(default_factory=list)  # those that the recording can show
    not_testable: dict[str, str] = field(default_factory=dict)
    unseen: list[Cause] = field(default_factory=list)  # causes that lack their experiment
    isolability: iso.Isolability | None = None
    short: str = ""
    decision: Decision | None = None
    reference: Candidate | None = None  # a better base, if the decision's has other friction
    held: HeldOut | None = None
    compared: HeldOut | None = None
    proposal: dict[str, Any] | None = None
    loop: dict[str, Any] | None = None
    loop_reason: str | None = "it was not requested"

    @classmethod
    def begin(
        cls, recording: Recording, sheet: Rig, plant: Any, floor: Floor, kind: Kind | None = None
    ) -> "Study":
        """Fit the base parameters of a plant to a recording."""
        kind = kind_of(plant, sheet) if kind is None else kind
        family = kind.bind(plant, recording, sheet)
        fallbacks = {output.name: output.noise for output in kind.outputs}
        measured = np.full((len(family.channels), len(recording.time)), np.nan)
        noise = np.empty(len(family.channels))
        for k, channel in enumerate(family.channels):
            values = recording.reading(channel)
            noise[k] = fallbacks[channel]
            if values is not None:
                measured[k] = np.where(recording.filled, np.nan, values)
                if channel == "contraction":
                    measured[k][exchanges(recording)] = np.nan
                noise[k] = max(_noise(floor[channel]), 1e-3 * fallbacks[channel])
        measured = kind.compared(measured, family, recording.restart)
        ticks = np.asarray(np.arange(len(recording.time)) * recording.period, np.float64)
        blocks = Blocks.make(ticks, measured)
        shapes = shapes_of(recording, sheet)
        fitted = kind.calibrate(family, measured, noise, blocks, ticks, shapes)
        problem, base = fitted.problem, fitted.base
        column = column_of(base.fit, base.fit.z)[None]
        problem.tie(column)
        outputs = fitted.family.simulate(column)[:, :, 0]
        found = fitted.family.signals(recording, outputs)
        regressors = Regressors.make(
            ticks, found.command, found.outputs, found.load, found.temperature, found.drive
        )
        data = (recording, sheet, kind, plant, floor, fitted, blocks, base, base, regressors)
        return cls(*data, found.shown)

    def floor_of(self, channel: str) -> tuple[float, str]:
        """Return the error [m], [Pa] of a perfect model, and its source."""
        floor = self.floor[channel]
        believed = floor.declared is not None and floor.declared > floor.value
        return (_noise(floor), "declared") if believed else (floor.value, floor.source)

    @property
    def model(self) -> Candidate:
        """The base with the causes of the decision."""
        return self.normal if self.decision is None else self.decision.model

    def plant_of(self, candidate: Candidate) -> Any:
        """Return the plant of a candidate."""
        return self.family.plant_of(self.column(candidate.fit))

    def identified(self, candidate: Candidate) -> Any:
        """Return the plant of a candidate with the provenance of its fitted parameters."""
        digest = self.recording.digest[:12]
        source = f"pam-envs diagnose, recording {digest}, rule {self.rule.version}"
        return self.family.identified(self.plant_of(candidate), candidate.fit.frees, source)

    def column(self, fit: Fit) -> Array:
        """Return the completed parameter column of a fit."""
        columns = column_of(fit, fit.z)[None]
        self.problem.tie(columns)
        return np.asarray(columns[0])

    def outputs(self, candidate: Candidate) -> Array:
        """Return the simulated readings of a candidate, shape (channels, T)."""
        return self.family.simulate(self.column(candidate.fit)[None])[:, :, 0]

    @property
    def family(self) -> Bound:
        """The plant with the inputs of the recording."""
        return self.fitted.family

    @property
    def problem(self) -> Problem:
        """Readings and simulation of the fits."""
        return self.fitted.problem

    @property
    def flexible(self) -> FlexibleBase:
        """Selection of the differences in which rigs commonly depart from the base."""
        data = (self.problem, self.family, self.blocks, self.base, self.rule)
        made = self.fitted
        starts = made.guesses, made.shown, made.linear, made.begins, made.others
        return FlexibleBase(*data, *starts)

    def make_flexible(self, causes: Sequence[Cause]) -> None:
        """Add the common differences that the recording needs to the base."""
        self.asked = list(causes)
        self.normal = self.flexible.select(causes)

    def find_testable(self, causes: Sequence[Cause], absent: Sequence[str] = ()) -> None:
        """Keep the causes that the recording can show; the plant has none of the ``absent``."""
        causes, replaced = acting(causes, self.family.plant)
        data = (self.problem, self.family, self.normal.fit, causes, self.recording, self.sheet)
        unmet = self.family.unmet_needs(self.recording, self.sheet)
        self.isolability, self.not_testable = not_testable(*data, unmet)
        self.not_testable |= dict.fromkeys(absent, "this plant has no parameter of it")
        self.not_testable |= dict.fromkeys(replaced, ORIFICES_REPLACE)
        self.causes = [c for c in causes if c.name not in self.not_testable]
        self.unseen = unseen_rivals(*data, unmet)

    def recheck_loads(self) -> None:
        """Repeat the decision with loads refitted within their tolerance if they may explain it."""
        if self.decision is None or not self.kind.weighed:
            return
        known, loads = self.sheet.tolerance.get(tolerance.LOAD), self.recording.load / GRAVITY
        limit = tolerance.load_error_limit(loads, tolerance.UNWEIGHED if known is None else known)
        models = (self.decision.model, *self.decision.open_rivals)
        at_stake = any(
            tolerance.may_be_load(self.problem, self.blocks, m, loads, known) for m in models
        )
        if at_stake and np.isfinite(limit):
            data = (self.problem, self.blocks, self.family)
            self.base = tolerance.refit_load(*data, self.base, limit)
            self.normal = tolerance.refit_load(*data, self.normal, limit)
            if self.reference is not None:
                self.reference = tolerance.refit_load(*data, self.reference, limit)
            self.causes = [c for c in self.causes if c.name != tolerance.PAYLOAD_ERROR]
            self.decision = self.decided(self.normal, self.reference)
            self.finish()

    def decide(self) -> None:
        """Compare rival causes."""
        moving = np.bincount(self.blocks.of, np.abs(np.diff(self.recording.command, prepend=0.0)))
        moved = int(np.sum(self.blocks.held_out & (moving > 0.0)))
        if moved < self.rule.least_blocks:
            self.short = iso.shortness_warning(moved, self.rule.least_blocks)
        testable = len(self.beside(self.normal))
        if self.short or iso.too_few_testable(testable, testable + len(self.not_testable)):
            self.decision = Decision("insufficient", self.normal)
            return
        self.decision = self.decided(self.normal)
        if possible_gain(self.blocks, self.model) > LITTLE_LEFT or self.decision.level > 1:
            self.try_other_friction()
        self.finish()

    def finish(self) -> None:
        """Drop the common differences that the model of the decision does not need."""
        assert self.decision is not None
        if self.decision.level and any(cause.common for cause, _ in self.model.causes):
            model = self.flexible.acting(self.decision.model)
            self.decision.model = self.flexible.needed(model)

    def beside(self, base: Candidate) -> list[Cause]:
        """Return the causes that the recording can show beside the differences of a base."""
        return [cause for cause in self.causes if cause.name not in base.names]

    def decided(self, base: Candidate, reference: Candidate | None = None) -> Decision:
        """Return the decision on a base; causes must gain over a reference too."""
        return decide(
            self.problem,
            self.family,
            self.blocks,
            base,
            self.beside(base),
            self.regressors,
            self.rule,
            self.seed,
            self.unseen,
            self.base,
            reference,
        )

    def try_other_friction(self) -> None:
        """Repeat the decision on a base with friction of one kind, and keep it if it is better.

        The base is selected as if no other cause acted, and may hold friction that imitates one.
        """
        best, tried = self.normal, []
        for other in self.flexible.alternatives(self.asked, best):
            if self.blocks.gain(best.errors, other.errors) > 0.0:
                best = other
            causes = self.beside(other)
            data = (self.problem, self.family, self.blocks, other, causes)
            screen = Screen.make(self.problem, self.family, other.fit, causes)
            models = [other, *search(*data, screen)]
            tried.append((other, max(models, key=self.ahead)))
        if not tried:
            return
        other, model = max(tried, key=lambda pair: self.ahead(pair[1]))
        if self.is_better(other, model, len(tried), self.rule.hint):
            found = self.decided(other, best)
            if self.is_better(other, found.model, len(tried)):
                self.normal, self.reference, self.decision = other, best, found

    def ahead(self, model: Candidate) -> float:
        """Return the gain of a model over that of the decision."""
        return self.blocks.gain(self.model.errors, model.errors)

    def is_better(self, base: Candidate, model: Candidate, tried: int, share: float = 1.0) -> bool:
        """Return whether a model on another base, one of ``tried``, replaces the decision's.

        ``share`` of the gain that this needs is enough of one that is not fitted to the end.
        """
        assert self.decision is not None
        fewer = len(model.causes) - len(base.causes) < self.decision.level
        if fewer:
            return self.ahead(model) > -self.rule.simpler
        data = (self.problem, self.blocks, self.model, model)
        clear = self.ahead(model) >= share * self.rule.differing_gain
        return clear and p_value(*data, tried) <= self.rule.doubt

    def hold_out(self) -> None:
        """Fit base, model and rivals without the held-out data."""
        assert self.decision is not None
        once = any(c.once for c, _ in self.model.causes)
        choice = interleaved(self.blocks) if once else choose(self.recording, self.blocks)
        self.compared = compared(self.problem, self.blocks, self.base, self.model, self.seed)
        self.held = hold_out(
            self.problem,
            self.blocks,
            choice,
            self.base,
            self.normal,
            self.model,
            [rival for rival, _ in judged(self.decision)],
            self.decision.open_rivals[:THOROUGH],
            self.seed,
        )

    def experiment(self) -> None:
        """Propose the experiment that separates the open rivals."""
        decision = self.decision
        if decision is None or decision.verdict != "ambiguous" or not decision.open_rivals:
            return
        plans = self.kind.plans(self.recording, self.sheet, self.family)
        if not plans:
            return
        first, *others = (
            rival_of(c.names, c.fit, len(self.normal.fit.frees), self.problem.tie)
            for c in (decision.model, *decision.open_rivals)
        )
        measured = np.isfinite(self.problem.measured).any(axis=1)
        noise = np.where(measured, self.problem.noise, np.inf)
        self.proposal = propose(plans, first, others, noise, self.causes)

    def close_loop(self, design: Callable[..., Any] | None, simulated: Any, oracle: Any) -> None:
        """Compare controllers designed on the base and on the extended plant."""
        self.loop_reason = self._no_loop()
        if self.loop_reason is not None:
            return
        if self.kind.loop is not None:
            plants = self.plant_of(self.base), self.plant_of(self.model)
            self.loop, reason = in_environment.compare(
                self.kind.loop, *plants, design, oracle, self.seed
            )
            self.loop_reason = reason or None
            return
        held = self.held
        residuals = None
        if simulated is None and held is not None and np.isfinite(self.problem.measured[0]).any():
            rows = held.rows & np.isfinite(self.problem.measured[0])
            left = -held.problem.rows(held.model.fit.residual)[0][rows] * self.problem.noise[0]
            residuals = loops.Residuals(np.ascontiguousarray(left), self.recording.period)
        loads = self.recording.load[self.recording.load > 0.0]
        load = float(np.median(loads)) / GRAVITY if len(loads) else 0.0
        celsius, kelvin = self.recording.temperature, None
        if celsius is not None:  # the temperature furthest from 20 deg C
            kelvin = float(celsius[np.argmax(np.abs(celsius - 20.0))]) + CELSIUS
        self.loop = loops.closed_loop(
            self.plant_of(self.base),
            self.plant_of(self.model),
            design,
            rig=simulated,
            oracle=oracle,
            residuals=residuals,
            load=load,
            kelvin=kelvin,
            seed=self.seed,
        )
        if self.loop is None:
            self.loop_reason = f"under {load:.3g} kg the stroke is too short for a reference"

    def _no_loop(self) -> str | None:
        """Return the reason against a comparison of controllers, if any."""
        causes = [cause for cause, _ in self.model.causes]
        if not causes:
            return "no cause was added to the plant"
        if not any(cause.compensable for cause in causes):
            names = ", ".join(cause.name for cause in causes)
            return f"a controller cannot compensate {names}"
        return self.kind.loop_reason or None

    def traces(self) -> Traces:
        """Return the time series of the report's figures."""
        r, channels = self.recording, self.family.channels

        def split(values: Array) -> dict[str, Array]:
            return {
                c: np.asarray(v)
                for c, v, m in zip(channels, values, self.problem.measured, strict=True)
                if np.isfinite(m).any()
            }

        effects = effect_traces(self.problem, self.family, self.model)
        return Traces(
            self.problem.time,
            r.segment,
            r.segments,
            self.held.rows if self.held is not None else np.zeros(len(r.time), bool),
            r.command,
            r.load,
            r.temperature,
            split(self.problem.measured),
            split(self.problem.shaped(self.outputs(self.base))),
            split(self.problem.shaped(self.outputs(self.model))),
            {name: split(trace) for name, trace in effects.items()},
            {c: (r.channel(c).unit, r.channel(c).scale) for c in channels},
            self.driving,
        )
