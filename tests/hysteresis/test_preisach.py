"""Preisach operator: sum of relays, hysteresis properties, inverse."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pam_envs.hysteresis.everett import (
    everett,
    symmetry_error,
    table_from_weights,
    weights_from_table,
)
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach, PreisachState

Array = NDArray[np.float64]
LOW, HIGH, CELLS = -1.0, 1.0, 8
LEVELS = np.linspace(LOW, HIGH, CELLS + 1)

few = settings(max_examples=100, deadline=None)
inputs = st.floats(LOW, HIGH, allow_subnormal=False)
histories = st.lists(inputs, min_size=1, max_size=14)


@st.composite
def relay_weights(draw: st.DrawFn, symmetric: bool = False) -> Array:
    """Draw weights per cell; the diagonal is above 0, so that there is an inverse."""
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    weights = np.tril(rng.uniform(0.0, 1.0, (CELLS, CELLS)) * (rng.random((CELLS, CELLS)) < 0.7))
    weights += np.diag(rng.uniform(0.3, 1.0, CELLS))
    return weights + weights[::-1, ::-1].T if symmetric else weights


@st.composite
def operators(draw: st.DrawFn, depth: int = 40) -> Preisach:
    virgin = draw(st.booleans())
    weights = draw(relay_weights(symmetric=virgin))
    start, output = ("virgin", 0.0) if virgin else ("low", draw(st.floats(-1.0, 1.0)))
    return Preisach.from_weights(weights, LOW, HIGH, depth, start, output)


def scale(operator: Preisach) -> float:
    return float(np.max(operator.everett))


# --- against relays ------------------------------------------------------------------------------


class Relays:
    """All relays of all cells by brute force, ``fine`` by ``fine`` of them a cell."""

    def __init__(self, weights: Array, fine: int, virgin: bool) -> None:
        near = np.eye(len(weights))[:, None, :, None]
        inner = np.eye(fine)[None, :, None, :]
        # relays of a cell are spread evenly; on the diagonal they are free of hysteresis
        share = near * inner / fine + (1.0 - near) / fine**2
        size = len(weights) * fine
        self.weights = (weights[:, None, :, None] * share).reshape(size, size)
        middle = LOW + (HIGH - LOW) * (np.arange(size) + 0.5) / size
        self.up, self.down = middle[:, None], middle[None, :]
        centre = self.up + self.down
        self.on = (centre < 0.0) if virgin else np.zeros((size, size), bool)
        self.half = virgin * (np.abs(centre) < 1e-9)  # relays on the virgin line: half of them up
        self.start = float(np.sum(self.weights * (self.on + 0.5 * self.half)))

    def __call__(self, x: float) -> float:
        up, down = self.up < x, self.down > x
        self.half = self.half * ~(up | down)
        self.on = (self.on | up) & ~down
        return float(np.sum(self.weights * np.where(self.half > 0, 0.5, self.on))) - self.start


@few
@given(relay_weights(), st.lists(st.integers(0, 4 * CELLS), min_size=1, max_size=14))
def test_output_is_the_sum_of_all_relays(weights, history):
    operator = Preisach.from_weights(weights, LOW, HIGH, 40)
    relays = Relays(weights, 4, False)
    x = LOW + (HIGH - LOW) * np.array(history) / (4 * CELLS)
    y, _ = operator.simulate(x)
    expected = np.array([relays(value) for value in x])
    np.testing.assert_allclose(y, expected, atol=1e-12 * scale(operator))


@few
@given(relay_weights(symmetric=True), st.lists(st.integers(0, CELLS), min_size=1, max_size=14))
def test_virgin_output_is_the_sum_of_relays_below_the_virgin_line(weights, history):
    operator = Preisach.from_weights(weights, LOW, HIGH, 40, "virgin")
    relays = Relays(weights, 1, True)
    x = LEVELS[history]
    y, _ = operator.simulate(x)
    expected = np.array([relays(value) for value in x])
    np.testing.assert_allclose(y, expected, atol=1e-12 * scale(operator))


def dominant_extrema(history: list[float]) -> tuple[list[float], list[float]]:
    """Return the maxima and the minima that a history from LOW leaves, with its end."""
    maxima, minima, rest = [], [], history
    while True:
        top = len(rest) - 1 - int(np.argmax(rest[::-1]))
        maxima.append(rest[top])
        rest = rest[top:]
        bottom = len(rest) - 1 - int(np.argmin(rest[::-1]))
        if bottom == 0:
            return maxima, minima
        minima.append(rest[bottom])
        rest = rest[bottom:]
        if len(rest) == 1:
            return maxima, minima


@few
@given(operators(), histories)
def test_output_equals_the_sum_over_dominant_extrema(operator, history):
    """Eq. (3.3) with the first-order curve values f, L_0 = low and f(u, u) = f(u)."""
    operator = Preisach(LOW, HIGH, operator.table, 40)
    cells = operator.inverse_cell

    def f(turn: float, end: float) -> float:
        top, bottom = (turn - LOW) * cells, (end - LOW) * cells
        return everett(top, 0.0, operator.everett) - everett(top, bottom, operator.everett)

    history = [LOW, *history]
    if history[-1] == LOW:
        expected = 0.0
    else:
        maxima, minima = dominant_extrema(history)
        lows = [LOW, *minima]
        falling = len(minima) == len(maxima)
        done = zip(maxima, lows[1:], lows[:-1], strict=False)
        expected = sum(f(high, new) - f(high, old) for high, new, old in done)
        if not falling:  # the input is its own last maximum
            expected += f(maxima[-1], maxima[-1]) - f(maxima[-1], lows[-1])
    y, _ = operator.simulate(history)
    assert y[-1] == pytest.approx(expected, abs=1e-12 * scale(operator))


# --- hysteresis ----------------------------------------------------------------------------------


@few
@given(operators(), st.lists(inputs, min_size=2, max_size=14), st.floats(0.0, 1.0))
def test_return_point_hysteresis_is_exact(operator, history, part):
    before, turn = history[-2:]
    y, _ = operator.simulate([*history, turn + part * (before - turn), turn])
    assert y[-1] == y[len(history) - 1]


@few
@given(operators(), histories, inputs)
def test_larger_excursion_wipes_out_smaller_ones(operator, history, last):
    largest = max(map(abs, history))
    through, hysteresis = operator.simulate([largest, -largest, *history, largest, last])
    without, short = operator.simulate([largest, -largest, largest, last])
    assert through[-1] == without[-1]
    assert hysteresis.counts == short.counts
    used = int(short.counts)
    np.testing.assert_array_equal(hysteresis.stack[:used], short.stack[:used])
    np.testing.assert_array_equal(hysteresis.sums[:used], short.sums[:used])


@few
@given(operators(), histories, st.integers(2, 7))
def test_output_is_rate_independent(operator, history, splits):
    y, hysteresis = operator.simulate(history)
    fine = [history[0], history[0]]
    for a, b in pairwise(history):
        fine += [*np.linspace(a, b, splits)[1:-1], b, b]
    z, other = operator.simulate(fine)
    assert z[-1] == y[-1]
    assert other.counts == hysteresis.counts


@few
@given(operators(), histories, histories, inputs, inputs)
def test_minor_loops_are_congruent(operator, one, other, a, b):
    low, high = min(a, b), max(a, b)
    loop = [low, *np.linspace(low, high, 9), *np.linspace(high, low, 9)]
    shapes = []
    for history in (one, other):
        y, _ = operator.simulate([*history, low, high, *loop])
        shapes.append(y[-len(loop) :] - y[-len(loop)])
    assert np.max(np.abs(shapes[0] - shapes[1])) <= 1e-12 * scale(operator)


@few
@given(operators(), st.lists(st.integers(0, CELLS), min_size=2, max_size=8))
def test_closed_cycles_never_create_energy(operator, turns):
    cycle = [*turns, turns[0]]
    ends = pairwise(cycle)
    nodes = [n for a, b in ends for n in range(a, b, 1 if b > a else -1)] + [turns[0]]
    y, _ = operator.simulate(LEVELS[[*cycle, *cycle, *nodes]])
    x, y = LEVELS[nodes], y[-len(nodes) :]
    assert y[-1] == pytest.approx(y[0], abs=1e-12 * scale(operator))
    # linear in the input from level to level: the trapezoidal sum of x dy is exact
    area = np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(y))
    assert area >= -1e-12 * scale(operator)


def test_full_loop_dissipates():
    operator = Preisach.from_weights(np.tril(np.ones((CELLS, CELLS))), LOW, HIGH)
    x = np.concatenate([LEVELS, LEVELS[-2::-1]])
    y, _ = operator.simulate(x)
    area = np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(y))
    # a relay loses its weight times the gap of its thresholds
    up, down = np.tril_indices(CELLS)
    assert area == pytest.approx(np.sum(up - down) * (HIGH - LOW) / CELLS, rel=1e-12)


# --- a full stack, the ends of the range ---------------------------------------------------------

SHRINKING = [0.9 * (-0.8) ** k for k in range(8)]


def test_full_stack_drops_only_the_smallest_loop():
    weights = np.tril(np.ones((CELLS, CELLS)))
    deep = Preisach.from_weights(weights, LOW, HIGH, 40)
    shallow = Preisach.from_weights(weights, LOW, HIGH, 6)
    history = [*SHRINKING, *np.linspace(SHRINKING[-1], 0.95, 41)]
    full, _ = deep.simulate(history)
    short, hysteresis = shallow.simulate(history)
    assert hysteresis.counts <= 6
    assert np.max(np.abs(full - short)) > 1e-3  # a loop was dropped
    kept = np.array(history) > SHRINKING[2]  # beyond the turns that were not stored
    np.testing.assert_array_equal(full[-10:][kept[-10:]], short[-10:][kept[-10:]])
    assert np.any(kept[-10:])


@few
@given(relay_weights(), st.lists(inputs, min_size=2, max_size=20))
def test_full_stack_gives_no_jump(weights, history):
    operator = Preisach.from_weights(weights, LOW, HIGH, 4)
    steepest = np.max(np.diff(operator.everett, axis=0)) * operator.inverse_cell
    path = np.concatenate([np.linspace(a, b, 30) for a, b in pairwise([LOW, *history])])
    y, hysteresis = operator.simulate(path)
    assert hysteresis.counts <= 4
    limit = steepest * np.abs(np.diff(path)) + 1e-12 * scale(operator)
    assert np.all(np.abs(np.diff(y)) <= limit)


@few
@given(operators(), st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=14))
def test_input_beyond_the_range_is_clipped_to_it(operator, history):
    y, _ = operator.simulate(history)
    held, _ = operator.simulate(np.clip(history, LOW, HIGH))
    np.testing.assert_allclose(y, held, atol=1e-12 * scale(operator))


def test_initial_output_is_the_start_output():
    weights = np.tril(np.ones((CELLS, CELLS)))
    low = Preisach.from_weights(weights, 0.0, 6e5, start_output=0.25)
    assert low.simulate([0.0])[0][0] == 0.25
    assert low.simulate([0.0, 6e5, 0.0])[0][-1] == 0.25
    virgin = Preisach.from_weights(weights, LOW, HIGH, start="virgin")
    assert virgin.simulate([0.0])[0][0] == 0.0
    y = virgin.simulate([HIGH, LOW, HIGH])[0]
    np.testing.assert_allclose(y, np.array([1, -1, 1]) * scale(virgin) / 2, rtol=1e-12)


# --- inverse -------------------------------------------------------------------------------------


def invert(operator: Preisach, y: Array, state: PreisachState) -> Array:
    x = np.empty(len(y))
    for t, value in enumerate(y):
        x[t], state = operator.inverse_step(value, state)
    return x


@few
@given(operators(), histories, histories)
def test_inverse_cancels_the_operator_at_any_history(operator, first, second):
    _, state = operator.simulate(first)
    y, _ = operator.simulate(second, state)
    np.testing.assert_allclose(invert(operator, y, state), second, rtol=0.0, atol=1e-9)


@few
@given(operators(), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=14))
def test_operator_cancels_its_inverse(operator, parts):
    ends, _ = operator.simulate([HIGH, LOW])
    outputs = ends[1] + np.array(parts) * (ends[0] - ends[1])
    x = invert(operator, outputs, operator.initial_state())
    y, _ = operator.simulate(x)
    np.testing.assert_allclose(y, outputs, rtol=0.0, atol=1e-9)


distinct = st.lists(st.integers(0, 1000), min_size=2, max_size=20, unique=True)


@few
@given(relay_weights(), distinct)
def test_inverse_is_exact_with_a_full_stack(weights, numbers):
    # no two turns so near that rounding decides which of them is wiped out
    history = LOW + (HIGH - LOW) * np.array(numbers) / 1000
    operator = Preisach.from_weights(weights, LOW, HIGH, 4)
    y, _ = operator.simulate(history)
    np.testing.assert_allclose(invert(operator, y, operator.initial_state()), history, atol=1e-9)


@few
@given(operators(), histories)
def test_inverse_step_leaves_the_same_state_as_a_step(operator, history):
    y, hysteresis = operator.simulate(history)
    state = operator.initial_state()
    for value in y:
        _, state = operator.inverse_step(value, state)
    again, _ = operator.simulate(SHRINKING, state)
    np.testing.assert_allclose(again, operator.simulate(SHRINKING, hysteresis)[0], atol=1e-9)


def test_output_out_of_reach_gives_the_end_of_the_range():
    operator = Preisach.from_weights(np.tril(np.ones((CELLS, CELLS))), LOW, HIGH)
    x = invert(operator, np.array([1e3, -1e3]), operator.initial_state())
    np.testing.assert_allclose(x, [HIGH, LOW])


# --- maps ----------------------------------------------------------------------------------------


@few
@given(relay_weights(), inputs, inputs)
def test_map_is_antisymmetric_and_zero_on_the_diagonal(weights, a, b):
    table = table_from_weights(weights)
    a, b = ((v - LOW) / (HIGH - LOW) * CELLS for v in (a, b))
    assert everett(a, a, table) == 0.0
    assert everett(a, b, table) == -everett(b, a, table)
    np.testing.assert_allclose(weights_from_table(table), weights, atol=1e-12 * np.max(table))


plays_on_grid = st.builds(
    lambda gaps, weights, linear: PlayOperator(
        tuple((np.cumsum(gaps) / CELLS).tolist()), tuple(weights[: len(gaps)]), linear
    ),
    st.lists(st.integers(1, 3), min_size=1, max_size=4),
    st.lists(st.floats(0.05, 2.0), min_size=4, max_size=4),
    st.floats(0.05, 2.0),
)


def come_from_below(operator: PlayOperator) -> Array:
    return LOW + np.array(operator.thresholds)


@few
@given(plays_on_grid, st.lists(st.integers(0, CELLS), min_size=1, max_size=14), st.booleans())
def test_plays_on_the_grid_are_a_preisach_operator(play, history, virgin):
    start, state = ("virgin", None) if virgin else ("low", come_from_below(play))
    operator = Preisach.resembling(play, LOW, HIGH, CELLS + 1, start, 40)
    y, _ = operator.simulate(LEVELS[history])
    np.testing.assert_allclose(y, play.simulate(LEVELS[history], state)[0], atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(plays_on_grid, histories, st.booleans())
def test_plays_between_the_grid_agree_to_the_cell(play, history, virgin):
    start, state = ("virgin", None) if virgin else ("low", come_from_below(play))
    expected = play.simulate(history, state)[0]
    for cells in (32, 256):
        operator = Preisach.resembling(play, LOW, HIGH, cells + 1, start, 40)
        y, _ = operator.simulate(history)
        cell = (HIGH - LOW) / cells
        bound = (len(history) + 1) * 0.25 * sum(play.weights) * cell
        assert np.max(np.abs(y - expected)) <= bound


@few
@given(plays_on_grid, st.floats(0.0, 1.0), st.booleans())
def test_width_has_the_same_effect_on_plays_and_their_preisach_operator(play, width, virgin):
    start = "virgin" if virgin else "low"
    cells = 64
    operator = Preisach.resembling(play, LOW, HIGH, cells + 1, start=start)
    other = Preisach.resembling(play.scaled(width), LOW, HIGH, cells + 1, start=start)
    if 2.0 * play.thresholds[-1] < HIGH - LOW - (HIGH - LOW) / cells:
        assert operator.total_slope == pytest.approx(play.total_slope, rel=1e-9)
    scaled = operator.scaled(width, slope=play.total_slope)
    np.testing.assert_allclose(scaled.everett, other.everett, atol=1e-11)
    assert scaled.start_output == pytest.approx(other.start_output, abs=1e-12)


@few
@given(operators(), histories, st.floats(0.0, 1.0), st.floats(0.0, 3.0))
def test_line_and_width_act_on_the_output(operator, history, width, slope):
    y, _ = operator.simulate(history)
    line = slope * np.array(history)
    z, _ = operator.plus_linear(slope).simulate(history)
    size = 1e-11 * (scale(operator) + slope)
    np.testing.assert_allclose(z, y + line, atol=size)
    narrow, _ = operator.scaled(width, slope).simulate(history)
    np.testing.assert_allclose(narrow, line - width * (line - y), atol=size)


def test_density_is_integrated():
    operator = Preisach.from_density(lambda a, b: 2.0 + a - b, LOW, HIGH, 65)
    # the integral of 2 + a - b over the triangle with legs 2
    assert scale(operator) == pytest.approx(2.0 * 2.0 + 8.0 / 6.0, rel=1e-4)


def test_symmetry_error_has_the_expected_size():
    even = Preisach.from_density(lambda a, b: 1.0 + (a + b) ** 2, LOW, HIGH)
    odd = Preisach.from_density(lambda a, b: 3.0 + a + b, LOW, HIGH)
    assert symmetry_error(even.table) < 1e-12
    assert symmetry_error(odd.table) > 0.05


# --- rows and bits -------------------------------------------------------------------------------


@few
@given(operators(), st.lists(histories, min_size=4, max_size=4))
def test_rows_of_steps_have_the_bits_of_a_simulation(operator, rows):
    length = min(map(len, rows))
    x = np.array([row[:length] for row in rows])
    state = operator.initial_state((2, 2))
    stepped = []
    for column in x.T:
        y, state = operator.step(column.reshape(2, 2), state)
        stepped.append(y.reshape(4))
    for i, row in enumerate(x):
        y, _ = operator.simulate(row)
        assert [v.hex() for v in y] == [float(v[i]).hex() for v in stepped]


def test_step_leaves_the_given_state_unchanged():
    operator = Preisach.from_weights(np.tril(np.ones((CELLS, CELLS))), LOW, HIGH)
    state = operator.initial_state((3,))
    operator.step([0.1, 0.2, 0.3], state)
    operator.inverse_step([1.0, 2.0, 3.0], state)
    for array, fresh in zip(state, operator.initial_state((3,)), strict=True):
        np.testing.assert_array_equal(array, fresh)


# --- errors --------------------------------------------------------------------------------------

LINE = [[0.0, -1.0], [1.0, 0.0]]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Preisach(1.0, 0.0, LINE), r"low is 1.0 and high is 0.0.*swap"),
        (lambda: Preisach(float("nan"), 1.0, LINE), r"nan.*finite"),
        (lambda: Preisach(0.0, 1.0, LINE, depth=2), r"depth is 2.*24"),
        (lambda: Preisach(0.0, 1.0, [[0.0, 1.0]]), r"shape \(1, 2\).*square"),
        (lambda: Preisach(0.0, 1.0, [[0.0, 1.0], [1.0, 0.0]]), r"table\[0\]\[1\] is 1.0.*-E\(a, b"),
        (lambda: Preisach(0.0, 1.0, [[0.0, np.nan], [1.0, 0.0]]), r"table\[0\]\[1\] is nan"),
        (
            lambda: Preisach.from_weights([[1.0, 0.0], [-1.0, 1.0]], 0.0, 1.0),
            r"cell \(1, 0\) is -1.*at least 0",
        ),
        (lambda: Preisach(0.0, 1.0, LINE, start="up"), r"start is 'up'.*choose"),
        (lambda: Preisach(0.0, 1.0, LINE, start="virgin"), r"low = 0.0.*low = -high"),
        (
            lambda: Preisach.from_weights([[1.0, 0.0], [0.0, 2.0]], -1.0, 1.0, start="virgin"),
            r"asymmetric by.*1e-9",
        ),
        (
            lambda: Preisach.from_weights([[1.0, 0.0], [1.0, 0.0]], 0.0, 1.0).inverse_step(
                0.5, Preisach(0.0, 1.0, LINE).initial_state()
            ),
            r"diagonal cell 1 is 0.0.*plus_linear",
        ),
        (
            lambda: Preisach(0.0, 1.0, LINE).simulate(
                [0.5], Preisach(0.0, 1.0, LINE).initial_state((2,))
            ),
            r"batch of shape \(2,\).*use step",
        ),
    ],
)
def test_errors_name_value_bound_and_remedy(make, message):
    with pytest.raises(ValueError, match=message):
        make()
