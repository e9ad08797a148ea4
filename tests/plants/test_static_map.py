"""Finer static map of the muscle, growing strands, and the pilot stage of the regulator."""

import dataclasses

import numpy as np
import pytest

from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import Inputs, replay
from tests.diagnosis.conftest import needs_kernels

PLAIN = SingleMuscle.mas10("maxwell_slip").with_lag_alone()
MAP = {"muscle.map_20": 10.0, "muscle.map_13": -5.0, "muscle.map_31": 4.0}


def inputs_of(command: np.ndarray, load: float = 2.55) -> Inputs:
    n = len(command)
    first = np.zeros(n, bool)
    first[0] = True
    kelvin, start = np.full(n, 293.15), np.full(n, command[0])
    return Inputs(0.02, command, np.full(n, load), kelvin, first, start, np.zeros(n, bool), 0.0051)


@pytest.mark.parametrize("kind", ["maxwell_slip", "maxwell_slip_length", "none"])
def test_pressure_of_a_contraction_inverts_the_mapped_law(kind):
    plant = SingleMuscle.mas10(kind).replace(MAP)
    drive = np.linspace(0.0, 5.5e5, 12)
    contraction = plant.contraction_at(drive, 2.55)
    assert np.all(np.diff(contraction) > 0.0)
    assert plant.drive_for(contraction, 2.55) == pytest.approx(drive, abs=0.5)


def test_derivative_of_the_map_by_pressure():
    law, e = PLAIN.replace(MAP).muscle, 0.06
    low, high = (float(law.mapped(w, e)[0]) for w in (2.99e5, 3.01e5))
    assert float(law.mapped(3e5, e)[1]) == pytest.approx((high - low) / 2e3, rel=1e-3)


@needs_kernels
def test_muscle_settles_where_the_mapped_law_balances_the_load():
    plant = SingleMuscle.mas10("none").with_lag_alone().replace(MAP)
    command = np.repeat([0.0, 1.5e5, 3e5, 4.5e5], 250)
    found = replay(plant, inputs_of(command))["contraction"][249::250]
    assert found == pytest.approx(plant.contraction_at(command[249::250], 2.55), abs=2e-7)


@needs_kernels
def test_strands_rub_harder_at_higher_pressure():
    ramp = np.concatenate([np.linspace(0.0, 5e5, 600), np.linspace(5e5, 0.0, 600)])
    strands = {f"muscle.strand_{k}": 3.0 for k in (1, 2, 3, 4)}

    def width(growth: float, pressure: float) -> float:
        plant = SingleMuscle.mas10("none").with_lag_alone()
        plant = plant.replace({**strands, "muscle.strand_per_pressure": growth})
        read = replay(plant, inputs_of(ramp))
        up = np.interp(pressure, read["pressure"][:600], read["contraction"][:600])
        down = np.interp(pressure, read["pressure"][:599:-1], read["contraction"][:599:-1])
        return float(down - up)

    assert width(4e-6, 3e5) > 1.5 * width(0.0, 3e5)
    assert width(0.0, 3e5) > 0.0


@needs_kernels
@pytest.mark.parametrize(("damping", "overshoots"), [(0.3, True), (1.0, False), (3.0, False)])
def test_pilot_stage_is_of_second_order(damping, overshoots):
    lag = 0.05
    plant = PLAIN.replace({"regulator.pilot_lag": lag, "regulator.pilot_damping": damping})
    fast = dataclasses.replace(plant, substeps=8).replace({"regulator.time_constant": 0.002})
    command = np.where(np.arange(250) < 50, 1e5, 3e5).astype(float)
    pressure = replay(fast, inputs_of(command))["pressure"]
    assert pressure[-1] == pytest.approx(3e5, rel=1e-3)
    ideal = np.exp(-np.pi * damping / np.sqrt(1.0 - damping**2)) if overshoots else 0.0
    assert pressure.max() - 3e5 == pytest.approx(2e5 * ideal, abs=5e3)


@needs_kernels
def test_exhaust_may_be_slower_than_filling():
    plant = PLAIN.replace({"regulator.slew_rate": 4e5, "regulator.slew_ratio": 0.5})
    command = np.concatenate([np.full(50, 0.5e5), np.full(150, 5e5), np.full(200, 0.5e5)])
    pressure = replay(plant, inputs_of(command))["pressure"]
    rate = np.diff(pressure) / 0.02
    assert rate.max() == pytest.approx(4e5, rel=1e-3)
    assert rate.min() == pytest.approx(-2e5, rel=1e-3)
