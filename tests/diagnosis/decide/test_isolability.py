"""Isolability and testability of causes on a recording."""

import dataclasses

import numpy as np
import pytest

from benchmarks.diagnosis.cases import recording_of, sheet_of
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.causes import by_name, catalogue
from pam_envs.diagnosis.decide.isolability import (
    LEAST_SIZE,
    Isolability,
    ends,
    isolability,
    not_testable,
    too_few_testable,
)
from pam_envs.diagnosis.diagnosis import Study
from pam_envs.diagnosis.fit.candidate import initial_fits
from pam_envs.diagnosis.fit.single_muscle import start_plant
from pam_envs.diagnosis.fit.tolerance import load_error_limit, may_be_within, refit_load
from tests.diagnosis import hidden
from tests.diagnosis.causes import users_cause
from tests.diagnosis.conftest import base_of, needs_kernels

pytestmark = pytest.mark.xdist_group("isolability")  # one study


def study_of(**changes: object) -> Study:
    """Return the base, refitted to a clean rig."""
    base, campaign = base_of(3), hidden.campaign_short(1)
    sheet = sheet_of(base, campaign)
    columns = hidden.make_recording(base, [], campaign, noise_seed=5)
    recording = recording_of(columns, sheet, "clean")
    recording = dataclasses.replace(recording, **changes)
    return Study.begin(recording, sheet, start_plant(sheet), noise_floor(recording, sheet))


@pytest.fixture(scope="module")
def study():
    return study_of()


@pytest.fixture(scope="module")
def blind():
    return study_of(pressure=None)


def of(study: Study, causes: list[Cause]) -> Isolability:
    return isolability(study.problem, study.family, study.base.fit, causes)


def reasons_of(study: Study, causes: list[Cause], **changes: object) -> dict[str, str]:
    """Return why causes are not testable on a recording with some columns changed."""
    recording = dataclasses.replace(study.recording, **changes)
    given = (study.problem, study.family, study.base.fit, causes)
    return not_testable(*given, recording, study.sheet)[1]


def cause_of(name: str, parameter: str, start: float, **bounds: float) -> Cause:
    term = Term(parameter, (start,), scale=abs(start), **bounds)
    return Cause(name, name, (Form("one", (term,)),))


@needs_kernels
def test_largest_effect_is_at_the_bounds(study):
    """The bounds of both signs count, not a multiple of the starting value."""
    narrow = cause_of("narrow", "pressure.bow", 2e-6, low=-8e-5, high=8e-5)
    wide = cause_of("wide", "pressure.bow", 2e-6, low=-8e-5, high=0.04)
    below = cause_of("below", "pressure.bow", 2e-6, low=-0.04, high=8e-5)
    little, up, down = of(study, [narrow, wide, below]).reach
    assert little < 0.03
    assert up == pytest.approx(500.0 * little, rel=1e-3)
    assert down == pytest.approx(up, rel=1e-3)
    reasons = reasons_of(study, [narrow, wide, below])
    assert set(reasons) == {"narrow"}
    assert f"shows at most {little:.2g} times the noise" in reasons["narrow"]


@needs_kernels
def test_both_bounds_of_each_form_are_tried(study):
    for cause in (by_name("creep"), by_name("exhaust_asymmetry"), by_name("supply_droop")):
        for form in cause.forms:
            fits = initial_fits(study.problem, study.family, study.base.fit, cause, form)
            low, high, far = ends(fits)
            for term, free in zip(form.terms, fits[0].frees[-len(form.terms) :], strict=True):
                if term.amount:
                    assert (low[free.place], high[free.place]) == (free.low, free.high)
                    assert free.low <= far[free.place] <= free.high
                else:
                    assert low[free.place] == high[free.place] == pytest.approx(free.start)


@needs_kernels
def test_invisible_start_has_no_absorbed_share(study):
    silent = cause_of("silent", "pressure.bow", 1e-12, low=-0.05, high=0.05)
    found = of(study, [silent, by_name("leak")])
    assert np.isnan(found.absorbed[0])
    assert found.reach[0] > LEAST_SIZE
    assert 0.0 < found.absorbed[1] < 0.5
    bow = of(study, [silent, by_name("sensor_nonlinearity")])
    assert bow.cosine[0, 1] > 0.5  # represented by its effect at the bounds


@needs_kernels
def test_number_of_simulated_columns(study):
    columns = []
    problem = dataclasses.replace(
        study.problem, simulate=lambda c: (columns.append(len(c)), study.problem.simulate(c))[1]
    )
    isolability(problem, study.family, study.base.fit, catalogue())  # looks for starts
    columns.clear()
    isolability(problem, study.family, study.base.fit, catalogue())
    assert sum(columns) <= 270


@needs_kernels
def test_ineffective_form_is_not_testable(study):
    reasons = reasons_of(study, list(catalogue()))
    left = {c.name for c in catalogue()} - set(reasons)
    assert {"creep", "leak", "temperature", "sensor_bias", "stick_slip"} <= left
    unloaded = np.zeros(len(study.recording.time))
    lacking = reasons_of(study, list(catalogue()), load=unloaded, temperature=None)
    assert lacking["payload_error"] == "the load was 0 N throughout"
    assert lacking["temperature"] == "the temperature was not recorded"


@needs_kernels
def test_users_cause_is_judged_like_shipped_ones(study):
    assert reasons_of(study, [users_cause.CAUSE]) == {}
    reasons = reasons_of(study, [users_cause.CAUSE], load=np.full(len(study.recording.time), 20.0))
    assert reasons == {"sprung_load": "the load was 20 N throughout"}


@needs_kernels
def test_without_pressure_similar_causes_are_not_testable(blind, study):
    """A gain of the pressure reading shows in nothing else; a delay imitates another delay."""
    late = cause_of("late", "regulator.dead_time", 0.01)
    later = dataclasses.replace(late, name="later")
    reasons = reasons_of(blind, [late, later, by_name("leak")])
    assert reasons == {
        "late": "cannot be separated from later without pressure_bar",
        "later": "cannot be separated from late without pressure_bar",
    }
    assert reasons_of(study, [late, later]) == {}
    bow = cause_of("bow", "pressure.bow", 0.01)
    assert "shows at most 0 times" in reasons_of(blind, [bow, by_name("leak")])["bow"]
    assert reasons_of(study, [bow]) == {}


def test_load_error_is_compared_with_its_tolerance():
    loads = [0.0, 1.5, 3.0, 6.0]
    assert load_error_limit(loads, 0.02) == pytest.approx(0.03)
    assert may_be_within((-0.01, 0.01), loads, 0.02)
    assert may_be_within((0.025, 0.2), loads, 0.02)  # overlaps the tolerance
    assert not may_be_within((0.035, 0.2), loads, 0.02)
    assert may_be_within((-0.2, -0.025), loads, 0.02)
    assert not may_be_within((-0.2, -0.035), loads, 0.02)
    assert may_be_within((0.035, 0.2), loads, 0.05)
    assert not may_be_within((-0.035, -0.2), loads, 0.02)
    assert not may_be_within((0.035, np.inf), loads, 0.02)
    assert may_be_within((5.0, 6.0), [0.0, 0.0], 0.02)  # no load, no error


@needs_kernels
def test_load_is_refitted_within_its_tolerance(study):
    free = refit_load(study.problem, study.blocks, study.family, study.base, 0.03)
    value = free.fit.values()["mass.load_error"]
    assert abs(value) <= 0.03
    assert free.names == ()
    assert len(free.fit.slopes) == len(free.fit.frees) == len(study.base.fit.frees) + 1
    assert free.fit.cost <= study.base.fit.cost * (1.0 + 1e-6)


@pytest.mark.parametrize(
    ("testable", "asked", "few"),
    [(0, 1, True), (1, 1, False), (2, 3, False), (1, 3, True), (4, 25, True), (5, 25, False)],
)
def test_few_testable_causes_are_insufficient(testable, asked, few):
    assert too_few_testable(testable, asked) is few
