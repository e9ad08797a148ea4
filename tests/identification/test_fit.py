"""Fits to records in time."""

from __future__ import annotations

import numpy as np
import pytest

from pam_envs.identification.fit import FREE, fit_record, jacobian, weights
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate

RANDOM = np.random.default_rng(0)
SET_POINTS = np.repeat(RANDOM.uniform(0, 6e5, 20), 100 if COMPILED else 6)


def test_the_jacobian_is_the_derivative() -> None:
    plant = SingleMuscle.mas10()
    names = ("regulator.time_constant", "muscle.area", "mass.damping", weights(plant)[2])
    outputs, derivatives = jacobian(plant, SET_POINTS, names)
    assert np.array_equal(outputs[0], simulate(plant, SET_POINTS)["contraction"])
    assert derivatives.shape == (4, len(SET_POINTS), 4)
    for k, name in enumerate(names[:3]):
        step = 1e-3 * plant.value(name)
        ends = [plant.replace({name: plant.value(name) + s}) for s in (-step, step)]
        low, high = (simulate(p, SET_POINTS)["contraction"] for p in ends)
        central = (high - low) / (2 * step)
        assert np.abs(derivatives[0, :, k] - central).max() < 0.02 * np.abs(central).max()
    with pytest.raises(ValueError, match="no parameter named"):
        jacobian(plant, SET_POINTS, ("mass.colour",))


@pytest.mark.skipif(not COMPILED, reason="many simulations")
def test_a_record_gives_back_what_made_it_and_says_what_it_cannot() -> None:
    start = SingleMuscle.mas10()
    hidden = {
        "regulator.time_constant": 0.08,
        "regulator.dead_time": 0.033,
        "mass.damping": 400.0,
        "muscle.area": 9.3e-4,
    }
    true = start.replace(hidden)
    clean = simulate(true, SET_POINTS)
    measured = {
        "contraction": clean["contraction"] + 3e-5 * RANDOM.standard_normal(len(SET_POINTS)),
        "pressure": clean["pressure"] + 800.0 * RANDOM.standard_normal(len(SET_POINTS)),
    }
    fit = fit_record(start, SET_POINTS, measured, tuple(hidden))
    assert fit.rms == pytest.approx(1.0, abs=0.05)
    assert fit.rank == 4
    for name, value in hidden.items():
        assert abs(fit.parameters[name] - value) < 5 * fit.standard_errors[name]
        assert fit.standard_errors[name] < 0.05 * value
    everything = fit_record(start, SET_POINTS, measured)
    assert everything.rms == pytest.approx(1.0, abs=0.05)
    assert everything.rank < len(FREE)  # rest length and the law's constants scale together


def test_a_record_that_does_not_fit_together_is_refused() -> None:
    plant = SingleMuscle.mas10()
    with pytest.raises(ValueError, match="not known"):
        fit_record(plant, SET_POINTS, {"force": SET_POINTS})
    with pytest.raises(ValueError, match="one sample for each control period"):
        fit_record(plant, SET_POINTS, {"contraction": SET_POINTS[:5]})
