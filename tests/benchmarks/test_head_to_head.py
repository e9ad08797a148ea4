"""A mass-spring-damper with hidden dry friction: flagged and named by ours; the page and its rows.

MuJoCo is not needed here.
"""

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.head_to_head import page as head_to_head_page
from benchmarks.head_to_head import rig as mass_spring_damper_rig
from benchmarks.head_to_head import run as head_to_head
from benchmarks.head_to_head.mass_spring_damper import CAUSES, MassSpringDamper
from benchmarks.head_to_head.rig import NOISE, PERIOD, Oscillator, another, campaign
from benchmarks.head_to_head.run import Case, diagnose

SEED = 7


@pytest.fixture(scope="module")
def force():
    return campaign(SEED)


def test_rig_satisfies_its_equation_of_motion():
    rig = Oscillator.drawn(SEED)
    force = another(SEED)[:600]
    state, found = np.zeros(2), []
    for value in force:
        found.append(state[0])
        state = solve_ivp(
            lambda _, y, f=value: [
                y[1],
                (f - rig.damping * y[1] - rig.stiffness * y[0]) / rig.mass,
            ],
            (0.0, PERIOD),
            state,
            rtol=1e-9,
            atol=1e-12,
        ).y[:, -1]
    np.testing.assert_allclose(rig.positions(force), found, atol=1e-8)


def test_static_friction_holds_mass_until_breakaway():
    rig = Oscillator(friction=1.0, breakaway=1.2)
    ramp = np.linspace(0.0, 3.0, 301)
    moved = np.flatnonzero(rig.positions(ramp) != 0.0)
    assert ramp[moved[0] - 1] == pytest.approx(1.2, abs=0.011)  # the force of the step before


def test_friction_stops_oscillation_within_its_dead_zone():
    rig = Oscillator(friction=1.0, breakaway=1.0)
    force = np.concatenate([np.full(300, 8.0), np.zeros(500)])
    x = rig.positions(force)
    assert np.ptp(x[-100:]) == 0.0
    assert 0.0 < abs(x[-1]) <= 1.0 / rig.stiffness


@pytest.mark.parametrize(
    ("friction", "most"), [(0.0, 1e-4), (1.0, 4e-4)], ids=["plain", "friction"]
)
def test_rig_and_candidate_agree_on_the_same_plant(force, friction, most):
    rig = Oscillator(friction=friction)
    family = MassSpringDamper(force, PERIOD, {"friction.force": friction})
    shown = family.simulate(family.column[None])[0, :, 0]
    off = np.sqrt(np.mean((shown - rig.positions(force)) ** 2))
    assert 0.0 < off < most  # two integrators: near, not the same


def test_rig_shares_no_code_with_the_fitted_model():
    tree = ast.parse(Path(mass_spring_damper_rig.__file__).read_text(encoding="utf-8"))
    names = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    names |= {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert names == {"math", "dataclasses", "numpy", "numpy.typing"}


@pytest.mark.parametrize("cause", CAUSES, ids=lambda c: c.name)
def test_cause_is_neutral_before_the_fit(force, cause):
    family = MassSpringDamper(force[:3000], PERIOD, {})
    plain = family.simulate(family.column[None])
    for form in cause.forms:
        for term in form.terms:
            assert term.name in {*family.parameters} - {*family.base_names}
        column = family.column
        for term in form.terms:
            if not term.amount:
                column[family.free(term.name).place] = term.starts[0]
        np.testing.assert_array_equal(family.simulate(column[None]), plain)
        for term in form.terms:
            column[family.free(term.name).place] = term.starts[0]
        assert np.abs(family.simulate(column[None]) - plain).max() > 0.1 * NOISE


@pytest.mark.parametrize("friction", head_to_head.FRICTIONS)
def test_hidden_friction_is_named_and_clean_rig_is_adequate(force, friction):
    rig = Oscillator.drawn(SEED, friction=friction)
    found = diagnose(force, rig.readings(force, SEED))
    decision = found.decision
    if friction == 0.0:
        assert decision.verdict == "adequate"
        assert decision.model.names == ()
        assert found.error(found.base) < 1.1
        return
    assert decision.verdict == "named"
    assert decision.model.names == ("dry_friction",)
    assert decision.model.fit.values()["friction.force"] == pytest.approx(friction, rel=0.1)
    assert found.error(found.base) > 3.0
    assert found.error(decision.model) < 0.5 * found.error(found.base)
    damping = found.base.fit.values()["damping"] / rig.damping
    assert damping > 1.5  # what a refit alone makes of friction


def test_other_effect_is_not_named_friction(force):
    case = Case(SEED, "dead_time", head_to_head.OTHERS["dead_time"])
    found = diagnose(force, case.rig.readings(force, SEED))
    assert found.decision.verdict == "named"
    assert found.decision.model.names == ("dead_time",)
    delay = found.decision.model.fit.values()["actuator.dead_time"]
    assert delay == pytest.approx(0.03, abs=0.002)


def test_table_rows_must_have_all_columns():
    with pytest.raises(ValueError, match="a row of 1 cells in a table of 2 columns"):
        head_to_head_page.table(["a", "b"], [["1"]])


def test_page_matches_the_results():
    assert head_to_head.PAGE.read_text(encoding="utf-8") == head_to_head_page.page(
        head_to_head.written()
    )


def test_results_flag_every_friction_and_clear_every_plain_rig():
    levels = head_to_head_page.by_friction(head_to_head.written()["rows"])
    assert tuple(levels) == head_to_head.FRICTIONS
    for friction, rows in levels.items():
        assert len(rows) >= 20
        assert all(head_to_head_page.flagged(row) == (friction > 0.0) for row in rows)
        if friction > 0.0:
            assert all(row["ours"]["causes"][0] == "dry_friction" for row in rows)


def test_page_without_mujoco_states_it():
    result = head_to_head.written()
    for row in result["rows"]:
        for key in ("sysid", "sysid_told"):
            row.pop(key, None)
    text = head_to_head_page.page(result)
    assert "its side was not run" in text
    assert "sysid: issues" not in text
