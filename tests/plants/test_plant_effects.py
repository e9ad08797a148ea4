"""Effects of every plant: physical response, and neutral values that change nothing."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401 (registers)
from pam_envs.kernels.build import COMPILED
from pam_envs.parameters import declarations
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.plants.elbow_orthosis.rollout import simulate_elbow
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate
from pam_envs.pneumatics.flow import SWITCH

Signals = dict[str, Any]
PERIOD = 0.01
DEAD_TIME = "regulator.dead_time"


def muscle(plant: SingleMuscle, pressure: Any) -> Signals:
    made = simulate(plant, pressure)
    return {"pressure": made["pressure"], "moved": made["contraction"]}


def knee(plant: KneeOrthosis, pressure: Any) -> Signals:
    made = simulate_knee(plant, pressure, compiled=False)
    return {"pressure": made["pressure"], "moved": -made["angle"]}


def joint(plant: AntagonisticJoint, pressure: Any) -> Signals:
    made = simulate_joint(plant, pressures=(pressure, np.full(len(pressure), 2e5)), compiled=False)
    return {"pressure": made["pressure_a"], "moved": made["angle"]}


def elbow(plant: ElbowOrthosis, pressure: Any) -> Signals:
    command = np.stack([np.full(len(pressure), 1e5), pressure], axis=1)
    made = simulate_elbow(plant, command, compiled=False)
    return {"pressure": made["pressure_b"], "moved": made["angle"]}


PLANTS: dict[str, tuple[Any, Callable[..., Signals]]] = {
    "single_muscle": (SingleMuscle.mas10("none").replace({"regulator.dead_time": 0.0}), muscle),
    "knee_orthosis": (KneeOrthosis.no_load("none").with_lag_alone(), knee),
    "antagonistic_joint": (AntagonisticJoint.paper("none").with_lag_alone(), joint),
    "elbow_orthosis": (ElbowOrthosis.paper("none").with_lag_alone(), elbow),
}
ALL = {name: plant for name, (plant, _) in PLANTS.items()}
ALL["redundant_manipulator"] = RedundantManipulator.paper("none")
EVERY = pytest.mark.parametrize("name", PLANTS)


def driven(name: str, changes: dict[str, float], pressure: Any) -> Signals:
    plant, run = PLANTS[name]
    return run(plant.replace(changes), pressure)


def step(high: float = 3e5, periods: int = 60, after: int = 10) -> Any:
    return np.where(np.arange(periods) < after, 1e5, high)


@EVERY
def test_leak_lowers_pressure_with_valve_closed(name: str) -> None:
    command = np.concatenate([np.full(100, 3e5), np.full(30, -1.0)])
    pressure = driven(name, {"regulator.leak": 0.5}, command)["pressure"]
    assert pressure[129] == pytest.approx(pressure[99] * np.exp(-0.5 * 30 * PERIOD), rel=1e-6)


@EVERY
def test_gain_scales_the_pressure_at_rest(name: str) -> None:
    pressure = driven(name, {"regulator.gain": 0.9}, np.full(150, 3e5))["pressure"]
    assert pressure[-1] == pytest.approx(2.7e5, rel=1e-3)


@EVERY
def test_dead_time_shifts_the_pressure(name: str) -> None:
    command = step(periods=160, after=100)
    plain, late = (driven(name, c, command)["pressure"] for c in ({}, {DEAD_TIME: 0.03}))
    assert np.allclose(late[103:], plain[100:-3], rtol=1e-3)
    assert late[102] == pytest.approx(late[99], rel=1e-3)


@EVERY
def test_dead_band_leaves_an_error(name: str) -> None:
    pressure = driven(name, {"regulator.dead_band": 2e4}, np.full(200, 3e5))["pressure"]
    assert pressure[-1] == pytest.approx(3e5, abs=2.01e4)
    small = np.concatenate([step(periods=200, after=50), np.full(50, 2.9e5)])
    held = driven(name, {"regulator.dead_band": 2e4}, small)["pressure"]
    assert held[-1] == pytest.approx(held[199], rel=1e-9)


@EVERY
def test_choked_exhaust_deflates_more_slowly(name: str) -> None:
    down = np.concatenate([np.full(100, 4e5), np.zeros(20)])
    plain, choked = (
        driven(name, c, down)["pressure"] for c in ({}, {"regulator.exhaust_rate": 0.5})
    )
    assert choked[105] > plain[105] and choked[99] == pytest.approx(plain[99], rel=1e-9)
    absolute = choked[99:105] + 101325.0
    assert np.diff(np.log(absolute)).min() >= -0.5 * PERIOD - 1e-6


@EVERY
def test_supply_limits_and_droops(name: str) -> None:
    limited = {"regulator.supply_pressure": 2.5e5, "regulator.supply_time": 0.05}
    pressure = driven(name, limited, step(periods=400, after=100))["pressure"]
    assert pressure[-1] <= 2.5e5 + 1.0
    high = {"regulator.supply_pressure": 3.2e5, "regulator.supply_time": 0.05}
    held = {**high, "regulator.supply_droop": 0.5, "regulator.supply_recovery": 100.0}
    command = np.concatenate([np.full(20, 1e5), np.full(80, 3e5)])
    full, drooped = (driven(name, c, command)["pressure"] for c in (high, held))
    assert drooped[60] < full[60] - 5e3


@EVERY
def test_drop_of_the_supply_lowers_every_setpoint_until_it_has_recovered(name: str) -> None:
    used = {"regulator.supply_droop": 0.1, "regulator.supply_recovery": 30.0}
    command = np.concatenate([np.full(20, 1e5), np.full(100, 3e5), np.full(100, 1e5)])
    plain, idle, lowered = (
        driven(name, c, command)["pressure"]
        for c in ({}, used, {**used, "regulator.supply_effect": 0.5})
    )
    assert np.array_equal(idle, plain)
    lost = 1.0 - lowered / plain
    # 20 kPa of drop over 600 kPa of full pressure, halved, once the rise is over
    assert 0.5 * 20.0 / 600.0 * 0.4 < lost[60] < 0.5 * 20.0 / 600.0 * 1.05
    assert np.all(np.diff(lost[60:115]) < 0.0)
    assert lost[-1] < 0.1 * lost[60]


@EVERY
def test_line_rings_at_its_frequency(name: str) -> None:
    ringing = {
        "regulator.ring_share": 1.0,
        "regulator.ring_frequency": 5.0,
        "regulator.ring_damping": 0.05,
        "regulator.slew_rate": 1e9,
        "regulator.time_constant": 0.005,
    }
    swing = driven(name, ringing, step(periods=120))["pressure"][20:] - 3e5
    signs = np.flatnonzero(np.diff(np.sign(swing)))
    assert np.mean(np.diff(signs)) * PERIOD == pytest.approx(0.1, rel=0.1)


@EVERY
def test_creep_moves_after_the_pressure_has_settled(name: str) -> None:
    creep = {"hysteresis.creep_1": 0.1, "hysteresis.creep_time_1": 1.0}
    still, crept = (driven(name, c, step(periods=220)) for c in ({}, creep))
    late = still["pressure"][[-100, -1]]
    assert late[0] == pytest.approx(late[1], rel=1e-3)
    drift = [abs(made["moved"][-1] - made["moved"][-100]) for made in (still, crept)]
    assert drift[1] > 10.0 * drift[0]


@EVERY
def test_first_cycles_reduce_the_force_reversibly(name: str) -> None:
    lost = {"hysteresis.first_loss": 0.2, "hysteresis.first_travel": 2e5}
    command = np.tile(np.repeat([3e5, 1e5], 60), 6)
    plain, worn = (driven(name, c, command)["moved"] for c in ({}, lost))
    first, last = (plain[k] - worn[k] for k in (59, 659))
    assert first > 3.0 * abs(last)


@EVERY
def test_temperature_raises_the_effective_pressure(name: str) -> None:
    parts = ("bundle_b",) if name == "elbow_orthosis" else ("muscle",)
    warm = {f"{p}.{n}": v for p in parts for n, v in
            (("temperature", 303.15), ("temperature_gain", 0.01))}  # fmt: skip
    plain, warmer = (driven(name, c, np.full(100, 3e5)) for c in ({}, warm))
    assert warmer["moved"][-1] > plain["moved"][-1]
    assert warmer["pressure"][-1] == pytest.approx(plain["pressure"][-1], rel=1e-9)


@pytest.mark.parametrize(
    ("name", "stick"),
    [("knee_orthosis", "lever.stick"), ("antagonistic_joint", "link.stick"),
     ("elbow_orthosis", "link.stick"), ("single_muscle", "mass.stick")],
)  # fmt: skip
def test_static_friction_of_the_bearing_resists_a_small_push(name: str, stick: str) -> None:
    plant, run = PLANTS[name]
    command = np.where(np.arange(120) < 80, 2e5, 2.02e5)
    large = 100.0 if name == "single_muscle" else 20.0
    held, free = (run(made, command)["moved"] for made in (plant.replace({stick: large}), plant))
    assert held[-1] == held[90] and free[-1] != free[79]


ENVIRONMENTS = {
    "PAM/MusclePositioning-v0": (ALL["single_muscle"], "contraction", "position"),
    "PAM/KneeTension-v0": (ALL["knee_orthosis"], "angle", "angle"),
    "PAM/KneeWalk-v0": (KneeOrthosis.on_leg(hysteresis="none"), "angle", "angle"),
    "PAM/AntagonisticJoint-v0": (ALL["antagonistic_joint"], "angle", "angle"),
    "PAM/ElbowOrthosis-v0": (ALL["elbow_orthosis"], "angle", "angle"),
    "PAM/RedundantManipulator-v0": (ALL["redundant_manipulator"], "angle_0", "angle"),
}
DELAY = 4
"""Control periods."""
slow_to_compile = pytest.mark.skipif(COMPILED, reason="machine code for each case takes minutes")


def episode(name: str, plant: Any, periods: int = 25, **arguments: Any) -> tuple[Any, Any, Any]:
    """Return readings and true values of a position, and all observations, along an episode."""
    env = gym.make(name, plant=plant, episode_seconds=2.0, **arguments)
    key, shown, true, seen = ENVIRONMENTS[name][1], [], [], []
    observation, info = env.reset(seed=5)
    for k in range(periods):
        shown.append(float(info[f"sensor/{key}"]))
        true.append(float(info[f"state/{key}"]))
        seen.append(observation)
        action = np.full(env.action_space.shape, 0.4 * np.sin(0.3 * k), np.float32)
        observation, _, _, _, info = env.step(action)
    return np.array(shown), np.array(true), np.array(seen)


def changed(name: str, **changes: float) -> Any:
    """Return the plant of an environment with a sensor free of noise and with other effects."""
    plant, _, sensor = ENVIRONMENTS[name]
    quiet = {"noise": 0.0, "resolution": 0.0, **changes}
    return plant.replace({f"{sensor}.{effect}": value for effect, value in quiet.items()})


@slow_to_compile
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_sensor_delay_shifts_the_reading_by_that_time(name: str) -> None:
    shown, true, _ = episode(name, changed(name, delay=DELAY * PERIOD))
    assert np.allclose(shown[DELAY:], true[:-DELAY], rtol=1e-9, atol=1e-12)
    assert not np.allclose(shown, true, rtol=1e-6)


@slow_to_compile
@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_sensor_drift_bow_and_slip_add_to_the_reading(name: str) -> None:
    shown, true, _ = episode(name, changed(name, drift=0.01))
    assert np.allclose(shown - true, 0.01 * PERIOD * np.arange(25), rtol=2e-4, atol=1e-9)
    shown, true, _ = episode(name, changed(name, slip=0.01, slip_at=0.12))
    assert np.allclose((shown - true)[[0, 24]], [0.0, 0.01], atol=1e-9)
    shown, true, _ = episode(name, changed(name, bow=0.2))
    off = (shown - true) / np.where(true == 0.0, 1.0, true)
    slope = np.polyfit(true, off, 1)
    assert np.allclose(off, np.polyval(slope, true), atol=1e-6) and slope[1] == pytest.approx(-0.2)


@slow_to_compile
@pytest.mark.parametrize("name", [n for n in ENVIRONMENTS if n != "PAM/MusclePositioning-v0"])
def test_extended_step_with_neutral_effects_moves_as_the_plain_one(name: str) -> None:
    plant = ENVIRONMENTS[name][0]
    plain = episode(name, plant)[2]
    extended = episode(name, plant, randomize={"regulator.leak": (0.0, 0.0)})[2]
    assert np.allclose(plain, extended, atol=1e-6)
    drawn = episode(name, plant, randomize={"regulator.leak": (2.0, 3.0)})[2]
    assert not np.allclose(plain, drawn, atol=1e-3)


@pytest.mark.parametrize("name", ALL)
def test_neutral_values_leave_the_plant_plain(name: str) -> None:
    plant = ALL[name]
    same = plant.replace(dict(plant.neutral))
    assert not same.extended and same.digest() == plant.digest()
    for effect, neutral in plant.neutral.items():
        part, _, field = effect.partition(".")
        declared = declarations(getattr(plant, part))[field]
        end = declared.high if declared.high > neutral else declared.low
        share = 1.0 if effect == SWITCH else 0.1
        other = plant.replace_with_substeps({effect: neutral + share * (end - neutral)})
        assert other.extended and other.digest() != plant.digest(), effect


@pytest.mark.parametrize("name", ALL)
def test_file_holds_the_effects_that_are_on(name: str, tmp_path: Path) -> None:
    plant = ALL[name].replace({"regulator.leak": 0.3, "pressure.drift": 5.0})
    plant.to_yaml(tmp_path / "plant.yaml")
    text = (tmp_path / "plant.yaml").read_text()
    assert "regulator.leak" in text and "pressure.drift_time" in text
    assert "regulator.dead_band" not in text and "pressure.bow" not in text
    assert type(plant).from_yaml(tmp_path / "plant.yaml").digest() == plant.digest()


def test_creep_of_one_joint_of_an_arm_moves_after_the_pressure_has_settled() -> None:
    arm = ALL["redundant_manipulator"]
    commands = np.tile(0.2 * np.ones(arm.stages), (250, 1))
    creep = {"hysteresis.creep_1": 0.1, "hysteresis.creep_time_1": 1.0}
    plain, crept = (simulate_manipulator(arm.replace(c), commands)["force"] for c in ({}, creep))
    assert np.all(np.abs(crept[0] - plain[0]) > 0.01 * np.abs(plain[0]))
    leaky = simulate_manipulator(arm.replace({"regulator.leak": 2.0}), commands)["pressure"]
    assert np.all(leaky[-1] < simulate_manipulator(arm, commands)["pressure"][-1])
