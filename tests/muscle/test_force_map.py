"""Static law of the joint's muscles: measured map, inverse, virtual work."""

import dataclasses
from importlib import resources

import numpy as np
import pytest
from scipy.optimize import least_squares

from pam_envs.muscle.force_map import (
    FULL_PRESSURE,
    ForceMap,
    force_terms,
    inner_volume,
    paper_stretch,
)

LAWS = (ForceMap(), ForceMap(stretch=paper_stretch()))
CONTRACTIONS = np.linspace(-0.02, 0.25, 28)
FITTED = ("area", "taper", "threshold", "braid_force", "braid_strain", "stiffness")
MAP = np.genfromtxt(
    str(resources.files("pam_envs.data") / "dmsp10_force_map.csv"), delimiter=",", names=True
)
"""Static forces of a DMSP-10-250 of 0.25 m, 0 N where the muscle is slack."""


def residuals(law: ForceMap) -> np.ndarray:
    """Return the errors of a law [N]; its pull where the muscle is slack."""
    value = law.law(MAP["pressure_pa"], 1.0 - MAP["length_m"] / 0.25)
    return np.where(MAP["force_n"] > 0.0, value - MAP["force_n"], np.maximum(0.0, value))


def test_force_law_fits_the_measured_map():
    assert len(MAP) == 85 and MAP["force_n"].max() == pytest.approx(542.5)
    errors = residuals(ForceMap())
    assert np.sqrt(np.mean(errors**2)) < 1.42
    assert np.abs(errors).max() < 8.3
    assert np.abs(errors[MAP["pressure_pa"] > 1.5e5]).max() < 2.5


def test_defaults_are_the_least_squares_fit():
    defaults = np.array([getattr(ForceMap(), name) for name in FITTED])

    def errors(x: np.ndarray) -> np.ndarray:
        values = dict(zip(FITTED, (x * defaults).tolist(), strict=True))
        return residuals(dataclasses.replace(ForceMap(), **values))

    found = least_squares(errors, np.full(len(FITTED), 0.8), xtol=1e-12).x
    assert found == pytest.approx(1.0, rel=2e-4)


@pytest.mark.parametrize("law", LAWS)
def test_inverse_is_exact(law):
    forces = np.linspace(0.0, 400.0, 9)[:, None]
    pressures = law.pressure(forces, CONTRACTIONS)
    assert law.law(pressures, CONTRACTIONS) == pytest.approx(
        np.broadcast_to(forces, pressures.shape), abs=1e-9
    )


@pytest.mark.parametrize("law", LAWS)
def test_force_rises_with_pressure_and_falls_with_contraction(law):
    pressures = np.linspace(0.0, FULL_PRESSURE, 14)[:, None]
    values = law.law(pressures, CONTRACTIONS)
    assert np.all(np.diff(values, axis=0) > 0.0)
    assert np.all(np.diff(values, axis=1) < 0.0)
    assert np.all(law.force(pressures, CONTRACTIONS) >= 0.0)


def test_force_ends_at_the_published_contraction():
    assert ForceMap().longest_contraction() == pytest.approx(0.209, abs=1e-3)
    stretched = ForceMap(stretch=paper_stretch())
    assert stretched.longest_contraction() == pytest.approx(0.25, abs=1e-9)
    assert stretched.force(3e5, 0.0) == ForceMap().force(3e5, 0.0)


@pytest.mark.parametrize("law", LAWS)
def test_volume_satisfies_virtual_work(law):
    """The share of the force that is proportional to the pressure is -dV/dL."""
    h = 1e-6
    numbers = (law.area, law.taper, 1.0 / law.stretch, 0.25 * np.pi * law.diameter**2)
    less, more = (inner_volume(CONTRACTIONS + d, *numbers, law.rest_length) for d in (-h, h))
    slope = (more - less) / (2 * h)
    assert slope / law.rest_length == pytest.approx(law.area_at(CONTRACTIONS), rel=1e-8)


@pytest.mark.parametrize("law", LAWS)
def test_force_map_kernel_equals_numpy(law):
    numbers = (law.area, law.taper, law.threshold, law.braid_force, law.braid_strain, law.stiffness)
    for x in CONTRACTIONS:
        area, passive, less, more = force_terms(float(x), *numbers, 1.0 / law.stretch)
        assert area == pytest.approx(float(law.area_at(x)), rel=1e-13)
        assert passive == pytest.approx(float(law.passive(x)), abs=1e-9)
        h = 1e-6
        slope = float(law.law(4e5, x + h) - law.law(4e5, x - h)) / (2 * h)
        assert 4e5 * less + more == pytest.approx(-slope, rel=1e-7)
