"""Simulated worlds of development: laws, loops and regulators have the property that names them."""

import numpy as np
import pytest

from tests.diagnosis.test_worlds_physics import force_of, response, rigs_of, steps
from tests.diagnosis.worlds import WORLDS, simulate, truth_of
from tests.diagnosis.worlds.laws import LAWS, force
from tests.diagnosis.worlds.loop_draws import DRAWS
from tests.diagnosis.worlds.rig import law_arrays

TABLE, OGDEN, CHAIN, BARREL, SPRING, ELEMENT = WORLDS[15:]
NO_TABLE, WORK = np.zeros((14, 16)), np.zeros((2, 4))
PRESSURES, STRAINS = (0.0, 3.0, 6.0), (0.02, 0.1, 0.18)


def test_table_is_straight_between_its_knots_and_has_kinks() -> None:
    for rig in rigs_of(TABLE):
        q, knots = law_arrays(rig.law, rig.table)
        q[0] = 0.0  # no stop
        pull = [force(15, q, knots, 4.4, e, 0.0, WORK) for e in (0.085, 0.095, 0.105, 0.115)]
        first, second, third = np.diff(pull)
        assert first == pytest.approx(second, rel=1e-9)
        assert abs(third - second) > 1e-3 * abs(second)


def ogden_energy(q: np.ndarray, pressure: float, strain: float) -> float:
    """Energy of gas and Ogden wall over the length [N]."""
    x = 1.0 - q[8] * strain
    outer2 = (1.0 - x * x * q[1]) / (1.0 - q[1])
    energy = -q[0] * pressure * x * outer2
    for ratio in q[6:8]:
        hoop = np.sqrt(ratio * outer2 - (ratio - 1.0) / x)
        for size, power in zip(q[2:4], q[4:6], strict=True):
            stretches = x**power + hoop**power + (x * hoop) ** -power
            energy += 0.5 * size / power * (stretches - 3.0)
    return energy


def test_force_of_ogden_wall_is_the_slope_of_its_energy() -> None:
    for rig in rigs_of(OGDEN):
        q = np.array(rig.law)
        q[9] = 0.0  # no stop
        for pressure in PRESSURES:
            for strain in STRAINS:
                ends = [ogden_energy(q, pressure, strain + h) for h in (-1e-6, 1e-6)]
                slope = (ends[0] - ends[1]) / (2e-6 * q[8])
                got = force(LAWS.index("ogden"), q, NO_TABLE, pressure, strain, 0.0, WORK)
                assert got == pytest.approx(slope, rel=1e-5, abs=1e-3)


def test_contractions_of_a_chain_add_up() -> None:
    for rig in rigs_of(CHAIN):
        q = np.array(rig.law)
        q[12] = 0.0  # no stop
        for pressure in PRESSURES:
            for strain in STRAINS:
                pull = force(LAWS.index("chain"), q, NO_TABLE, pressure, strain, 0.0, WORK)
                total = 0.0
                for gas, factor, rubber, share in q[:12].reshape(3, 4):
                    square = pull + gas * pressure * (factor / 3.0 + 1.0) + rubber
                    square /= gas * pressure * factor + rubber
                    total += share * (1.0 - np.sqrt(square))
                assert total == pytest.approx(strain, abs=1e-6)


def test_barrel_with_short_ends_is_the_ideal_cylinder() -> None:
    for rig in rigs_of(BARREL):
        q = np.array(rig.law)
        q[2], q[3], q[5] = 1e-6, 0.0, 0.0
        kind = LAWS.index("barrel")
        for strain in STRAINS:
            ideal = q[0] * 3.0 * (3.0 * q[1] * (1.0 - strain) ** 2 - 1.0) / (1.0 - q[1])
            assert force(kind, q, NO_TABLE, 3.0, strain, 0.0, WORK) == pytest.approx(ideal)
        real = np.array(rig.law)
        real[3] = real[5] = 0.0
        assert force(kind, real, NO_TABLE, 3.0, 0.18, 0.0, WORK) < ideal


def test_spring_stiffens_with_stretch() -> None:
    for rig in rigs_of(SPRING):
        pull = force_of(rig)
        stiffness = [pull(6.0, e) - pull(6.0, e + 0.01) for e in (0.15, 0.05)]
        assert stiffness[1] > 1.15 * stiffness[0]


def test_stiffness_falls_and_then_rises_with_pressure() -> None:
    for rig in rigs_of(ELEMENT):
        pull = force_of(rig)
        stiffness = np.array([pull(p, 0.08) - pull(p, 0.1) for p in np.linspace(0.0, 6.0, 13)])
        least = int(np.argmin(stiffness))
        assert 2 < least < 8
        assert stiffness[0] > 1.05 * stiffness[least] and stiffness[-1] > 1.2 * stiffness[least]


@pytest.mark.parametrize("name", ("slip_lag", "elastoplastic", "relaxing"))
def test_friction_in_length_is_bounded_and_dissipates(name: str) -> None:
    cycle = 20.0 - 20.0 * np.cos(np.linspace(0.0, 4 * np.pi, 8001))
    for seed in range(6):
        out = response(DRAWS[name](np.random.default_rng(seed), 0.35, 200.0), cycle)
        assert np.abs(out).max() < 1.06
        assert out[5000:5500].min() > 0.85 and out[7000:7500].max() < -0.85


def test_sliding_friction_settles_some_time_after_breakaway() -> None:
    operator = DRAWS["slip_lag"](np.random.default_rng(2), 0.35, 200.0)
    slow, fast = (
        response(operator, np.linspace(0.0, 30.0, 3001), 0.01 / speed)[-1] for speed in (0.5, 100.0)
    )
    assert 0.005 < slow - fast < 0.05


def test_bristle_is_elastic_below_its_breakaway() -> None:
    kind, constants = DRAWS["elastoplastic"](np.random.default_rng(1), 0.35, 200.0)
    reach, share = constants[0], constants[24]
    way = 0.9 * share * reach
    out = response((kind, constants), np.r_[np.linspace(0, way, 200), np.linspace(way, 0, 200)])
    assert out[-1] == pytest.approx(0.0, abs=1e-9)


def test_few_per_cent_of_the_friction_relax_after_a_motion() -> None:
    operator = DRAWS["relaxing"](np.random.default_rng(1), 0.35, 200.0)
    moving, waiting = np.linspace(0.0, 40.0, 200), 40.0 + 1e-6 * np.arange(1, 1001)
    out = response(operator, np.r_[moving, waiting])
    assert 0.005 < out[199] - out[-1] < 0.05


def test_coarse_valve_acts_on_large_errors_only() -> None:
    for rig in rigs_of(TABLE):
        pressure = simulate(rig, [], steps([1.0, 1.2, 5.0]))["pressure_bar"]
        small, large = (np.diff(pressure[k : k + 60]).max() for k in (75, 150))
        assert 0.02 < small < 0.1
        assert 0.15 < large < 0.5
        assert truth_of(rig)["slew_limit"] and truth_of(rig)["exhaust_asymmetry"]


def test_back_calculation_keeps_the_overshoot_of_a_limited_step_small() -> None:
    for rig in rigs_of(OGDEN):
        pressure = simulate(rig, [], steps([0.5, 5.5], 3.0))["pressure_bar"][150:]
        assert pressure[-1] == pytest.approx(pressure[120], abs=0.01)
        assert 0.01 < pressure.max() - pressure[-1] < 0.2
        truth = truth_of(rig)
        assert truth["slew_limit"] and not truth["exhaust_asymmetry"]


def test_restriction_of_a_line_slows_large_steps() -> None:
    for rig in rigs_of(CHAIN):
        pressure = simulate(rig, [], steps([1.0, 1.4, 5.4, 1.4]))["pressure_bar"]
        small, large = (np.diff(pressure[k : k + 60]).max() for k in (75, 150))
        assert large < 7.0 * small  # ten times the step
        assert np.diff(pressure[225:]).min() == pytest.approx(-large, rel=0.06)
        truth = truth_of(rig)
        assert truth["slew_limit"] and truth["dead_time"] and not truth["exhaust_asymmetry"]


def test_flapper_empties_more_slowly_than_it_fills() -> None:
    for rig in rigs_of(BARREL):
        pressure = simulate(rig, [], steps([1.0, 4.0, 1.0], 2.0))["pressure_bar"]
        up, down = pressure[100:200], pressure[200:300]
        rising = np.argmax(up > up[0] + 0.9 * np.ptp(up))
        falling = np.argmax(down < down[0] - 0.9 * np.ptp(down))
        assert rising < falling
        truth = truth_of(rig)
        assert truth["exhaust_asymmetry"] and not truth["slew_limit"]


def test_digital_regulator_has_no_visible_steady_error() -> None:
    for rig in rigs_of(SPRING):
        pressure = simulate(rig, [], steps([1.5, 3.0, 1.5]))["pressure_bar"]
        gain, offset = (rig.valve_value(key) for key in ("gain", "offset_bar"))
        assert pressure[149] == pytest.approx(3.0 * gain + offset, abs=0.006)
        assert not any(truth_of(rig)[key] for key in ("slew_limit", "dead_time"))


def test_regulator_with_gap_is_faster_in_large_steps() -> None:
    for rig in rigs_of(ELEMENT):
        pressure = simulate(rig, [], steps([1.0, 1.2, 5.2]))["pressure_bar"]
        small, large = (np.diff(pressure[k : k + 60]).max() for k in (75, 150))
        assert large > 22.0 * small  # twenty times the step
        truth = truth_of(rig)
        assert truth["dead_time"] and not truth["slew_limit"] and not truth["exhaust_asymmetry"]
