"""Elbow controllers: allocation, friction compensation, valves and PI."""

from functools import partial
from typing import Any

import numpy as np
import pytest

from baselines.elbow.nominal import make_elbow_friction, make_elbow_signal_map, pressures_for
from baselines.elbow.valves import make_pressure_loop
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from tests.baselines.conftest import built, make_env, rms, rollout, spec_of

VALVES = ("proportional", "on_off")
PROMPT = {"regulator.time_constant": 2e-3, "regulator.slew_rate": 1e9}


make_elbow = partial(make_env, "PAM/ElbowOrthosis-v0")


def quiet(hysteresis: str = "maxwell_slip", prompt: bool = False, **how: Any) -> ElbowOrthosis:
    """Return a plant without noise; ``prompt``: whose regulators hardly lag."""
    plant = ElbowOrthosis.paper(hysteresis, **how).without_noise()
    return plant.with_lag_alone().replace(PROMPT) if prompt else plant


def torque_error(env: Any, name: str) -> float:
    """Return the RMS error [N m] of an episode."""
    record = rollout(env, built(name, env))
    return rms((record["output"] - record["reference"])[50:])


def test_actions_of_another_kind_are_refused():
    other = make_elbow(action="torque_stiffness")
    with pytest.raises(ValueError, match="make the environment with action='pressures'"):
        built("elbow_allocation", other)


def test_allocation_recovers_the_pressures_of_torque_and_stiffness():
    plant, random = ElbowOrthosis.paper(), np.random.default_rng(0)
    angle, a, b = random.uniform((0.0, 0.0, 0.0), (2.09, 6e5, 6e5), (200, 3)).T
    torque, stiffness = plant.torque(angle, a, b), plant.stiffness(angle, a, b)
    found = pressures_for(plant, angle, torque, stiffness)
    assert np.allclose(found, (a, b), rtol=1e-9, atol=1e-3)
    assert np.allclose(plant.torque(angle, *found), torque, atol=1e-9)
    assert np.allclose(plant.stiffness(angle, *found), stiffness, atol=1e-9)


def test_allocation_with_friction_gives_the_torque_of_the_bundles():
    plant = ElbowOrthosis.paper("maxwell_slip")
    angle, lag = np.array([0.7, 1.4]), np.array([2e-3, -1e-3])
    friction = plant.friction(lag)
    torque = np.array([1.0, -2.0])
    a, b = pressures_for(plant, angle, torque, np.array([4.0, 4.0]), friction)
    x_a, x_b = plant.coefficients(a, b)
    phi_a, phi_b, _, _ = plant.geometry(angle)
    forces = x_a * (phi_a - friction[0]), x_b * (phi_b - friction[1])
    assert np.allclose(plant.pulley.torque(*forces), torque, atol=1e-9)
    assert np.allclose(plant.stiffness(angle, a, b), 4.0, atol=1e-9)


@pytest.mark.parametrize(
    "hysteresis",
    ["maxwell_slip", "preisach", "maxwell_slip_length", "preisach_length", "none"],
)
def test_hysteresis_is_compensated_exactly_without_lag(hysteresis):
    env = make_elbow(plant=quiet(hysteresis, prompt=True), reference="free", motion="sines",
                   episode_seconds=6.0)  # fmt: skip
    exact = torque_error(env, "elbow_allocation_hysteresis")
    assert exact < 0.02
    assert (torque_error(env, "elbow_allocation") > 8.0 * exact) == (hysteresis != "none")


def test_free_motion_needs_little_torque_of_the_wearer():
    env = make_elbow(plant=quiet("none", prompt=True), reference="free", episode_seconds=6.0)
    record, limp = (rollout(env, built(n, env)) for n in ("elbow_allocation", "elbow_limp"))
    assert np.abs(record["state/angle"] - record["state/intent"])[50:].max() < 0.02
    assert rms(record["state/felt"][50:]) < 0.2 * rms(limp["state/felt"][50:])


def test_pid_tracks_the_torque_and_not_the_stiffness():
    env = make_elbow(plant=quiet("none"), reference="weight", motion="sines", episode_seconds=6.0)
    assert torque_error(env, "elbow_pid") < 0.2 * torque_error(env, "elbow_limp")
    records = [rollout(env, built(name, env)) for name in ("elbow_pid", "elbow_allocation")]
    pid, both = (rms((r["state/stiffness"] - r["state/stiffness_reference"])[50:]) for r in records)
    assert pid > 10.0 * both


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
def test_friction_in_the_estimate_removes_most_of_the_pids_error(hysteresis):
    plant = quiet(hysteresis).with_lag_alone()
    env = make_elbow(plant=plant, reference="free", motion="sines", episode_seconds=5.0)
    assert torque_error(env, "elbow_pid_hysteresis") < 0.4 * torque_error(env, "elbow_pid")
    bare = make_elbow(plant=quiet("none"), reference="free", motion="sines", episode_seconds=1.0)
    records = [rollout(bare, built(n, bare)) for n in ("elbow_pid", "elbow_pid_hysteresis")]
    assert np.array_equal(records[0]["output"], records[1]["output"])


def test_estimate_with_friction_is_the_torque_of_the_bundles():
    """With the true hysteresis as nominal model and without noise."""
    env = make_elbow(plant=quiet(), motion="sines", episode_seconds=3.0, normalize=False)
    view = make_elbow_signal_map(spec_of(env))
    friction, action = make_elbow_friction(env.plant, known=True), np.array([1e5, 2e5], np.float32)
    observation, _ = env.reset(seed=4)
    state, off = friction.initial(1), []
    for _ in range(299):
        seen = view.read(observation)
        state = friction.losses(seen, state)[1]
        observation, *_, info = env.step(action)
        off.append([info["sensor/torque"] - info["output"], 0.0])
        seen = view.read(observation)
        off[-1][1] = float(
            (seen.torque + friction.torque(seen, friction.losses(seen, state)[0]))[0]
        )
        off[-1][1] -= info["output"]
    plain, known = np.abs(np.array(off)[50:]).max(axis=0)
    assert plain > 0.3
    assert known < 0.02


@pytest.mark.parametrize("valves", VALVES)
def test_reachable_pressures_keep_the_torque_during_the_transition(valves):
    """At a wall, where the stiffness has to grow at once."""
    env = make_elbow(plant=quiet("none", valves=valves), reference="wall", motion="sines",
                   pace=1.5 if valves == "proportional" else 6.0, episode_seconds=7.0)  # fmt: skip
    slow = rollout(env, built("elbow_allocation_hysteresis", env))
    assert np.ptp(slow["state/stiffness_reference"]) > 1.0
    error = rms((slow["output"] - slow["reference"])[50:])
    assert torque_error(env, "elbow_allocation_early") < 0.5 * error


@pytest.mark.parametrize("valves", VALVES)
def test_reach_of_the_valves_is_that_of_their_longest_commands(valves):
    plant = quiet("none", valves=valves).with_lag_alone()
    env = make_elbow(plant=plant, motion="still", reference="free")
    signals = make_elbow_signal_map(spec_of(env))
    loop, steps = make_pressure_loop(spec_of(env)), 2 if valves == "proportional" else 5
    for sign, side in ((-1.0, 0), (1.0, 1)):
        observation, info = env.reset(seed=2)
        before = np.array([info["state/pressure_a"], info["state/pressure_b"]])
        reach = loop.reach(signals.read(observation))[side][:, 0]
        for _ in range(steps):
            *_, info = env.step(np.full(2, sign, np.float32))
        found = np.array([info["state/pressure_a"], info["state/pressure_b"]])
        assert found - before == pytest.approx(reach - before, rel=0.15, abs=1e3)


def test_pulses_bring_pressures_to_their_references():
    env = make_elbow(plant=quiet("none", valves="on_off"), motion="still", episode_seconds=30.0)
    signals = make_elbow_signal_map(spec_of(env))
    loop, observation = make_pressure_loop(spec_of(env)), env.reset(seed=0)[0]
    for levels in ((3e5, 1e5), (1e5, 3e5), (2.0e5, 2.0e5)):
        target = np.array(levels)[:, None]
        for _ in range(500):
            action = signals.write(loop.commands(signals.read(observation), target), observation)
            observation, *_, info = env.step(action)
        found = (info["state/pressure_a"], info["state/pressure_b"])
        assert found == pytest.approx(levels, abs=6e3)  # half of the least pulse
    before = info
    for _ in range(50):
        action = signals.write(loop.commands(signals.read(observation), target), observation)
        observation, *_, info = env.step(action)
        assert info["effort/switchings"] == 0.0  # what is as near as can be is left alone
    assert before["state/pressure_a"] == pytest.approx(info["state/pressure_a"], abs=500.0)


def test_on_off_valves_follow_slow_motion():
    env = make_elbow(plant=quiet(valves="on_off"), reference="free", motion="sines", pace=10.0,
                   episode_seconds=8.0)  # fmt: skip
    record = rollout(env, built("elbow_allocation_hysteresis", env))
    error = rms((record["output"] - record["reference"])[50:])
    assert error < 0.25 * torque_error(env, "elbow_limp")
    assert record["effort/switchings"].sum() > 20.0
