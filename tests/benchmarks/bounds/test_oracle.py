"""Oracle: copies of environments, and a bound that controllers do not pass."""

import numpy as np

from baselines.core.catalogue import make_controller
from benchmarks.bounds.copies import Copies
from benchmarks.bounds.run import play
from benchmarks.runs.rollout import run
from benchmarks.scenarios.scenario import ScenarioSet, available
from benchmarks.scenarios.scenario_env import make_batch, make_env
from benchmarks.scoring.metrics import scores_of

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


def test_no_controller_passes_the_bound_of_the_oracle():
    track: ScenarioSet = available()["positioning_nominal"]
    scenario = next(s for s in track.scenarios() if s.name == "maxwell_slip_2.55kg_steps")
    scenario.kwargs["episode_seconds"] = 5.0
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
