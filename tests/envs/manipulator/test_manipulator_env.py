"""Redundant manipulator: path, plan, observation, output."""

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.envs.manipulator.layout import POSE
from pam_envs.envs.manipulator.paths import DRAWN, USUAL_PAYLOAD, paths_for
from pam_envs.mechanics.redundancy.resolution import UnreachablePose
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.plants.antagonistic_joint.statics import UnbearableLoad, bearable_payload
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.references.path import PATHS

NAME = "PAM/RedundantManipulator-v0"
PLANT = RedundantManipulator.paper()
LIGHT = RedundantManipulator.paper(
    chain=SerialChain.uniform(gravity=(0.0, 0.0, 0.0)), hysteresis__width=0.0
)
"""Without hysteresis and weight: setpoints are the angles at rest."""


def make(**arguments: Any) -> Any:
    return gym.make(NAME, **{"normalize": False, "reference": "path_1", **arguments}).unwrapped


def vector(info: dict[str, float], key: str) -> np.ndarray:
    """Return a quantity of every joint."""
    return np.array([info[f"{key}_{k}"] for k in range(6)])


def pose(info: dict[str, float], key: str = "") -> np.ndarray:
    return np.array([info[f"state/{key}{name}"] for name in POSE])


def follow(env: Any, seconds: float, seed: int = 0) -> list[dict[str, float]]:
    """Return ``info`` while the setpoints are the planned angles."""
    observation, info = env.reset(seed=seed)
    infos = [dict(info)]
    for _ in range(round(100 * seconds)):
        expected = [env.signals.decode(observation, f"joint_reference_{k}") for k in range(6)]
        observation, *_, info = env.step(np.array(expected, np.float32))
        infos.append(dict(info))
    return infos


def test_reference_rests_follows_the_path_rests_and_returns() -> None:
    env = make(path_seconds=1.0, rest_seconds=0.25, reference="path_3")
    infos = follow(env, 2.5)
    expected = np.array([pose(info, "reference_") for info in infos])
    chain, ends = PLANT.chain, PATHS[2].angles()
    assert np.allclose(expected[:26], chain.pose(ends[0]), atol=1e-12)
    assert np.allclose(expected[125:151], chain.pose(ends[-1]), atol=1e-12)
    assert np.allclose(expected[250], chain.pose(ends[0]), atol=1e-12)
    assert np.allclose(expected[25:126], expected[150:251][::-1], atol=1e-9)
    fastest = np.linalg.norm(np.diff(expected[:126, :3], axis=0), axis=1)
    assert 70 < np.argmax(fastest) < 80  # in the middle of the way, as least jerk has it


def test_planned_angles_follow_the_path_within_joint_limits() -> None:
    quick = {"path_seconds": 0.5, "rest_seconds": 0.02}
    for number, path in enumerate(PATHS):
        infos = follow(make(reference=path.name, **quick), 0.54)
        planned = np.array([vector(info, "state/joint_reference") for info in infos])
        expected = np.array([pose(info, "reference_") for info in infos])
        assert np.abs(planned).max() < math.radians(30.0), number
        assert np.allclose(PLANT.chain.pose(planned), expected, atol=2e-4)
    free = follow(make(reference="path_3", weighted=False, **quick), 0.54)
    peak = max(np.abs(vector(info, "state/joint_reference")).max() for info in free)
    assert peak == pytest.approx(math.radians(37.12), abs=math.radians(0.02))


def test_without_hysteresis_and_weight_the_arm_rests_on_its_plan() -> None:
    first = follow(make(plant=LIGHT), 0.5)[-1]
    assert first["state/joint_error"] < 1e-6
    assert first["output"] < 1e-5
    assert first["state/pointing_error"] < 1e-5


def test_weight_and_payload_increase_the_position_error() -> None:
    bare, loaded = (follow(make(payload=p), 0.5)[-1]["output"] for p in (0.0, 0.1))
    assert 0.01 < bare < loaded < 0.5


def test_output_and_pointing_error_follow_from_true_angles() -> None:
    for info in follow(make(), 1.5)[::30]:
        true, expected = PLANT.chain.pose(vector(info, "state/angle")), pose(info, "reference_")
        assert np.allclose(pose(info), true, atol=1e-12)
        assert info["output"] == pytest.approx(float(np.linalg.norm((true - expected)[:3])))
        assert info["state/pointing_error"] == pytest.approx(
            float(np.linalg.norm((true - expected)[3:]))
        )
        off = vector(info, "state/angle") - vector(info, "state/joint_reference")
        assert info["state/joint_error"] == pytest.approx(float(np.sqrt(np.mean(off**2))))
        assert info["reference"] == 0.0


def test_observed_pose_follows_from_sensed_angles() -> None:
    env = make()
    observation, info = env.reset(seed=0)
    for _ in range(20):
        observation, *_, info = env.step(np.full(6, 0.1, np.float32))
        seen = np.array([env.signals.decode(observation, name) for name in POSE])
        sensed = PLANT.chain.pose(vector(info, "sensor/angle"))
        assert np.allclose(seen, sensed, atol=1e-6)
        assert info["sensor/output"] == pytest.approx(
            float(np.linalg.norm(sensed[:3] - pose(info, "reference_")[:3]))
        )
        assert not np.allclose(sensed, pose(info), atol=1e-9)


def test_previews_equal_later_references() -> None:
    env = make(preview=3, preview_stride=7, path_seconds=0.5, rest_seconds=0.1)
    observation, _ = env.reset(seed=0)
    seen = []
    for _ in range(80):
        seen.append(observation.copy())
        observation, *_ = env.step(np.zeros(6, np.float32))
    for name in ("reference_y", "reference_point_z", "joint_reference_4"):
        for i in (1, 2, 3):
            signal = env.signals[f"{name}_{i}"]
            assert signal.ahead == pytest.approx(0.07 * i)
            now = [o[env.signals[name].index] for o in seen[7 * i :]]
            assert [o[signal.index] for o in seen[: -7 * i]] == now


def test_episodes_draw_among_the_paths() -> None:
    env = make(reference="paths")
    drawn = {env.reset(seed=seed)[1]["state/path"] for seed in range(20)}
    assert drawn == {0.0, 1.0, 2.0}


def test_reference_accepts_poses() -> None:
    line = np.linspace(0.1, 0.2, 5)[:, None] * np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0])
    poses = PLANT.chain.pose(line)
    infos = follow(make(reference=poses, path_seconds=0.5, rest_seconds=0.1), 0.6)
    assert np.allclose(pose(infos[0], "reference_"), poses[0])
    assert np.allclose(pose(infos[-1], "reference_"), poses[-1])


def test_unreachable_pose_is_refused_at_construction() -> None:
    far = np.array([[0.0, 0.0, 1.5, 0.0, 0.0, 1.0], [1.4, 0.0, 0.0, 0.0, 0.0, 1.0]])
    with pytest.raises(UnreachablePose, match="is out of reach with joints"):
        make(reference=far)


def test_other_arms_follow_drawn_paths() -> None:
    arm = RedundantManipulator.paper(chain=SerialChain.uniform("xyxyxyx", 0.2, 0.08))
    line = np.linspace(0.1, 0.2, 5)[:, None] * np.array([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
    env = make(plant=arm, reference=arm.chain.pose(line))
    assert env.action_space.shape == (7,)
    _, info = env.reset(seed=0)
    assert {f"state/angle_{k}" for k in range(7)} <= set(info)
    with pytest.raises(ValueError, match="is for an arm of 6 joints and this one has 7"):
        make(plant=arm, reference="path_1")


def test_twelve_pressures_as_actions() -> None:
    env = make(action="pressures", plan=False)
    assert env.action_space.shape == (12,)
    assert "joint_reference_0" not in list(env.signals.names())
    env.reset(seed=0)
    pressures = np.linspace(1e5, 5e5, 12)
    for _ in range(100):
        *_, info = env.step(pressures.astype(np.float32))
    found = [info[f"state/pressure_{k}{m}"] for k in range(6) for m in "ab"]
    assert np.allclose(found, pressures.astype(np.float32), rtol=1e-6)


def test_joint_at_its_stop_ends_the_episode() -> None:
    env = make(action="pressures", payload=0.1)
    env.reset(seed=0)
    ended = False
    for _ in range(400):
        action = np.tile([6.5e5, 0.0], 6).astype(np.float32)
        _, _, ended, _, info = env.step(action)
        largest = np.abs(vector(info, "state/angle")).max()
        assert ended == (largest > PLANT.largest_angle)
        if ended:
            break
    assert ended


SHORT = (0.0308, 0.0362)
"""Lever arms [m]; one of them may be short."""


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"action": "angle_stiffness"}, "action = 'angle_stiffness' is not known"),
        ({"plan": 1}, "plan = 1"),
        ({"weighted": "yes"}, "weighted = 'yes'"),
        ({"path_seconds": 0.0}, "path_seconds = 0.0"),
        ({"rest_seconds": -1.0}, "rest_seconds"),
        ({"payload": 0.8}, "from 0 to 0.1 kg"),
        ({"reference": np.zeros((4, 5))}, r"shape \(4, 5\); give from 2 to 10000 finite poses"),
        ({"reference": np.zeros((1, 6))}, "from 2 to"),
        ({"randomize": {"link.stop": (0.6, 0.61)}}, "can be drawn"),
        ({"randomize": {"lever.r_u": SHORT, "lever.r_o": SHORT}}, "loses its lever arm"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        gym.make(NAME, **arguments)


@pytest.mark.parametrize("make_arm", [RedundantManipulator.paper, RedundantManipulator.measured])
def test_drawn_plans_are_continuous_and_can_be_held(make_arm: Any) -> None:
    arm = make_arm("none")
    paths = paths_for(arm, "drawn", weighted=True)
    assert len(paths) == DRAWN
    for path in paths.values():
        angles = path[6:].T
        moved = np.ptp(angles, axis=0).max()
        assert np.abs(np.diff(angles, axis=0)).max() < 0.2 * moved + 1e-3
        assert np.abs(angles).max() < arm.link.limit
        assert bearable_payload(arm, angles) >= USUAL_PAYLOAD
    ends = {path[:3, -1].tobytes() for path in paths.values()}
    assert len(ends) == DRAWN  # no path twice


def test_measured_arm_names_the_paths_it_can_follow() -> None:
    arm = RedundantManipulator.measured()
    with pytest.raises(
        UnreachablePose, match=r"of \+-20\.\d+ degrees.* not for this arm: take 'drawn'"
    ):
        gym.make(NAME, plant=arm)
    gym.make(NAME, plant=arm, reference="drawn").reset(seed=0)


def test_unbearable_payload_names_pose_joint_and_torques() -> None:
    said = (
        r"path_3, pose 40: with 0.05 kg of payload joint 2 needs 1.58 N m at -27.8 degrees and "
        r"its muscles exert 1.49 N m there at most; give it a payload of 0.0367 kg or less"
    )
    with pytest.raises(UnbearableLoad, match=said):
        make(reference="path_3", payload=0.05)
    with pytest.raises(UnbearableLoad, match=r"with 0.05 kg"):
        make(reference="paths", payload=[0.0, 0.03], payload_change=0.02)
    with pytest.raises(UnbearableLoad, match=r"with 0.05 kg"):  # nor is it hidden by another plan
        make(reference="path_3", payload=0.05, weighted=False)
    make(reference="path_1", payload=0.05, payload_change=0.05)
    with pytest.raises(UnbearableLoad, match="nor is it borne without a payload"):
        make(plant=RedundantManipulator.paper(chain=SerialChain.uniform(mass=0.3)))


def test_payload_none_draws_up_to_the_largest_bearable_one() -> None:
    env = make(reference="path_3", payload=None, payload_change=0.01)
    drawn = {env.reset(seed=seed)[1]["state/payload"] for seed in range(40)}
    plan = paths_for(PLANT, "path_3", weighted=True)["path_3"][6:].T
    assert len(drawn) == 6
    assert max(drawn) == pytest.approx(bearable_payload(PLANT, plan) - 0.01, abs=1e-12)


def test_rates_are_filtered_differences_of_sensed_angles() -> None:
    env, twin = make(plant=PLANT.without_noise()), make()
    observation, _ = env.reset(seed=0)
    twin.reset(seed=0)
    smooth, last, noise, shown = np.zeros(6), None, [], []
    for k in range(60):
        action = np.full(6, 0.02 * min(k, 12), np.float32)
        observation, *_, info = env.step(action)
        angles, rates = vector(info, "sensor/angle"), vector(info, "sensor/rate")
        if last is not None:
            smooth = smooth + 0.01 / 0.04 * ((angles - last) / 0.01 - smooth)
            assert np.allclose(rates, smooth, atol=1e-9)
        else:
            smooth = rates
        shown = [float(env.signals.decode(observation, f"rate_{k}")) for k in range(6)]
        assert np.allclose(shown, rates, atol=1e-5)
        noise.append(vector(twin.step(action)[4], "sensor/rate") - rates)
        last = angles
    single = PLANT.angle.noise * math.sqrt(2.0) / 0.01  # of the difference of two readings
    assert 0.1 * single < np.std(noise[10:]) < 0.3 * single


def test_resting_flag_marks_rests_of_the_path() -> None:
    env = make(path_seconds=0.3, rest_seconds=0.2)
    infos = follow(env, 1.2)
    places = np.array([pose(info, "reference_") for info in infos])
    still = np.array([info["state/resting"] for info in infos])
    assert set(still) == {0.0, 1.0}
    moved = np.abs(np.diff(places, axis=0)).max(axis=1) > 0.0
    assert not (moved & (still[1:] == 1.0) & (still[:-1] == 1.0)).any()
    assert moved[(still[1:] == 0.0)].all()
