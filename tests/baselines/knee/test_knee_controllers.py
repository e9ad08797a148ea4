"""Knee controllers: inverse, preview, feedback and zero torque."""

from __future__ import annotations

import numpy as np
import pytest

from tests.baselines.conftest import built
from tests.baselines.knee.knee_runs import make_knee, quiet, run


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach", "none"])
@pytest.mark.parametrize("family", ["KneeTension", "KneeStiffness"])
def test_inverse_is_exact_without_lag(family, hysteresis):
    plant = quiet("no_load" if family == "KneeTension" else "rig", hysteresis, prompt=True)
    env = make_knee(family, plant=plant, reference="sine", frequency=0.02, start="paper",
                    episode_seconds=40.0)  # fmt: skip
    record = run(env, built("knee_inverse", env))
    error = (record["output"] - record["reference"])[200:]
    assert np.abs(error).max() < 2e-3 * np.ptp(record["reference"])


def test_straight_line_misses_by_the_loop_and_is_the_inverse_without_one():
    errors = {}
    for hysteresis in ("maxwell_slip", "none"):
        env = make_knee("KneeStiffness", plant=quiet("rig", hysteresis, prompt=True),
                        reference="sine", frequency=0.05, episode_seconds=20.0)  # fmt: skip
        record = run(env, built("knee_line", env))
        off = (record["output"] - record["reference"])[200:]
        errors[hysteresis] = np.sqrt(np.mean(off**2)) / (0.5 * np.ptp(record["reference"]))
    assert errors["none"] < 3e-3  # 2 pi 0.05 Hz times 7 ms of lag and hold
    assert 0.09 < errors["maxwell_slip"] < 0.14


def test_one_lag_of_preview_removes_the_lag():
    env = make_knee("KneeTension", plant=quiet("no_load"), start="paper", episode_seconds=12.0)
    now, ahead = (run(env, built(name, env)) for name in ("knee_inverse", "knee_inverse_ahead"))
    rms = [np.sqrt(np.mean((r["output"] - r["reference"])[200:] ** 2)) for r in (now, ahead)]
    assert rms[1] < 0.25 * rms[0]


def test_feedback_corrects_a_muscle_that_the_model_does_not_know():
    plant = quiet("no_load")
    other = plant.replace({"muscle.gain": 1.1, "hysteresis.width": 0.6, "lever.stiffness": 33.0})
    env = make_knee("KneeTension", plant=other, start="paper", episode_seconds=12.0)
    records = [run(env, built(n, env, plant)) for n in ("knee_inverse_ahead", "knee_inverse_ltr")]
    rms = [np.sqrt(np.mean((r["output"] - r["reference"])[200:] ** 2)) for r in records]
    assert rms[1] < 0.25 * rms[0]


def test_free_knee_has_little_torque_where_the_muscle_can_pull():
    plant = quiet("on_leg", prompt=True)
    env = make_knee("KneeWalk", plant=plant, start="heel_contact", episode_seconds=5.0)
    pulls, torque = {}, {}
    for name in ("knee_free", "zero"):
        record = run(env, built(name, env))
        pulls[name] = (record["state/angle"] < plant.lever.relaxed_angle - 0.1)[50:]
        torque[name] = np.sqrt(np.mean(record["state/torque"][50:][pulls[name]] ** 2))
    assert pulls["knee_free"].mean() > 0.3
    assert torque["knee_free"] < 0.15 * torque["zero"]  # what is left: the brace's own friction
