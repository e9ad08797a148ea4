"""Catalogue of policies: entries of presets, also of a user's, and checks of the files."""

import shutil

import pytest

from agents.policies import catalogue
from agents.policies.policy_file import PolicyFileError
from agents.settings import presets as configs
from agents.settings.schema import SettingsError

BASE = "extends: KneeWalk-v0.ppo\n"


@pytest.fixture
def presets(tmp_path, monkeypatch):
    """A folder of presets that may be changed."""
    folder = tmp_path / "configs"
    shutil.copytree(configs.FOLDER, folder)
    monkeypatch.setattr(configs, "FOLDER", folder)
    return folder


def test_users_preset_has_an_entry_with_its_comment_as_summary(presets):
    (presets / "KneeWalk-v0.ppo-mine.yaml").write_text(f"# PPO, with my network.\n{BASE}")
    (presets / "KneeWalk-v0.ppo-terse.yaml").write_text(BASE)
    made = catalogue.offered()
    assert set(made) - set(catalogue.OFFERED) == {"ppo_mine_knee_walk", "ppo_terse_knee_walk"}
    mine = made["ppo_mine_knee_walk"]
    assert mine.file == "KneeWalk-v0.ppo-mine.s{seed}.onnx"
    assert mine.envs == ("PAM/KneeWalk-v0",)
    assert (mine.kind, mine.knowledge) == ("learned", "nominal model")
    assert mine.citation == catalogue.PPO
    assert mine.summary == "PPO, with my network; trained at 5 s a stride"
    assert made["ppo_terse_knee_walk"].summary.startswith("ppo, variant terse;")


def test_users_residual_is_recognised_by_its_settings(presets):
    text = "extends: KneeWalk-v0.sac\nsearch: {trials: 3}\n"
    text += "residual: {controller: knee_pid, scale: 0.1}\n"
    (presets / "KneeWalk-v0.sac-on_pid.yaml").write_text(text)
    entry = catalogue.offered()["sac_on_pid_knee_walk"]
    assert (entry.kind, entry.baseline) == ("residual", "knee_pid")
    assert entry.summary.startswith("knee_pid corrected by a SAC policy")
    assert entry.citation == f"{catalogue.SAC}; {catalogue.RESIDUAL}"
    assert entry.tuning.startswith("search of 3")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("KneeWalk-v0.ppo-Mine", BASE, "'ppo_Mine_knee_walk', which is not a valid name; name"),
        ("KneeWalk-v0.ppp", BASE, "ppp.yaml is for PAM/KneeWalk-v0 with ppo; name its file"),
        ("KneeTension-v0.ppo-mine", BASE, "is for PAM/KneeWalk-v0 with ppo; name its file"),
        (
            "MusclePositioning-v0.ppo-knee_walk",
            "extends: MusclePositioning-v0.ppo\n",
            "'ppo_knee_walk', which is already in use; name its file ENV.ALGO-VARIANT.yaml",
        ),
        (
            "KneeWalk-v0.ppo-wrong",
            BASE + "network: {hold: []}\nresidual: {controller: knee_pd}\n",
            r"residual.controller = 'knee_pd' is no controller; did you mean 'knee_pid'",
        ),
    ],
)
def test_invalid_preset_is_named(name, text, message, presets):
    (presets / f"{name}.yaml").write_text(text)
    with pytest.raises(SettingsError, match=message):
        catalogue.offered()


def test_unlisted_environment_gets_its_snake_case_name_as_suffix():
    assert catalogue._suffix("AnkleBrace2-v0") == "_ankle_brace2"
    assert catalogue._suffix("MusclePositioning-v0") == ""


def test_policy_file_without_a_preset_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(catalogue, "FOLDER", tmp_path)
    (tmp_path / "KneeWalk-v0.ppo.s3.onnx").touch()
    catalogue.check_files(catalogue.OFFERED)
    (tmp_path / "KneeWalk-v0.ppo-mine.s0.onnx").touch()
    with pytest.raises(PolicyFileError, match=r"there is no KneeWalk-v0.ppo-mine.yaml in agents"):
        catalogue.check_files(catalogue.OFFERED)
    (tmp_path / "KneeWalk-v0.ppo-mine.s0.onnx").rename(tmp_path / "KneeWalk-v0.ppo.onnx")
    with pytest.raises(PolicyFileError, match=r"ppo.onnx names no training seed, as .*ppo.s0.onnx"):
        catalogue.check_files(catalogue.OFFERED)
