"""Terms of the muscle that recordings show: damping, friction at the start, slack, sensors."""

from dataclasses import replace

import numpy as np
import pytest

from pam_envs.mechanics.hanging_mass import load_fraction
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import Inputs
from pam_envs.plants.single_muscle.replay import replay as replayed
from pam_envs.plants.single_muscle.rollout import simulate
from pam_envs.sensing.sensor import bowed

PLAIN = SingleMuscle.mas10("none").with_lag_alone()
STRANDS = {"muscle.strand_2": 4.0, "muscle.strand_4": 6.0, "muscle.yield_force": 5.0}
REST = np.zeros(40)
CYCLE = np.concatenate([np.linspace(0.0, 5e5, 300), np.linspace(5e5, 0.0, 300), REST])


def inputs_of(command: np.ndarray, period: float = 0.01) -> Inputs:
    n = len(command)
    first = np.arange(n) == 0
    held = np.full(n, 293.15), first, np.full(n, command[0]), np.zeros(n, bool)
    return Inputs(period, command, np.full(n, 2.55), *held, 0.00251)


def test_damping_that_grows_with_pressure_is_that_damping_at_a_held_pressure() -> None:
    """A small step about 4 bar moves as with the constant damping of that pressure."""
    step = np.append(np.full(100, 4e5), np.full(60, 4.05e5))
    grows = PLAIN.replace({"muscle.viscosity_per_pressure": 5e-4})
    constant = PLAIN.replace({"mass.damping": PLAIN.mass.damping + 5e-4 * 4e5})
    moved = [simulate(p, step)["contraction"][99:] for p in (PLAIN, grows, constant)]
    plain, made, wanted = (x - x[0] for x in moved)
    assert made == pytest.approx(wanted, abs=0.02 * np.ptp(wanted))
    assert np.abs(plain - wanted).max() > 0.1 * np.ptp(wanted)


def test_relaxation_has_its_own_share_of_that_damping() -> None:
    grows = {"muscle.viscosity_per_pressure": 5e-4}
    up, down = (
        np.append(np.full(100, 2e5), np.full(60, 4e5)),
        np.append(np.full(100, 4e5), np.full(60, 2e5)),
    )
    less = grows | {"muscle.viscosity_relaxing": 0.0}
    plain, even, own = (
        [simulate(PLAIN.replace(c), s)["contraction"][100:] for s in (up, down)]
        for c in ({}, grows, less)
    )
    assert own[0] == pytest.approx(even[0], abs=1e-5)
    assert own[1] == pytest.approx(plain[1], abs=1e-5)
    assert np.abs(even[1] - plain[1]).max() > 1e-4


@pytest.mark.parametrize("kind", ["none", "maxwell_slip"])
@pytest.mark.parametrize("start", [-1.0, -0.4, 0.7])
def test_friction_at_the_start_rests_and_ends_in_the_same_cycle(kind: str, start: float) -> None:
    yields = {"hysteresis.yield_width": 8e3, **STRANDS}
    plant = SingleMuscle.mas10(kind).with_lag_alone().replace(yields)
    moved = plant.replace({"hysteresis.start": start})
    assert np.ptp(replayed(moved, inputs_of(REST))["contraction"]) < 2e-6
    command = np.concatenate([REST, CYCLE, CYCLE])
    new, old = (replayed(p, inputs_of(command))["contraction"] for p in (plant, moved))
    first = slice(len(REST), len(REST) + 300)
    second = slice(len(REST) + len(CYCLE), len(REST) + len(CYCLE) + 300)
    offset = (old - new)[second].mean()
    assert old[second] == pytest.approx(new[second] + offset, abs=2e-5)
    lead = (old - new - offset)[first][:120].mean()
    assert lead * start < 0.0 and abs(lead) > 3e-5


def test_after_relaxation_the_first_cycle_is_like_the_next_one() -> None:
    plant = PLAIN.replace({**STRANDS, "hysteresis.start": -1.0})
    x = replayed(plant, inputs_of(np.concatenate([CYCLE, CYCLE])))["contraction"]
    virgin = replayed(plant.replace({"hysteresis.start": 0.0}), inputs_of(CYCLE))["contraction"]
    n = len(CYCLE)
    assert x[:n] == pytest.approx(x[n:], abs=5e-5)
    assert np.abs(virgin - x[n:]).max() > 2e-4


def test_stiffness_of_the_first_travel_fades() -> None:
    stiff = PLAIN.replace({"hysteresis.first_stiffness": 200.0, "hysteresis.first_travel": 3e5})
    many = np.concatenate([CYCLE] * 5)
    off = simulate(stiff, many)["contraction"] - simulate(PLAIN, many)["contraction"]
    n = len(CYCLE)
    assert off[:n].min() < -1e-4
    assert np.abs(off[-n:]).max() < 1e-6


def test_first_travel_widens_strands_and_yielding_friction() -> None:
    plant = PLAIN.replace(STRANDS)
    wide = plant.replace({"hysteresis.first_width": 1.0, "hysteresis.first_travel": 1e9})
    double = plant.replace({name: 2.0 * value for name, value in STRANDS.items()})
    made, wanted = (simulate(p, CYCLE)["contraction"] for p in (wide, double))
    assert made == pytest.approx(wanted, abs=2e-5)


@pytest.mark.parametrize(("free", "sag"), [(0.0, 0.0), (0.4, 0.0), (0.0, 1.0), (0.3, 0.5)])
def test_share_of_a_load_rises_from_none_to_all_with_its_slope(free: float, sag: float) -> None:
    slack, hangs = 2e-3, 1e-2
    assert load_fraction(hangs - 1e-3, hangs, slack, free, sag)[0] == 0.0
    assert load_fraction(hangs + 40 * slack, hangs, slack, free, sag)[0] == pytest.approx(1.0)
    for u in (0.1, 0.35, 0.7, 1.6):
        x, h = hangs + u * slack, 1e-9
        ahead, behind = (load_fraction(x + s, hangs, slack, free, sag)[0] for s in (h, -h))
        slope = load_fraction(x, hangs, slack, free, sag)[1]
        assert slope == pytest.approx((ahead - behind) / (2.0 * h), rel=1e-4, abs=1e-3)
    assert load_fraction(0.0, 0.0, 0.0, free, sag) == (1.0, 0.0)


def test_wave_of_a_sensor_is_an_s_with_three_zeros() -> None:
    u = np.linspace(0.0, 1.0, 101)
    off = np.array([bowed(6.0 * x, 0.0, 0.5, 6.0) - 6.0 * x for x in u])
    assert off[[0, 50, 100]] == pytest.approx(0.0, abs=1e-12)
    assert off[:50].sum() == pytest.approx(-off[51:].sum()) and abs(off[20]) > 0.1


@pytest.mark.parametrize("lag", [0.008, 0.02])
def test_pilot_stage_hardly_depends_on_the_sub_step(lag: float) -> None:
    quick = {"regulator.pilot_lag": lag, "regulator.pilot_damping": 0.7}
    plant = SingleMuscle.mas10("none").replace(
        quick | {"regulator.slew_rate": 1e9, "regulator.dead_time": 0.0}
    )
    t = np.arange(300) * plant.control_period
    wave = 2.5e5 - 2e5 * np.cos(2.0 * np.pi * t)
    coarse, fine = (simulate(replace(plant, substeps=n), wave)["pressure"] for n in (3, 48))
    assert np.abs(coarse - fine).max() < 100.0
