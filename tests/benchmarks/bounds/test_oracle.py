"""Oracle: copies of environments, and a bound that controllers do not pass."""

import numpy as np
import pytest

from baselines.core.catalogue import make_controller
from benchmarks.bounds.copies import Copies
from benchmarks.bounds.oracle import targets_of
from benchmarks.bounds.run import play
from benchmarks.runs.rollout import run
from benchmarks.scenarios.scenario import Scenario, ScenarioSet, available
from benchmarks.scenarios.scenario_env import make_batch, make_env
from benchmarks.scoring.group import Record
from benchmarks.scoring.groups.elbow import of_elbow
from benchmarks.scoring.groups.joint import DIRECTION, POSITION, of_chain
from benchmarks.scoring.metrics import headline_of, scores_of

KWARGS = {"reference": "steps", "load": 2.55, "episode_seconds": 5.0}


def test_copies_run_ahead_as_the_environment_does():
    for randomize in (False, True):
        env = make_batch("PAM/MusclePositioning-v0", {**KWARGS, "randomize": randomize}, 3)
        env.reset(seed=[1, 2, 3])
        actions = np.random.default_rng(0).uniform(-1.0, 1.0, (30, 3, 1))
        for action in actions[:10]:
            env.step(action)
        copies = Copies(env, 20)
        copies.take(env)
        ahead = copies.run(np.repeat(actions[10:, :, None], 20, axis=2))
        for t, action in enumerate(actions[10:]):
            info = env.step(action)[4]
            for key in ("output", "reference", "state/pressure"):
                assert np.array_equal(ahead[key][t], np.repeat(info[key][:, None], 20, axis=1))


def short_steps() -> tuple[ScenarioSet, Scenario]:
    """Return the nominal track of positioning and its scenario with steps, for 5 s."""
    track: ScenarioSet = available()["positioning_nominal"]
    scenario = next(s for s in track.scenarios() if s.name == "maxwell_slip_2.55kg_steps")
    scenario.kwargs["episode_seconds"] = 5.0
    return track, scenario


def test_no_controller_passes_the_bound_of_the_oracle():
    track, scenario = short_steps()
    seeds = (900_001, 900_002)
    bound = play(track, scenario, seeds, horizon=50)
    env = make_env(track.env, scenario.kwargs)
    base = env.unwrapped
    for name in ("inverse_pid", "predictive_inverse", "predictive_inverse_dob"):
        made = make_controller(name, base.plant, base.signals, base.action_signals)
        for seed, best in zip(seeds, bound, strict=True):
            found = scores_of(run(env, made, seed), track.content, scenario.rests)["rms_error"]
            least = scores_of(best, track.content, scenario.rests)["rms_error"]
            assert least < 1.02 * found


def test_actions_of_a_controller_improve_the_search_with_a_short_horizon():
    track, scenario = short_steps()
    env = make_env(track.env, scenario.kwargs)
    base = env.unwrapped
    made = make_controller("predictive_inverse", base.plant, base.signals, base.action_signals)
    episodes = [run(env, made, 900_001)]
    for start in ("", "predictive_inverse"):
        episodes += play(track, scenario, (900_001,), 20, start)
    controller, plain, started = (
        scores_of(one, track.content, scenario.rests)["rms_error"] for one in episodes
    )
    assert started < 0.9 * plain
    assert started < 1.02 * controller


@pytest.mark.parametrize(
    ("track", "score", "points"),
    [("manipulator_nominal", of_chain, 2), ("elbow_nominal", of_elbow, 1)],
)
def test_squares_of_targets_sum_to_square_of_headline(track, score, points):
    content = available()[track].content
    names = [f"state/{r}{k}" for r in ("", "reference_") for k in (*POSITION, *DIRECTION)]
    names += ["output", "reference", "saturated", "state/pointing_error", "state/joint_error"]
    names += ["state/stiffness", "state/stiffness_reference", "state/torque_clipped"]
    names += ["state/stiffness_clipped", "state/felt", "state/object_torque", "state/object"]
    names += ["state/slack", "state/angle_0", "state/joint_reference_0", "effort/switchings"]
    samples = np.random.default_rng(0).normal(size=(len(names), 50))
    signals = dict(zip(names, samples, strict=True))
    window = np.ones(50, bool)
    headline = score(Record(signals, window, window, 0.01, content))[headline_of(content)]
    errors = [
        sum(factor * (signals[y] - signals[r]) for y, r, factor in terms)
        for terms in targets_of(content)
    ]
    assert np.sum(np.mean(np.square(errors), axis=1)) / points == pytest.approx(headline**2)
