"""Friction elements driven by length: duality with plays, relays, passivity, kernels."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pam_envs.hysteresis import slip
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.slip import PreisachSlip, SlipModel, StraightSlip

STRAIGHT = StraightSlip((0.1, 0.3, 0.7), (0.3, 0.2, 0.4))
CURVED = PreisachSlip(
    -1.0, 1.0, (0.1, 0.3, 0.7), ((0.3, 0.1, 0.0, 0.2), (0.2, 0.3, 0.2, 0.1), (0.0, 0.5, 0.4, 0.0))
)
MODELS = (STRAIGHT, CURVED)


def path(seed: int, steps: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """Random smooth inputs and limits, both from 0 and 1."""
    random, fine = np.random.default_rng(seed), np.linspace(0.0, 1.0, steps)
    x, limit = (
        np.interp(fine, np.linspace(0.0, 1.0, 13), random.uniform(-1.0, 1.0, 13)) for _ in range(2)
    )
    return x - x[0], 1.0 + limit - limit[0]


@pytest.mark.parametrize("kind", [StraightSlip, PreisachSlip])
def test_lag_at_the_limit_1_is_that_of_the_play_operator(kind: type[SlipModel]) -> None:
    plays = PlayOperator((0.1, 0.3, 0.7), (0.3, 0.2, 0.4), 0.1)
    model = kind.resembling(plays, -1.0, 1.0, 9, "virgin")
    x, _ = path(0)
    np.testing.assert_allclose(model.simulate(x)[0], plays.simulate(x)[0], atol=1e-12)


def test_preisach_slip_is_a_sum_of_relays() -> None:
    """Relays of the given half-gaps and densities, switched one by one, on a fine grid."""
    centres, x = np.linspace(-2.0, 2.0, 40001), path(1)[0]
    cell = centres[1] - centres[0]
    found = CURVED.simulate(x)[0]
    density = [
        np.array(row)[np.clip(((centres + 1.0) * 2.0).astype(int), 0, 3)]
        for row in CURVED.densities
    ]
    up = [centres < 0.0 for _ in CURVED.thresholds]  # those that a virgin slider has passed
    start = [state.copy() for state in up]
    for value, output in zip(x, found, strict=True):
        lag = 0.0
        for k, r in enumerate(CURVED.thresholds):
            up[k] = np.where(
                value >= centres + r, True, np.where(value <= centres - r, False, up[k])
            )
            ahead = (centres < value).astype(float) - (centres < 0.0)
            lag += cell * np.sum(density[k] * (ahead - up[k] + start[k]))
        assert value - output == pytest.approx(lag, abs=1e-3)


@pytest.mark.parametrize("model", MODELS)
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_work_from_the_virgin_state_is_never_negative(model: SlipModel, seed: int) -> None:
    corners, limits = path(seed, 250)
    at = np.linspace(0.0, 249.0, 249 * 16 + 1)  # fine enough for the trapezoidal rule
    x = np.interp(at, np.arange(250), corners)
    limit = np.interp(at, np.arange(250), np.maximum(0.0, limits))
    state, lags = model.initial_state(), [0.0]
    for value, scale in zip(x[1:], limit[1:], strict=True):
        lag, state = model.lag(value, state, scale)
        lags.append(float(lag))
    force = np.array(lags)
    work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(x))
    assert work.min() > -1e-6


@pytest.mark.parametrize("model", MODELS)
def test_friction_vanishes_with_its_limit_and_does_not_come_back(model: SlipModel) -> None:
    lag, state = model.lag(0.5, model.initial_state())
    assert float(lag) > 0.1
    released, state = model.lag(0.5, state, 0.0)
    assert float(released) == 0.0
    assert float(model.lag(0.5, state)[0]) == 0.0


@pytest.mark.parametrize("model", MODELS)
def test_inverse_cancels_the_operator_at_any_history(model: SlipModel) -> None:
    state = model.initial_state((2,))
    for x in path(3)[0][::10]:
        y, after = model.step(np.array([x, -x]), state)
        np.testing.assert_allclose(model.inverse_step(y, state)[0], [x, -x], atol=1e-9)
        state = after


@pytest.mark.parametrize("model", MODELS)
def test_kernels_equal_the_operator(model: SlipModel) -> None:
    straight = isinstance(model, StraightSlip)
    lag_of, peek_of = (
        (slip.straight_lag, slip.straight_peek) if straight else (slip.curved_lag, slip.curved_peek)
    )
    at, table = 3, [[] if straight else model.table_rows().tolist()]  # type: ignore[union-attr]
    fixed = [[v] for v in model.numbers()]
    rows: list[Any] = [[0.0] for _ in range(at + slip.STATE_ROWS)]
    counts, state = [[0]], model.initial_state()
    for x, limit in zip(*path(4), strict=True):
        rows[0][0], rows[at + slip.LIMIT][0] = float(x), max(0.0, float(limit))
        peek_of(rows, fixed, counts, table, at, model.elements, 0, 1, 2, 1, 0, 0, 0, 0, 1)
        lag, after = model.lag(x, state, rows[at + slip.LIMIT][0])
        _, curves, low, per = model.arrays
        cells = np.clip(int((x - low) * per), 0, curves.shape[1] - 2)
        stuck = np.sum((per * np.diff(curves)[:, cells])[after == state])
        assert rows[1][0] == pytest.approx(float(lag), abs=1e-12)
        assert rows[2][0] == pytest.approx(float(stuck), abs=1e-6)
        lag_of(rows, fixed, counts, table, at, model.elements, 0, 1, 1, 0, 0, 0, 0, 1)
        assert rows[1][0] == pytest.approx(float(lag), abs=1e-12)
        state = after


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((1.0, 0.0, (0.1,), ((1.0,),)), "swap them"),
        ((0.0, 1.0, (0.1,), ((-1.0,),)), "create energy"),
        ((0.0, 1.0, (0.1, 0.2), ((1.0,), (1.0, 2.0))), "rows of one length"),
        ((0.0, 1.0, (0.2, 0.1), ((1.0,), (1.0,))), "sort"),
    ],
)
def test_impossible_relays_are_refused(values: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PreisachSlip(*values)
