"""Controllers that are designed from the plant drawn in each episode."""

from dataclasses import replace

import numpy as np
import pytest

from baselines.core import informed
from baselines.core.catalogue import CONTROLLERS, PUBLISHED
from benchmarks.runs import cells, controllers, rollout, runner
from benchmarks.runs.cells import Cell, Group
from benchmarks.runs.controllers import find
from benchmarks.scenarios.scenario import available as tracks
from benchmarks.scenarios.scenario_env import drawn_plant, make_env
from pam_envs.envs.positioning.env import MusclePositioningEnv

DRAWN = ("positioning", "knee_tension", "knee_walk", "elbow", "joint", "manipulator")
SHORT = {"episode_seconds": 0.3}


@pytest.mark.parametrize("everyday", [False, True])
@pytest.mark.parametrize("family", DRAWN)
def test_drawn_plant_is_that_of_the_episode(family, everyday):
    track = tracks()[f"{family}_{'everyday' if everyday else 'randomised'}"]
    kwargs = {**track.scenarios()[0].kwargs, **SHORT}
    env = make_env(track.env, kwargs)
    digests = set()
    for seed in (1, 2):
        env.reset(seed=seed)
        plant = drawn_plant(env)
        column = env.unwrapped.get_state()["fixed"][0, :, 0]
        np.testing.assert_array_equal(plant.parameter_rows(), column)
        digests.add(plant.digest())
    assert len(digests | {env.unwrapped.plant.digest()}) == 3
    env.close()


def test_environment_with_the_drawn_plant_has_the_same_episode():
    drawn = make_env("PAM/MusclePositioning-v0", {"randomize": True, **SHORT})
    drawn.reset(seed=3)
    fixed = MusclePositioningEnv(plant=drawn_plant(drawn), **SHORT)
    hold = find("zero")
    first, second = (
        rollout.run(env, controllers.make(hold, None, env), 3) for env in (drawn, fixed)
    )
    np.testing.assert_array_equal(first.signals["output"], second.signals["output"])


def test_design_from_the_drawn_plant_has_a_smaller_error():
    track = tracks()["knee_tension_randomised"]
    scenario = track.scenarios()[0]
    errors = {}
    for name in ("knee_inverse_ahead", "knee_inverse_ahead_informed"):
        cell = Cell(find(name), track, scenario, seeds=(1, 2, 3, 4))
        (record,) = cells.compute(Group((cell,))).values()
        errors[name] = [episode["scores"]["rms_error"] for episode in record["episodes"]]
        assert record["knows_plant"] == name.endswith("informed")
    nominal, informed_ones = errors.values()
    assert np.mean(informed_ones) < 0.5 * np.mean(nominal)


def test_informed_controllers_run_only_where_plants_are_drawn():
    entrant = find("inverse_informed")
    chosen = {track.name for _, track in runner.pairs_of([entrant], tracks().values())}
    assert chosen == {"positioning_randomised", "positioning_everyday"}


def test_informed_entries_are_their_bases_with_the_true_model():
    assert {env for name in informed.BASES for env in PUBLISHED[name].envs} == {
        env for entry in PUBLISHED.values() for env in entry.envs
    }
    for name in informed.BASES:
        base, entry = PUBLISHED[name], CONTROLLERS[f"{name}{informed.SUFFIX}"]
        assert base.knowledge == "nominal model"
        assert entry.knowledge == "true model"
        assert entry.make is base.make
        assert replace(entry, summary=base.summary, knowledge=base.knowledge, knobs={}) == replace(
            base, knobs={}
        )
