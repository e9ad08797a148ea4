"""Dynamic similarity: the similar muscle moves as the original one."""

import numpy as np
import pytest

from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.fit.similarity import EXPONENTS, Similarity
from pam_envs.diagnosis.fit.single_muscle import start_plant
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.families import base_plant
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import Inputs, replay_rows

N, PERIOD = 400, 0.02
EFFECTS = {
    "muscle.strand_1": 0.5,
    "muscle.strand_per_pressure": 2e-6,
    "muscle.yield_force": 0.3,
    "muscle.viscosity": 2.0,
    "muscle.viscosity_per_pressure": 1e-5,
    "muscle.load_stiffening": 1e-3,
    "hysteresis.stretch": 0.2,
    "hysteresis.threshold": 1e3,
    "regulator.dead_band": 500.0,
    "mass.stick": 0.1,
    "mass.load_error": 0.01,
    "pressure.bias": 300.0,
}


def test_every_unit_of_the_plant_has_its_exponents():
    plant = SingleMuscle()
    assert {plant.declaration(name).unit for name in R.NAMES} <= set(EXPONENTS)


@pytest.mark.parametrize(("diameter", "full"), [(0.003, 3e5), (0.03, 1.5e4), (0.05, 6e5)])
def test_similar_muscle_moves_alike(diameter, full):
    plant = base_plant("mckibben", 0.15, diameter, max_pressure=full)
    wide = (diameter / 0.003) ** 2 * full / 3e5
    effects = {
        name: value * (wide if plant.declaration(name).unit in ("N", "N s/m") else 1.0)
        for name, value in EFFECTS.items()
    }
    effects |= {n: EFFECTS[n] * full / 3e5 for n in EFFECTS if plant.declaration(n).unit == "Pa"}
    plant = plant.replace(effects)
    similar = Similarity.of(plant)
    alike = similar.plant(plant)
    assert alike.muscle.tension(alike.regulator.max_pressure, 0.0) == pytest.approx(
        similar.force * plant.muscle.tension(full, 0.0)
    )
    random = np.random.default_rng(2)
    command = full * np.repeat(random.uniform(0.0, 1.0, N // 25), 25)
    load = np.where(np.arange(N) < N // 2, 0.02, 0.05) * wide

    def replay(one: SingleMuscle, other: Similarity) -> np.ndarray:
        inputs = Inputs(
            PERIOD,
            other.pressure * command,
            other.force * load,
            np.full(N, 293.15),
            np.arange(N) == 0,
            np.zeros(N),
            np.zeros(N, bool),
        )
        return replay_rows(one, one.parameter_rows()[None], inputs)[:, :, 0]

    plain, made = replay(plant, Similarity(1.0, 1.0)), replay(alike, similar)
    assert np.ptp(plain[0]) > 5e-3
    np.testing.assert_allclose(made[0], plain[0], atol=1e-5 * np.ptp(plain[0]))
    np.testing.assert_allclose(made[1], similar.pressure * plain[1], rtol=1e-6, atol=1e-6 * full)
    back = similar.inverse.plant(alike)
    for name in R.NAMES:
        assert back.value(name) == pytest.approx(plant.value(name), rel=1e-9)


def test_muscle_of_10_mm_at_6_bar_is_its_own_similar_one():
    plant = start_plant(Rig())
    similar = Similarity.of(plant)
    assert (similar.force, similar.pressure) == (1.0, 1.0)
    assert similar.plant(plant).digest() == plant.digest()
    orifices = plant.with_air("flow")
    assert Similarity.of(orifices.replace({"regulator.max_pressure": 2e4})).pressure == 1.0
