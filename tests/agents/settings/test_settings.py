"""Checked settings: errors with their remedy, extension, kinds of rows."""

import dataclasses
from pathlib import Path

import gymnasium as gym
import pytest
import yaml
from short_runs import ID

from agents.policies.networks import input_matrix, input_names
from agents.settings import presets as configs
from agents.settings import seeds
from agents.settings.parts import TQC, Network, Search
from agents.settings.schema import SettingsError
from agents.training import evaluation

TWO = {"hysteresis": ["maxwell_slip", "preisach"]}
DRAWN = {"randomize": True}
LAYERS = {"network": {"linear": False, "hold": []}}


@pytest.mark.parametrize(("env", "algo", "variant"), sorted(configs.presets()))
def test_preset_fits_its_environment(env, algo, variant):
    config = configs.preset(env, algo, variant)
    assert (config.env, config.algo) == (env, algo)
    made = gym.make(env, **config.env_kwargs).unwrapped
    names = input_names(config, made.signals, made.action_signals)
    matrix = input_matrix(config.network, names)
    assert len(matrix) == len(names) + len(config.network.differences)
    info = made.reset(seed=seeds.TUNING)[1]
    assert {*config.evaluation.gate, "output", "reference", evaluation.TRAVEL} <= set(info)


def test_every_environment_has_a_preset_of_every_kind():
    ids = {name for name in gym.registry if name.startswith("PAM/")}
    kinds = (("ppo", ""), ("sac", ""), ("tqc", ""), ("recurrent_ppo", ""), ("ppo", "residual"))
    kinds += (("ppo", "robust"),)
    assert {(name, *kind) for name in ids for kind in kinds} <= set(configs.presets())


REFUSED = yaml.safe_load(Path(__file__).with_name("refused.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        *(({"env": ID, **given}, message) for given, message in REFUSED),
        ({"algo": "ppo"}, "must set env"),
        ([1], "must be a mapping"),
    ],
)
def test_invalid_setting_is_named(given, message):
    with pytest.raises(SettingsError, match=message):
        configs.from_mapping(given)


def test_preset_extends_another():
    plain, history = configs.preset(ID, "ppo"), configs.preset(ID, "ppo", "history")
    randomized = configs.preset(ID, "ppo", "randomized")
    assert history.network == plain.network
    assert history.history.frames > 0
    assert randomized.history == history.history
    assert randomized.plants.hysteresis == history.plants.hysteresis
    assert (randomized.plants.randomize, history.plants.randomize) == (True, False)
    other = configs.from_mapping({"extends": "MusclePositioning-v0.ppo", "algo": "tqc", **LAYERS})
    assert other.network.differences == plain.network.differences
    assert other.tqc == TQC()


@pytest.mark.parametrize("name", ["../ppo", "MusclePositioning-v0.pp", 3, "/etc/x-v0.ppo"])
def test_only_presets_can_be_extended(name):
    with pytest.raises(SettingsError, match="extends = "):
        configs.from_mapping({"extends": name})


def test_presets_that_extend_each_other_are_refused(tmp_path, monkeypatch):
    for own, other in (("A-v0.ppo", "B-v0.ppo"), ("B-v0.ppo", "A-v0.ppo")):
        (tmp_path / f"{own}.yaml").write_text(f"extends: {other}\n")
    monkeypatch.setattr(configs, "FOLDER", tmp_path)
    with pytest.raises(SettingsError, match=r"circular \(B-v0.ppo -> A-v0.ppo -> B-v0.ppo\)"):
        configs.read(tmp_path / "A-v0.ppo.yaml")


def test_search_budget_is_not_inherited(tmp_path, monkeypatch):
    searched = f"env: {ID}\nsearch: {{trials: 40, steps: 1000}}\nppo: {{gamma: 0.9}}\n"
    (tmp_path / "A-v0.ppo.yaml").write_text(searched)
    monkeypatch.setattr(configs, "FOLDER", tmp_path)
    made = configs.from_text("extends: A-v0.ppo\nsteps: 7")
    assert (made.ppo.gamma, made.steps, made.search) == (0.9, 7, Search())
    assert configs.read(tmp_path / "A-v0.ppo.yaml").search.trials == 40


def test_decisive_settings_are_those_that_affect_the_policy():
    config = configs.preset(ID, "ppo")
    idle = configs.changed(config, ["search.trials=40", "checkpoint_steps=123"])
    assert idle.decisive() == config.decisive()
    for change in ("evaluation.episodes=3", "steps=7", "ppo.gamma=0.5"):
        assert configs.changed(config, [change]).decisive() != config.decisive()


def test_rows_are_divided_among_all_combinations():
    made = configs.from_mapping(
        {
            "env": ID,
            "env_kwargs": {"load": None},
            "share": {"reference": ["sines", "steps"]},
            "plants": TWO | DRAWN,
        }
    )
    common = {"load": None, "randomize": True}
    assert made.kinds() == tuple(
        {**common, "reference": reference, "hysteresis": law}
        for law in ("maxwell_slip", "preisach")
        for reference in ("sines", "steps")
    )
    weighted = dataclasses.replace(made, per_reference={"sines": {"reward": {"error_scale": 1e-5}}})
    weight = {"error_scale": 1e-5}
    assert [kind.get("reward") for kind in weighted.kinds()] == [weight, None, weight, None]
    plain = {"reference": "mixed", "load": None}
    assert configs.preset(ID, "ppo").kinds() == tuple(
        {**plain, "hysteresis": law} for law in TWO["hysteresis"]
    )


def test_settings_round_trip_through_plain_values():
    for names in configs.presets():
        config = configs.preset(*names)
        assert configs.from_mapping(config.as_dict()) == config


def test_single_settings_can_be_changed():
    config = configs.preset(ID, "ppo")
    made = configs.changed(config, ["ppo.gamma=0.9", "env_kwargs.load=2.55", "steps=7"])
    assert (made.ppo.gamma, made.env_kwargs["load"], made.steps) == (0.9, 2.55, 7)
    assert made.network == config.network
    with pytest.raises(SettingsError, match="name=value"):
        configs.changed(config, ["ppo.gamma"])
    with pytest.raises(SettingsError, match="did you mean 'gamma'"):
        configs.changed(config, ["ppo.gama=1"])


def test_numbers_may_be_written_as_yaml_reads_them_as_text():
    made = configs.changed(configs.preset(ID, "ppo"), ["ppo.learning_rate=[1e-3, 5e-5]"])
    assert made.ppo.learning_rate == (1e-3, 5e-5)


def test_yaml_cannot_run_code(tmp_path):
    marker = tmp_path / "ran"
    file = tmp_path / "bad.yaml"
    file.write_text(f"!!python/object/apply:os.system ['touch {marker}']\n")
    with pytest.raises(SettingsError, match=r"is not YAML|is not text"):
        configs.read(file)
    assert not marker.exists()
    file.write_text("[" * 5_000)
    with pytest.raises(SettingsError, match=r"is not YAML|is not text"):
        configs.read(file)


def test_unknown_environment_names_the_nearest():
    with pytest.raises(SettingsError, match="did you mean 'PAM/MusclePositioning-v0'"):
        configs.preset("PAM/MusclePositoning-v0", "ppo")


def test_unknown_signal_is_refused():
    network = Network(differences=("reference - contractoin",))
    with pytest.raises(SettingsError, match="no signal named 'contractoin'"):
        input_matrix(network, tuple(gym.make(ID).unwrapped.signals.names()))
