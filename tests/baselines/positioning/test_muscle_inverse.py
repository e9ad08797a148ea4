"""Exact inverse of the muscle against curves without hysteresis."""

import numpy as np
import pytest

from baselines.positioning.inverse import aims_of
from pam_envs.plants.single_muscle.plant import SingleMuscle
from tests.baselines.conftest import QUIET, SECONDS, built, make_env, quiet, rollout


@pytest.mark.parametrize("load", [0.0, 4.55])
@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach", "none"])
@pytest.mark.parametrize("name", ["inverse", "inverse_no_preview", "inverse_pid"])
def test_staircase_with_minor_loops_is_tracked_within_10_um(
    name, hysteresis, load, staircase, settled
):
    env = make_env(plant=quiet(hysteresis), load=load, reference=staircase, episode_seconds=SECONDS)
    errors = settled(rollout(env, built(name, env)))
    # an integral creeps to its place in the inner loop that an episode begins in
    assert errors[1 if name == "inverse_pid" else 0 :].max() < 1e-5


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
@pytest.mark.parametrize("name", ["linear", "one_cubic"])
def test_single_branch_errs_by_the_loop_width(name, hysteresis, staircase, settled):
    env = make_env(plant=quiet(hysteresis), load=2.55, reference=staircase, episode_seconds=SECONDS)
    errors = settled(rollout(env, built(name, env)))
    assert np.sqrt(np.mean(errors**2)) > 3e-4


@pytest.mark.parametrize(
    "hysteresis, bound",
    [
        ("maxwell_slip", 1e-5),
        ("preisach", 1e-5),
        ("maxwell_slip_length", 2e-5),
        ("preisach_length", 2e-5),
    ],
)
def test_slow_ramp_is_tracked(hysteresis, bound):
    """Friction driven by length slips with the motion, whose lag behind rest adds to the error."""
    ramp = np.interp(np.arange(1200), [0, 500, 800, 1200], [2e-3, 12e-3, 6e-3, 9e-3])
    plant = SingleMuscle.mas10(hysteresis).replace(QUIET)  # the regulator's own dead time and lag
    env = make_env(plant=plant, load=2.55, reference=ramp, episode_seconds=12.0)
    record = rollout(env, built("inverse", env))
    away = np.min(np.abs(np.arange(1, 1201)[:, None] - [0, 500, 800]), axis=1) > 40
    assert np.abs(record["output"] - record["reference"])[away].max() < bound


def test_preview_removes_the_delay():
    plant = SingleMuscle.mas10("maxwell_slip").replace(QUIET)
    env = make_env(plant=plant, reference="sines", episode_seconds=8.0)
    with_it, without = (
        rollout(env, built(name, env)) for name in ("inverse", "inverse_no_preview")
    )
    rms = [np.sqrt(np.mean((r["output"] - r["reference"])[200:] ** 2)) for r in (with_it, without)]
    assert rms[0] < 1e-5 < 1e-4 < rms[1]


def test_later_targets_are_due_after_longer_travel():
    aims, due = aims_of(0.04 * np.arange(6), 0.09)
    np.testing.assert_allclose(aims.sum(axis=1), 1.0)
    assert due[0] == 0.0 and np.all(np.diff(due) > 0.0) and len(due) == 4


def test_pid_acts_only_on_the_model_error(staircase, settled):
    plant = quiet("maxwell_slip", regulator__dead_time=0.045, regulator__time_constant=0.05)
    other = plant.replace(
        {"muscle.area": 0.96 * plant.muscle.area, "hysteresis.width_per_load": 0.0}
    )
    env = make_env(plant=plant, load=2.55, reference=staircase, episode_seconds=SECONDS)
    right = [rollout(env, built(name, env)) for name in ("inverse", "inverse_pid")]
    assert np.std(right[0]["output"] - right[1]["output"]) < 5e-5
    wrong = [rollout(env, built(name, env, other)) for name in ("inverse", "inverse_pid")]
    assert np.median(settled(wrong[0])) > 3e-4
    assert settled(wrong[1]).max() < 1.5e-4
