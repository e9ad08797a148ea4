"""The proposed experiment, carried out: the recording that an owner hands in afterwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.diagnosis_cases import Case, Made, recording_of, sheet_of
from pam_envs.data.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.experiment import Plan, plans
from tests.diagnosis import hidden

FULL = 6.0
"""Pressure [bar] that a plan's commands are parts of."""
FRESH = ("cycles_after_rest",)
"""Plans that begin with a muscle that has rested: the rig starts anew."""


def again(case: Case, made: Made, plan_name: str) -> tuple[Recording, Rig]:
    """Return the recording of the campaign and the experiment after it, and the owner's sheet.

    Parameters
    ----------
    case : Case
    made : Made
        The case, made.
    plan_name : str
        As the report names the experiment.
    """
    plan = {p.name: p for p in plans()}[plan_name]
    before, extra = made.ground.campaign, _campaign(plan, made.ground.campaign)
    effects = [(truth.effect, truth.amplitude) for truth in made.truths]
    whole = _joined(before, extra)
    sheet = sheet_of(made.ground.base, whole, case.noise)
    if plan.name in FRESH:
        columns = _after_rest(case, made, effects, before, extra)
    else:
        share = before.command_bar.size / whole.command_bar.size
        lasting = [(_sooner(effect, share), amplitude) for effect, amplitude in effects]
        columns = hidden.make_recording(
            made.ground.base, lasting, whole, case.seed + 13, noise_factor=case.noise
        )
    return recording_of(columns, sheet, f"case {case.seed} and {plan.name}"), sheet


def _campaign(plan: Plan, before: hidden.Campaign) -> hidden.Campaign:
    """Return a plan as what is done to a rig, its pieces labelled by whether the valve is shut."""
    shut = plan.command < 0.0
    piece = np.concatenate([[0], np.cumsum(shut[1:] != shut[:-1])])
    held = np.where(shut, 0.0, plan.command)
    return hidden.Campaign(
        np.round(FULL * held, 4),
        np.array([f"next_{chr(ord('a') + k)}" for k in piece]),
        plan.load.astype(float),
        np.round(before.temperature_C[-1] + plan.kelvin, 2),
        shut,
        before.period,
    )


def _joined(first: hidden.Campaign, second: hidden.Campaign) -> hidden.Campaign:
    names = ("command_bar", "segment", "load_N", "temperature_C", "valve_closed")
    both = [np.concatenate([getattr(first, n), getattr(second, n)]) for n in names]
    return hidden.Campaign(*both, first.period)


def _sooner(effect: hidden.Effect, share: float) -> hidden.Effect:
    """Keep the moment of what happens at a share of the run, where the run gets longer."""
    if "when" not in effect.shape:
        return effect
    return replace(effect, shape={**effect.shape, "when": share * effect.shape["when"]})


def _after_rest(
    case: Case,
    made: Made,
    effects: list[tuple[hidden.Effect, float]],
    before: hidden.Campaign,
    extra: hidden.Campaign,
) -> dict[str, np.ndarray]:
    """Return both recordings, one after the other; time starts anew in the second."""
    runs = [
        hidden.make_recording(
            made.ground.base, effects, campaign, case.seed + 13 + k, noise_factor=case.noise
        )
        for k, campaign in enumerate((before, extra))
    ]
    return {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}
