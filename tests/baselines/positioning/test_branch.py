"""Selection between the branches of inflation and deflation."""

from __future__ import annotations

import numpy as np

from baselines.positioning.branch import DEAD_BAND, first_branch, next_branch


def _run(reference, contraction=0.0):
    branch = first_branch(np.array([reference[0]]), np.array([contraction]))
    taken = []
    for r in reference:
        branch = next_branch(branch, np.array([r]))
        taken.append(bool(branch.inflating[0]))
    return np.array(taken)


def test_start_goes_towards_the_reference():
    assert _run([5e-3], contraction=2e-3)[0]
    assert not _run([5e-3], contraction=8e-3)[0]


def test_steps_choose_at_once_and_keep_while_held():
    steps = np.repeat([2e-3, 8e-3, 5e-3, 6e-3], 50)
    expected = np.repeat([True, True, False, True], 50)
    np.testing.assert_array_equal(_run(steps), expected)


def test_ramp_turns_after_the_dead_band_however_slow():
    ramp = 5e-3 - 1e-7 * np.arange(2000)  # a thousandth of the dead band a period and below
    taken = _run(ramp)
    assert np.flatnonzero(~taken)[0] == np.flatnonzero(ramp < ramp[0] - DEAD_BAND)[0]
    assert not taken[-1]


def test_small_reversals_and_noise_keep_the_branch():
    rng = np.random.default_rng(0)
    rise = np.linspace(1e-3, 10e-3, 500) + rng.uniform(-0.45, 0.45, 500) * DEAD_BAND
    assert _run(rise).all()


def test_extremum_point_is_counted_from_not_the_last():
    creep = np.concatenate([[6e-3, 6e-3 - 0.9 * DEAD_BAND], [6e-3 - 1.2 * DEAD_BAND]])
    np.testing.assert_array_equal(_run(creep), [True, True, False])


def test_rows_are_independent_and_the_old_branch_is_unchanged():
    branch = first_branch(np.array([5e-3, 5e-3]), np.zeros(2))
    after = next_branch(branch, np.array([4e-3, 6e-3]))
    np.testing.assert_array_equal(after.inflating, [False, True])
    np.testing.assert_array_equal(branch.inflating, [True, True])
    np.testing.assert_array_equal(branch.extremum, [5e-3, 5e-3])
