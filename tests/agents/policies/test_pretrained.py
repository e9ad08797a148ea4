"""Policies that come with the project: their records, plants, names and tracking errors."""

import dataclasses
import functools
import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from short_runs import with_card

from agents.policies import catalogue
from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import finished
from agents.policies.residual import ResidualPolicy, with_controller
from agents.settings import presets as configs
from baselines.core.catalogue import make_controller
from benchmarks.runs import controllers as entrants

FILES = [path for entry in catalogue.CONTROLLERS.values() for path in entry.files().values()]
RECORDED = {
    *("steps", "seconds", "cpu_seconds", "frames_per_second", "hardware", "seed"),
    *("first_env_seed", "tuning_seeds", "tuning_trials", "command"),
}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_file_is_small_with_a_training_record(path):
    assert path.stat().st_size < 250_000  # two layers of 128 on the many inputs of an arm: 199 kB
    record = json.loads(path.with_suffix(".json").read_text())
    assert set(record) <= {"author", "sha256", "training"}
    assert isinstance(record.get("author", ""), str)
    assert set(record["training"]) <= RECORDED
    card = finished(path)
    assert f"--steps {card['config']['steps']} --seed {card['seed']}" in card["command"]
    assert configs.from_mapping(card["config"]).env == card["env"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_settings_on_the_card_are_the_presets(path):
    card = OnnxPolicy.load(path).card
    read = configs.from_mapping(card["config"]).as_dict()
    stored, known = (config.pop("search", {}) for config in (dict(card["config"]), read))
    assert stored.items() <= known.items()
    assert read == {name: value for name, value in card["config"].items() if name != "search"}
    preset = configs.read(configs.FOLDER / f"{path.stem.rpartition('.')[0]}.yaml")
    assert preset.decisive() == configs.from_mapping(card["config"]).decisive()
    assert "--config" not in card["command"]


@functools.cache
def env_of(name: str, kind: str) -> Any:
    """Return an environment by id and arguments in JSON."""
    return gym.make(name, **json.loads(kind)).unwrapped


@pytest.fixture(scope="module", autouse=True)
def shared_controllers():
    """Build each controller once for all training seeds of a policy."""
    made: dict[tuple[str, str], Any] = {}
    make = make_controller

    def shared(name: str, plant: Any, *signals: Any) -> Any:
        key = name, plant.digest()
        if key not in made:
            made[key] = make(name, plant, *signals)
        return made[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("agents.policies.residual.make_controller", shared)
        yield


@pytest.mark.parametrize("name", catalogue.CONTROLLERS)
def test_plants_of_training_are_unchanged_or_the_policy_is_outdated(name):
    same = {unchanged(path) for path in catalogue.CONTROLLERS[name].files().values()}
    assert same == {not catalogue.outdated(name)}


def unchanged(path: Path) -> bool:
    """Return whether a policy's plants are those of its environment; check its signals."""
    policy = OnnxPolicy.load(path)
    plants = []
    for kind in configs.from_mapping(policy.card["config"]).kinds():
        env = env_of(policy.card["env"], json.dumps(kind, sort_keys=True))
        policy.check(env.signals, env.action_signals)
        with_controller(policy, env.plant)
        plants.append(env.plant.digest())
    return list(dict.fromkeys(plants)) == policy.card["plants"]


def named(source: Path, place: Path, **changes: Any) -> None:
    """Write a policy with another card."""
    place.write_bytes(with_card(source, **changes))


def test_training_seeds_of_one_policy_are_distinguished(tmp_path, monkeypatch):
    source = catalogue.CONTROLLERS["ppo"].first
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    file = "MusclePositioning-v0.ppo.s{seed}.onnx"
    entry = dataclasses.replace(catalogue.CONTROLLERS["ppo"], file=file)
    for seed in (2, 11):
        named(source, tmp_path / file.format(seed=seed), seed=seed)
    for name in (file.format(seed=1)[:-5] + ".json", file.format(seed="x")):
        (tmp_path / name).write_bytes(source.read_bytes())
    assert {seed: path.name for seed, path in entry.files().items()} == {
        2: file.format(seed=2),
        11: file.format(seed=11),
    }
    named(source, tmp_path / file.format(seed=0), seed=0)
    assert entry.files()[0].name == file.format(seed=0)
    monkeypatch.setitem(catalogue.CONTROLLERS, "x", entry)
    assert catalogue.load_pretrained("x", training_seed=11).name == file.format(seed=11)
    assert catalogue.load_pretrained("x").name == file.format(seed=0)
    with pytest.raises(ValueError, match=r"no training seed 5; there are: \[0, 2, 11\]"):
        catalogue.load_pretrained("x", training_seed=5)


def test_author_is_read_from_the_record(tmp_path, monkeypatch):
    source = catalogue.CONTROLLERS["ppo"].first
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    entry = catalogue.CONTROLLERS["ppo"]
    assert entry.author == ""
    named(source, tmp_path / "MusclePositioning-v0.ppo.s0.onnx", seed=0)
    assert entry.author == ""
    beside = json.loads(source.with_suffix(".json").read_text()) | {"author": "Doe, J."}
    (tmp_path / "MusclePositioning-v0.ppo.s0.json").write_text(json.dumps(beside))
    assert entry.author == "Doe, J."
    assert entrants._entrant("ppo", entry, "agents.policies.catalogue").author == "Doe, J."
    assert catalogue.load_pretrained("ppo").card["seed"] == 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 4}, "seed 4, its file name 3"),
        ({"seed": None}, "seed None, its file name 3"),
        ({"seed": 3, "env": "PAM/KneeWalk-v0"}, "has env 'PAM/KneeWalk-v0'"),
        ({"seed": 3, "algo": "sac"}, "has algo 'sac'"),
        ({"seed": 3, "baseline": {"name": "pid"}}, "has baseline 'pid'"),
    ],
)
def test_policy_under_another_file_name_is_refused(changes, message, tmp_path, monkeypatch):
    source = catalogue.CONTROLLERS["ppo"].first
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    monkeypatch.setattr(OnnxPolicy, "_check_shapes", lambda _: 0)
    named(source, tmp_path / "MusclePositioning-v0.ppo.s3.onnx", **changes)
    with pytest.raises(ValueError, match=message):
        catalogue.load_pretrained("ppo", training_seed=3)


def test_catalogue_makes_every_policy():
    for name, entry in catalogue.CONTROLLERS.items():
        env = gym.make(*entry.envs).unwrapped
        made = catalogue.make_controller(name, env.plant, env.signals, env.action_signals, seed=0)
        assert entry.envs == (made.card["env"],)
        policy = catalogue.load_pretrained(name)
        inside = made.policy if isinstance(made, ResidualPolicy) else made
        assert inside.digest() == policy.digest()
        assert policy.corrects == entry.baseline
        assert (entry.kind == "residual") == bool(entry.baseline)
    with pytest.raises(ValueError, match="no policy named 'pppo'; did you mean 'ppo'"):
        catalogue.load_pretrained("pppo")
