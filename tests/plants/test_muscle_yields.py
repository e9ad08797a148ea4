"""Yielding friction of the single muscle, in pressure and in length."""

from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.kernels.yielding import deflected_with_tail, yielded_with_tail
from pam_envs.muscle.effects import LengthYieldTailEffects, yield_spring
from pam_envs.parameters import declarations
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.replay import Inputs, alike, replay, replay_rows
from pam_envs.plants.single_muscle.rollout import simulate

KINDS = ("none", "maxwell_slip", "maxwell_slip_length")
BY_PRESSURE = {
    "hysteresis.yield_width": 8e3,
    "hysteresis.yield_break": 3e4,
    "hysteresis.yield_ratio": 0.7,
    "hysteresis.yield_tail": -0.6,
}
BY_LENGTH = {
    "muscle.yield_force": 6.0,
    "muscle.yield_per_pressure": 2e-5,
    "muscle.yield_break": 0.015,
    "muscle.yield_ratio": 0.3,
    "muscle.yield_tail": 0.4,
}
UP_AND_DOWN = np.concatenate([np.linspace(0.0, 5e5, 40), np.linspace(5e5, 1e5, 30)])


def inputs_of(command: np.ndarray, period: float = 0.01) -> Inputs:
    n = len(command)
    first = np.arange(n) == 0
    held = np.full(n, 293.15), first, np.full(n, command[0]), np.zeros(n, bool)
    return Inputs(period, command, np.full(n, 2.55), *held, 0.00251)


@pytest.mark.parametrize("kind", KINDS)
def test_effective_pressure_loses_the_yielding_share(kind: str) -> None:
    plant = SingleMuscle.mas10(kind).with_lag_alone().replace({"hysteresis.threshold": 1e4})
    plain, made = (simulate(p, UP_AND_DOWN) for p in (plant, plant.replace(BY_PRESSURE)))
    assert np.array_equal(plain["pressure"], made["pressure"])
    above, z, lost = np.maximum(0.0, made["pressure"] - 1e4), 0.0, []
    wide = 1.0 + plant.hysteresis.width_per_load * 2.55
    for moved in np.diff(above, prepend=0.0) / BY_PRESSURE["hysteresis.yield_break"]:
        shape = BY_PRESSURE["hysteresis.yield_ratio"], BY_PRESSURE["hysteresis.yield_tail"]
        z = yielded_with_tail(z, moved, *shape)[0]
        lost.append(BY_PRESSURE["hysteresis.yield_width"] * z * wide)
    assert plain["drive"] - made["drive"] == pytest.approx(np.array(lost), abs=1e-4)
    assert min(lost) < -7e3 * wide and max(lost) > 7e3 * wide


def test_pressure_that_turns_within_a_sub_step_yields_there() -> None:
    """The setpoint switches between samples: both directions count, as in a fine replay."""
    quick = {"regulator.time_constant": 4e-3, "regulator.slew_rate": 1e9}
    plant = SingleMuscle.mas10("none").replace(
        BY_PRESSURE | quick | {"regulator.dead_time": 7.5e-3}
    )
    command = np.tile([2e5, 3e5, 1.5e5, 2.5e5], 6)
    coarse, fine = (simulate(replace(plant, substeps=n), command) for n in (2, 16))
    assert coarse["pressure"] == pytest.approx(fine["pressure"], abs=1e-3)
    assert coarse["drive"] == pytest.approx(fine["drive"], abs=1.0)


def test_yielding_in_length_acts_against_the_motion_and_grows_with_pressure() -> None:
    plant = SingleMuscle.mas10("none").with_lag_alone()
    slow = np.concatenate([np.linspace(0.0, 5e5, 150), np.linspace(5e5, 0.0, 150)])

    def width(changes: dict[str, float], at: float) -> float:
        made = simulate(plant.replace(changes), slow)
        up = np.interp(at, made["pressure"][:150], made["contraction"][:150])
        down = np.interp(at, made["pressure"][:149:-1], made["contraction"][:149:-1])
        return float(down - up)

    constant = BY_LENGTH | {"muscle.yield_per_pressure": 0.0}
    lag = width({}, 3e5)
    assert width(constant, 3e5) - lag > 1e-4
    assert width(BY_LENGTH, 3e5) - lag > 1.3 * (width(constant, 3e5) - lag)


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_share_divides_the_growth_between_stiffness_and_slip(share: float) -> None:
    """Force at full yield, and force of a small motion, at two pressures."""
    law = SingleMuscle.mas10("none").replace(BY_LENGTH | {"muscle.yield_share": share}).muscle
    fixed = np.array([[getattr(law, name)] for name in declarations(LengthYieldTailEffects)])
    for pressure in (0.0, 3e5):
        stiff, limit = yield_spring(fixed, 0, 0, pressure)
        assert stiff * limit == pytest.approx(law.yield_force + law.yield_per_pressure * pressure)
        gained = share * law.yield_per_pressure * pressure
        assert stiff == pytest.approx((law.yield_force + gained) / law.yield_break)


@pytest.mark.parametrize("seed", range(4))
def test_closed_cycles_of_pressure_and_strain_lose_energy(seed: int) -> None:
    """With drawn parameters, among them friction that grows or falls with pressure."""
    random = np.random.default_rng(seed)
    for _ in range(8):
        growth, ratio = random.uniform(-2e-5, 4e-5), random.uniform(0.0, 1.0)
        tail = random.uniform(-1.0, 1.0)
        fixed = [[random.uniform(1.0, 20.0)], [growth], [random.uniform(0.005, 0.1)], [ratio]]
        corners = random.uniform(0.0, [[6e5], [0.15]], (2, 5))
        around = np.linspace(0.0, 5.0, 1000, endpoint=False)
        pressure, strain = (np.interp(around, np.arange(6), [*c, c[0]]) for c in corners)
        at, force = 0.0, np.zeros((3, strain.size))
        for turn in range(3):
            for k in range(strain.size):
                stiff, limit = yield_spring(fixed, 0, 0, pressure[k])
                at = deflected_with_tail(at, strain[k] - strain[k - 1], limit, ratio, tail)[0]
                force[turn, k] = stiff * at
        steps = np.diff(strain, append=strain[0])
        work = 0.5 * (force[2] + np.roll(force[2], -1)) @ steps
        assert work > -1e-4 * fixed[0][0] * np.abs(steps).sum()
        assert np.abs(force).max() > 0.1 * fixed[0][0]


@pytest.mark.parametrize("kind", KINDS)
def test_replay_and_rollout_equal_steps_of_the_environment(kind: str) -> None:
    plant = SingleMuscle.mas10(kind).replace(BY_PRESSURE | BY_LENGTH)
    command = np.append(UP_AND_DOWN, UP_AND_DOWN[:20])
    env = gym.make("PAM/MusclePositioning-v0", plant=plant, load=2.55, start="rest")
    env.reset(seed=1)
    signal = env.unwrapped.action_signals[0]  # type: ignore[attr-defined]
    infos = [env.step(np.array([signal.encode(c)], np.float32))[4] for c in command]
    given = np.array([signal.decode(np.array([signal.encode(c)], np.float32)) for c in command])
    made = simulate(plant, given)
    for name, size in (("contraction", 1e-9), ("pressure", 1e-3), ("drive", 1e-3)):
        assert made[name] == pytest.approx([i[f"state/{name}"] for i in infos], abs=size), name
    replayed = replay(plant, inputs_of(given))
    assert replayed["contraction"][1:] == pytest.approx(made["contraction"][:-1], abs=1e-7)
    assert replayed["pressure"][1:] == pytest.approx(made["pressure"][:-1], abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_replay_does_not_depend_on_the_plants_beside_it(kind: str) -> None:
    plant = SingleMuscle.mas10(kind)
    changes: list[dict[str, Any]] = [{}, BY_PRESSURE, BY_LENGTH, BY_PRESSURE | BY_LENGTH]
    changes += [{"hysteresis.creep_1": 0.05}, {"muscle.strand_2": 3.0}]
    plants = [plant.replace(c) for c in changes]
    inputs = inputs_of(UP_AND_DOWN[::2], 0.02)
    together = replay_rows(plant, np.stack([p.parameter_rows() for p in plants]), inputs)
    for lane, p in enumerate(plants):
        alone = replay(p, inputs)
        assert np.array_equal(together[0, :, lane], alone["contraction"]), changes[lane]
        assert np.array_equal(together[1, :, lane], alone["pressure"])
    moved = np.abs(together[0] - together[0, :, :1]).max(axis=0)
    assert (moved[1:] > 1e-6).all()


def test_lanes_that_yield_are_replayed_side_by_side() -> None:
    plant = SingleMuscle.mas10("none")
    mixed = [{}, BY_PRESSURE, BY_LENGTH, {}, BY_PRESSURE, BY_LENGTH]
    columns = np.stack([plant.replace(c).parameter_rows() for c in mixed])
    (order,) = alike(columns)
    pairs = [order.tolist().index(k) - order.tolist().index(k + 3) for k in range(3)]
    assert pairs == [-1, -1, -1]


@pytest.mark.parametrize("changes", [BY_PRESSURE, BY_LENGTH])
def test_neutral_size_switches_the_effect_off(changes: dict[str, float]) -> None:
    plant = SingleMuscle.mas10("maxwell_slip_length")
    on = plant.replace(changes)
    neutral = {name: 0.0 for name in changes if name in SingleMuscle.neutral}
    off = on.replace(neutral)
    assert on.extended and not off.extended
    assert on.digest() != plant.digest() == off.digest()
    made, plain = simulate(off, UP_AND_DOWN), simulate(plant, UP_AND_DOWN)
    assert all(np.array_equal(made[k], plain[k]) for k in plain)


def test_plant_file_holds_the_yielding_elements(tmp_path: Any) -> None:
    plant = SingleMuscle.mas10("none").replace(BY_PRESSURE | BY_LENGTH)
    plant.to_yaml(tmp_path / "plant.yaml")
    assert SingleMuscle.from_yaml(tmp_path / "plant.yaml") == plant
    for name, value in (BY_PRESSURE | BY_LENGTH).items():
        assert plant.parameter_rows()[R.place(name)] == value


@pytest.mark.parametrize("name", ["hysteresis.yield_ratio", "muscle.yield_ratio"])
def test_ratio_beyond_the_passive_range_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"yield_ratio = -0.1 is outside its bounds \[0, 1\]"):
        SingleMuscle.mas10("none").replace({name: -0.1})
