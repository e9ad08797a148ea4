"""Bank of regulators: response of the plant's kernels, choice of the true candidate."""

import dataclasses

import numpy as np
import pytest

from baselines.predictive.regulator import RegulatorBank
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee

PLANT = KneeOrthosis.rig().without_noise()


def commands() -> np.ndarray:
    """Return setpoints [Pa] with ramps at the rate limit and small steps, after 2 bar."""
    levels = 2e5 + 1e5 * np.random.default_rng(4).uniform(-1.0, 1.0, 30)
    return np.concatenate([np.full(3, 2e5), np.repeat(levels, 12)])


@pytest.mark.parametrize("dead_time", [0.0, 0.045, 0.05])
def test_nominal_regulator_is_that_of_the_plant_one_dead_time_ahead(dead_time):
    plant = PLANT.replace({"regulator.dead_time": dead_time})
    bank, given = RegulatorBank.make(plant), commands()
    record = simulate_knee(plant, given, pressure=2e5)["pressure"]
    state, now, ahead = bank.start(np.array([2e5])), [], []
    for command in given:
        ahead.append(bank.arrival(state).pressures[-1, 0])
        state = bank.advance(state, np.array([command]))
        now.append(bank.now(state)[0])
    np.testing.assert_allclose(now, record, rtol=1e-9)
    whole = round(dead_time / 0.01)
    if dead_time == 0.05:
        np.testing.assert_allclose(ahead[: -whole + 1], record[whole - 1 :], rtol=1e-9)


@pytest.mark.parametrize(("dead_time", "slew_rate"), [(0.02, 1.2e6), (0.09, 5e5)])
def test_regulator_is_identified_from_the_sensed_pressure(dead_time, slew_rate):
    true = PLANT.replace({"regulator.dead_time": dead_time, "regulator.slew_rate": slew_rate})
    given = commands()
    record = simulate_knee(true, given, pressure=2e5)["pressure"]
    noisy = dataclasses.replace(PLANT, pressure=KneeOrthosis.rig().pressure)
    bank = RegulatorBank.make(noisy, adaptive=True)
    state = bank.start(np.array([2e5]))
    for command, pressure in zip(given, record, strict=True):
        state = bank.observe(bank.advance(state, np.array([command])), np.array([pressure]))
    best = bank.best(state)[0]
    assert bank.dead_time[best] == pytest.approx(dead_time, abs=0.012)
    assert bank.rate[best] == pytest.approx(slew_rate, rel=0.25)
    nominal = abs(state.pressure[0, 0] - record[-1])
    assert abs(bank.now(state)[0] - record[-1]) < 0.3 * nominal


def test_alike_regulators_share_their_deviations():
    bank = RegulatorBank.make(PLANT, adaptive=True)
    state = bank.start(np.array([1e5, 1e5, 2e5, 2e5]))
    state = bank.observe(state, np.array([1e5, 1.02e5, 2e5, 2e5]))
    shared = bank.alike(state, 2).deviation
    np.testing.assert_array_equal(shared[0], shared[1])
    np.testing.assert_allclose(shared[0], 0.5 * (state.deviation[0] + state.deviation[1]))
    np.testing.assert_array_equal(shared[2:], state.deviation[2:])
