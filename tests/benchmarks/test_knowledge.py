"""What the catalogues say that controllers know, tried out on plants that are a little off."""

from __future__ import annotations

import pytest

from benchmarks.runs import knowledge, runner
from benchmarks.runs.controllers import available, find
from benchmarks.scenarios.scenario import available as tracks
from benchmarks.scenarios.scenario_env import make_env

IDS = sorted({track.env for track in tracks().values()})
CLAIMS = [
    (name, env)
    for name, entrant in sorted(available().items())
    for env in IDS
    if entrant.runs_in(env) and entrant.knowledge in knowledge.IGNORANT
]


@pytest.mark.parametrize("env_id", IDS)
def test_a_foil_is_another_plant_in_nearly_all(env_id: str) -> None:
    env = make_env(env_id, {})
    plant = env.unwrapped.plant
    other = knowledge.foil(plant)
    assert other.digest() != plant.digest()
    named = [name for name in plant.names if plant.value(name) != 0.0]
    moved = [name for name in named if other.value(name) != plant.value(name)]
    assert len(moved) > 0.8 * len(named)
    env.close()


@pytest.mark.parametrize(("name", "env_id"), CLAIMS)
def test_who_says_that_he_knows_no_model_depends_on_none(name: str, env_id: str) -> None:
    env = make_env(env_id, {})
    assert not knowledge.uses_model(find(name), env.unwrapped.plant, env, None)
    env.close()


def test_who_is_built_from_a_model_depends_on_it() -> None:
    env = make_env("PAM/MusclePositioning-v0", {})
    assert knowledge.uses_model(find("pid"), env.unwrapped.plant, env, None)
    env.close()


def test_labels() -> None:
    told, drawn = {"knows_plant": True}, {"knows_plant": False}
    assert knowledge.label("nominal model", [told, told]) == "true model"
    assert knowledge.label("nominal model", [told, drawn]) == "nominal model"
    assert knowledge.label("true model", [drawn]) == "nominal model"
    met = drawn | {"trained_on_plant": True}
    assert knowledge.label("nominal model", [drawn, met]) == knowledge.TRAINED
    assert knowledge.label("nominal model", [told]) == "true model"
    assert knowledge.label("tables", [told]) == "tables"
    assert knowledge.label("nothing", [told | {"uses_model": True}]) == "true model"


class Policy:
    """A controller with a card."""

    def __init__(self, plants: list[str], **env_kwargs: object) -> None:
        self.card = {"plants": plants, "env_kwargs": env_kwargs}


def test_a_policy_that_met_what_others_are_not_told_was_trained_on_the_plant() -> None:
    name = "PAM/MusclePositioning-v0"
    env, drawn = make_env(name, {"hysteresis": "preisach"}), make_env(name, {"randomize": True})
    plant, told = env.unwrapped.plant, drawn.unwrapped.plant
    both = Policy([plant.digest(), told.digest()])
    assert knowledge.trained_on_plant(both, told, env)
    assert not knowledge.trained_on_plant(both, plant, env)
    assert not knowledge.trained_on_plant(Policy([told.digest()]), told, env)
    assert not knowledge.trained_on_plant(object(), told, env)
    assert not knowledge.trained_on_plant(both, told, drawn)
    assert knowledge.trained_on_plant(Policy([told.digest()], randomize=True), told, drawn)
    env.close()
    drawn.close()


def test_a_policy_runs_in_tracks_that_show_and_take_what_it_was_trained_on() -> None:
    known = tracks()
    residual, classical = find("residual_elbow"), find("elbow_allocation")
    assert runner.fits(residual, known["elbow_nominal"])
    assert not runner.fits(residual, known["elbow_valves"])
    assert runner.fits(classical, known["elbow_valves"])
    pairs = runner.pairs_of([residual, classical], [known["elbow_valves"]])
    assert [entrant.name for entrant, _ in pairs] == ["elbow_allocation"]
