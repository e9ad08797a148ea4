"""yeh2010: printed transfer functions, their loop, and tracking with the inverse."""

import math

import numpy as np
import pytest
from pages import figures_of

from baselines.knee import published as seed
from baselines.linear.ltr import closed_loop_poles, design_ltr, loop_figures
from benchmarks.papers import figures as papers
from benchmarks.papers import gait
from benchmarks.papers import knee as figures
from benchmarks.papers import knee_studies as studies
from benchmarks.papers.equations import brace
from benchmarks.papers.published import UNKNOWN, VERDICTS, Figure, compared, table

PLANT, CONTROLLER = seed.printed_plant(), seed.printed_controller()


def test_printed_plant():
    poles = np.sort_complex(PLANT.poles())
    np.testing.assert_allclose(
        poles,
        [-12.33, -10.475, -7.495, -7.095, -6.685, -4.055 - 0.823j, -4.055 + 0.823j],
        atol=1e-3,
    )
    np.testing.assert_allclose(np.sort(PLANT.zeros().real), [-9.30, -8.15, -4.19, -3.20], atol=6e-3)
    assert PLANT.dcgain() == pytest.approx(0.7398, abs=5e-5)
    phase = np.degrees(np.unwrap(np.angle(PLANT(1j * 2 * np.pi * np.array([0.1, 0.5, 1, 2])))))
    np.testing.assert_allclose(phase, [-10.6, -55.8, -105.4, -163.8], atol=0.06)
    at_3_db = PLANT(1j * np.array([2.0 * np.pi * 0.824]))[0]
    assert abs(at_3_db) / PLANT.dcgain() == pytest.approx(math.sqrt(0.5), abs=1e-3)


def test_printed_controller_roots():
    upper = [-23.55, -20.53 + 3.99j, -13.87 + 1.09j, -6.417, -5.284]
    found = sorted(CONTROLLER.zeros()[CONTROLLER.zeros().imag > -1e-9], key=lambda z: z.real)
    np.testing.assert_allclose(found, upper, atol=6e-3)
    assert np.min(np.abs(CONTROLLER.poles())) < 1e-9


def test_printed_loop():
    loop = loop_figures(lambda w: PLANT(1j * w) * CONTROLLER(1j * w))
    assert loop.crossover == pytest.approx(9.02, abs=0.005)
    assert math.degrees(loop.phase_margin) == pytest.approx(56.5, abs=0.05)
    assert loop.gain_margin == pytest.approx(2.65, abs=0.005)
    assert loop.delay_margin == pytest.approx(0.109, abs=5e-4)
    assert loop.bandwidth == pytest.approx(20.43, abs=0.005)
    assert loop.peak_sensitivity == pytest.approx(1.635, abs=5e-4)
    assert loop.peak_tracking == pytest.approx(1.058, abs=5e-4)
    assert closed_loop_poles(PLANT, CONTROLLER)[0].real == pytest.approx(-2.84, abs=5e-3)
    slow = np.array([1e-4])
    velocity = abs(PLANT(1j * slow) * CONTROLLER(1j * slow))[0] * 1e-4
    assert velocity == pytest.approx(8.14, abs=0.005)
    s = 1.0 / (1.0 + (PLANT(1j * (w := np.array([0.2 * np.pi]))) * CONTROLLER(1j * w))[0])
    assert abs(s) == pytest.approx(0.076, abs=5e-4)


def test_controller_is_a_design_on_the_inferred_plant():
    refit = seed.refit_controller()
    assert refit.largest_error < 4.5e-4
    inferred = refit.design.plant
    assert inferred.dcgain() == pytest.approx(0.789, abs=5e-4)
    assert refit.fourth_zero == pytest.approx(-69.7, abs=0.05)
    assert refit.design.bandwidth == pytest.approx(62.7, abs=0.05)
    assert refit.design.control_weight == pytest.approx(9.5e-7, abs=0.1e-7)
    w = np.geomspace(0.1, 100.0, 60)
    ours = refit.design.controller(1j * w)
    np.testing.assert_allclose(ours, CONTROLLER(1j * w), rtol=5e-3)
    loop = loop_figures(lambda w: inferred(1j * w) * CONTROLLER(1j * w))
    assert loop.bandwidth == pytest.approx(26.0, abs=0.05)
    assert loop.peak_tracking < 1.001


def test_bandwidth_of_10_hz_gives_the_same_figure():
    assert seed.refit_controller(20.0 * math.pi).largest_error < 6.5e-4


def test_both_plants_fit_the_same_frequency_response():
    w = np.linspace(0.6, 20.0, 200)
    ratio = seed.refit_controller().design.plant(1j * w) / PLANT(1j * w)
    assert 0.92 < np.min(np.abs(ratio)) < np.max(np.abs(ratio)) < 1.14
    assert np.max(np.abs(np.degrees(np.angle(ratio)))) < 5.0


def test_printed_controller_is_no_design_on_the_printed_plant():
    distance = np.abs(CONTROLLER.zeros()[:, None] - PLANT.poles()[None, :]).min(axis=1)
    assert np.max(distance) > 10.0


def test_26_2_hertz_is_not_credible():
    at_100_hz = np.array([200.0 * np.pi])
    needed = design_ltr(PLANT, 2.0 * np.pi * 26.2, 1e-14).controller(1j * at_100_hz)
    assert abs(needed[0]) > 4000.0
    assert abs(CONTROLLER(1j * at_100_hz)[0]) == pytest.approx(0.16, abs=0.005)


def test_without_lag_the_inverse_is_exact():
    assert figures.stiffness_tracking()[0] == pytest.approx(2.07, abs=0.01)
    inverse, line = figures.stiffness_tracking(lag=1e-6)
    assert inverse < 0.01
    assert line > 9.0


def test_without_hysteresis_the_line_equals_the_inverse():
    inverse, line = figures.stiffness_tracking(friction=0.0)
    assert inverse == pytest.approx(line, rel=1e-9)


def test_tension_tracking_preset_dynamic():
    found = [figures.tension_tracking(width) for width in figures.LOOP_WIDTHS]
    for one in found:
        assert 5.0 < one.feedback < 5.52
        assert 0.9 < one.with_inverse < 1.06
        assert one.feedback > 3.5 * one.with_inverse
    narrow, _, wide = found
    assert narrow.with_line == pytest.approx(narrow.with_inverse, rel=1e-6)
    assert 1.4 < wide.with_line / wide.with_inverse < 1.7


def test_every_figure_states_its_origin():
    statics = {name for name, *_ in brace()}
    for name, figure in figures_of("yeh2010").items():
        if name in statics:
            continue
        kind, preset, norm, *_ = figure.note.split("; ")
        assert kind.startswith(("calibrated", "predicted"))
        assert preset.startswith("preset ")
        assert norm
        if "Fig. 8" in figure.source or "section 5.1" in figure.source:
            assert "first 2 s dropped" in norm


def test_fitted_figures_are_inputs_and_equal_the_printed_ones():
    fitted = ("EMG, ", "stiffness, ", "KneeStiffness, ")
    fits = [f for name, f in figures_of("yeh2010").items() if name.startswith(fitted)]
    assert sum(figure.given for figure in fits) == 10
    for figure in fits:
        assert figure.given == figure.note.startswith("calibrated")
        if figure.given:
            printed = figure.expected if figure.printed is None else figure.printed
            assert figure.ours == pytest.approx(printed, abs=figure.tolerance)
            assert figure.verdict == "not checkable"


def test_table_has_a_line_for_each_figure():
    made = list(compared("yeh2010", gait.switching_transient))
    lines = table(made).splitlines()
    assert len(lines) == 6
    assert all("mismatch 10 N" in line for line in lines[1:])
    assert ["reproduced" in line for line in lines[1:]] == [False] * 4 + [True]


@pytest.mark.parametrize(
    ("ours", "more", "verdict"),
    [
        (3.6, {"tolerance": 0.2}, "reproduced"),
        (3.2, {"tolerance": 0.2}, "differs"),
        (5.5, {"tolerance": 0.2, "expected": 5.52}, "differs"),
        (3.6, {}, "reproduced"),
        (3.8, {}, "differs"),
        (5.5, {"published": UNKNOWN, "tolerance": 0.2, "expected": 5.52}, "reproduced"),
        (3.5, {"published": UNKNOWN, "tolerance": 0.2, "expected": 5.52}, "differs"),
        (5.4, {"published": UNKNOWN, "expected": 5.52}, "reproduced"),
        (3.5, {"published": UNKNOWN, "expected": 5.52}, "differs"),
        (1.6, {"published": UNKNOWN, "at_least": 3.5}, "not checkable"),
        (1.6, {"published": UNKNOWN, "at_least": 3.5, "claim": "faster"}, "differs"),
        (1.4, {"published": UNKNOWN, "at_most": 1.5, "claim": "slower"}, "reproduced"),
        (1.4, {"published": UNKNOWN}, "not checkable"),
        (9.0, {"tolerance": 0.1, "given": True, "at_most": 1.0}, "not checkable"),
        (None, {}, "not checkable"),
        (None, {"absent": "not modelled"}, "not modelled"),
    ],
)
def test_figure_is_judged_by_the_printed_value_and_else_by_its_target(ours, more, verdict):
    assert Figure("a", ours, **({"published": 3.5} | more)).verdict == verdict
    assert verdict in VERDICTS


def test_input_is_not_judged_and_a_difference_states_its_reason():
    given = Figure("a", 9.0, published=3.0, tolerance=0.1, given=True, at_most=1.0)
    assert (given.passed, given.target) == (None, "")
    known = Figure("a", 9.0, published=3.0, tolerance=0.1, note="note", why="because")
    assert (known.verdict, known.remark) == ("differs", "note; because")
    right = Figure("a", 3.0, published=3.0, tolerance=0.1, note="note", why="because")
    assert (right.verdict, right.remark) == ("reproduced", "note")
    assert known.record()["why"] == "because"


def test_group_that_fails_is_one_line(monkeypatch):
    def broken():
        """Say what is missing."""
        raise ModuleNotFoundError("no such thing")

    monkeypatch.setattr(papers, "BY_PAPER", {"yeh2010": (broken,)})
    figure, *_ = papers.all_figures()
    assert (figure.name, figure.verdict) == ("Say what is missing", "not checkable")
    assert "no such thing" in figure.note


def test_uncalibrated_proxy_at_the_papers_pace():
    """Share left of a fifth: with Eq. (1), with the delay of the low-pass, with the floor."""
    exact = gait.uncalibrated_change("walk", 5.0, exact=True, floor=0.0)
    late = gait.uncalibrated_change("walk", 5.0, floor=0.0)
    whole = gait.uncalibrated_change("walk", 5.0)
    assert exact == pytest.approx(-0.208, abs=0.005)
    assert late == pytest.approx(-0.127, abs=0.005)
    assert whole == pytest.approx(-0.092, abs=0.005)
    assert gait.uncalibrated_change("walk", 5.0, changes={"leg.aim_height": 0.0}) > -0.06
    assert gait.uncalibrated_change("walk", 1.224) > 0.0


def test_bumpless_transfer_reduces_the_transient_of_a_switch():
    (soft, jump), (hard, plain_jump) = (gait.linear_switch(10.0, b) for b in (True, False))
    assert soft < 15.0 < 40.0 < hard
    assert jump < 10.0 < 150.0 < plain_jump


@pytest.mark.parametrize(
    ("width", "feedback", "line", "over_line"),
    [(0.0, 5.06, 0.95, 1.0), (0.25e5, 5.20, 1.31, 1.3), (0.5e5, 5.37, 1.69, 1.6)],
)
def test_errors_of_printed_feedback_with_either_feedforward(
    width: float, feedback: float, line: float, over_line: float
) -> None:
    errors = studies.tension_errors(width)
    assert errors.with_inverse < 1.33
    assert errors.feedback / errors.with_inverse > 3.5
    assert errors.feedback == pytest.approx(feedback, abs=0.2)
    assert errors.with_line == pytest.approx(line, abs=0.2)
    assert errors.with_line / errors.with_inverse == pytest.approx(over_line, abs=0.1)


def test_designed_feedback_is_at_least_as_good_as_the_printed_one() -> None:
    assert studies.tension_errors(feedback="designed").with_inverse < 1.05


def test_transient_of_a_switch_with_and_without_bumpless_transfer() -> None:
    smooth, bumpy = (studies.switching(10.0, bumpless=b) for b in (True, False))
    assert smooth.tension < 15.0 < 30.0 < bumpy.tension
    assert smooth.excess < 0.5 * bumpy.excess
    assert smooth.tension <= smooth.at_switch + smooth.excess + 1e-9
    assert smooth.command < 0.3e5 < 1e5 < bumpy.command
    assert studies.switching(10.0, preview=True).tension < 15.0


@pytest.mark.parametrize(
    ("activity", "expected"),
    [
        ("walk", (0.891, 1.027, 0.754, 0.733)),
        ("stairs_up", (0.821, 0.886, 0.689, 0.693)),
        ("stairs_down", (0.800, 0.850, 0.729, 0.731)),
    ],
)
def test_emg_reductions_of_the_assistance_delivered_in_the_environment(activity, expected) -> None:
    ratios = studies.emg_ratios(activity)
    names = ("extensors_ratio", "ratio", "extensors_ratio_fitted_a", "extensors_ratio_fitted_b")
    assert [ratios[f"emg_{name}"] for name in names] == pytest.approx(expected, abs=0.01)
