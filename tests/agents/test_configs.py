"""Settings are checked, and a mistake is named together with its remedy."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
import pytest
from short_runs import ID

from agents import configs
from agents.networks import input_matrix
from agents.settings import SettingsError


@pytest.mark.parametrize(("env", "algo"), sorted(configs.presets()))
def test_every_preset_is_sound_and_fits_its_environment(env: str, algo: str) -> None:
    config = configs.preset(env, algo)
    assert (config.env, config.algo) == (env, algo)
    made = gym.make(env, **config.env_kwargs).unwrapped
    matrix = input_matrix(config.network, made.signals)
    assert len(matrix) == len(made.signals) + len(config.network.differences)


def test_every_environment_has_a_preset_of_ppo() -> None:
    ids = {name for name in gym.registry if name.startswith("PAM/")}
    assert {(name, "ppo") for name in ids} <= set(configs.presets())


def test_both_algorithms_have_a_preset_for_muscle_positioning() -> None:
    assert {(ID, "ppo"), (ID, "sac")} <= set(configs.presets())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"env": ID, "stepps": 3}, "unknown setting 'stepps'; did you mean 'steps'?"),
        ({"env": ID, "ppo": {"n_epoch": 3}}, "unknown setting 'ppo.n_epoch'; did you mean"),
        ({"env": ID, "ppo": {"zzz": 3}}, "there are: .*gamma"),
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
        ({"algo": "ppo"}, "must say env"),
        ([1], "must be a mapping"),
    ],
)
def test_a_mistake_is_named(given: object, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        configs.from_mapping(given)


def test_settings_survive_their_plain_form() -> None:
    for env, algo in configs.presets():
        config = configs.preset(env, algo)
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


def test_an_unknown_environment_is_answered_with_the_nearest() -> None:
    with pytest.raises(SettingsError, match="did you mean 'PAM/MusclePositioning-v0'"):
        configs.preset("PAM/MusclePositoning-v0", "ppo")


def test_a_name_that_is_no_signal_is_refused() -> None:
    network = configs.Network(differences=("reference - contractoin",))
    with pytest.raises(SettingsError, match="no signal named 'contractoin'"):
        input_matrix(network, gym.make(ID).unwrapped.signals)
