"""The knee's controllers keep the contract of a policy predictor, and do what they are for."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.core.catalogue import PUBLISHED, make_controller
from baselines.knee.catalogue import KNEE, KNEE_CONTROLLERS, KNEE_MAKERS
from pam_envs.plants.single_muscle.plant import SingleMuscle
from tests.baselines.conftest import built, check_form, observations_of
from tests.baselines.knee_runs import make_knee, quiet, run

PAIRS = [
    (env.split("/")[1].split("-")[0], name)
    for name, entry in PUBLISHED.items()
    for env in entry.envs
    if env in KNEE
]


def test_catalogue_and_makers_name_the_same():
    assert set(KNEE_CONTROLLERS) == set(KNEE_MAKERS)


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize(("family", "name"), PAIRS)
def test_action_is_in_the_space_and_has_the_form_of_the_observation(family, name, normalize):
    env = make_knee(family, normalize=normalize)
    check_form(built(name, env), env)


@pytest.mark.parametrize(("family", "name"), [p for p in PAIRS if p[1] != "random"])
def test_rows_of_a_batch_are_single_runs(family, name):
    env = make_knee(family)
    controller = built(name, env)
    seen = observations_of(env, steps=31, rows=3)
    state, together = None, []
    for observation in seen:
        action, state = controller.predict(observation, state)
        together.append(action[:, 0])
    for row in range(3):
        state, alone = None, []
        for observation in seen[:, row]:
            action, state = controller.predict(observation, state)
            alone.append(action[0])
        np.testing.assert_array_equal(np.array(together)[:, row], alone)


@pytest.mark.parametrize("name", ["knee_inverse_ltr", "knee_ltr", "knee_pid"])
def test_a_row_that_begins_anew_forgets(name):
    env = make_knee("KneeWalk")
    controller = built(name, env)
    first = np.array([env.reset(seed=s)[0] for s in (0, 1)])
    later = np.array([env.step(np.array([0.5], np.float32))[0]] * 2)
    begun, state = controller.predict(first)
    _, state = controller.predict(later, state)
    again, _ = controller.predict(first, state, np.array([True, False]))
    assert again[0] == begun[0]
    assert again[1] != begun[1]


def test_a_plant_of_another_family_is_refused():
    env = make_knee("KneeTension")
    with pytest.raises(ValueError, match="knee_pid is for a KneeOrthosis"):
        make_controller("knee_pid", SingleMuscle.mas10(), env.signals, env.action_signals)


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


def test_free_knee_bears_next_to_no_torque_where_the_muscle_can_pull():
    plant = quiet("on_leg", prompt=True)
    env = make_knee("KneeWalk", plant=plant, start="heel_contact", episode_seconds=5.0)
    pulls, torque = {}, {}
    for name in ("knee_free", "zero"):
        record = run(env, built(name, env))
        pulls[name] = (record["state/angle"] < plant.lever.relaxed_angle - 0.1)[50:]
        torque[name] = np.sqrt(np.mean(record["state/torque"][50:][pulls[name]] ** 2))
    assert pulls["knee_free"].mean() > 0.3
    assert torque["knee_free"] < 0.15 * torque["zero"]  # what is left: the brace's own friction
