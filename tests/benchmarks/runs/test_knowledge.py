"""Model knowledge that the catalogues state, checked on plants with other parameters."""

from typing import Any

import pytest

from agents.policies import catalogue
from benchmarks.runs import controllers, knowledge, runner
from benchmarks.runs.controllers import available, find
from benchmarks.scenarios.scenario import available as tracks
from benchmarks.scenarios.scenario_env import make_env
from tests.object_digest import object_digest

IDS = sorted({track.env for track in tracks().values()})
CLAIMS = [
    (name, env)
    for name, entrant in sorted(available().items())
    for env in IDS
    if entrant.runs_in(env) and entrant.knowledge in knowledge.IGNORANT
]


MOVED = 1.01
"""Factor by which a foil's parameters differ."""


def foil(plant: Any) -> Any:
    """Return a plant with every parameter a little off, where its bounds allow it."""
    for name in plant.names:
        for factor in (MOVED, 1.0 / MOVED):
            try:
                plant = plant.replace({name: plant.value(name) * factor})
                break
            except (ValueError, TypeError):
                continue  # out of bounds, or bound to another parameter
    return plant


def uses_model(name: str, env: Any) -> bool:
    """Return whether a controller differs when its model is another one."""
    plant = env.unwrapped.plant
    made = (controllers.make(find(name), model, env) for model in (plant, foil(plant)))
    return len({object_digest(controller) for controller in made}) > 1


@pytest.mark.parametrize("env_id", IDS)
def test_foil_differs_in_most_parameters(env_id):
    env = make_env(env_id, {})
    plant = env.unwrapped.plant
    other = foil(plant)
    assert other.digest() != plant.digest()
    named = [name for name in plant.names if plant.value(name) != 0.0]
    moved = [name for name in named if other.value(name) != plant.value(name)]
    assert len(moved) > 0.8 * len(named)
    env.close()


@pytest.mark.parametrize(("name", "env_id"), CLAIMS)
def test_controllers_without_model_knowledge_do_not_depend_on_the_model(name, env_id):
    env = make_env(env_id, {})
    assert not uses_model(name, env)
    env.close()


def test_model_based_controller_depends_on_its_model():
    env = make_env("PAM/MusclePositioning-v0", {})
    assert uses_model("pid", env)
    env.close()


KNOWS, DRAWN = {"knows_plant": True}, {"knows_plant": False}


@pytest.mark.parametrize(
    ("claimed", "cells", "label"),
    [
        ("nominal model", [KNOWS, KNOWS], "true model"),
        ("nominal model", [KNOWS, DRAWN], "nominal model"),
        ("nominal model", [DRAWN, DRAWN | {"trained_on_plant": True}], knowledge.TRAINED),
        ("true model", [DRAWN], "nominal model"),
        ("tables", [KNOWS], "tables"),
        ("nothing", [KNOWS], "nothing"),
    ],
)
def test_label_follows_from_the_cells(claimed, cells, label):
    assert knowledge.label(claimed, cells) == label


class Policy:
    """A controller with a card."""

    def __init__(self, plants: list[str], **env_kwargs: object) -> None:
        self.card = {"plants": plants, "env_kwargs": env_kwargs}


def test_informed_controller_knows_drawn_plants():
    name = "PAM/MusclePositioning-v0"
    env, drawn = make_env(name, {}), make_env(name, {"randomize": True})
    informed, nominal = find("inverse_informed"), find("inverse")
    plant, other = env.unwrapped.plant, foil(env.unwrapped.plant)
    assert knowledge.of_plant(informed, object(), plant, drawn)["knows_plant"]
    assert not knowledge.of_plant(nominal, object(), plant, drawn)["knows_plant"]
    assert not knowledge.of_plant(informed, object(), other, env)["knows_plant"]
    assert knowledge.label("true model", [KNOWS]) == "true model"


def test_policy_trained_on_an_undeclared_plant_is_reported_as_such():
    name, ppo = "PAM/MusclePositioning-v0", find("ppo")
    env, drawn = make_env(name, {"hysteresis": "preisach"}), make_env(name, {"randomize": True})
    plant, nominal = env.unwrapped.plant, drawn.unwrapped.plant
    both = Policy([plant.digest(), nominal.digest()])
    other = Policy([nominal.digest()])

    def trained(controller: object, model: Any, env: Any) -> bool:
        return knowledge.of_plant(ppo, controller, model, env)["trained_on_plant"]

    assert trained(both, nominal, env)
    assert not trained(both, plant, env)
    assert not trained(other, nominal, env)
    assert not trained(object(), nominal, env)
    assert not trained(both, nominal, drawn)
    assert not trained(Policy([nominal.digest()], randomize=True), nominal, drawn)
    assert trained(Policy([nominal.digest()], randomize=True), plant, drawn)
    env.close()
    drawn.close()


def test_policy_runs_in_tracks_with_the_signals_of_its_training(monkeypatch):
    monkeypatch.setattr(catalogue, "outdated", lambda name: False)
    known = tracks()
    residual, classical = find("residual_elbow"), find("elbow_allocation")
    assert runner.fits(residual, known["elbow_nominal"])
    assert not runner.fits(residual, known["elbow_valves"])
    assert runner.fits(classical, known["elbow_valves"])
    pairs = runner.pairs_of([residual, classical], [known["elbow_valves"]])
    assert [entrant.name for entrant, _ in pairs] == ["elbow_allocation"]
