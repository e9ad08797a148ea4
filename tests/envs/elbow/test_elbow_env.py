"""Elbow orthosis: references, reachable values, estimates, pulses."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401 (registers)
from baselines.core.catalogue import make_controller
from benchmarks.scoring.groups.elbow import NEAR
from pam_envs.constants import GRAVITY
from pam_envs.envs.elbow.env import largest_errors, model_row, signal_ranges
from pam_envs.envs.elbow.kernels import estimate, pressures_for, within_reach
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis
from pam_envs.tasks.torque_stiffness import TorqueStiffness
from tests.envs.cases import record

ID = "PAM/ElbowOrthosis-v0"
PLANT = ElbowOrthosis.paper()
QUIET = ElbowOrthosis.paper("none").without_noise()
MODEL = model_row(PLANT).tolist()


def made(**arguments: Any) -> Any:
    return gym.make(ID, disable_env_checker=True, **arguments).unwrapped


def driven(env: Any, action: Any, steps: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Return ``info`` as arrays, and the observations, under one action."""
    info = record(env, [action] * steps, seed)
    assert len(info["time"]) == steps + 1
    return info


def test_estimate_equals_the_law_of_the_nominal_bundles() -> None:
    random = np.random.default_rng(1)
    for angle, a, b in random.uniform((0.0, 0.0, 0.0), (2.09, 6e5, 6e5), (50, 3)).tolist():
        torque, stiffness = estimate(MODEL, angle, a, b)
        assert torque == pytest.approx(float(PLANT.torque(angle, a, b)), abs=1e-9)
        assert stiffness == pytest.approx(float(PLANT.stiffness(angle, a, b)), abs=1e-9)
        assert pressures_for(MODEL, angle, torque, stiffness) == pytest.approx((a, b), abs=1e-3)


def test_estimate_uses_the_bundles_of_the_plant() -> None:
    plant = ElbowOrthosis.paper(bundle_a__muscles=5.0, pulley__highest=1.8)
    torque, stiffness = estimate(model_row(plant).tolist(), 0.9, 1e5, 2e5)
    assert torque == pytest.approx(float(plant.torque(0.9, 1e5, 2e5)), abs=1e-9)
    assert stiffness == pytest.approx(float(plant.stiffness(0.9, 1e5, 2e5)), abs=1e-9)


def test_reachable_values_are_the_parallelogram_of_the_corners() -> None:
    for angle in np.linspace(0.0, 2.09, 8).tolist():
        torques, stiffnesses = PLANT.corners(angle)
        assert within_reach(MODEL, angle, 99.0, 5.0)[0] == pytest.approx(torques.max())
        assert within_reach(MODEL, angle, -99.0, 5.0)[0] == pytest.approx(torques.min())
        for torque, stiffness in zip(torques.tolist(), stiffnesses.tolist(), strict=True):
            assert within_reach(MODEL, angle, torque, stiffness) == pytest.approx(
                (torque, stiffness), abs=1e-9
            )


@pytest.mark.parametrize("bear", [True, False])
def test_weight_reference_is_its_torque_at_the_hand(bear: bool) -> None:
    env = made(reference="weight", weight=0.8, bear=bear)
    info = driven(env, [0.0, -0.5], 250)
    assert np.ptp(info["state/angle"]) > 0.1
    pulled = -0.8 * GRAVITY * env.plant.wearer.handle * np.sin(info["state/angle"])
    assert np.allclose(info["state/object_torque"], pulled, atol=1e-9)
    borne = env.plant.weight_torque(info["state/angle"]) if bear else 0.0
    asked = info["reference"] + info["state/torque_clipped"]
    assert np.allclose(asked, pulled + borne, atol=1e-9)


def test_wall_reference_is_a_spring_beyond_its_angle() -> None:
    env = made(reference="wall", bear=False, motion="sines", pace=1.0)
    info = driven(env, [-0.3, -0.5], 900)
    torque, angle = info["state/object_torque"], info["state/angle"]
    inside = torque < 0.0
    assert 50 < inside.sum() < 850
    slope, place = np.polyfit(angle[inside], torque[inside], 1)
    assert 5.0 <= -slope <= 7.0
    assert 0.8 <= -place / slope <= 1.3
    assert (torque[angle < -place / slope - 1e-9] == 0.0).all()
    asked = info["state/stiffness_reference"] + info["state/stiffness_clipped"]
    deep = angle > -place / slope + 0.05
    assert np.allclose(asked[deep], -slope)
    assert np.ptp(asked[~inside]) < 1e-12


def test_unreachable_references_are_clipped_torque_first_and_reported() -> None:
    samples = [[40.0, 14.0]] * 20 + [[-30.0, 1.0]] * 20
    env = made(reference=samples, motion="still")
    info = driven(env, [0.0, 0.0], 39)
    torques, stiffnesses = env.plant.corners(info["state/angle"])
    late = np.arange(40) >= 20
    nearest = np.where(late, torques.min(axis=1), torques.max(axis=1))
    assert np.allclose(info["reference"], nearest)
    corner = np.where(late, stiffnesses[:, 1], stiffnesses[:, 3])
    assert np.allclose(info["state/stiffness_reference"], corner)
    asked = np.where(late, -30.0, 40.0)
    assert np.allclose(info["state/torque_clipped"], asked - nearest)
    assert (info["saturated"] == 0.0).all()


def test_signal_ranges_cover_the_bundles() -> None:
    assert signal_ranges(PLANT) == (30.0, 15.0)
    assert signal_ranges(ElbowOrthosis.paper(bundle_a__muscles=1.0)) == (30.0, 15.0)
    strong = ElbowOrthosis.paper("none", bundle_a__muscles=12.0, bundle_b__muscles=20.0)
    env = made(plant=strong.without_noise(), reference=[[40.0, 45.0]], motion="still")
    info = driven(env, [1.0, 1.0], 60)
    assert info["sensor/stiffness"][-1] > 30.0
    for key, name in (("sensor/torque", "torque"), ("sensor/stiffness", "stiffness"),
                      ("reference", "reference"),
                      ("state/stiffness_reference", "stiffness_reference")):  # fmt: skip
        assert env.signals.decode(info["seen"], name) == pytest.approx(info[key], abs=1e-4)
    by_torque = made(plant=strong, action="torque_stiffness").action_signals
    assert by_torque["stiffness_set_point"].high == signal_ranges(strong)[1]


def test_start_pressures_do_not_exceed_the_drawn_supply() -> None:
    env = made(valves="on_off", randomize={"valve.supply_pressure": (2e5, 2.1e5)}, start="random",
               reference=[[20.0, 10.0]])  # fmt: skip
    found = [env.reset(seed=s)[1] for s in range(12)]
    most = [max(info["state/pressure_a"], info["state/pressure_b"]) for info in found]
    assert max(most) <= 2.1e5 + 1e-6
    assert max(most) > 1.9e5


def test_reward_weighs_torque_and_stiffness_as_the_headline() -> None:
    task = TorqueStiffness()
    torque = task.torque_weight / task.torque_scale
    assert task.stiffness_weight / task.stiffness_scale == pytest.approx(NEAR * torque)


def test_torque_and_stiffness_as_actions() -> None:
    env = made(plant=QUIET, action="torque_stiffness", motion="still", normalize=False)
    held = driven(env, [1.0, 4.0], 80, 3)
    assert held["saturated"][-1] == 0.0
    assert held["state/torque"][-1] == pytest.approx(1.0, abs=2e-3)
    assert held["state/stiffness"][-1] == pytest.approx(4.0, abs=2e-3)
    *_, info = env.step(np.array([1.0, 14.0], np.float32))
    assert info["saturated"] == 1.0
    full = env.plant.full_pressure
    assert max(info["state/command_a"], info["state/command_b"]) == pytest.approx(full)


def test_observed_references_are_those_at_the_sensed_angle() -> None:
    env = made(reference="weight", weight=1.0, bear=False)
    info = driven(env, [0.0, -0.5], 100)
    seen = env.signals.decode(info["seen"], "reference")
    handle = env.plant.wearer.handle
    desired = -GRAVITY * handle * np.sin(info["sensor/angle"])
    reached = np.abs(info["state/torque_clipped"]) < 1e-12
    assert reached.sum() > 50
    assert np.allclose(seen[reached], desired[reached], atol=1e-5)
    assert not np.allclose(seen, info["reference"], atol=1e-5)


def test_previews_follow_the_intended_motion() -> None:
    env = made(reference="weight", weight=1.0, bear=False, preview=2, preview_stride=5)
    info = driven(env, [0.0, -0.5], 120)
    ahead = env.signals.decode(info["seen"], "reference_2")[:-10]
    intended = info["state/intent"][10:]
    desired = -GRAVITY * env.plant.wearer.handle * np.sin(intended)
    lowest = np.array([env.plant.corners(q)[0].min() for q in intended])
    assert np.allclose(ahead, np.maximum(desired, lowest), atol=1e-5)


def test_one_pulse_is_taken_per_cycle() -> None:
    def pressures(actions: list[list[float]]) -> list[float]:
        env = made(valves="on_off", motion="still")
        observation, _ = env.reset(seed=0)
        waits, found = [], []
        for action in actions:
            waits.append(float(env.signals.decode(observation, "to_pulse")))
            observation, *_, info = env.step(np.array(action, np.float32))
            found.append(info["state/pressure_b"])
        assert waits[:6] == pytest.approx([0.0, 0.04, 0.03, 0.02, 0.01, 0.0], abs=1e-6)
        return found

    pulse, rest = [0.0, 0.8], [0.0, 0.0]
    once = pressures([pulse] + [rest] * 9)
    assert once == pressures([pulse, *[[0.9, -0.9]] * 4] + [rest] * 5)
    never = pressures([rest] * 10)
    assert once[4] > never[4] + 1e3
    assert pressures([rest, pulse, pulse, *[rest] * 7]) == never


def test_pulses_are_observed_and_penalised_until_the_next_ones() -> None:
    env = made(valves="on_off", motion="still")
    env.reset(seed=0)
    seen, paid = [], []
    for action in [[0.5, -1.0], *[[1.0, 1.0]] * 4, [0.0, 0.0]]:
        observation, *_, info = env.step(np.array(action, np.float32))
        seen.append([float(env.signals.decode(observation, f"pulse_{k}")) for k in "ab"])
        paid.append(info["reward/effort"])
    assert np.allclose(seen[:5], [0.025, -0.05], atol=1e-6)
    assert np.allclose(seen[5], 0.0, atol=1e-6)
    assert np.allclose(paid, [-0.2 * 0.75] * 5 + [0.0], atol=1e-6)


FLIMSY = ElbowOrthosis.paper(pulley__stop_stiffness=10.0, wearer__stiffness=4.0, link__gravity=0.0)
"""Stops that the bundles break against a wearer who hardly holds on; the preset's they cannot."""


def rewards(policy: Any, seed: int) -> tuple[np.ndarray, dict[str, Any]]:
    """Return the rewards of an episode, and its last info."""
    env = made(plant=FLIMSY, reference="free", episode_seconds=4.0)
    if isinstance(policy, str):
        policy = make_controller(policy, env.plant, env.signals, env.action_signals)
    observation, _ = env.reset(seed=seed)
    found, state, over = [], None, False
    while not over:
        if isinstance(policy, list):
            action = np.array(policy, np.float32)
        else:
            action, state = policy.predict(observation, state, state is None)
        observation, reward, terminated, truncated, info = env.step(action)
        found.append(reward)
        over = terminated or truncated
    return np.array(found), info | {"terminated": terminated}


@pytest.mark.parametrize("seed", [0, 1])
def test_ending_an_episode_at_a_stop_has_the_lowest_return(seed: int) -> None:
    crash, info = rewards([-1.0, 1.0], seed)
    assert info["terminated"]
    assert len(crash) < 100
    held, allocated = (rewards(f"elbow_{name}", seed)[0] for name in ("hold", "allocation"))
    assert len(held) == len(allocated) == 400
    for discount in (1.0, 0.97):
        values = [float(r @ discount ** np.arange(len(r))) for r in (crash, held, allocated)]
        assert values == sorted(values)
    left = 400 - len(crash) + 1
    per_period = -info["reward/ended"] / left
    assert per_period > -2.0 * min(held.min(), crash[:-1].min())  # no period costs as much


def test_reward_of_a_period_exceeds_the_penalty_per_remaining_period() -> None:
    torque, stiffness = largest_errors(PLANT)
    env = made(randomize=True, motion="sines", span=(0.1, 2.0), pace=1.0, start="random")
    worst = TorqueStiffness().worst(torque, stiffness)
    random = np.random.default_rng(0)
    for seed in range(3):
        env.reset(seed=seed)
        for _ in range(150):
            _, reward, terminated, *_ = env.step(random.choice([-1.0, 1.0], 2).astype(np.float32))
            assert not terminated
            assert reward > -0.7 * worst


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"valves": "on_off", "action": "torque_stiffness"}, "on/off valves have none"),
        ({"valves": "on_off", "plant": PLANT}, "the plant's are 'proportional'"),
        ({"span": (1.2, 0.4)}, "swap them"),
        ({"span": 1.0}, "must be two angles"),
        ({"span": (0.5, 3.0)}, "span = 3.0 must be a number"),
        ({"motion": "run"}, "motion = 'run'"),
        ({"reference": [[1.0, 2.0, 3.0]]}, "give 2 numbers"),
        ({"pace": 0.0}, "pace = 0.0 must be a number"),
        ({"weight": -1.0}, "weight = -1.0"),
        ({"weight": 1.0, "reference": "wall"}, "the reference has no weight"),
        ({"reference": [[100.0, 2.0]]}, "reaches 100 N m; at most 60 N m"),
        ({"reference": [[1.0, 31.0]]}, "reaches 31 N m/rad; at most 30 N m/rad"),
        ({"reference": [[1.0, -2.0]]}, "stiffness of -2 N m/rad"),
        ({"reward": {"nearest_wall": 2.0, "farthest_wall": 1.0}}, "nearest_wall = 2 is above"),
        ({"reward": {"lightest": 3.0}}, "lightest = 3 is above"),
        ({"randomize": {"wearer.handle": (0.1, 0.12)}}, "not a parameter that can be drawn"),
        (
            {
                "randomize": {
                    "link.inertia": (1e-4, 0.01),
                    "wearer.inertia": (5e-3, 0.1),
                    "wearer.damping": (1.0, 20.0),
                }
            },
            "too fast",
        ),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        made(**arguments)
