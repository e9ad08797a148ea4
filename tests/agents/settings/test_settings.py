"""Checked settings: errors with their remedy, extension, kinds of rows."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import gymnasium as gym
import pytest
from short_runs import ID

from agents.policies.networks import input_matrix, input_names
from agents.settings import presets as configs
from agents.settings import seeds
from agents.settings.parts import TQC, Network, Search
from agents.settings.schema import SettingsError
from agents.training import evaluation

TWO = {"hysteresis": ["maxwell_slip", "preisach"]}
DRAWN = {"randomize": True}
HELD = {"linear": True, "hold": ["set_point"]}
LAYERS = {"network": {"linear": False, "hold": []}}


@pytest.mark.parametrize(("env", "algo", "variant"), sorted(configs.presets()))
def test_preset_fits_its_environment(env: str, algo: str, variant: str) -> None:
    config = configs.preset(env, algo, variant)
    assert (config.env, config.algo) == (env, algo)
    made = gym.make(env, **config.env_kwargs).unwrapped
    names = input_names(config, made.signals, made.action_signals)
    matrix = input_matrix(config.network, names)
    assert len(matrix) == len(names) + len(config.network.differences)
    info = made.reset(seed=seeds.TUNING)[1]
    assert {*config.evaluation.gate, "output", "reference", evaluation.TRAVEL} <= set(info)


def test_every_environment_has_a_preset_of_every_kind() -> None:
    ids = {name for name in gym.registry if name.startswith("PAM/")}
    kinds = (("ppo", ""), ("sac", ""), ("tqc", ""), ("recurrent_ppo", ""), ("ppo", "residual"))
    assert {(name, *kind) for name in ids for kind in kinds} <= set(configs.presets())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"env": ID, "stepps": 3}, "unknown setting 'stepps'; did you mean 'steps'?"),
        ({"env": ID, "ppo": {"n_epoch": 3}}, "unknown setting 'ppo.n_epoch'; did you mean"),
        ({"env": ID, "ppo": {"zzz": 3}}, "known: .*gamma"),
        ({"env": ID, "ppo": {"gamma": 1.2}}, "ppo.gamma = 1.2 must be from 0 to 1"),
        ({"env": ID, "ppo": {"gamma": "high"}}, "ppo.gamma = 'high' must be a finite number"),
        ({"env": ID, "steps": 1.5}, "steps = 1.5 must be a whole number"),
        ({"env": ID, "steps": True}, "steps = True must be a whole number"),
        ({"env": ID, "algo": "pp"}, "algo = 'pp' is not known; did you mean 'ppo'?"),
        ({"env": ID, "network": {"activation": "tan"}}, "did you mean 'tanh'?"),
        ({"env": ID, "network": {"hidden": 64}}, "network.hidden = 64 must be a list"),
        ({"env": ID, "network": {"hold": ["set_point"]}}, "needs network.linear"),
        ({"env": ID, "ppo": {"batch_size": 3000}}, "choose a divisor"),
        ({"env": ID, "ppo": {"learning_rate": [1e-3]}}, "must have 2 entries"),
        ({"env": ID, "sac": {"ent_coef": "aut"}}, "sac.ent_coef = 'aut'"),
        ({"algo": "ppo"}, "must set env"),
        ({"env": ID, "history": {"frames": 2}}, "both frames and signals"),
        ({"env": ID, "algo": "tqc", "network": {"linear": True}}, "leave it out for tqc"),
        ({"env": ID, "num_envs": 9, "ppo": {"batch_size": 9}, "plants": TWO}, "no multiple"),
        ({"env": ID, "env_kwargs": {"randomize": True}, "plants": TWO | DRAWN}, "keep plants"),
        ({"env": ID, "network": HELD, "residual": {"controller": "pid"}}, "starts from its contr"),
        ({"env": ID, "recurrent_ppo": {"lstm_size": 0}}, "must be from 1 to 1024"),
        ({"env": ID, "evaluation": {"episodes": 2_000}}, "must be from 0 to 1000"),
        ({"env": ID, "share": {"reference": "sines"}}, "must be a list"),
        ({"env": ID, "per_reference": {"sines": {}}}, "which share.reference lacks"),
        ([1], "must be a mapping"),
        ({"env": "PAM/MusclePositoning-v0"}, "did you mean 'PAM/MusclePositioning-v0'"),
        ({"env": f"evil:{ID}"}, "is no environment here"),
        ({"env": f"{ID}\n"}, "is no environment here"),
        ({"env": "CartPole-v1"}, "is no environment here; known: PAM/"),
    ],
)
def test_invalid_setting_is_named(given: object, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        configs.from_mapping(given)


def test_preset_extends_another() -> None:
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
def test_only_presets_can_be_extended(name: object) -> None:
    with pytest.raises(SettingsError, match="extends = "):
        configs.from_mapping({"extends": name})


def test_presets_that_extend_each_other_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for own, other in (("A-v0.ppo", "B-v0.ppo"), ("B-v0.ppo", "A-v0.ppo")):
        (tmp_path / f"{own}.yaml").write_text(f"extends: {other}\n")
    monkeypatch.setattr(configs, "FOLDER", tmp_path)
    with pytest.raises(SettingsError, match=r"circular \(B-v0.ppo -> A-v0.ppo -> B-v0.ppo\)"):
        configs.read(tmp_path / "A-v0.ppo.yaml")


def test_search_budget_is_not_inherited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    searched = f"env: {ID}\nsearch: {{trials: 40, steps: 1000}}\nppo: {{gamma: 0.9}}\n"
    (tmp_path / "A-v0.ppo.yaml").write_text(searched)
    monkeypatch.setattr(configs, "FOLDER", tmp_path)
    made = configs.from_text("extends: A-v0.ppo\nsteps: 7")
    assert (made.ppo.gamma, made.steps, made.search) == (0.9, 7, Search())
    assert configs.read(tmp_path / "A-v0.ppo.yaml").search.trials == 40


def test_decisive_settings_are_those_that_affect_the_policy() -> None:
    config = configs.preset(ID, "ppo")
    idle = configs.changed(config, ["search.trials=40", "checkpoint_steps=123"])
    assert idle.decisive() == config.decisive()
    for change in ("evaluation.episodes=3", "steps=7", "ppo.gamma=0.5"):
        assert configs.changed(config, [change]).decisive() != config.decisive()


def test_rows_are_divided_among_all_combinations() -> None:
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


def test_settings_round_trip_through_plain_values() -> None:
    for names in configs.presets():
        config = configs.preset(*names)
        assert configs.from_mapping(config.as_dict()) == config


def test_single_settings_can_be_changed() -> None:
    config = configs.preset(ID, "ppo")
    made = configs.changed(config, ["ppo.gamma=0.9", "env_kwargs.load=2.55", "steps=7"])
    assert (made.ppo.gamma, made.env_kwargs["load"], made.steps) == (0.9, 2.55, 7)
    assert made.network == config.network
    with pytest.raises(SettingsError, match="name=value"):
        configs.changed(config, ["ppo.gamma"])
    with pytest.raises(SettingsError, match="did you mean 'gamma'"):
        configs.changed(config, ["ppo.gama=1"])


def test_numbers_may_be_written_as_yaml_reads_them_as_text() -> None:
    made = configs.changed(configs.preset(ID, "ppo"), ["ppo.learning_rate=[1e-3, 5e-5]"])
    assert made.ppo.learning_rate == (1e-3, 5e-5)


def test_yaml_cannot_run_code(tmp_path: Path) -> None:
    marker = tmp_path / "ran"
    file = tmp_path / "bad.yaml"
    file.write_text(f"!!python/object/apply:os.system ['touch {marker}']\n")
    with pytest.raises(SettingsError, match="cannot be read as YAML"):
        configs.read(file)
    assert not marker.exists()
    file.write_text("[" * 5_000)
    with pytest.raises(SettingsError, match="cannot be read as YAML"):
        configs.read(file)


def test_unknown_environment_names_the_nearest() -> None:
    with pytest.raises(SettingsError, match="did you mean 'PAM/MusclePositioning-v0'"):
        configs.preset("PAM/MusclePositoning-v0", "ppo")


def test_unknown_signal_is_refused() -> None:
    network = Network(differences=("reference - contractoin",))
    with pytest.raises(SettingsError, match="no signal named 'contractoin'"):
        input_matrix(network, tuple(gym.make(ID).unwrapped.signals.names()))
