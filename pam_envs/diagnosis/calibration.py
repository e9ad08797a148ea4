"""Calibration of a base plant, without a search for causes: ``pam-envs calibrate``.

The base of the diagnosis of a plant is fitted to a recording: static law, friction, dead time, lag
and rate of the regulator, and the differences in which rigs commonly depart from the plant. A
single muscle of any size is fitted as the similar one of 10 mm, from the nearest family. A table of
static forces gives its static law alone.
"""

import dataclasses
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.data.force_table import ForceTable
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.decide.verdict import Decision
from pam_envs.diagnosis.diagnosis import Study, fit_failures_explained
from pam_envs.diagnosis.families.compiled import in_valve
from pam_envs.diagnosis.families.kinds import kind_of
from pam_envs.diagnosis.fit.intervals import NEAR_BOUND, at_bound
from pam_envs.diagnosis.fit.least_squares import Free
from pam_envs.diagnosis.fit.similarity import NO_FLOW, SAME_SIZE, Similarity
from pam_envs.diagnosis.fit.single_muscle import (
    PLAIN_NEUTRAL,
    SWITCHED_OFF,
    THRESHOLDS,
    identified,
    inputs_of,
    spread,
)
from pam_envs.diagnosis.plant_protocol import Kind
from pam_envs.diagnosis.report.outcome import steps
from pam_envs.identification.force_table import LawFit, fit_law
from pam_envs.parameters import declarations
from pam_envs.plants.single_muscle.families import FAMILIES, PRESSURE, base_plant
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import replay_rows

DEAD_TIME = 0.03
"""Starting value of the dead time [s], which the fit moves."""
SAME = 1.01
"""Ratio of errors up to which the first family is taken."""
LEAST_WEIGHT = 1e-6
"""Weight of an element of friction below which it is not used."""
CALIBRATED = "pam-envs calibrate"
NO_COMMANDS = (
    "without commanded pressures the regulator is not fitted: it is that of the plant at the start"
)
WIDTH = 100


WITHOUT = {**SWITCHED_OFF, "muscle.braid_force": 0.0, "muscle.area_taper": 0.0}
"""Values at which a term of the plant is absent."""


@dataclasses.dataclass(frozen=True)
class Errors:
    """RMS errors of a channel, in SI."""

    before: float  # of the plant before the fit
    after: float  # of the fitted plant
    held_out: float  # on data that were left out of a fit
    floor: float  # noise of the readings
    source: str  # origin of the noise floor
    unit: str  # in which the recording has the channel
    scale: float  # size [SI] of that unit


@dataclasses.dataclass(frozen=True)
class BasePlant:
    """Calibrated plant with its errors.

    Attributes
    ----------
    plant : Plant
        The fitted plant, with the provenance of each parameter.
    family : str
        Family of the muscle at the start of the fit; empty for a given plant.
    errors : mapping of str to Errors
        By recorded channel; empty for a table of forces.
    differences : tuple of str
        Common differences from the plain plant that the recording needs.
    at_bound : tuple of str
        Sentences on the fitted parameters at one of their bounds.
    off : tuple of str
        Parameters at a bound that is their neutral value: effects that the recording does not show.
    warnings : tuple of str
        Limitations of the data.
    forces : LawFit or None
        Fit to a table of forces.
    regulator : bool
        Whether the regulator was fitted, too.
    """

    plant: Any
    family: str
    errors: Mapping[str, Errors]
    differences: tuple[str, ...]
    at_bound: tuple[str, ...]
    warnings: tuple[str, ...]
    off: tuple[str, ...] = ()
    forces: LawFit | None = None
    regulator: bool = True

    def write(self, path: str | Path) -> None:
        """Write the plant file, replaced atomically."""
        self.plant.to_yaml(path)

    def summary(self) -> str:
        """Return errors, regulator, bounds and warnings for a terminal."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        p, r = self.plant, getattr(self.plant, "regulator", None)
        start = f", from the family {self.family}" if self.family else ""
        sizes = ""
        if isinstance(p, SingleMuscle):
            sizes = f": {1e3 * p.muscle.diameter:g} mm x {1e3 * p.muscle.rest_length:g} mm"
            sizes += f", {p.regulator.max_pressure / 1e5:g} bar"
        yield f"{p.family}{sizes}{start}"
        if self.forces is not None:
            yield f"force: RMS {self.forces.rms:.3g} N, largest error {self.forces.worst:.3g} N"
        if self.errors:
            yield f"{'RMS error':18}{'before':>10}{'after':>10}{'held out':>10}{'noise':>10}"
        for channel, e in self.errors.items():
            numbers = (e.before, e.after, e.held_out, e.floor)
            cells = "".join(f"{value / e.scale:>10.3g}" for value in numbers)
            yield f"{f'{channel} [{e.unit}]':18}{cells}  (noise: {e.source})"
        if self.errors and self.regulator and r is not None:
            rate = f", rate {r.slew_rate / 1e5:.3g} bar/s" if r.slew_rate < 1e8 else ""
            air = f"lag {1e3 * r.time_constant:.3g} ms" if p.air == "regulator" else "orifices"
            yield f"regulator: dead time {1e3 * r.dead_time:.3g} ms, {air}{rate}"
        if self.errors:
            yield f"differences from the plain plant: {', '.join(self.differences) or 'none'}"
        if self.off:
            text = f"at 0, not shown by the recording: {', '.join(self.off)}"
            yield textwrap.fill(text, WIDTH, subsequent_indent="  ")
        for kind, texts in (("at a bound", self.at_bound), ("warning", self.warnings)):
            for text in texts:
                yield textwrap.fill(f"{kind}: {text}", WIDTH, subsequent_indent="  ")


def calibrate(
    recording: Recording,
    rig: Rig,
    plant: Any = None,
    *,
    seed: int = 0,
    progress: bool = True,
) -> BasePlant:
    """Fit the base of a plant to a recording.

    Parameters
    ----------
    recording : Recording
        See :func:`pam_envs.data.recording.recording.load_recording`.
    rig : Rig
        Known properties of the rig; of a single muscle, its size too.
    plant : Plant, optional
        Plant to fit, of the rig's family. Default: the shipped plant of that family with the sizes
        of the rig; for a single muscle, that of its family, or the nearest to the recording.
    seed : int
        Seed of all random draws.
    progress : bool
        Print the stages with the time since the start to stderr.

    Raises
    ------
    ValueError
        If the data cannot be used; the sentences name rows and remedies.
    """
    kind = kind_of(plant, rig)
    with fit_failures_explained(), steps(progress) as step:
        step("checking the data")
        checked = kind.audit(recording, rig).passed()
        # a plant file holds no clock: an offset is part of the dead time unless a limit is declared
        sheet = dataclasses.replace(rig, clock_tolerance=rig.clock_tolerance or 0.0)
        if kind.name == SingleMuscle.family:
            begun = Start.of_muscle(recording, sheet, plant)
        else:
            begun = Start(recording, sheet, kind.start(sheet) if plant is None else plant)
        step("refitting the plant")
        study = begun.study(kind)
        step("differences from the plain plant")
        study.make_flexible(kind.causes(kind.catalogue))
        study.seed, study.decision = seed, Decision("adequate", study.normal)
        step("held-out experiments")
        study.hold_out()
    found = study.normal
    made = begun.original(study, f"{CALIBRATED}, recording {recording.digest[:12]}")
    frees, values = found.fit.frees, found.fit.values()
    valve = any(in_valve(free.name) for free in frees)
    unfitted = () if valve else (NO_COMMANDS,)
    units = {free.name: study.family.declared(free.name).unit for free in frees}
    bounds = dict(_bounds(made, frees, values, units, begun.similar.inverse))
    return BasePlant(
        plant=made,
        family=begun.family,
        errors=_errors(study, begun, recording),
        differences=found.names,
        at_bound=tuple(text for text in bounds.values() if text),
        off=tuple(name for name, text in bounds.items() if not text),
        warnings=tuple(dict.fromkeys((*checked.warnings, *unfitted))),
        regulator=valve,
    )


@dataclasses.dataclass(frozen=True)
class Start:
    """Plant, recording and rig of a fit; for a single muscle, those of the similar one.

    Attributes
    ----------
    recording, sheet, plant
        What is fitted.
    family : str
        Family of the muscle; empty for a given plant.
    similar : Similarity
        Factors from the original.
    """

    recording: Recording
    sheet: Rig
    plant: Any
    family: str = ""
    similar: Similarity = SAME_SIZE

    @classmethod
    def of_muscle(cls, recording: Recording, sheet: Rig, plant: SingleMuscle | None) -> "Start":
        """Return the start of a single muscle."""
        if recording.contraction is None:
            raise ValueError(
                "the recording has no column contraction_mm, which the muscle is calibrated to; "
                "record it, or give a table of forces (pressure_bar, contraction_mm, force_N)"
            )
        family = ""
        if plant is None:
            family, plant = nearest(recording, sheet)
        similar = Similarity.of(plant)
        begin = similar.plant(plant)
        if similar.pressure != 1.0:
            begin = begin.replace(NO_FLOW)
        return cls(similar.recording(recording), similar.rig(sheet), begin, family, similar)

    def study(self, kind: Kind) -> Study:
        """Fit the base of the plant."""
        floor = noise_floor(self.recording, self.sheet)
        return Study.begin(self.recording, self.sheet, self.plant, floor, kind)

    def original(self, study: Study, source: str) -> Any:
        """Return the fitted plant of a study in the original size, with its provenance."""
        frees, fitted = study.normal.fit.frees, study.plant_of(study.normal)
        if not isinstance(fitted, SingleMuscle):
            return study.family.identified(fitted, frees, source)
        made = identified(self.similar.inverse.plant(fitted), frees, source)
        load = float(np.median(self.recording.load)) / self.similar.force
        loads = {"mass.load": ("assumed", f"median of the recording, {source}")}
        loaded = made.replace({"mass.load": load / GRAVITY})
        return dataclasses.replace(loaded, provenance={**loaded.provenance, **loads})


def calibrate_forces(table: ForceTable, rig: Rig) -> BasePlant:
    """Fit the static law of a muscle to a table of forces; all else is that of the family.

    Raises
    ------
    ValueError
        Naming what RIG.yaml lacks.
    """
    if rig.plant != SingleMuscle.family:
        raise ValueError(
            f"plant: {rig.plant!r} is not calibrated to a table of forces; give a recording in "
            f"time, or plant: {SingleMuscle.family} for the table of one of its muscles"
        )
    full = rig.max_pressure or float(table.pressure.max())
    fits = []
    for family in (rig.family,) if rig.family else FAMILIES:
        plant = sized(family, rig, max_pressure=full)
        fits.append((family, plant, fit_law(table, plant.muscle)))
    enough = SAME * min(fit.rms for _, _, fit in fits)
    family, plant, fit = next(found for found in fits if found[2].rms <= enough)
    values = {f"muscle.{name}": value for name, value in fit.values.items()}
    made = plant.replace({**values, "muscle.area_curve": 0.0})
    sources = dict.fromkeys(values, ("identified", f"{CALIBRATED}, {Path(table.source).name}"))
    made = dataclasses.replace(made, provenance={**made.provenance, **sources})
    declared = declarations(made.muscle)
    bounds = tuple(
        _at_bound(f"muscle.{n}", fit.values[n], declared[n].low, declared[n].high, declared[n].unit)
        for n in fit.at_bound
    )
    warnings = (
        "friction, regulator and moving mass are those of the family; calibrate with a recording "
        "in time: pam-envs calibrate RECORDING --plant PLANT",
    )
    return BasePlant(made, family, {}, (), bounds, warnings, forces=fit)


def sized(family: str, rig: Rig, **more: Any) -> SingleMuscle:
    """Return the base plant of a family with the sizes of a rig; ValueError without them."""
    if rig.rest_length is None or rig.diameter is None:
        key = "rest_length_mm" if rig.rest_length is None else "diameter_mm"
        raise ValueError(
            f"a calibration needs muscle.{key}; add muscle: {{rest_length_mm: 200, diameter_mm: "
            "10} with the sizes of your muscle to RIG.yaml, or start from a plant (--plant)"
        )
    full = {"max_pressure": rig.max_pressure or PRESSURE, **more}
    return base_plant(family, rig.rest_length, rig.diameter, braid_angle=rig.braid_angle, **full)


def start(family: str, rig: Rig) -> SingleMuscle:
    """Return the plant from which a fit starts: many elements of friction, a dead time."""
    plant = sized(family, rig)
    rated = plant.regulator.max_pressure / PRESSURE
    return plant.replace(
        {
            **PLAIN_NEUTRAL,
            "regulator.dead_time": DEAD_TIME,
            "hysteresis.operator": spread([rated * t for t in THRESHOLDS]),
            "mass.load": 0.0,
            "mass.carried": 0.0 if rig.load == "constant_force" else 1.0,
        }
    )


def nearest(recording: Recording, rig: Rig) -> tuple[str, SingleMuscle]:
    """Return the family, of all unless declared, whose start is nearest to the recording."""
    starts = {name: start(name, rig) for name in ((rig.family,) if rig.family else FAMILIES)}
    if len(starts) == 1:
        return next(iter(starts.items()))
    assert recording.contraction is not None
    inputs, off = inputs_of(recording, rig), {}
    for name, plant in starts.items():
        simulated = replay_rows(plant, plant.parameter_rows()[None], inputs)[0, :, 0]
        left = simulated - recording.contraction
        off[name] = float(np.nan_to_num(np.std(left), nan=np.inf))
    best = min(off, key=lambda name: off[name])
    return best, starts[best]


def _errors(study: Study, begun: Start, recording: Recording) -> dict[str, Errors]:
    """Return the RMS errors by channel, zero offsets and settling removed."""
    problem, held = study.problem, study.held
    assert held is not None
    first = study.kind.bind(begun.plant, study.recording, study.sheet)
    before = problem.shaped(first.simulate(first.column[None])[:, :, 0])
    after = problem.shaped(study.outputs(study.normal))
    left = held.problem.rows(held.model.fit.residual) * problem.noise[:, None]
    found = {}
    for k, channel in enumerate(study.family.channels):
        if not np.isfinite(problem.measured[k]).any():
            continue
        floor, source = study.floor_of(channel)
        shown = recording.channel(channel)
        scale = 1.0 / begun.similar.pressure if channel == "pressure" else 1.0
        unseen = ~(held.rows & np.isfinite(problem.measured[k]))
        found[channel] = Errors(
            scale * _rms(before[k] - problem.measured[k]),
            scale * _rms(after[k] - problem.measured[k]),
            scale * _rms(np.where(unseen, np.nan, left[k])),
            scale * floor,
            source,
            shown.unit,
            shown.scale,
        )
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))


def _bounds(
    plant: Any,
    frees: Sequence[Free],
    values: Mapping[str, float],
    units: Mapping[str, str],
    original: Similarity,
) -> Iterator[tuple[str, str]]:
    """Yield the parameters at a bound with a sentence, which is empty at a neutral value."""
    for free in frees:
        value = values[free.name]
        weight = free.name.startswith("hysteresis.weight")
        if at_bound(free, value) and not (weight and value < LEAST_WEIGHT):
            f = original.factor_of(plant, free.name)
            text = _at_bound(free.name, f * value, f * free.low, f * free.high, units[free.name])
            without = WITHOUT.get(free.name, plant.neutral.get(free.name))
            absent = without is not None and abs(value - without) <= NEAR_BOUND * (
                free.high - free.low
            )
            yield free.name, "" if absent else text


def _at_bound(name: str, value: float, low: float, high: float, unit: str) -> str:
    unit = "" if unit == "1" else f" {unit}"
    return (
        f"{name} = {value:.4g}{unit} is at a bound of [{low:.4g}, {high:.4g}]{unit}: its value and "
        "those that depend on it are not reliable; check the sizes in RIG.yaml and the units, or "
        "record what shows it (docs/base_plant.md)"
    )
