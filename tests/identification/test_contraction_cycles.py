"""The shipped plants are identified from the shipped readings, with their identifiability."""

import dataclasses

import numpy as np
import pytest

from pam_envs.data.tables import load_contraction_table
from pam_envs.hysteresis.protocol import kinds
from pam_envs.identification import contraction_cycles as cc
from pam_envs.identification.mas10 import minor_loops
from pam_envs.plants.single_muscle.plant import SingleMuscle

TABLE = load_contraction_table()
CYCLES = cc.mean_cycles(TABLE)


def residual(plant: SingleMuscle) -> np.ndarray:
    made = [cc.quasi_static(plant, CYCLES.pressures, m) for m in CYCLES.loads.tolist()]
    return np.array(made) - CYCLES.contractions


@pytest.fixture(scope="module")
def fits():
    return {kind: cc.fit_cycles(CYCLES, kind) for kind in kinds()}


@pytest.mark.parametrize("kind", kinds())
def test_shipped_plant_equals_the_identified_plant(kind, fits):
    shipped, fitted = residual(SingleMuscle.mas10(kind)), fits[kind].residual
    assert np.abs(shipped - fitted).max() < 2e-5  # 0.02 mm: the optimum is flat in places
    assert np.sqrt(np.mean(shipped**2)) == pytest.approx(np.sqrt(np.mean(fitted**2)), rel=1e-3)


@pytest.mark.parametrize("kind", ["maxwell_slip", "preisach"])
def test_fitted_loop_widths_agree_within_a_third_of_a_millimetre(kind, fits):
    pressures, measured, model = fits[kind].widths()
    assert pressures.tolist() == [3.5e5, 4.5e5, 3.5e5]
    assert np.allclose(measured, [3.29e-3, 2.82e-3, 2.40e-3])
    assert np.abs(model - measured).max() < 0.3e-3


def test_fit_residuals_are_near_the_repeatability_of_the_readings(fits):
    floor = cc.repeatability_floor(TABLE)
    assert floor == pytest.approx(0.168e-3, abs=1e-6)
    assert fits["maxwell_slip"].rms() < 0.25e-3
    assert fits["preisach"].rms() < 0.21e-3
    assert fits["none"].rms() > 3 * fits["maxwell_slip"].rms()


def test_every_member_of_the_ensemble_fits_about_as_well():
    for kind in ("maxwell_slip", "preisach"):
        plant = SingleMuscle.mas10(kind)
        members = plant.members()
        assert len(members) >= 5
        best = np.sqrt(np.mean(residual(plant)[:, 1:] ** 2))
        for member in members[1:]:
            assert np.sqrt(np.mean(residual(member)[:, 1:] ** 2)) < 1.101 * best
        drives = {round(float(m.drive_for(0.007, 2.55)), 1) for m in members}
        assert len(drives) == len(members)  # equally good, and different


def test_rank_reveals_unidentifiable_parameters(fits):
    found = cc.identifiability(fits["maxwell_slip"])
    fixed = dict(zip(found.names, found.fixed, strict=True))
    assert found.rank < len(found.names)
    for name in ("dead_time", "time_constant", "slew_rate"):
        assert fixed[f"regulator.{name}"] < 1e-20
    assert max(fixed["mass.moving_mass"], fixed["mass.damping"]) < 1e-20
    assert fixed["muscle.area"] > 0.9
    assert fixed["hysteresis.width_per_load"] > 0.9


def test_known_muscle_is_recovered_from_its_own_cycles():
    true = SingleMuscle.mas10("maxwell_slip").replace(
        {"muscle.area": 9.5e-4, "hysteresis.width_per_load": -0.03}
    )
    made = [cc.quasi_static(true, CYCLES.pressures, m) for m in CYCLES.loads.tolist()]
    fit = cc.fit_cycles(dataclasses.replace(CYCLES, contractions=np.array(made)))
    assert fit.rms() < 0.02e-3
    assert fit.plant.value("muscle.area") == pytest.approx(9.5e-4, rel=0.03)
    assert fit.plant.value("hysteresis.width_per_load") == pytest.approx(-0.03, abs=0.005)


def test_preisach_is_congruent_in_drive_and_not_in_contraction():
    inner, outer = minor_loops(SingleMuscle.mas10("preisach"))
    assert inner < 1e-9
    assert outer > 0.02
