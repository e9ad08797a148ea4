"""Base plants by size and family."""

import math

import numpy as np
import pytest

from pam_envs.constants import BAR
from pam_envs.data import rig_file
from pam_envs.plants.single_muscle.families import DMSP, FAMILIES, base_plant
from pam_envs.plants.single_muscle.plant import SingleMuscle

SIZES = ((0.002, 0.06, 0.1), (0.003, 0.1, 17.0), (0.01, 0.25, 6.5), (0.04, 0.5, 30.0), (0.08, 1, 8))


def test_rig_files_know_every_family():
    assert rig_file.MUSCLES == FAMILIES


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(("diameter", "length", "bar"), SIZES)
def test_muscle_of_any_size_pulls_less_as_it_contracts(family, diameter, length, bar, tmp_path):
    full = bar * BAR
    plant = base_plant(family, length, diameter, max_pressure=full)
    strain = np.linspace(0.0, 0.15, 31)
    for share in (0.5, 1.0):
        assert (np.diff(plant.muscle.tension(share * full, strain)) < 0.0).all()
    # force over pressure and cross-section is that of a braided muscle, 3 to 15 times
    ideal = 0.25 * math.pi * diameter**2 * full
    assert 3.0 < plant.muscle.tension(full, 0.0) / ideal < 15.0
    plant.to_yaml(tmp_path / "plant.yaml")
    assert SingleMuscle.from_yaml(tmp_path / "plant.yaml") == plant


@pytest.mark.parametrize("family", FAMILIES)
def test_forces_grow_with_cross_section_and_rated_pressure(family):
    one = base_plant(family, 0.2, 0.01, max_pressure=6e5)
    other = base_plant(family, 0.2, 0.02, max_pressure=3e5)
    strain = np.linspace(0.0, 0.1, 5)
    np.testing.assert_allclose(
        other.muscle.tension(3e5, strain), 4.0 * 0.5 * one.muscle.tension(6e5, strain), rtol=1e-9
    )


def test_ideal_braided_muscle_follows_the_angle_of_its_threads():
    angle, diameter, pressure = 0.35, 0.006, 3e5
    law = base_plant("mckibben", 0.1, diameter, max_pressure=6e5, braid_angle=angle).muscle
    e = np.linspace(0.0, 0.2, 9)
    a, b = 3.0 / math.tan(angle) ** 2, 1.0 / math.sin(angle) ** 2
    ideal = 0.25 * math.pi * diameter**2 * pressure * (a * (1.0 - e) ** 2 - b)
    np.testing.assert_allclose(law.tension(pressure, e) + law.passive(e), ideal, rtol=1e-9)


def test_festo_muscle_of_10_mm_has_the_law_of_its_map():
    law = base_plant("festo_dmsp", 0.25, 0.01, max_pressure=6e5).muscle
    for name, value in DMSP.items():
        assert getattr(law, name.partition(".")[2]) == pytest.approx(value)


def test_sources_and_refusals():
    plant = base_plant("mckibben", 0.1, 0.006)
    assert plant.provenance["muscle.area"][0] == "derived"
    assert "tondu2000" in plant.provenance["muscle.area"][1]
    with pytest.raises(ValueError, match=r"family = 'pleated'; choose one of festo_mas"):
        base_plant("pleated", 0.1, 0.006)
    with pytest.raises(ValueError, match=r"muscle.diameter = 0.2 m is outside its bounds"):
        base_plant("festo_mas", 0.1, 0.2)
