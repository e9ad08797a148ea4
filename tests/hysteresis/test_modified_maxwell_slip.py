"""Modified Maxwell-slip model: forward and inverse, hysteresis, energy."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pam_envs.hysteresis.maxwell_slip import MaxwellSlip
from pam_envs.hysteresis.modified_maxwell_slip import (
    ModifiedMaxwellSlip,
    even_model,
    stiffness_step,
)

RIG = even_model(4.5e5, 7110.0, 0.5e5)
BENT = replace(RIG, spring=tuple(np.array(RIG.spring) + 2e4 * np.sin(np.linspace(0.0, 5.0, 11))))
few = settings(max_examples=60, deadline=None)
pressures = st.lists(st.floats(-2e4, 5e5), min_size=1, max_size=12)
models = st.sampled_from([RIG, BENT, RIG.scaled(0.4), even_model(3e5, 5000.0, 0.2e5, 3)])


@few
@given(models, pressures, pressures)
def test_inverse_cancels_the_model_at_any_history(model, first, second):
    _, state = model.simulate(first)
    stiffness, end = model.simulate(second, state)
    back, same = model.inverse_simulate(stiffness, state)
    np.testing.assert_allclose(back, second, rtol=0.0, atol=1e-6)
    np.testing.assert_array_equal(same, end)


@few
@given(models, pressures, st.lists(st.floats(-500.0, 8000.0), min_size=1, max_size=12))
def test_model_cancels_its_inverse(model, first, stiffnesses):
    _, state = model.simulate(first)
    pressure, _ = model.inverse_simulate(stiffnesses, state)
    np.testing.assert_allclose(model.simulate(pressure, state)[0], stiffnesses, rtol=0.0, atol=1e-8)


@few
@given(models, pressures, st.integers(2, 7))
def test_intermediate_stops_change_nothing(model, history, splits):
    ends = zip([0.0, *history], history, strict=False)
    fine = [v for a, b in ends for v in [*np.linspace(a, b, splits)[1:-1], b]]
    np.testing.assert_allclose(
        model.simulate(fine)[1], model.simulate(history)[1], rtol=0.0, atol=1e-7
    )


@few
@given(models, st.floats(0.0, 4e5), st.floats(0.0, 4e5))
def test_closed_excursion_returns_to_its_reversal_point(model, turn, away):
    stiffness, _ = model.simulate([4.5e5, turn, away if away > turn else turn, turn])
    assert stiffness[3] == pytest.approx(stiffness[1], abs=1e-7)


def test_loop_down_to_zero_pressure_is_the_major_loop():
    stiffness, state = RIG.simulate([0.0, 4.5e5, 0.0])
    np.testing.assert_allclose(stiffness, [0.0, 7110.0, 0.0], atol=1e-8)
    np.testing.assert_allclose(state, RIG.initial_state(), atol=1e-8)


def test_loop_is_about_15_percent_wide_at_mid_pressure():
    rising, _, falling = RIG.simulate([2.25e5, 4.5e5, 2.25e5])[0]
    assert (falling - rising) / 7110.0 == pytest.approx(0.15, abs=0.01)


def test_linear_spring_gives_the_maxwell_slip_model():
    breaks, stiffnesses, spring, segment = RIG.arrays
    straight = (spring[-1] - spring[0]) / (segment * (len(spring) - 1))
    plain = MaxwellSlip(straight, tuple(stiffnesses), tuple(breaks))
    path = np.array([100.0, 5000.0, 2500.0, 6900.0, 40.0, 4000.0])
    ours, _ = RIG.inverse_simulate(path)
    force, _ = plain.simulate(path, RIG.initial_state())
    np.testing.assert_allclose(ours, force + spring[0], rtol=1e-12)


def test_loop_area_is_the_friction_work():
    path = np.concatenate([np.linspace(0.0, 6000.0, 4001), np.linspace(6000.0, 0.0, 4001)[1:]])
    pressure, _ = BENT.inverse_simulate(path)
    area = np.trapezoid(pressure, path)
    turns = [BENT.initial_state()]
    for x in (6000.0, 0.0):
        turns.append(BENT.inverse_step(x, turns[-1])[1])
    held = np.multiply(*BENT.parts[:2])
    work = sum(float(np.abs(b - a) @ held) for a, b in pairwise(turns))
    assert area == pytest.approx(work, rel=1e-3)
    assert work > 0.0


@pytest.mark.parametrize("width", [0.0, 0.5, 1.0])
def test_width_scales_the_loop_between_the_same_tips(width):
    tips = RIG.scaled(width).simulate([0.0, 4.5e5])[0]
    np.testing.assert_allclose(tips, [0.0, 7110.0], atol=1e-8)
    at_middle = [m.inverse_simulate([3555.0, 7110.0, 3555.0])[0] for m in (RIG, RIG.scaled(width))]
    full, scaled = (p[0] - p[2] for p in at_middle)
    assert scaled == pytest.approx(width * full, abs=1e-6)


def test_kernels_scale_the_width_like_scaled():
    path = [1e5, 4e5, 2e5, 3e5]
    state = [[w] for w in RIG.initial_state()]
    ours = [stiffness_step(p, state, 0, *RIG.arrays, 0.3) for p in path]
    np.testing.assert_allclose(ours, RIG.scaled(0.3).simulate(path)[0], rtol=1e-12)


def test_batch_gives_the_bits_of_single_histories():
    rng = np.random.default_rng(0)
    paths = rng.uniform(0.0, 5e5, (7, 20))
    state = BENT.initial_state((7,))
    batch = np.empty_like(paths)
    for t in range(20):
        batch[:, t], state = BENT.step(paths[:, t], state)
    for path, row, end in zip(paths, batch, state, strict=True):
        single, last = BENT.simulate(path)
        np.testing.assert_array_equal(row, single)
        np.testing.assert_array_equal(end, last)


def test_nan_input_leaves_the_state_unchanged():
    state = RIG.simulate([3e5])[1]
    stiffness, after = RIG.step(np.nan, state)
    assert np.isnan(stiffness)
    np.testing.assert_array_equal(after, state)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"spring": (0.0, 1.0, 1.0)}, r"spring\[2\] is 1.0, not above spring\[1\]"),
        ({"spring": (0.0,)}, "spring has 1 knots"),
        ({"segment": 0.0}, "segment is 0.0"),
        ({"stiffnesses": (-1.0,) * 10}, r"stiffnesses\[0\] is -1.0"),
        ({"stiffnesses": (), "break_stiffnesses": ()}, "stiffnesses is empty"),
        ({"break_stiffnesses": (1.0,)}, "break_stiffnesses has 1 values"),
    ],
)
def test_bad_parameters_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        replace(RIG, **change)


def test_more_friction_than_half_the_pressure_is_refused():
    with pytest.raises(ValueError, match="friction is 230000"):
        even_model(4.5e5, 7110.0, 2.3e5)


def test_state_of_another_model_is_refused():
    with pytest.raises(ValueError, match="10 elements"):
        RIG.step(1e5, np.zeros(4))


def test_model_with_every_element_slipping_follows_the_spring():
    model = ModifiedMaxwellSlip((2.0,), (1.0,), (0.0, 10.0, 30.0), 10.0)
    stiffness, _ = model.simulate([22.0, 52.0])
    np.testing.assert_allclose(stiffness, [15.0, 30.0])
