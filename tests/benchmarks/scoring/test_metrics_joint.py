"""Metrics of joints and arms, on records whose scores are known and on episodes."""

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401 (registers)
from benchmarks.board import accessors as views
from benchmarks.board import standings
from benchmarks.runs import rollout
from benchmarks.scenarios.scenario import ScenarioSet, available
from benchmarks.scenarios.scenario_env import make_env
from benchmarks.scoring import metrics
from benchmarks.scoring.groups import joint as metrics_joint

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
    for key in (*metrics_joint.POSITION, *metrics_joint.DIRECTION):
        made[f"state/{key}"] = made[f"state/reference_{key}"] = np.zeros(N)
    for k in range(2):
        made[f"state/angle_{k}"] = made[f"state/joint_reference_{k}"] = np.full(N, -0.3 * k)
    return {"time": TIME, **made, **changes}


def score(record: dict[str, np.ndarray], group: str) -> dict[str, float]:
    content = {
        "settle_seconds": 2.0,
        "hold_seconds": 0.5,
        "sensed": "sensed",
        "cost_scales": {"cost/angle": 0.01},
        "metrics": [group],
        "tool_length": 0.25,
    }
    return metrics.score(record, PERIOD, content)


def test_percent_error_is_relative_to_half_range():
    reference = joint()["reference"]
    scores = score(joint(output=reference + 0.02), "joint")
    assert scores["rms_error"] == pytest.approx(0.02)
    assert scores["rms_percent"] == pytest.approx(10.0)
    assert set(scores) == set(metrics.of_track({"metrics": ["joint"]}))


def test_sensed_and_model_errors_are_scored_beside_the_headline():
    angle = joint()["state/angle"]
    scores = score(joint(sensed=angle + 0.01), "joint")
    assert scores["rms_error"] == 0.0
    assert scores["sensed_rms_error"] == pytest.approx(0.01)
    assert np.isnan(scores["model_rms_error"])
    modelled = score(joint(**{"model/0": angle - 0.03}), "joint")
    assert modelled["rms_error"] == 0.0
    assert modelled["model_rms_error"] == pytest.approx(0.03)


def test_shares_of_time_refer_to_the_window_after_settling():
    short = (TIME <= 6.0).astype(float)
    scores = score(joint(saturated=short, **{"state/slack": 2.0 * short}), "joint")
    assert scores["saturated_time"] == pytest.approx(0.5)
    assert scores["slack_time"] == pytest.approx(0.5)


def test_chain_scores_tip_pointing_joints_and_model_separately():
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


def test_tip_error_displaces_the_whole_tool():
    scores = score(chain(**{"state/x": np.full(N, 3e-3)}), "chain")
    assert scores["tool_rms_error"] == pytest.approx(3e-3)


def test_pointing_error_counts_by_half_of_its_displacement():
    turned = {"state/point_y": np.full(N, 0.04)}  # the tip is right, the other point 10 mm off
    scores = score(chain(output=np.zeros(N), **turned), "chain")
    assert scores["rms_error"] == 0.0
    assert scores["tool_rms_error"] == pytest.approx(10e-3 / np.sqrt(2.0))
    # about the other point: it is right and the tip is off
    about = {**turned, "state/y": np.full(N, 0.01)}
    assert score(chain(**about), "chain")["tool_rms_error"] == pytest.approx(10e-3 / np.sqrt(2.0))
    # about the middle between both: each is off by half
    about["state/y"] = np.full(N, 0.005)
    assert score(chain(**about), "chain")["tool_rms_error"] == pytest.approx(5e-3)


def test_tool_is_scored_after_settling_only():
    early = {"state/z": np.where(TIME <= 2.0, 0.1, 0.0)}
    assert score(chain(**early), "chain")["tool_rms_error"] == 0.0


def test_steady_state_error_of_tip_is_scored_while_its_path_rests():
    moving = np.clip(TIME - 3.0, 0.0, 2.0)  # 3 s to 5 s; it counts as at rest from 5.5 s on
    off = np.where((TIME > 2.5) & (TIME < 5.5), 0.02, 1e-3)
    record = chain(output=off, **{f"state/{r}point_x": moving for r in ("", "reference_")})
    scores = score(record, "chain")
    assert scores["max_error"] == 0.02
    assert scores["steady_state_error"] == pytest.approx((1e-3 * 451 + 0.02 * 50) / 501, rel=0.02)
    still = metrics_joint.path_length(record)
    assert np.all(np.diff(still)[:298] == 0.0) and np.all(np.diff(still)[500:] == 0.0)
    assert still[-1] == pytest.approx(2.0)


def test_chain_is_ranked_by_its_whole_tool():
    arm, one = TRACKS["manipulator_nominal"].content, TRACKS["joint_nominal"].content
    assert metrics.headline_of(arm) == "tool_rms_error"
    assert metrics.headline_of(one) == metrics.HEADLINE == "rms_error"
    for key, value in (("headline", "air"), ("tool_length", None)):
        changed = {k: v for k, v in (arm | {key: value}).items() if v is not None}
        with pytest.raises(ValueError, match=key):
            ScenarioSet(changed)
    ordered = standings.tracks([_row(arm, "tip", 1e-3, 9e-3), _row(arm, "tool", 2e-3, 3e-3)])
    names = [row["controller"]["name"] for row in ordered["manipulator_nominal"]]
    assert names == ["tool", "tip"]


def _row(content: Any, name: str, tip: float, *tool: float) -> dict[str, Any]:
    """Return a row with an episode for each tool error, one a scenario."""
    where = {"seed": 1, "training_seed": None, "split": "public", "failed": False}
    episodes = [
        {**where, "scenario": s.name, "scores": {"rms_error": tip, "tool_rms_error": error}}
        for s, error in zip(ScenarioSet(content).scenarios(), tool, strict=False)
    ]
    return {
        "controller": {"name": name, "kind": "classical"},
        "env": {"id": CHAIN},
        "scenarios": {"name": content["name"], "content": content},
        "episodes": episodes,
        "audit": None,
    }


def test_scores_by_setting_are_of_the_headline():
    track = TRACKS["manipulator_nominal"]
    errors = np.arange(1.0, 1.0 + len(track.scenarios()))
    found = views.by_setting(_row(track.content, "any", 9.0, *errors))
    references = [value for (axis, _), value in found.items() if axis == "reference"]
    assert np.mean(references) == pytest.approx(3.5)


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
def test_episode_records_model_output_at_the_same_instants(name, joints):
    env = gym.make(name, episode_seconds=0.2)
    episode = rollout.run(env, Follower(joints), 0)
    for k in range(joints):
        assert np.allclose(episode.signals[f"model/{k}"], 0.001 * np.arange(20))
    assert len(episode.signals["time"]) == 20
    plain = rollout.run(env, Follower(joints, models=False), 0)
    assert not any(key.startswith("model/") for key in plain.signals)
    assert np.array_equal(plain.signals["output"], episode.signals["output"])


@pytest.mark.parametrize("name", sorted(TRACKS))
def test_tracks_name_existing_signals(name):
    track: ScenarioSet = TRACKS[name]
    keys = gym.make(track.env).unwrapped.setup.info_keys
    assert track.content["sensed"] in keys
    assert set(track.content["cost_scales"]) <= set(keys)
    expected = metrics.of_track(track.content)
    assert {metric for metric, _, _ in metrics.columns_of(track.content)} <= set(expected)
    assert expected["rms_error"] == expected[metrics.headline_of(track.content)]
    assert expected["rms_error"] == track.content["unit"]
    assert {f"state/{k}" for k in metrics_joint.POSITION} <= set(keys) or track.env == JOINT


@pytest.mark.parametrize("name", sorted(TRACKS))
def test_environments_of_all_scenarios_can_be_made(name):
    """Payloads and references of the tracks are what the muscles bear."""
    for scenario in TRACKS[name].scenarios():
        env = make_env(TRACKS[name].env, scenario.kwargs)
        lengths = getattr(getattr(env.unwrapped.plant, "chain", None), "lengths", (0.25,))
        assert TRACKS[name].content.get("tool_length", 0.25) == lengths[-1]


def test_joint_and_chain_have_every_kind_of_track():
    for word in ("joint", "manipulator"):
        assert {f"{word}_nominal", f"{word}_payload", f"{word}_wrong_model"} <= set(TRACKS)
    assert {"joint_disturbed", "joint_reduced"} <= set(TRACKS)


def test_run_ended_by_a_stop_counts_at_worst_case():
    content = TRACKS["joint_nominal"].content
    scores = score(joint(), "joint")
    worst = metrics.worst_of(scores, content["worst_case"])
    assert worst["rms_error"] == 1.0
    assert worst["max_error"] == 1.0
    assert worst["rms_percent"] == 500.0
