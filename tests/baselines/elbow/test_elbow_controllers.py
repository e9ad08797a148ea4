"""Elbow controllers: allocation, friction compensation, valves and PI."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401  registers the ids
from baselines.core.catalogue import make_controller
from baselines.elbow.friction import make_elbow_friction
from baselines.elbow.torque_stiffness import Allocation
from baselines.elbow.valves import make_pressure_loop
from baselines.elbow.view import make_elbow_signal_map
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

VALVES = ("proportional", "on_off")
PROMPT = {"regulator.time_constant": 2e-3, "regulator.slew_rate": 1e9}


def make_env(**arguments: Any) -> Any:
    return gym.make("PAM/ElbowOrthosis-v0", disable_env_checker=True, **arguments).unwrapped


def quiet(hysteresis: str = "maxwell_slip", prompt: bool = False, **how: Any) -> ElbowOrthosis:
    """Return a plant without noise; ``prompt``: whose regulators hardly lag."""
    plant = ElbowOrthosis.paper(hysteresis, **how).without_noise()
    return plant.replace(PROMPT) if prompt else plant


def built(name: str, env: Any, plant: Any = None) -> Any:
    model = env.plant if plant is None else plant
    return make_controller(name, model, env.signals, env.action_signals)


def run(env: Any, controller: Any, seed: int = 1) -> dict[str, np.ndarray]:
    """Return the recorded info of one episode."""
    observation, _ = env.reset(seed=seed)
    state, over, rows = None, False, []
    while not over:
        action, state = controller.predict(observation, state, state is None)
        observation, _, terminated, truncated, info = env.step(action)
        assert not terminated
        over = truncated
        rows.append(dict(info))
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def rms(record: dict[str, np.ndarray], what: str = "torque") -> float:
    pair = {
        "torque": ("output", "reference"),
        "stiffness": ("state/stiffness", "state/stiffness_reference"),
    }[what]
    off = record[pair[0]] - record[pair[1]]
    return float(np.sqrt(np.mean(off[50:] ** 2)))


def test_random_draws_each_bundle_by_itself_and_by_its_seed():
    env = make_env()
    observation = env.reset(seed=0)[0]
    controllers = [
        make_controller("elbow_random", env.plant, env.signals, env.action_signals, seed=s)
        for s in (0, 0, 1)
    ]
    first, again, other = (c.predict(observation)[0] for c in controllers)
    assert np.array_equal(first, again)
    assert first[0] != first[1]
    assert not np.intersect1d(first, other).size


def test_actions_of_another_kind_are_refused():
    other = make_env(action="torque_stiffness")
    with pytest.raises(ValueError, match="make the environment with action='pressures'"):
        built("elbow_allocation", other)


def test_allocation_goes_to_the_pressures_and_back():
    plant, random = ElbowOrthosis.paper(), np.random.default_rng(0)
    angle, a, b = random.uniform((0.0, 0.0, 0.0), (2.09, 6e5, 6e5), (200, 3)).T
    torque, stiffness = plant.torque(angle, a, b), plant.stiffness(angle, a, b)
    found = Allocation(plant).pressures(angle, torque, stiffness)
    assert np.allclose(found, (a, b), rtol=1e-9, atol=1e-3)
    assert np.allclose(plant.torque(angle, *found), torque, atol=1e-9)
    assert np.allclose(plant.stiffness(angle, *found), stiffness, atol=1e-9)


def test_allocation_with_friction_gives_the_torque_of_the_bundles_as_they_are():
    plant = ElbowOrthosis.paper()
    angle, lag = np.array([0.7, 1.4]), np.array([2e-3, -1e-3])
    friction = plant.friction(lag)
    wanted = np.array([1.0, -2.0])
    a, b = Allocation(plant).pressures(angle, wanted, np.array([4.0, 4.0]), friction)
    x_a, x_b = plant.coefficients(a, b)
    phi_a, phi_b, _, _ = plant.geometry(angle)
    forces = x_a * (phi_a - friction[0]), x_b * (phi_b - friction[1])
    assert np.allclose(plant.pulley.torque(*forces), wanted, atol=1e-9)
    assert np.allclose(plant.stiffness(angle, a, b), 4.0, atol=1e-9)


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach", "none"])
def test_the_hysteresis_is_undone_exactly_where_nothing_lags(hysteresis):
    env = make_env(plant=quiet(hysteresis, prompt=True), reference="free", motion="sines",
                   episode_seconds=6.0)  # fmt: skip
    record = run(env, built("elbow_allocation_hysteresis", env))
    assert rms(record) < 0.02
    plain = rms(run(env, built("elbow_allocation", env)))
    assert (plain > 8.0 * rms(record)) == (hysteresis != "none")


def test_free_motion_needs_little_torque_of_the_wearer():
    env = make_env(plant=quiet("none", prompt=True), reference="free", episode_seconds=6.0)
    record = run(env, built("elbow_allocation", env))
    off = np.abs(record["state/angle"] - record["state/intent"])[50:]
    assert off.max() < 0.02
    limp = run(env, built("elbow_limp", env))
    felt = [float(np.sqrt(np.mean(r["state/felt"][50:] ** 2))) for r in (record, limp)]
    assert felt[0] < 0.2 * felt[1]


def test_pid_tracks_the_torque_and_not_the_stiffness():
    env = make_env(plant=quiet("none"), reference="weight", motion="sines", episode_seconds=6.0)
    pid, both, limp = (
        run(env, built(name, env)) for name in ("elbow_pid", "elbow_allocation", "elbow_limp")
    )
    assert rms(pid) < 0.2 * rms(limp)
    assert rms(pid, "stiffness") > 10.0 * rms(both, "stiffness")


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
def test_friction_in_the_estimate_is_most_of_what_a_pid_leaves(hysteresis):
    env = make_env(plant=quiet(hysteresis), reference="free", motion="sines",
                   episode_seconds=5.0)  # fmt: skip
    plain, known = (rms(run(env, built(n, env))) for n in ("elbow_pid", "elbow_pid_hysteresis"))
    assert known < 0.4 * plain
    bare = make_env(plant=quiet("none"), reference="free", motion="sines", episode_seconds=1.0)
    records = [run(bare, built(n, bare)) for n in ("elbow_pid", "elbow_pid_hysteresis")]
    assert np.array_equal(records[0]["output"], records[1]["output"])


def test_the_estimate_with_friction_is_the_torque_of_the_bundles():
    """With the true hysteresis as nominal model and without noise."""
    env = make_env(plant=quiet(), motion="sines", episode_seconds=3.0, normalize=False)
    view = make_elbow_signal_map(env.signals, env.action_signals, env.control_period)
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
def test_the_next_steps_pressures_keep_the_torque_first_on_the_way(valves):
    """At a wall, where the stiffness has to grow at once."""
    env = make_env(plant=quiet("none", valves=valves), reference="wall", motion="sines",
                   pace=1.5 if valves == "proportional" else 6.0, episode_seconds=7.0)  # fmt: skip
    slow, early = (
        run(env, built(f"elbow_allocation_{name}", env)) for name in ("hysteresis", "early")
    )
    assert np.ptp(slow["state/stiffness_reference"]) > 1.0
    assert rms(early) < 0.5 * rms(slow)


@pytest.mark.parametrize("valves", VALVES)
def test_the_reach_of_the_valves_is_where_their_longest_commands_lead(valves):
    env = make_env(plant=quiet("none", valves=valves), motion="still", reference="free")
    signals = make_elbow_signal_map(env.signals, env.action_signals, env.control_period)
    loop, steps = make_pressure_loop(env.plant), 2 if valves == "proportional" else 5
    for sign, side in ((-1.0, 0), (1.0, 1)):
        observation, info = env.reset(seed=2)
        before = np.array([info["state/pressure_a"], info["state/pressure_b"]])
        told = loop.reach(signals.read(observation))[side][:, 0]
        for _ in range(steps):
            *_, info = env.step(np.full(2, sign, np.float32))
        found = np.array([info["state/pressure_a"], info["state/pressure_b"]])
        assert found - before == pytest.approx(told - before, rel=0.15, abs=1e3)


def test_pulses_bring_pressures_where_they_are_wanted():
    env = make_env(plant=quiet("none", valves="on_off"), motion="still", episode_seconds=30.0)
    signals = make_elbow_signal_map(env.signals, env.action_signals, env.control_period)
    loop, observation = make_pressure_loop(env.plant), env.reset(seed=0)[0]
    for levels in ((3e5, 1e5), (1e5, 3e5), (2.0e5, 2.0e5)):
        wanted = np.array(levels)[:, None]
        for _ in range(500):
            action = signals.write(loop.commands(signals.read(observation), wanted), observation)
            observation, *_, info = env.step(action)
        found = (info["state/pressure_a"], info["state/pressure_b"])
        assert found == pytest.approx(levels, abs=6e3)  # half of the least pulse
    before = info
    for _ in range(50):
        action = signals.write(loop.commands(signals.read(observation), wanted), observation)
        observation, *_, info = env.step(action)
        assert info["effort/switchings"] == 0.0  # what is as near as can be is left alone
    assert before["state/pressure_a"] == pytest.approx(info["state/pressure_a"], abs=500.0)


def test_on_off_valves_follow_slow_motion():
    env = make_env(plant=quiet(valves="on_off"), reference="free", motion="sines", pace=10.0,
                   episode_seconds=8.0)  # fmt: skip
    records = {n: run(env, built(n, env)) for n in ("elbow_limp", "elbow_allocation_hysteresis")}
    torque = {name: rms(record) for name, record in records.items()}
    assert torque["elbow_allocation_hysteresis"] < 0.25 * torque["elbow_limp"]
    assert records["elbow_allocation_hysteresis"]["effort/switchings"].sum() > 20.0
