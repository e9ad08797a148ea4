"""The plant: static law, regulator, integrator, files."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.protocol import kinds
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.single_muscle.hysteresis import Hysteresis
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate
from pam_envs.pneumatics.regulator import regulator_step

KINDS = ("maxwell_slip", "preisach", "maxwell_slip_length", "preisach_length")
LOADS = (0.0, 0.5, 1.5, 2.55, 4.55)


def commands(steps: int = 500) -> dict[str, np.ndarray]:
    random = np.random.default_rng(0)
    t = 0.01 * np.arange(steps)
    return {
        "anew every period": random.uniform(0, 6e5, steps),
        "held": np.repeat(random.uniform(0, 6e5, -(-steps // 50)), 50)[:steps],
        "full steps": np.where(np.arange(steps) // 75 % 2, 0.0, 6e5),
        "sine": 3e5 * (1.0 + np.sin(2 * np.pi * 2.0 * t)),
    }


def run(substeps: int, set_points: np.ndarray, kind: str = "maxwell_slip") -> np.ndarray:
    base = dataclasses.replace(SingleMuscle.mas10(kind), substeps=substeps)
    plants = [base.replace({"mass.load": m}) for m in LOADS]
    return simulate(plants, set_points)["contraction"]


@pytest.mark.skipif(not COMPILED, reason="too many sub-steps for plain Python")
@pytest.mark.parametrize("kind", kinds())
def test_default_substeps_are_accurate_over_loads_and_pressures(kind: str) -> None:
    default = SingleMuscle.mas10(kind)
    for name, set_points in commands(1500).items():
        error = np.abs(run(default.substeps, set_points, kind) - run(100, set_points, kind)).max()
        assert error < min(1e-5, 0.1 * default.position.noise), f"{name}: {1e6 * error:.2f} um"


@pytest.mark.skipif(not COMPILED, reason="too many sub-steps for plain Python")
def test_the_integrator_converges_with_order_two() -> None:
    t = 0.01 * np.arange(300)
    smooth = 3e5 * (1.0 - np.cos(2 * np.pi * t))
    base = SingleMuscle.mas10("none").replace({"regulator.dead_time": 0.0, "mass.load": 2.55})

    def at(substeps: int) -> np.ndarray:
        return simulate(dataclasses.replace(base, substeps=substeps), smooth)["contraction"]

    exact, steps = at(100), np.array([4, 6, 8, 12, 16])
    errors = [np.sqrt(np.mean((at(int(n)) - exact) ** 2)) for n in steps]
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.9 < order < 2.25, errors


def test_motion_equals_that_of_an_independent_solver() -> None:
    plant = dataclasses.replace(SingleMuscle.mas10("none"), substeps=20).replace(
        {"mass.load": 2.55, "regulator.dead_time": 0.0, "regulator.slew_rate": 1e9}
    )
    target, law, mass = 4e5, plant.muscle, plant.mass
    got = simulate(plant, np.full(40, target))["contraction"]
    rest = float(plant._absolute(np.zeros(()), np.array(mass.load)))

    def slope(t: float, y: np.ndarray) -> list[float]:
        pressure = target * (1.0 - math.exp(-t / plant.regulator.time_constant))
        pull = float(law.tension(pressure, y[0] / law.rest_length))
        force = pull - mass.load * GRAVITY - mass.damping * y[1]
        return [y[1], force / (mass.load + mass.moving_mass)]

    times = 0.01 * np.arange(1, 41)
    exact = solve_ivp(slope, (0, 0.4), [rest, 0.0], t_eval=times, rtol=1e-10, atol=1e-13).y[0]
    assert np.abs(got - (exact - rest)).max() < 2e-7


@pytest.mark.parametrize("kind", kinds())
def test_long_hold_ends_at_the_static_law(kind: str) -> None:
    plant = SingleMuscle.mas10(kind).replace({"mass.load": 4.55})
    made = simulate(plant, np.full(300, 3.5e5))
    expected = plant.contraction_at(made["drive"][-1], 4.55)
    assert abs(made["contraction"][-1] - expected) < 1e-9
    assert abs(made["velocity"][-1]) < 1e-9
    assert made["pressure"][-1] == pytest.approx(3.5e5, abs=1e-3)


def test_static_law_and_its_inverse() -> None:
    plant = SingleMuscle.mas10()
    x = np.linspace(0.0, 0.015, 31)[:, None]
    loads = np.array(LOADS)
    drive = plant.drive_for(x, loads)
    assert np.abs(plant.contraction_at(drive, loads) - x).max() < 1e-12
    assert (np.diff(drive, axis=0) > 0).all()  # more contraction, more pressure
    # in the middle of the stroke and above, more load needs more pressure
    assert (np.diff(drive[10:], axis=1) > 0).all()
    assert np.abs(plant.contraction_at(0.0, loads)).max() == 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("load", [0.0, 2.55, 4.55])
def test_exact_inverse_of_the_hysteresis(kind: str, load: float) -> None:
    plant = SingleMuscle.mas10(kind)
    inverse = plant.hysteresis_inverse(load)
    random = np.random.default_rng(1)
    pressures = random.uniform(0.0, 6e5, (60, 5))
    state = inverse.initial_state((5,))
    for p in pressures:
        drive, after = inverse.drive(p, state)
        again, _ = inverse.pressure(drive, state)
        assert np.abs(again - p).max() < 1e-9 * 6e5
        state = after


def test_hysteresis_output_lags_its_input() -> None:
    up, down = np.linspace(0, 6e5, 61), np.linspace(6e5, 0, 61)
    for kind in KINDS:
        inverse = SingleMuscle.mas10(kind).hysteresis_inverse(0.0)
        state, drives = inverse.initial_state((1,)), []
        for p in np.concatenate([up, down]):
            drive, state = inverse.drive(np.array([p]), state)
            drives.append(float(drive[0]))
        rising, falling = np.array(drives[:61]), np.array(drives[61:])[::-1]
        assert (rising <= up + 1e-6).all()
        assert (falling[:-1] > rising[:-1]).all()
        assert np.max(falling - rising) > 5e4  # over half a bar wide: the loop is really there


def test_regulator_ramps_then_decays() -> None:
    lag, slew, h = 0.05, 6.8e5, 0.0005
    pressure, times = 0.0, []
    for k in range(2000):
        pressure = regulator_step(pressure, 6e5, lag, 1 / lag, slew, 1 / slew, h)
        times.append((k + 1) * h)
        if pressure > 6e5 - slew * lag:
            break
        assert pressure == pytest.approx(slew * times[-1], rel=1e-9)
    one = regulator_step(0.0, 6e5, lag, 1 / lag, slew, 1 / slew, 1.2)
    ramp = (6e5 - slew * lag) / slew
    exact = 6e5 - slew * lag * math.exp(-(1.2 - ramp) / lag)
    assert one == pytest.approx(exact, rel=1e-9)
    down = regulator_step(6e5, 0.0, lag, 1 / lag, slew, 1 / slew, 1.2)
    assert down == pytest.approx(6e5 - exact, abs=1e-3)


@pytest.mark.parametrize("dead", [0.0, 0.003, 0.01, 0.0125, 0.045, 0.1099])
def test_dead_time_shifts_the_step_and_nothing_else(dead: float) -> None:
    plant = SingleMuscle.mas10().replace({"regulator.dead_time": dead})
    step = np.full(60, 3e5)
    pressure = simulate(plant, step)["pressure"]
    lag, slew = plant.regulator.time_constant, plant.regulator.slew_rate
    for k, got in enumerate(pressure):
        t = max(0.0, 0.01 * (k + 1) - dead)
        want = regulator_step(0.0, 3e5, lag, 1 / lag, slew, 1 / slew, t) if t > 0 else 0.0
        assert got == pytest.approx(want, abs=1e-3)


def test_neutral_effects_change_no_bit() -> None:
    random = np.random.default_rng(2).uniform(0, 6e5, 200)
    plant = SingleMuscle.mas10("maxwell_slip")
    same = plant.replace({"muscle.area_taper": 0.0, "position.bias": 0.0})
    assert np.array_equal(
        simulate(plant, random)["contraction"], simulate(same, random)["contraction"]
    )
    other = plant.replace({"muscle.area_taper": 1.0})
    assert not np.array_equal(
        simulate(plant, random)["contraction"], simulate(other, random)["contraction"]
    )


@pytest.mark.parametrize("name", Hysteresis.pressure_only)
def test_settings_that_friction_driven_by_length_lacks_are_refused(name: str) -> None:
    change = {f"hysteresis.{name}": 0.1}
    SingleMuscle.mas10("preisach").replace(change)
    with pytest.raises(ValueError, match=f"hysteresis.{name} = 0.1 acts on friction driven by pr"):
        SingleMuscle.mas10("preisach_length").replace(change)


def test_incomplete_plant_file_gets_defaults(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text("schema: 1\nfamily: single_muscle\nparameters:\n  mass.load: 1\n")
    plant = SingleMuscle.from_yaml(path)
    assert plant.mass.load == 1.0
    assert plant.hysteresis.kind == "none"
    assert plant.muscle == SingleMuscle().muscle


def test_every_parameter_carries_unit_bounds_provenance_and_source() -> None:
    from pam_envs.parameters import PROVENANCES, declarations

    for component in SingleMuscle.components:
        for name, d in declarations(getattr(SingleMuscle(), component)).items():
            assert d.unit, name
            assert d.low < d.high, name
            assert d.provenance in PROVENANCES, name
            assert len(d.source) > 5, name
    assumed = ("dead_time", "time_constant", "slew_rate")
    declared = declarations(SingleMuscle().regulator)
    assert all(declared[n].provenance == "assumed" and declared[n].spread for n in assumed)
    declared = declarations(SingleMuscle().mass)
    assert declared["damping"].provenance == declared["moving_mass"].provenance == "assumed"
