"""What to know of a recording before anything is concluded from it."""

from __future__ import annotations

import dataclasses

import numpy as np

from pam_envs.data.recording import Recording, check_rig, repeat_rows
from pam_envs.data.rig_file import Rig
from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis import audit_channels as channels
from pam_envs.diagnosis.audit_tables import audit_table
from pam_envs.diagnosis.audit_units import wrong_units
from pam_envs.diagnosis.noise import Floor, holds, noise_floor

BAR = 1e5
LOAD_STEP = 0.5
"""Loads [N] closer than this are one level."""
REST_PRESSURE = 0.1e5
REST_SECONDS = 2.0
WARMING = 1.0
"""Kelvin by which the temperature must vary for its effect to be told."""
SHUT_SECONDS = 2.0
MANY_CYCLES = 5

NEED_CONTRACTION = (
    "creep",
    "sensor_delay",
    "viscous_loss",
    "temperature",
    "first_cycle_softening",
    "load_dependent_hysteresis",
    "load_dependent_compliance",
    "hysteresis_shape",
    "hysteresis_drive",
    "stick_slip",
    "threshold_pressure",
    "pressure_dependent_friction",
    "slip_step",
    "wire_slack",
    "payload_error",
)
"""Causes that act on the contraction alone."""
NEED_LOADS = ("load_dependent_hysteresis", "load_dependent_compliance", "payload_error")


@dataclasses.dataclass(frozen=True)
class Audit:
    """What the checks found.

    Attributes
    ----------
    problems : tuple of str
        Why no diagnosis can be made; empty if one can.
    warnings : tuple of str
        What to bear in mind.
    """

    problems: tuple[str, ...]
    warnings: tuple[str, ...]


def audit(recording: Recording | ContractionTable, rig: Rig | None = None) -> Audit:
    """Check a recording, or a table of settled readings.

    Parameters
    ----------
    recording : Recording or ContractionTable
    rig : Rig, optional

    Returns
    -------
    Audit
        Sentences with rows of the file and remedies.
    """
    if isinstance(recording, ContractionTable):
        return Audit((), tuple(audit_table(recording)))
    rig = rig or Rig()
    problems = check_rig(recording, rig)
    if problems:
        return Audit(tuple(problems), recording.notes)
    floor = noise_floor(recording, rig)
    wrong, warnings = wrong_units(recording, rig)
    problems = _empty_outputs(recording) + wrong
    seen = recording if recording.raw is None else recording.raw
    for name in channels.UNITS:
        if getattr(seen, name) is not None:
            stuck, still = channels.stuck(seen, name) if name in _outputs(seen) else ([], [])
            problems += stuck
            warnings += still + channels.clipped(seen, name) + channels.spikes(seen, name)
    noise = {name: _noise(floor, name) for name in _outputs(seen)}
    for name, rms in noise.items():
        warnings += channels.coarse(seen, name, rms)
    warnings += channels.copies(seen, noise)
    warnings += [*floor.warnings, *_repeats(recording, rig), *_lacks(recording, rig)]
    return Audit(tuple(problems), tuple(dict.fromkeys((*recording.notes, *warnings))))


def undecidable(recording: Recording, rig: Rig | None = None) -> dict[str, str]:
    """Return the causes that a recording cannot show, and why.

    Parameters
    ----------
    recording : Recording
    rig : Rig, optional

    Returns
    -------
    dict of str to str
        Reason by name of the cause. A cause that is not listed may still not be excited.
    """
    rig = rig or Rig()
    reasons: dict[str, str] = {}
    if recording.contraction is None:
        reasons |= dict.fromkeys(NEED_CONTRACTION, "the contraction was not recorded")
    if recording.pressure is None:
        reasons.setdefault("sensor_delay", "cannot be told from dead_time: no pressure_bar")
    levels = load_levels(recording)
    if len(levels) < 2:
        reason = f"the load was {levels[0]:.3g} N throughout"
        reasons |= {name: reason for name in NEED_LOADS if name not in reasons}
    if recording.temperature is None:
        reasons.setdefault("temperature", "the temperature was not recorded")
    elif np.ptp(recording.temperature) < WARMING:
        span = np.ptp(recording.temperature)
        reasons.setdefault("temperature", f"the temperature varied by only {span:.2g} K")
    if _longest_shut(recording) <= SHUT_SECONDS:
        reasons["leak"] = (
            f"the valve was never shut for more than {SHUT_SECONDS:g} s (valve_closed in RIG.yaml)"
        )
    if rig.cycles_since_rest > MANY_CYCLES:
        reasons.setdefault(
            "first_cycle_softening",
            f"the muscle had already made {rig.cycles_since_rest} cycles since it rested",
        )
    if not _falls(recording):
        reasons["exhaust_asymmetry"] = "the command never falls by more than 0.5 bar"
    return dict(sorted(reasons.items()))


def load_levels(recording: Recording) -> list[float]:
    """Return the loads [N] that were hung, ascending."""
    levels: list[float] = []
    for load in np.unique(recording.load):
        if not levels or load - levels[-1] > LOAD_STEP:
            levels.append(float(load))
    return levels


def _outputs(recording: Recording) -> list[str]:
    pair = ("contraction", "pressure")
    return [name for name in pair if getattr(recording, name) is not None]


def _empty_outputs(recording: Recording) -> list[str]:
    return [
        f"{channels.UNITS[name][0]} holds one value in all rows; connect the sensor, or leave the "
        "column out"
        for name in _outputs(recording)
        if np.ptp(getattr(recording, name)) == 0.0
    ]


def _noise(floor: Floor, channel: str) -> float:
    """Return the noise to judge a resolution by; what rounding adds to it does not count."""
    found = floor[channel]
    return found.reading if found.declared is None else found.declared


def _repeats(recording: Recording, rig: Rig) -> list[str]:
    """Return which segments do not repeat one another though the rig says so."""
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
    """Return what the campaign leaves out, and what cannot be decided for it."""
    warnings = []
    levels = load_levels(recording)
    if len(levels) < 2:
        warnings.append(
            f"the load was {levels[0]:.3g} N throughout: causes that act with the load cannot be "
            "decided; record segments with at least two loads"
        )
    if not rig.repeats:
        warnings.append(
            "no segments repeat one another: the noise floor rests on holds; record one segment "
            "twice and name both under repeats in RIG.yaml"
        )
    for field, column, loss in (
        ("temperature", "temperature_C", "an effect of temperature cannot be told from drift"),
        (
            "pressure",
            "pressure_bar",
            "what the valve does cannot be told from what the muscle does",
        ),
        ("contraction", "contraction_mm", "only the valve and the air can be judged"),
    ):
        if getattr(recording, field) is None:
            warnings.append(f"there is no column {column}: {loss}")
    if not _rests(recording):
        warnings.append(
            f"the command never rests near 0 bar for {REST_SECONDS:g} s: the sensors' zeros cannot "
            "be checked; start each run with a rest"
        )
    return warnings


def _rests(recording: Recording) -> bool:
    return any(
        len(rows) * recording.period >= REST_SECONDS - 1e-9
        and recording.command[rows].max() <= REST_PRESSURE
        for rows in holds(recording)
    )


def _longest_shut(recording: Recording) -> float:
    shut = recording.valve_closed & ~recording.filled
    same = shut[1:] & shut[:-1] & ~recording.restart[1:]
    return max((b - a + 1 for a, b in channels.runs(same)), default=0) * recording.period


def _falls(recording: Recording) -> bool:
    free = recording.command[~recording.valve_closed]
    return len(free) > 0 and bool(np.any(np.maximum.accumulate(free) - free > 0.5 * BAR))
