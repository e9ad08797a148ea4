"""Plays and stops: hysteresis properties to the last bit, duality, and energy."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pam_envs.hysteresis.maxwell_slip import MaxwellSlip, PlayOperator

Array = NDArray[np.float64]
Step = Callable[[float, Array], Array]
BOUND = 4.0
NEVER_SATURATED = 5.0  # a threshold that inputs within +-BOUND cannot sweep over

inputs = st.floats(-BOUND, BOUND, allow_subnormal=False)
histories = st.lists(inputs, min_size=1, max_size=12)
few = settings(max_examples=100, deadline=None)


@st.composite
def elements(draw: st.DrawFn) -> tuple[tuple[float, ...], tuple[float, ...]]:
    gaps = draw(st.lists(st.floats(0.05, 1.0), min_size=1, max_size=4))
    sizes = draw(st.lists(st.floats(0.02, 2.0), min_size=len(gaps) + 1, max_size=len(gaps) + 1))
    return (*np.cumsum(gaps).tolist(), NEVER_SATURATED), tuple(sizes)


@st.composite
def plays(draw: st.DrawFn) -> PlayOperator:
    thresholds, weights = draw(elements())
    return PlayOperator(thresholds, weights, draw(st.floats(0.05, 2.0)))


@st.composite
def slips(draw: st.DrawFn) -> MaxwellSlip:
    breaks, stiffnesses = draw(elements())
    return MaxwellSlip(draw(st.floats(0.05, 2.0)), stiffnesses, breaks)


def run(step: Step, x: list[float], state: Array) -> Array:
    for value in x:
        state = step(value, state)
    return state


def exact(operator: PlayOperator) -> Step:
    return lambda x, state: operator.step(x, state)[1]


def leaky(operator: PlayOperator) -> Step:
    """Return a mutant that loses 0.1 % a step, which the properties below must detect."""
    return lambda x, state: operator.step(x, 0.999 * state)[1]


# --- errors of the properties ---------------------------------------------------------------------


def return_point_error(step: Step, start: Array, history: list[float], part: float) -> float:
    """Return the change of the state by an excursion that returns to its turn."""
    before, turn = history[-2:]
    at_turn = run(step, history, start)
    back = run(step, [turn + part * (before - turn), turn], at_turn)
    return float(np.max(np.abs(back - at_turn)))


def wiping_error(step: Step, start: Array, history: list[float]) -> float:
    """Return the trace that a history leaves after an excursion larger than all of it."""
    largest = max(map(abs, history))
    through = run(step, [largest, -largest, *history, largest], start)
    without = run(step, [largest, -largest, largest], start)
    return float(np.max(np.abs(through - without)))


def refinement_error(step: Step, start: Array, history: list[float], splits: int) -> float:
    coarse = run(step, history, start)
    ends = zip([history[0], *history], history, strict=False)
    fine = [float(v) for a, b in ends for v in [*np.linspace(a, b, splits)[:-1], b]]
    return float(np.max(np.abs(run(step, fine, start) - coarse)))


@few
@given(plays(), st.lists(inputs, min_size=2, max_size=12), st.floats(0.0, 1.0))
def test_return_point_hysteresis_is_exact(operator, history, part):
    assert return_point_error(exact(operator), operator.initial_state(), history, part) == 0.0


@few
@given(plays(), histories)
def test_larger_excursion_wipes_out_smaller_ones(operator, history):
    assert wiping_error(exact(operator), operator.initial_state(), history) == 0.0


@few
@given(plays(), histories, st.integers(2, 7))
def test_output_is_rate_independent(operator, history, splits):
    assert refinement_error(exact(operator), operator.initial_state(), history, splits) == 0.0


@given(plays())
@settings(max_examples=20, deadline=None)
def test_properties_detect_a_leaky_play(operator):
    step, start = leaky(operator), operator.initial_state()
    history = [3.9, -3.0, 3.5, -2.5, 3.0]
    scale = np.max(np.abs(run(step, history, start)))
    # the outer element is not swept: the test would be vacuous without one
    driven = [10.0, *history]
    assert return_point_error(step, start, driven, 0.4) > 1e-4 * scale
    assert wiping_error(step, run(step, [20.0], start), history) > 1e-4 * scale
    assert refinement_error(step, start, driven, 5) > 1e-4 * scale
    assert congruency_gap(operator, step, driven, [20.0, -1.0], -1.0, 1.0) > 1e-6


def congruency_gap(
    operator: PlayOperator, step: Step, one: list[float], other: list[float], low: float,
    high: float,
) -> float:  # fmt: skip
    """Return the relative difference of one minor loop in two histories."""
    shapes = []
    for history in (one, other):
        # once round the loop first: a fresh loop may still be closing
        state = run(step, [*history, low, high, low], operator.initial_state())
        shape = []
        for value in [*np.linspace(low, high, 9), *np.linspace(high, low, 9)]:
            state = step(value, state)
            shape.append(operator.linear * value + state @ np.array(operator.weights))
        shapes.append(np.array(shape) - shape[0])
    scale = operator.total_slope * BOUND
    return float(np.max(np.abs(shapes[0] - shapes[1]))) / scale


@few
@given(plays(), histories, histories, inputs, inputs)
def test_minor_loops_are_congruent(operator, one, other, a, b):
    gap = congruency_gap(operator, exact(operator), one, other, min(a, b), max(a, b))
    assert gap <= 1e-12


# --- inverse --------------------------------------------------------------------------------------


@few
@given(st.one_of(plays(), slips()), histories, histories)
def test_inverse_cancels_the_operator_at_any_history(operator, first, second):
    inverse = operator.inverse()
    _, state = operator.simulate(first)
    y, _ = operator.simulate(second, state)
    x, _ = inverse.simulate(y, operator.inverse_state(state))
    np.testing.assert_allclose(x, second, rtol=0.0, atol=1e-9)


@few
@given(st.one_of(plays(), slips()), histories, histories)
def test_operator_cancels_its_inverse(operator, first, second):
    inverse = operator.inverse()
    _, state = inverse.simulate(first)
    x, _ = inverse.simulate(second, state)
    y, _ = operator.simulate(x, inverse.inverse_state(state))
    np.testing.assert_allclose(y, second, rtol=0.0, atol=1e-9)


@few
@given(st.one_of(plays(), slips()), histories)
def test_inverse_round_trips_states_and_parameters(operator, history):
    inverse = operator.inverse()
    again = inverse.inverse()
    _, state = operator.simulate(history)
    back = inverse.inverse_state(operator.inverse_state(state))
    np.testing.assert_allclose(back, state, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(again.simulate(history)[0], operator.simulate(history)[0], atol=1e-9)
    assert again.total_slope == pytest.approx(operator.total_slope, rel=1e-12)


def test_play_without_width_is_part_of_the_line():
    operator = PlayOperator((0.0, 0.5), (0.3, 0.4), 0.0)
    x = np.array([0.2, 1.5, -0.7, 0.4, 0.1, 2.0])
    y, state = operator.simulate(x)
    back, inverse_state = operator.inverse().simulate(y)
    np.testing.assert_allclose(back, x, atol=1e-12)
    np.testing.assert_allclose(operator.inverse_state(state), inverse_state, atol=1e-12)


def test_inverse_slopes_are_reciprocal():
    operator = PlayOperator((0.5, 1.0), (1.0, 2.0), 1.0)
    inverse = operator.inverse()
    assert inverse.spring == pytest.approx(1 / 4)
    assert inverse.stiffnesses == pytest.approx((1 - 1 / 2, 1 / 2 - 1 / 4))
    assert inverse.break_displacements == pytest.approx((0.5, 0.5 + 2 * 0.5))


# --- energy ---------------------------------------------------------------------------------------

steps_on_lattice = st.lists(st.integers(-16, 16), min_size=2, max_size=10)


def lattice_path(turns: list[int]) -> Array:
    """Walk through the turns in quarters: every kink of the models below is on the way."""
    x = [0.0]
    for turn in turns:
        here = round(4 * x[-1])
        x += [k / 4 for k in range(here, turn, 1 if turn > here else -1)][1:]
        x.append(turn / 4)
    return np.array(x)


def work(force: Array, x: Array) -> float:
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x)))


def dissipated(model, before, after) -> float:
    """Return the work lost between two states, the input having moved monotonically."""
    thresholds, gains, _ = model.parts
    return float(np.abs(after - before) @ (gains * thresholds))


@few
@given(steps_on_lattice, st.lists(st.floats(0.0, 3.0), min_size=3, max_size=3))
def test_work_is_stored_or_dissipated(turns, stiffnesses):
    model = MaxwellSlip(0.7, tuple(stiffnesses), (0.25, 0.75, 1.5))
    x = lattice_path(turns)
    state, force, lost = model.initial_state(), [], 0.0
    for value in x:
        f, after = model.step(value, state)
        step_loss = dissipated(model, state, after)
        assert step_loss >= 0.0
        force.append(float(f))
        lost, state = lost + step_loss, after
    stored = 0.5 * model.spring * x[-1] ** 2 + 0.5 * (x[-1] - state) ** 2 @ stiffnesses
    total = work(np.array(force), x)
    assert total == pytest.approx(lost + stored, abs=1e-10)


@few
@given(steps_on_lattice, st.lists(st.floats(0.0, 3.0), min_size=3, max_size=3))
def test_closed_cycles_lose_their_loop_area(turns, weights):
    operator = PlayOperator((0.25, 0.75, 1.5), tuple(weights), 0.3)
    cycle = [*turns, turns[0]]
    _, first = operator.simulate(lattice_path(cycle))
    x = lattice_path([*cycle, *cycle])[len(lattice_path(cycle)) - 1 :]
    state, lost, y = first, 0.0, [operator.step(x[0], first)[0]]
    for value in x[1:]:
        out, after = operator.step(value, state)
        lost += dissipated(operator, state, after)
        y.append(out)
        state = after
    np.testing.assert_array_equal(state, first)
    assert lost >= 0.0
    assert work(x, np.array(y)) == pytest.approx(lost, abs=1e-11)


def test_major_loop_area_is_the_sum_of_break_forces():
    model = MaxwellSlip(1.0, (2.0, 4.0), (0.25, 0.5))
    x = lattice_path([8, -8, 8])
    force, _ = model.simulate(x)
    corner = np.flatnonzero(x == 2.0)
    area = work(force[corner[0] : corner[1] + 1], x[corner[0] : corner[1] + 1])
    friction = 2.0 * 0.25 + 4.0 * 0.5
    # each element slips over the stroke less twice its break displacement, both ways
    expected = 2 * (2.0 * 0.25 * (4.0 - 0.5) + 4.0 * 0.5 * (4.0 - 1.0))
    assert area == pytest.approx(expected, rel=1e-12)
    assert force[corner[0]] == pytest.approx(2.0 + friction)


# --- scaling, rows, bits --------------------------------------------------------------------------


@few
@given(st.one_of(plays(), slips()), histories, st.floats(0.0, 1.5))
def test_width_scales_the_hysteretic_part_alone(operator, history, width):
    y, _ = operator.simulate(history)
    line = operator.total_slope * np.array(history)
    scaled, _ = operator.scaled(width).simulate(history)
    scale = 1.0 + np.max(np.abs(y)) + np.max(np.abs(line))
    np.testing.assert_allclose(scaled, line - width * (line - y), atol=1e-12 * scale)


@few
@given(st.one_of(plays(), slips()), st.lists(histories, min_size=2, max_size=3))
def test_rows_of_steps_have_the_bits_of_a_simulation(operator, rows):
    length = min(map(len, rows))
    x = np.array([row[:length] for row in rows])
    state = operator.initial_state((len(rows),))
    stepped = []
    for column in x.T:
        y, state = operator.step(column, state)
        stepped.append(y)
    for i, row in enumerate(x):
        y, last = operator.simulate(row)
        assert [v.hex() for v in y] == [float(v[i]).hex() for v in stepped]
        assert [v.hex() for v in last] == [v.hex() for v in state[i]]


# --- errors ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PlayOperator((-0.5,), (1.0,), 1.0), r"thresholds\[0\] is -0.5.*at least 0"),
        (lambda: PlayOperator((1.0, 0.5), (1.0, 1.0), 1.0), r"thresholds\[1\] is 0.5.*sort"),
        (lambda: PlayOperator((0.5, 0.5), (1.0, 1.0), 1.0), r"thresholds\[1\] is 0.5.*join"),
        (lambda: PlayOperator((float("nan"),), (1.0,), 1.0), r"thresholds\[0\] is nan.*finite"),
        (lambda: PlayOperator((0.5,), (float("inf"),), 1.0), r"weights\[0\] is inf.*finite"),
        (lambda: PlayOperator((0.5,), (1.0, 2.0), 1.0), r"thresholds has 1 values and weights"),
        (lambda: PlayOperator((0.5,), (-1.0,), 2.0).inverse(), r"weights\[0\] is -1.0.*inverse"),
        (lambda: PlayOperator((0.5,), (1.0,), 0.0).inverse(), r"initial slope is 0.0.*above 0"),
        (lambda: PlayOperator((0.5,), (1.0,), 0.0).scaled(-0.1), r"width\[0\] is -0.1.*at least 0"),
        (lambda: MaxwellSlip(1.0, (-1.0,), (0.5,)), r"stiffnesses\[0\] is -1.0.*at least 0"),
        (lambda: MaxwellSlip(-1.0, (1.0,), (0.5,)), r"spring\[0\] is -1.0.*at least 0"),
        (lambda: MaxwellSlip(0.0, (1.0,), (0.5,)).inverse(), r"spring is 0.0.*above 0"),
        (lambda: PlayOperator((0.5,), (1.0,), 1.0).simulate([[1.0]]), r"2 dimensions.*use step"),
        (
            lambda: PlayOperator((0.5,), (1.0,), 1.0).simulate([1.0], np.zeros((2, 1))),
            r"shape \(2, 1\).*use step",
        ),
    ],
)
def test_errors_name_value_bound_and_remedy(make, message):
    with pytest.raises(ValueError, match=message):
        make()
