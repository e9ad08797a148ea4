"""Jacobian of a simulated record."""

from __future__ import annotations

import numpy as np
import pytest

from pam_envs.identification.record_jacobian import jacobian, weights
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate

RANDOM = np.random.default_rng(0)
SET_POINTS = np.repeat(RANDOM.uniform(0, 6e5, 20), 100 if COMPILED else 6)


def test_jacobian_equals_central_differences() -> None:
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
