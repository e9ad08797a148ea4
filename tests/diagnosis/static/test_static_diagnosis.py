"""Diagnosis of settled readings: measured tables, and synthetic ones with known truth."""

import dataclasses
import json

import numpy as np
import pytest

from pam_envs.data.tables import load_contraction_table
from pam_envs.diagnosis.static.cells import THRESHOLDS, cells_of, stops
from pam_envs.diagnosis.static.compare import Study
from pam_envs.diagnosis.static.diagnosis import audit_polynomials, diagnose_readings
from pam_envs.diagnosis.static.fit import Fit, check_nested
from pam_envs.diagnosis.static.models import TERMS, predict, units
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from tests.diagnosis.static.synthetic_readings import PRESSURES, table

pytestmark = pytest.mark.xdist_group("static diagnosis")  # one report of the measured tables

TABLE = load_contraction_table()
COMPLIANCE = "load_dependent_compliance"
WIDTH = "load_dependent_hysteresis"
FRICTION = "pressure_dependent_friction"


@pytest.fixture(scope="module")
def measured():
    return diagnose_readings(TABLE)


def _stage(report, *forms):
    return next(r for r in report["readings"]["ladder"] if tuple(r["model"]) == forms)


def _tried(stage, form):
    return next(t for t in stage["tried"] if t["form"] == form)


def _cause(report, name):
    return next(c for c in report["causes"] if c["name"] == name)


def test_measured_causes_are_named_in_the_order_of_evidence(measured):
    assert measured["verdict"] == "named"
    assert [c["name"] for c in measured["causes"]] == [COMPLIANCE, WIDTH, FRICTION]
    assert measured["causes"][0]["form"] == "pressure shift"


def test_noise_floor_is_that_of_the_repeats(measured):
    floor = measured["noise_floor"]["contraction"]
    assert floor["value"] == pytest.approx(0.168, abs=0.001)
    assert floor["from"] == "repeats"


def test_load_blind_model_errs_by_three_noise_floors(measured):
    base = _stage(measured)
    assert base["cells_mm"] == pytest.approx(0.475, abs=0.005)
    assert base["load_left_out_mm"] == pytest.approx(0.634, abs=0.01)
    assert measured["error_before"]["contraction"]["times_floor"] == pytest.approx(2.95, abs=0.1)
    structure = measured["residual_structure"]["before"]["contraction"]
    assert structure["r2"]["load"] == pytest.approx(0.67, abs=0.02)


def test_linear_load_effects_reduce_held_out_load_error_by_30_percent(measured):
    before, after = (
        measured[key]["contraction"]["kinds"]["loads, one held out (mean)"]
        for key in ("error_before", "error_after")
    )
    assert after <= 0.7 * before
    assert after == pytest.approx(0.38, abs=0.015)
    cut = measured["readings"]["loads_left_out"]["cut_percent"]
    assert cut["value"] == pytest.approx(39.7, abs=2.0)
    assert cut["interval"][0] > 10.0
    both = _stage(measured, "pressure shift", "width linear in load")
    assert both["load_left_out_mm"] <= 0.7 * before


def test_zero_referenced_form_of_the_shift_is_an_equal_rival(measured):
    forms = {r["form"]: r for r in measured["rivals"]}
    assert not forms["pressure shift, zeroed at each load"]["excluded"]
    assert forms["smaller stroke"]["excluded"]
    assert any("0.115 bar/kg" in text for text in measured["warnings"])


def test_shift_and_width_have_confidence_intervals(measured):
    shift = _cause(measured, COMPLIANCE)["parameters"][0]
    assert shift["unit"] == "bar/kg"
    assert shift["value"] == pytest.approx(0.077, abs=0.002)
    assert shift["interval"] == pytest.approx([0.065, 0.088], abs=0.004)
    width = _cause(measured, WIDTH)["parameters"][0]
    assert width["value"] == pytest.approx(-0.056, abs=0.003)
    assert width["interval"] == pytest.approx([-0.077, -0.037], abs=0.008)


def test_width_is_significant_only_beside_the_shift(measured):
    alone = _tried(_stage(measured), "width linear in load")
    beside = _tried(_stage(measured, "pressure shift"), "width linear in load")
    assert alone["p"] > 0.3
    assert not alone["accepted"]
    assert beside["p"] < 0.005
    assert beside["accepted"]
    pair = next(p for p in measured["readings"]["pairs"] if p["names"] == [COMPLIANCE, WIDTH])
    assert pair["masked"] == [WIDTH]
    assert "significant only beside load_dependent_compliance" in measured["text"]


def test_residual_creep_and_threshold_are_not_accepted(measured):
    last = measured["readings"]["ladder"][-1]
    assert last["chosen"] is None
    assert {t["name"] for t in last["tried"]} == {"creep", "threshold_pressure"}


def test_exponent_is_post_hoc_and_not_separable_from_dead_zone(measured):
    power, dead = measured["readings"]["load_laws"]
    assert power["value"] == pytest.approx(1.92, abs=0.03)
    assert power["load_left_out_mm"] == pytest.approx(0.22, abs=0.01)
    assert power["status"] == dead["status"] == "post hoc, not held out"
    assert power["cells_mm"] == pytest.approx(dead["cells_mm"], abs=1e-4)
    warnings = " ".join(measured["warnings"])
    assert "measure at least five" in warnings
    assert "the readings do not separate them" in warnings
    assert measured["experiment"]["between"] == ["power", "dead zone"]
    assert "1.5 kg and 3.6 kg" in measured["experiment"]["description"]


def test_noise_floor_is_not_reached(measured):
    assert measured["readings"]["lack_of_fit"]["after"]["F"] > 8.0
    assert measured["error_after"]["contraction"]["times_floor"] == pytest.approx(1.57, abs=0.05)
    assert "The noise floor is not reached" in measured["text"]


def test_audit_finds_drift_unequal_scatter_and_missed_setpoint(measured):
    warnings = " ".join(measured["warnings"])
    assert "drift by +0.033 mm a repeat" in warnings
    assert "scatter differently" in warnings
    (point,) = measured["readings"]["set_points"]
    assert (point["pressure"], point["falling"]) == (5.5, False)
    assert point["loads"] == [0.0, 2.55]
    assert max(point["missed"]) < -0.5
    assert abs(point["others"][0]) < 0.2


def test_same_table_and_seed_give_the_same_report():
    small = table(pressures=PRESSURES[::2], loads=(0.0, 3.0), repeats=2)
    made = [diagnose_readings(small, seed=4) for _ in range(2)]
    for one in made:
        del one["runtime_s"]
    assert json.dumps(made[0]) == json.dumps(made[1])


def test_table_without_load_effect_is_adequate():
    found = diagnose_readings(table(seed=1))
    assert found["verdict"] == "adequate"
    assert found["causes"] == []
    assert found["error_before"]["contraction"]["times_floor"] < 1.1


def test_loops_narrowing_with_load_are_named():
    found = diagnose_readings(table(seed=2, width=lambda m: np.exp(-0.08 * m)))
    assert found["verdict"] == "named"
    assert [c["name"] for c in found["causes"]] == [WIDTH]
    assert "The noise floor is reached" in found["text"]


def test_load_law_of_five_loads_is_held_out():
    loads = (0.0, 1.2, 2.4, 3.6, 4.8)
    found = diagnose_readings(table(loads, seed=3, shift=lambda m: 0.4 * (m / 4.8) ** 2))
    assert [c["name"] for c in found["causes"]] == [COMPLIANCE]
    power = found["readings"]["load_laws"][0]
    assert power["status"] == "held out"
    assert power["value"] == pytest.approx(2.0, abs=0.25)
    linear = found["error_after"]["contraction"]["kinds"]["loads, one held out (mean)"]
    assert power["load_left_out_mm"] < 0.7 * linear


def test_with_one_load_causes_of_the_load_are_not_testable():
    found = diagnose_readings(table((2.0,), seed=4, bend=-0.5))
    untestable = {entry["name"]: entry["reason"] for entry in found["not_testable"]}
    assert untestable[COMPLIANCE] == untestable[WIDTH] == "there is one load"
    assert [c["name"] for c in found["causes"]] == [FRICTION]
    assert found["experiment"] is None


def test_one_repeat_leaves_noise_floor_unknown_and_names_shift():
    found = diagnose_readings(table(repeats=1, seed=5, shift=lambda m: 0.36 * (m / 4.55) ** 1.3))
    assert found["noise_floor"]["contraction"]["value"] is None
    assert found["causes"][0]["name"] == COMPLIANCE
    assert "pressures, one held out" in found["error_after"]["contraction"]["kinds"]
    assert any("noise floor is not known" in text for text in found["warnings"])


def test_copied_repeats_are_reported_and_give_no_noise_floor():
    one = table((0.0, 3.0), repeats=1, pressures=PRESSURES[::2])
    columns = {f.name: np.tile(getattr(one, f.name), 2) for f in dataclasses.fields(one)}
    columns["repeat"] = np.repeat([1, 2], len(one.repeat))
    found = diagnose_readings(dataclasses.replace(one, **columns))
    assert found["noise_floor"]["contraction"]["value"] is None
    assert any("one is a copy" in text for text in found["warnings"])


def test_common_zero_reference_is_named_stretch_at_rest():
    one = table((0.0, 2.0, 4.0), repeats=2, pressures=PRESSURES[::2])
    sunk = one.contraction_m - 1e-3 * one.load_kg + 1e-4
    found = diagnose_readings(dataclasses.replace(one, contraction_m=sunk))
    assert [c["form"] for c in found["causes"]] == ["stretch at rest"]
    assert found["causes"][0]["parameters"][0]["value"] == pytest.approx(1.0, abs=0.05)


def test_without_deflation_friction_is_not_testable():
    found = diagnose_readings(table(repeats=2, pressures=np.arange(0.0, 6.25, 0.25)))
    untestable = {entry["name"]: entry["reason"] for entry in found["not_testable"]}
    assert untestable[WIDTH] == untestable[FRICTION] == "the pressure was never lowered"
    assert found["verdict"] == "adequate"


def test_too_few_cells_are_insufficient():
    found = diagnose_readings(table((0.0,), pressures=PRESSURES[::3], repeats=2))
    assert found["verdict"] == "insufficient"
    assert "Measure more pressures" in found["text"]


def test_readings_that_are_all_zero_are_refused():
    with pytest.raises(ValueError, match="readings at several pressures"):
        diagnose_readings(dataclasses.replace(TABLE, contraction_m=0.0 * TABLE.contraction_m))


PUBLISHED = {
    "(1)": (0.0, True, (-0.053, 0.718, 0.079, 0.096)),
    "(2)": (0.0, False, (-0.118, 1.005, 0.684, 0.296)),
    "(3)": (2.55, True, (-0.053, 0.718, 0.079, 0.096)),
    "(4)": (2.55, False, (-0.120, 1.092, 0.180, 0.439)),
    "(5)": (4.55, True, (-0.055, 0.786, -0.421, 0.071)),
    "(6)": (4.55, False, (-0.106, 1.016, 0.005, 0.270)),
}


def test_published_polynomial_3_is_found_to_be_a_copy_of_1():
    found = audit_polynomials(TABLE, PUBLISHED)
    by_name = {e["name"]: e for e in found["equations"]}
    assert by_name["(3)"]["copy_of"] == "(1)"
    assert by_name["(3)"]["rms"] == pytest.approx(0.372, abs=5e-4)
    assert by_name["(3)"]["best"]["load"] == 0.0
    assert by_name["(3)"]["best"]["rms"] == pytest.approx(0.218, abs=5e-4)
    assert [e["copy_of"] for name, e in by_name.items() if name != "(3)"] == [None] * 5
    first, second = found["discrepancies"]
    assert first.startswith("equation (3) is a copy of (1)")
    assert second.startswith("equation (5) misses")


def test_polynomials_that_fit_their_readings_raise_no_discrepancy():
    right = {k: PUBLISHED[k] for k in ("(1)", "(2)", "(4)", "(6)")}
    assert audit_polynomials(TABLE, right)["discrepancies"] == []


def test_lags_are_those_of_play_operators_on_any_path():
    path = np.array([0.0, 0.4, 0.9, 0.3, 0.6, 0.1, 1.0, 0.0])
    lags = stops(path[None], np.arange(len(path))[:, None])
    for lag, half in zip(lags, THRESHOLDS, strict=True):
        play, _ = PlayOperator((half,), (1.0,), 0.0).simulate(path)
        np.testing.assert_allclose(lag[0], path - play, atol=1e-15)


def test_every_term_is_neutral_at_its_neutral_value():
    study = Study(cells_of(table(pressures=PRESSURES[::2], repeats=2)))
    values = study.base.fit.values()
    plain = predict(study.cells, values)
    for number in (term.number for term in TERMS):
        neutral = values | {number.name: np.array([[number.neutral]])}
        np.testing.assert_allclose(predict(study.cells, neutral), plain, atol=1e-9)


def test_fit_worse_than_nested_model_is_refused():
    parent = Fit((), np.zeros((1, 9)), np.array([1.0]))
    child = Fit(TERMS[:1], np.zeros((1, 10)), np.array([1.1]))
    with pytest.raises(RuntimeError, match="fits worse"):
        check_nested([parent], child)


def test_units_convert_to_bar_and_kg():
    assert units(TERMS[0].number, (4.55, 6e5, 0.0151)) == pytest.approx(6.0 / 4.55)
