"""Audit of a recording or a table before its diagnosis: problems, warnings, undecidable causes."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR
from pam_envs.data.recording.channels import MUSCLE
from pam_envs.data.recording.recording import Recording, check_rig, repeat_rows
from pam_envs.data.rig_file import Rig
from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.audit import channels
from pam_envs.diagnosis.audit.noise import holds, noise_floor, outputs_of
from pam_envs.diagnosis.audit.tables import audit_table
from pam_envs.diagnosis.audit.units import wrong_units
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.fit.single_muscle import BASE
from pam_envs.diagnosis.fit.tolerance import LOAD, unknown_names

LOAD_STEP = 0.5  # largest difference of loads of one level [N]
REST_PRESSURE = 0.1e5
REST_SECONDS = 2.0
WARMING = 1.0  # least variation of the temperature [K] that shows its effect
SHUT_SECONDS = 2.0
MANY_CYCLES = 5
NO_REPEATS = (
    "no segments repeat one another: the noise floor is estimated from holds; record one segment "
    "twice and name both under repeats in RIG.yaml"
)


@dataclasses.dataclass(frozen=True)
class Audit:
    """Result of an audit."""

    problems: tuple[str, ...]  # reasons against a diagnosis; empty if one can be made
    warnings: tuple[str, ...]  # limitations of the data

    def passed(self) -> "Audit":
        """Return the audit; ValueError with all problems if there are any."""
        if self.problems:
            raise ValueError("the recording cannot be used: " + " ".join(self.problems))
        return self


def audit(recording: Recording | ContractionTable, rig: Rig | None = None) -> Audit:
    """Return the findings on a recording, or on a table of readings, with rows and remedies."""
    if isinstance(recording, ContractionTable):
        return Audit((), tuple(audit_table(recording)))
    rig = rig or Rig()
    problems = [*check_rig(recording, rig), *unknown_names(rig.tolerance)]
    if problems:
        return Audit(tuple(problems), recording.notes)
    wrong, warnings = wrong_units(recording, rig)
    problems, found = _channels(recording, rig, [*wrong])
    warnings += [*found, *_lacks(recording, rig), *_not_used(recording, rig)]
    return Audit(tuple(problems), tuple(dict.fromkeys((*recording.notes, *warnings))))


def audit_channels(recording: Recording, rig: Rig, names: Sequence[str]) -> Audit:
    """Return the findings on the channels of any plant with parameters of some names."""
    problems = [*check_rig(recording, rig), *unknown_names(rig.tolerance, names)]
    problems += unknown_names(rig.parameters, names, "parameters")
    problems += [
        f"RIG.yaml: noise is declared of {name!r}, which was not recorded"
        for name in rig.noise
        if name not in recording.outputs
    ]
    if problems:
        return Audit(tuple(problems), recording.notes)
    problems, warnings = _channels(recording, rig, [])
    if not rig.repeats:
        warnings.append(NO_REPEATS)
    return Audit(tuple(problems), tuple(dict.fromkeys((*recording.notes, *warnings))))


def _channels(recording: Recording, rig: Rig, wrong: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return problems, with those of wrong units, and warnings on the measured channels."""
    floor, warnings = noise_floor(recording, rig), []
    problems = [
        f"{recording.channel(name).column} holds one value in all rows; connect the sensor, or "
        "leave the column out"
        for name in outputs_of(recording)
        if np.ptp(recording.reading(name)) == 0.0
    ]
    problems += wrong
    seen = recording if recording.raw is None else recording.raw
    for name in recording.outputs or MUSCLE:
        if seen.reading(name) is not None:
            stuck, still = channels.stuck(seen, name) if name in outputs_of(seen) else ([], [])
            problems += stuck
            warnings += still + channels.clipped(seen, name) + channels.spikes(seen, name)
    # the noise to compare a resolution with, without the part due to rounding
    found = {name: floor[name] for name in outputs_of(seen)}
    noise = {k: f.reading if f.declared is None else f.declared for k, f in found.items()}
    for name, rms in noise.items():
        warnings += channels.coarse(seen, name, rms)
    warnings += channels.copies(seen, noise)
    return problems, [*warnings, *floor.warnings, *_repeats(recording, rig)]


def undecidable(
    recording: Recording,
    rig: Rig | None = None,
    causes: Sequence[Cause] | None = None,
    unmet: Mapping[str, str] | None = None,
) -> dict[str, str]:
    """Return the causes, of the catalogue by default, that a recording cannot decide, and why.

    ``unmet`` are the needs that the recording does not meet; default: of a single muscle.
    """
    unmet = unmet_needs(recording, rig or Rig()) if unmet is None else unmet
    reasons = {}
    for cause in catalogue() if causes is None else causes:
        lacks = [unmet[word] for word in cause.needs if word in unmet]
        if lacks:
            reasons[cause.name] = lacks[0]
    return dict(sorted(reasons.items()))


def unmet_needs(recording: Recording, rig: Rig) -> dict[str, str]:
    """Return the needs of causes (:data:`NEEDS`) that a recording does not meet, and why."""
    levels, kelvin = load_levels(recording), recording.temperature
    span = 0.0 if kelvin is None else float(np.ptp(kelvin))
    free = recording.command[~recording.valve_closed]
    falls = np.any(np.maximum.accumulate(free) - free > 0.5 * BAR)
    needs = {
        "contraction": (recording.contraction is not None, "the contraction was not recorded"),
        "pressure": (recording.pressure is not None, "the pressure was not recorded"),
        "loads": (len(levels) > 1, f"the load was {levels[0]:.3g} N throughout"),
        "weighed": (
            LOAD in rig.tolerance,
            "no tolerance of the loads is declared; add tolerance: {mass.load: 0.02} to RIG.yaml "
            "if they were weighed to 2 %",
        ),
        "temperature": (
            span >= WARMING,
            "the temperature was not recorded"
            if kelvin is None
            else f"the temperature varied by only {span:.2g} K",
        ),
        "valve_closed": (
            longest_shut(recording) > SHUT_SECONDS,
            f"the valve was never shut for more than {SHUT_SECONDS:g} s (valve_closed in RIG.yaml)",
        ),
        "rest": (
            rig.cycles_since_rest <= MANY_CYCLES,
            f"the muscle had already made {rig.cycles_since_rest} cycles since it rested",
        ),
        "exhaust": (falls, "the command never falls by more than 0.5 bar"),
    }
    return {word: reason for word, (met, reason) in needs.items() if not met}


def load_levels(recording: Recording) -> list[float]:
    """Return the load levels of a recording [N], ascending."""
    return levels_of(recording.load, LOAD_STEP)


def levels_of(values: Array, step: float) -> list[float]:
    """Return the levels of a signal that are more than ``step`` apart, ascending."""
    levels: list[float] = []
    for value in np.unique(values):
        if not levels or value - levels[-1] > step:
            levels.append(float(value))
    return levels


def _repeats(recording: Recording, rig: Rig) -> list[str]:
    """Return warnings on declared repeats with different commands."""
    warnings = []
    for names, group in zip(rig.repeats, repeat_rows(recording, rig), strict=True):
        for label, rows in zip(names[1:], group[1:], strict=True):
            apart = np.abs(recording.command[rows] - recording.command[group[0]])
            other = np.mean(apart > 0.05 * BAR)
            if other > 0.02:
                warnings.append(
                    f"segments {names[0]!r} and {label!r} should repeat one another, but their "
                    f"commands differ in {other:.0%} of the samples; correct repeats"
                )
    return warnings


def _lacks(recording: Recording, rig: Rig) -> list[str]:
    """Return warnings on missing experiments and columns, with the consequence."""
    warnings = []
    levels = load_levels(recording)
    if len(levels) < 2:
        warnings.append(
            f"the load was {levels[0]:.3g} N throughout: causes that act with the load cannot be "
            "decided; record segments with at least two loads"
        )
    if not rig.repeats:
        warnings.append(NO_REPEATS)
    for field, column, loss in (
        ("temperature", "temperature_C", "an effect of temperature looks like drift"),
        ("pressure", "pressure_bar", "effects of valve and muscle cannot be separated"),
        ("contraction", "contraction_mm", "only the valve and the air can be judged"),
    ):
        if getattr(recording, field) is None:
            warnings.append(f"there is no column {column}: {loss}")
    if not any(
        len(rows) * recording.period >= REST_SECONDS - 1e-9
        and recording.command[rows].max() <= REST_PRESSURE
        for rows in holds(recording)
    ):
        warnings.append(
            f"the command is never near 0 bar for {REST_SECONDS:g} s: the sensors' zeros cannot "
            "be checked; start each run with a rest"
        )
    return warnings


def _not_used(recording: Recording, rig: Rig) -> list[str]:
    """Return warnings on declarations that the replay does not use."""
    warnings = [
        f"tolerance of {name} is not used: no refit moves it"
        for name in rig.tolerance
        if name not in (*BASE, LOAD)
    ]
    if recording.supply is not None:
        warnings.append(
            "supply_pressure_bar is not used: the replay assumes a constant supply, except for a "
            "fitted droop"
        )
    if rig.cycles_since_rest > 0:
        warnings.append(
            f"history.cycles_since_rest = {rig.cycles_since_rest} is not used: the replay starts "
            "with a rested muscle"
        )
    return warnings


def longest_shut(recording: Recording) -> float:
    """Return the longest time [s] with the valve shut."""
    shut = recording.valve_closed & ~recording.filled
    same = shut[1:] & shut[:-1] & ~recording.restart[1:]
    return max((b - a + 1 for a, b in channels.runs(same)), default=0) * recording.period
