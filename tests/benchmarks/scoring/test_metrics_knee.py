"""The knee's metrics, on signals whose scores are known."""

from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from baselines.core.controller import encode_actions
from baselines.trivial import Constant
from benchmarks.runs import rollout, rows
from benchmarks.scenarios.scenario import ScenarioSet, available
from benchmarks.scoring import metrics
from benchmarks.scoring.groups import knee as metrics_knee

PERIOD = 0.01
N = 1000
GATE = ("state/stance", "sensor/stance")
TIME = PERIOD * np.arange(1, N + 1)
STANCE = ((TIME % 5.0) > 2.5).astype(float)


def signals(**changes: Any) -> dict[str, np.ndarray]:
    """Return a record in which the tension is right in stance and the angle in swing."""
    reference = 100.0 + 50.0 * np.sin(2.0 * np.pi * TIME)
    path = 1.5 + 0.5 * np.sin(2.0 * np.pi * TIME)
    level = 0.1 + 0.05 * np.sin(2.0 * np.pi * TIME)
    made = {
        "time": TIME,
        "reference": reference,
        "output": reference.copy(),
        "sensed": reference.copy(),
        "state/stance": STANCE,
        "sensor/stance": STANCE.copy(),
        "state/angle_reference": path,
        "state/angle": path.copy(),
        "state/pressure": np.full(N, 2e5),
        "state/torque": np.full(N, 3.0),
        "state/torque_reference": np.full(N, 3.0),
        "state/torque_ideal": np.full(N, 5.0),
        "state/estimate": 30.0 * (1.0 + np.sin(2.0 * np.pi * TIME)),
        "cost/pressure": np.zeros(N),
        "effort/pressure_travel": np.zeros(N),
        "effort/air": np.zeros(N),
        "effort/over_assistance": np.zeros(N),
    }
    for reading in ("", "_calibrated"):
        made[f"effort/extensors{reading}"] = 0.8 * level
        made[f"effort/extensors_free{reading}"] = level
    made |= {"effort/flexors": 2.0 * level, "effort/flexors_free": level}
    return made | changes


def score(record: dict[str, np.ndarray], **how: Any) -> dict[str, float]:
    content = {
        "settle_seconds": 0.0,
        "hold_seconds": 0.5,
        "sensed": "sensed",
        "cost_scales": {"cost/pressure": 1e5},
        "metrics": ["range", "gait"],
        "gate": GATE,
        "activity": "walk",
    }
    return metrics.score(record, PERIOD, content | how)


def test_perfect_record_has_no_error_and_the_constructed_ratios():
    scores = score(signals())
    assert set(scores) == set(metrics.of_track({"metrics": ["range", "gait"]}))
    for name in ("rms_error", "rms_percent", "angle_rms", "switch_error", "torque_rms"):
        assert scores[name] == 0.0
    assert scores["torque_ideal_rms"] == pytest.approx(2.0)
    assert scores["emg_extensors_ratio"] == pytest.approx(0.8)
    assert scores["emg_effort"] == pytest.approx(1.4)  # 0.8 and 2 of 1 and 1
    assert scores["emg_ratio"] == pytest.approx(1.8)  # the flexors' 2 less 1 on top
    assert scores["emg_extensors_ratio_fitted_a"] <= scores["emg_ratio_fitted_a"]
    assert scores["emg_flexors_ratio"] == pytest.approx(2.0)
    assert 0.0 < scores["emg_ratio_fitted_b"] < 1.0


def test_tension_counts_in_stance_and_angle_in_swing():
    record = signals()
    record["output"] = record["reference"] + np.where(STANCE > 0.5, 5.0, 80.0)
    record["state/angle"] = record["state/angle_reference"] + np.where(STANCE > 0.5, 0.5, 0.1)
    scores = score(record)
    assert scores["rms_error"] == pytest.approx(5.0)
    assert scores["rms_percent"] == pytest.approx(10.0, rel=1e-3)
    assert scores["angle_rms"] == pytest.approx(0.1)
    assert scores["angle_rms_percent"] == pytest.approx(20.0, rel=1e-3)
    assert score(record, gate=())["rms_error"] > 50.0
    assert score(record, half_range=125.0)["rms_percent"] == pytest.approx(4.0)


@pytest.mark.parametrize("seen", [0.0, 1.0])
def test_samples_with_wrong_sensed_phase_are_not_scored(seen):
    record = signals()
    record["output"] = record["reference"] + 5.0
    record["state/angle"] = record["state/angle_reference"] + 0.1
    before = score(record)
    odd = int(np.flatnonzero(seen != STANCE)[60])  # well within a phase, not at its ends
    record["sensor/stance"][odd] = seen
    record["output"][odd] += 214.0
    record["state/angle"][odd] += 1.0
    after = score(record)
    for name in ("rms_error", "p95_error", "max_error", "angle_rms", "rms_percent"):
        assert after[name] == pytest.approx(before[name], rel=1e-3), name


def test_open_valve_does_not_reduce_emg():
    env: Any = gym.make(
        "PAM/KneeWalk-v0", start="heel_contact", strides="identical", episode_seconds=16.0
    ).unwrapped
    full = Constant(partial(encode_actions, tuple(env.action_signals)), (4.5e5,))
    made = rollout.run(env, full, 0).signals
    window = (made["time"] > 5.0) & (made["time"] < 15.0 + 0.5 * PERIOD)
    ratios = metrics_knee.emg(made, window, PERIOD, "walk")
    for reading in ("", "_fitted_a", "_fitted_b"):
        assert ratios[f"emg_extensors_ratio{reading}"] < ratios[f"emg_ratio{reading}"]
    assert ratios["emg_extensors_ratio"] == pytest.approx(0.577, abs=0.01)
    assert ratios["emg_ratio"] == pytest.approx(1.206, abs=0.02)
    assert ratios["emg_ratio_fitted_a"] == pytest.approx(1.83, abs=0.03)


def test_reading_b_gives_little_emg_for_a_small_sustained_torque():
    """All of Eq. (1) as demand, and a power of 2: the flexors' 15 N m are a tenth of the peak."""
    demand = np.where(STANCE > 0.5, 50.0, 0.0)
    open_valve = np.full(N, 15.0)
    record = signals(**{"state/estimate": demand, "state/torque": open_valve})
    whole = np.ones(N, bool)
    ratios = metrics_knee.emg(record, whole, PERIOD, "walk")
    power, share = 2.0255, 15.0 / 50.0
    assert ratios["emg_ratio_fitted_b"] == pytest.approx(
        np.hypot((1.0 - share) ** power, share**power), abs=0.02
    )
    assert ratios["emg_ratio_fitted_b"] < 0.55
    assert ratios["emg_ratio_fitted_a"] > 0.65  # (27.5 - 15) / 27.5 and 15 / 27.5


def test_gate_that_never_opens_is_reported():
    with pytest.raises(ValueError, match="state/stance and sensor/stance are never 1 together"):
        score(signals(**{"state/stance": np.zeros(N)}))


def test_landings_are_the_first_samples_of_stance_after_swing():
    stance = np.zeros(400)
    stance[100:200] = 1.0
    stance[205:210] = 1.0  # a heel that chatters as it is lifted
    stance[300:] = 1.0
    np.testing.assert_array_equal(metrics_knee.landings(stance, PERIOD), [100, 300])


def test_jump_is_the_mean_over_landings_of_the_largest_subsequent_change():
    record, starts = signals(), np.flatnonzero(np.diff(STANCE) > 0.0) + 1
    first, second = starts
    for k, size, change in ((first, 30.0, 1e4), (second, 10.0, 3e4)):
        record["output"][k] += 4.0
        record["output"][k + 49] -= size
        record["output"][k + 50] += 90.0  # too late to count
        record["state/pressure"][k + 9 :] += change
    scores = score(record)
    assert scores["switch_error"] == pytest.approx(4.0)
    assert scores["switch_excess"] == pytest.approx(16.0)
    assert scores["pressure_jump"] == pytest.approx(2e4)


def test_saturated_time_is_the_share_at_the_capacity():
    over = np.where(TIME <= 2.5, 1e3, 0.0)
    assert score(signals(**{"cost/pressure": over}))["saturated_time"] == pytest.approx(0.25)


def test_inactive_muscle_has_no_emg_ratio():
    still = np.zeros(N)
    scores = score(signals(**{"effort/flexors": still, "effort/flexors_free": still}))
    assert np.isnan(scores["emg_flexors_ratio"])


def test_units_follow_the_track():
    units = metrics.of_track({"unit": "N", "metrics": ["gait"]})
    assert units["rms_error"] == units["max_error"] == "N"
    assert units["angle_rms"] == "rad" and units["air_use"] == "kg/s"
    assert metrics.of_track({}) == metrics.METRICS


def test_unknown_metric_group_or_missing_worst_case_is_refused():
    content = dict(available()["knee_walk_nominal"].content)
    with pytest.raises(ValueError, match="choose from elbow, joint, chain, range, gait"):
        ScenarioSet(content | {"metrics": ["stride"]})
    with pytest.raises(ValueError, match=r"worst_case needs a value for each of .*switch_error"):
        ScenarioSet(content | {"worst_case": {"rms_error": 1.0}})


def test_no_finished_episode_of_the_board_is_worse_than_the_worst_case():
    """Or a controller would gain by having an episode ended."""
    found = [path for path in rows.files() if path.parent.name.startswith("knee_")]
    assert len(found) > 100
    for path in found:
        row = rows.load(path)
        worst = row["scenarios"]["content"]["worst_case"]
        finished = [e["scores"] for e in row["episodes"] if not e["failed"]]
        for name, most in worst.items():
            values = [s[name] for s in finished if s[name] is not None]
            assert max(values, default=0.0) <= most, (rows.name_of(path), name)
