"""Metrics of joints and arms, on records whose scores are known and on episodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401 (registers)
from benchmarks import metrics, rollout
from benchmarks.leaderboard import columns_of
from benchmarks.scenarios import ScenarioSet, available

PERIOD = 0.01
N = 1000
TIME = PERIOD * np.arange(1, N + 1)
JOINT, CHAIN = "PAM/AntagonisticJoint-v0", "PAM/RedundantManipulator-v0"
EFFORT = ("effort/pressure_travel", "effort/air", "cost/angle", "cost/pressure")
TRACKS = {n: t for n, t in available().items() if t.env in (JOINT, CHAIN)}


def joint(**changes: Any) -> dict[str, np.ndarray]:
    """Return a record of a joint that is where it should be."""
    reference = 0.2 * np.sin(2.0 * np.pi * TIME)
    made = {key: reference.copy() for key in ("reference", "output", "sensed", "state/angle")}
    made |= {key: np.zeros(N) for key in (*EFFORT, "saturated", "state/slack")}
    return {"time": TIME, **made, **changes}


def chain(**changes: Any) -> dict[str, np.ndarray]:
    """Return a record of an arm of two joints whose tip is 3 mm off."""
    made = {key: np.zeros(N) for key in (*EFFORT, "reference", "saturated", "state/slack")}
    made |= {"output": np.full(N, 3e-3), "sensed": np.full(N, 4e-3)}
    made |= {"state/pointing_error": np.full(N, 0.02), "state/joint_error": np.full(N, 0.01)}
    for k in range(2):
        made[f"state/angle_{k}"] = made[f"state/joint_reference_{k}"] = np.full(N, -0.3 * k)
    return {"time": TIME, **made, **changes}


def score(record: dict[str, np.ndarray], group: str) -> dict[str, float]:
    return metrics.score(record, PERIOD, 2.0, 0.5, {"cost/angle": 0.01}, groups=(group,))


def test_the_error_is_over_half_the_range() -> None:
    reference = joint()["reference"]
    scores = score(joint(output=reference + 0.02), "joint")
    assert scores["rms_error"] == pytest.approx(0.02)
    assert scores["rms_percent"] == pytest.approx(10.0)
    assert set(scores) == set(metrics.of_track({"metrics": ["joint"]}))


def test_the_sensed_error_and_that_to_the_model_stand_beside_the_headline() -> None:
    angle = joint()["state/angle"]
    scores = score(joint(sensed=angle + 0.01), "joint")
    assert scores["rms_error"] == 0.0
    assert scores["sensed_rms_error"] == pytest.approx(0.01)
    assert np.isnan(scores["model_rms_error"])
    told = score(joint(**{"model/0": angle - 0.03}), "joint")
    assert told["rms_error"] == 0.0
    assert told["model_rms_error"] == pytest.approx(0.03)


def test_shares_of_time_are_of_the_window_after_settling() -> None:
    short = (TIME <= 6.0).astype(float)
    scores = score(joint(saturated=short, **{"state/slack": 2.0 * short}), "joint")
    assert scores["saturated_time"] == pytest.approx(0.5)
    assert scores["slack_time"] == pytest.approx(0.5)


def test_of_a_chain_tip_pointing_joints_and_model_are_scored_apart() -> None:
    models = {"model/0": np.full(N, 0.04), "model/1": np.full(N, -0.3)}
    scores = score(chain(**models), "chain")
    assert set(scores) == set(metrics.of_track({"metrics": ["chain"]}))
    assert scores["rms_error"] == pytest.approx(3e-3)
    assert scores["sensed_rms_error"] == pytest.approx(4e-3)
    assert scores["pointing_rms"] == pytest.approx(0.02)
    assert scores["joint_rms"] == pytest.approx(0.01)
    assert scores["largest_angle"] == pytest.approx(0.3)
    assert scores["model_rms_error"] == pytest.approx(0.04 / np.sqrt(2.0))
    one = score(chain(**{"model/0": np.zeros(N)}), "chain")
    assert np.isnan(one["model_rms_error"])  # a model of one joint is no model of the arm


@dataclass(frozen=True)
class Follower:
    """Asks for an angle of 0.1 and says what its model does."""

    joints: int
    models: bool = True

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        count = 0 if state is None or episode_start else state + 1
        return np.full(self.joints, 0.1, np.float32), count

    def __getattr__(self, name: str) -> Any:
        if name == "model_output" and self.models:
            return lambda state: np.full((1, self.joints), 0.001 * state)
        raise AttributeError(name)


@pytest.mark.parametrize(("name", "joints"), [(JOINT, 1), (CHAIN, 6)])
def test_an_episode_records_what_a_model_does_at_the_same_instants(name: str, joints: int) -> None:
    env = gym.make(name, episode_seconds=0.2)
    episode = rollout.run(env, Follower(joints), 0)
    for k in range(joints):
        assert np.allclose(episode.signals[f"model/{k}"], 0.001 * np.arange(20))
    assert len(episode.signals["time"]) == 20
    plain = rollout.run(env, Follower(joints, models=False), 0)
    assert not any(key.startswith("model/") for key in plain.signals)
    assert np.array_equal(plain.signals["output"], episode.signals["output"])


@pytest.mark.parametrize("name", sorted(TRACKS))
def test_tracks_name_signals_that_there_are(name: str) -> None:
    track: ScenarioSet = TRACKS[name]
    keys = gym.make(track.env).unwrapped.setup.info_keys
    assert track.content["sensed"] in keys
    assert set(track.content["cost_scales"]) <= set(keys)
    wanted = metrics.of_track(track.content)
    assert {metric for metric, _, _ in columns_of(track.content)} <= set(wanted)
    assert wanted["rms_error"] == track.content["unit"]


def test_each_kind_of_track_is_there_for_both() -> None:
    for word in ("joint", "manipulator"):
        assert {f"{word}_nominal", f"{word}_payload", f"{word}_wrong_model"} <= set(TRACKS)
    assert {"joint_disturbed", "joint_reduced"} <= set(TRACKS)


def test_a_run_that_the_stop_ends_counts_at_the_worst_case() -> None:
    content = TRACKS["joint_nominal"].content
    scores = score(joint(), "joint")
    worst = metrics.worst_of(scores, content["worst_case"])
    assert worst["rms_error"] == 1.0
    assert worst["max_error"] == 1.0
    assert worst["rms_percent"] == 500.0
