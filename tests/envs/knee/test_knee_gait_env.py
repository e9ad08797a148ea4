"""Knee orthosis on a leg: references, assistance and effort follow from recorded signals."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.muscle.emg import calibration, emg_proxy
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.sensing.butterworth import filtered
from tests.envs.cases import actions_for, record

GAITS = {
    "PAM/KneeWalk-v0": "walk",
    "PAM/KneeStairsUp-v0": "stairs_up",
    "PAM/KneeStairsDown-v0": "stairs_down",
}
EACH_GAIT = pytest.mark.parametrize("name", GAITS)


def quiet(name: str) -> KneeOrthosis:
    return KneeOrthosis.on_leg(GAITS[name], stride=2.0).without_noise()


def driven(name: str, steps: int = 300, **arguments: Any) -> tuple[Any, dict[str, np.ndarray]]:
    """Return the environment, and ``info`` and observations in SI under held random actions."""
    env = gym.make(name, normalize=False, episode_seconds=60.0, **arguments).unwrapped
    info = record(env, 0.5 * actions_for(env.action_space, steps, 1), 3)
    assert len(info["time"]) == steps + 1
    return env, info


@EACH_GAIT
@pytest.mark.parametrize("mismatch", [0.0, 10.0, -20.0])
def test_tension_reference_gives_the_desired_torque_in_stance_and_the_mismatch_in_swing(
    name: str, mismatch: float
) -> None:
    env, info = driven(name, mismatch=mismatch)
    stance = info["sensor/stance"] > 0.5
    assert 0 < stance.mean() < 1
    torque = np.where(stance, info["state/torque_reference"], 0.0)
    tension = np.maximum(0.0, env.plant.tension_for(info["sensor/angle"], torque))
    shift = np.where(stance, 0.0, mismatch)
    assert np.allclose(info["reference"], tension + shift, rtol=1e-9, atol=1e-9)


@EACH_GAIT
def test_angle_reference_is_the_path_in_swing_and_the_sensed_angle_in_stance(
    name: str,
) -> None:
    env, info = driven(name)
    stance = info["sensor/stance"] > 0.5
    path = env.plant.lever.mount_angle + info["state/knee"]
    expected = np.where(stance, info["sensor/angle"], path)
    assert np.allclose(info["state/angle_reference"], expected, atol=1e-12)
    assert np.allclose(info["state/angle"], path + info["state/deviation"], atol=1e-12)


@EACH_GAIT
@pytest.mark.parametrize(("assistance", "lowest"), [("signed", -np.inf), ("clipped", 0.0)])
@pytest.mark.parametrize(("source", "key"), [("estimate", "estimate"), ("demand", "demand")])
def test_desired_torque_is_a_low_passed_share_of_the_estimate(
    name: str, assistance: str, lowest: float, source: str, key: str
) -> None:
    arguments = {"assistance": assistance, "reference": source, "ratio": 0.3}
    _, info = driven(name, 450, plant=quiet(name), **arguments)
    share = np.maximum(lowest, 0.3 * info[f"state/{key}"])
    settled = slice(200, None)  # what was before the episode has faded by then
    assert np.ptp(share[settled]) > 1.0
    assert np.allclose(info["state/torque_reference"][settled], filtered(share)[settled], atol=2e-3)


def test_samples_are_the_desired_torque_without_low_pass() -> None:
    samples = 3.0 * np.sin(0.05 * np.arange(100))
    _, info = driven("PAM/KneeWalk-v0", 150, reference=samples)
    later = samples[np.minimum(np.arange(151), 99)]
    assert np.allclose(info["state/torque_reference"], later, atol=1e-12)


@EACH_GAIT
def test_preview_equals_later_references_without_disturbance(name: str) -> None:
    plant = quiet(name).replace({"leg.hold_stiffness": 500.0, "leg.stance_stiffness": 2e3})
    env, info = driven(name, plant=plant, preview=3, preview_stride=5)
    signals, seen = env.signals, info["seen"]
    now, ahead = signals["reference"].index, signals["reference_3"].index
    assert signals["reference_3"].ahead == pytest.approx(0.15)
    stiff = np.abs(info["state/deviation"][15:]) < 0.01
    error = seen[:-15, ahead] - seen[15:, now]
    assert np.ptp(seen[:, now]) > 100.0
    assert stiff.mean() > 0.3
    assert np.median(np.abs(error[stiff])) < 2.0
    now, ahead = signals["angle_reference"].index, signals["angle_reference_3"].index
    swing = info["state/stance"][15:] < 0.5
    assert np.allclose(seen[:-15, ahead][swing], seen[15:, now][swing], atol=1e-5)


@EACH_GAIT
def test_emg_proxies_follow_from_recorded_torques(name: str) -> None:
    env, info = driven(name)
    period, muscle = env.control_period, env.plant.activation
    helped = info["state/torque"]
    plain = emg_proxy(info["state/demand"], helped, period, muscle)
    share = calibration(GAITS[name], "A")
    fitted = emg_proxy(info["state/estimate"], helped, period, muscle, "A", share)
    settled = slice(50, None)
    for key, expected in (
        ("extensors", plain.extensors),
        ("extensors_free", plain.extensors_free),
        ("flexors", plain.flexors),
        ("flexors_free", plain.flexors_free),
        ("extensors_calibrated", fitted.extensors),
        ("extensors_free_calibrated", fitted.extensors_free),
    ):
        assert np.allclose(info[f"effort/{key}"][settled], expected[settled], atol=1e-6), key


def test_over_assistance_is_torque_beyond_the_demand_or_against_it() -> None:
    _, info = driven("PAM/KneeWalk-v0")
    torque, demand = info["state/torque"], info["state/demand"]
    between = np.clip(torque, np.minimum(0.0, demand), np.maximum(0.0, demand))
    assert np.allclose(info["effort/over_assistance"], np.abs(torque - between), atol=1e-12)
    assert (info["effort/over_assistance"] > 1.0).any()


@EACH_GAIT
def test_references_use_nominal_and_not_drawn_parameters(name: str) -> None:
    drawn = {"lever.stiffness": (33.0, 34.0), "lever.relaxed_angle": (2.2, 2.25)}
    env, info = driven(name, randomize=drawn)
    stance = info["sensor/stance"] > 0.5
    torque = np.where(stance, info["state/torque_reference"], 0.0)
    tension = env.plant.tension_for(info["sensor/angle"], torque)
    assert np.allclose(info["reference"], np.maximum(0.0, tension), rtol=1e-9, atol=1e-9)


@EACH_GAIT
def test_planned_references_use_the_nominal_body_mass(name: str) -> None:
    seen, plant = [], quiet(name)
    for mass in (60.0, 85.0):
        heavy = {"leg.body_mass": (mass, mass + 1e-6)}
        arguments = {"plant": plant, "randomize": heavy, "preview": 3, "preview_stride": 40}
        env, info = driven(name, 60, start="heel_contact", **arguments)
        seen.append(
            info["seen"][:, [env.signals[k].index for k in ("ground_force", "reference_3")]]
        )
    assert np.abs(seen[0][:, 0] - seen[1][:, 0]).max() > 100.0
    assert np.abs(seen[0][:, 1] - seen[1][:, 1]).max() < 1.0


def test_ambient_air_is_not_counted_as_effort() -> None:
    env = gym.make("PAM/KneeWalk-v0", normalize=False).unwrapped
    env.reset(seed=0)
    infos = [env.step(np.zeros(1, np.float32))[4] for _ in range(800)][300:]
    assert np.ptp([i["state/length"] for i in infos]) > 0.01  # it draws air as the leg moves
    assert max(i["effort/air"] for i in infos) == 0.0


def test_rewards_are_gated_where_sensed_and_true_phase_agree() -> None:
    noisy = KneeOrthosis.on_leg("walk", stride=2.0).replace({"heel.noise": 2.0})
    _, info = driven("PAM/KneeWalk-v0", plant=noisy)
    true, seen = info["state/stance"] > 0.5, info["sensor/stance"] > 0.5
    assert (true != seen).any()
    stance = true & seen
    assert (info["reward/angle"][true | seen] == 0.0).all()
    assert (info["reward/tension"][~stance] == 0.0).all()
    error = np.abs(info["output"] - info["reference"])[stance]
    assert np.allclose(info["reward/tension"][stance], -error / 10.0)


@EACH_GAIT
def test_pace_sets_the_stride_time(name: str) -> None:
    for pace, seconds in (("slow", 5.0), ("normal", 1.224), (2.5, 2.5)):
        _, info = driven(name, 20, pace=pace, start="heel_contact", strides="identical")
        assert info["state/phase"][0] == 0.0
        assert info["state/phase"][20] == pytest.approx(0.2 / seconds)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"pace": "fast"}, "pace = 'fast' is not known; choose one of 'slow', 'normal'"),
        ({"pace": 0.1}, "from 0.8 to 20 s a stride"),
        ({"ratio": 0.6}, "ratio = 0.6 must be a number from 0 to 0.5"),
        ({"assistance": "some"}, "choose one of 'signed', 'clipped'"),
        ({"mismatch": 1e3}, "from -100 to 100 N"),
        ({"start": "toe_off"}, "choose one of 'random', 'heel_contact'"),
        ({"plant": KneeOrthosis.no_load()}, r"give KneeOrthosis.on_leg\('walk'\)"),
        ({"plant": KneeOrthosis.on_leg("stairs_up")}, r"give KneeOrthosis.on_leg\('walk'\)"),
        ({"reference": [1e3]}, "reference reaches 1000 N m; at most 100 N m is accepted"),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        gym.make("PAM/KneeWalk-v0", **arguments)
