"""Entry of finished runs as the complete set of training seeds of a preset."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from short_runs import with_card

from agents.__main__ import main
from agents.policies import catalogue
from agents.policies.policy_file import write_policy
from agents.settings import presets as configs

PRETRAINED = catalogue.FOLDER
NAME = "KneeWalk-v0.ppo"
COMMAND = "python -m agents train PAM/KneeWalk-v0 --algo ppo --steps 10000000 --seed 1"


def run_of(folder: Path, seed: int, name: str = f"{NAME}.s0", **changes: Any) -> Path:
    """Return the folder of a run whose card is a shipped one but for its seed and changes."""
    made = with_card(PRETRAINED / f"{name}.onnx", seed=seed, **changes)
    folder.mkdir(parents=True)
    write_policy(folder / "policy.onnx", made, {"training": {"seed": seed}})
    return folder


@pytest.fixture
def place(tmp_path, monkeypatch):
    """An empty folder in place of the one of the policies that come with the project."""
    folder = tmp_path / "pretrained"
    folder.mkdir()
    monkeypatch.setattr(catalogue, "FOLDER", folder)
    return folder


def runs(folder: Path, seeds: Sequence[int]) -> list[str]:
    return [str(run_of(folder / f"run{k}", seed)) for k, seed in enumerate(seeds)]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def both(*stems: str) -> list[str]:
    return sorted(f"{stem}.{end}" for stem in stems for end in ("json", "onnx"))


def test_runs_are_copied_under_the_presets_name(place, tmp_path):
    given = runs(tmp_path, [2, 0, 1])
    assert main(["enter", *given]) == 0
    assert names(place) == both(*(f"{NAME}.s{seed}" for seed in range(3)))
    for folder, seed in zip(given, (2, 0, 1), strict=True):
        for end in ("onnx", "json"):
            expected = (Path(folder) / f"policy.{end}").read_bytes()
            assert (place / f"{NAME}.s{seed}.{end}").read_bytes() == expected
    entry = catalogue.OFFERED["ppo_knee_walk"]
    assert list(entry.files()) == [0, 1, 2]
    assert entry.author == ""
    for seed in range(3):
        assert catalogue.load_pretrained("ppo_knee_walk", training_seed=seed).card["seed"] == seed


def test_older_files_of_a_preset_are_replaced_and_listed(place, tmp_path, capsys):
    assert main(["enter", *runs(tmp_path / "old", [0, 1, 2])]) == 0
    for other in both("KneeWalk-v0.ppo-residual.s0", "KneeStairsUp-v0.ppo.s2"):
        (place / other).write_text("{}")
    capsys.readouterr()
    assert main(["enter", *runs(tmp_path / "new", [0, 1]), "--author", "Doe, J."]) == 0
    kept = ("KneeWalk-v0.ppo-residual.s0", "KneeStairsUp-v0.ppo.s2")
    assert names(place) == both(f"{NAME}.s0", f"{NAME}.s1", *kept)
    lines = capsys.readouterr().out.splitlines()
    gone = both(*(f"{NAME}.s{seed}" for seed in range(3)))
    replaced = [line for line in lines if line.startswith("replaced ")]
    assert sorted(replaced) == sorted(f"replaced {place / name}" for name in gone)
    assert lines[-1] == "ppo_knee_walk: training seeds 0, 1"
    assert catalogue.OFFERED["ppo_knee_walk"].author == "Doe, J."
    card = json.loads((place / f"{NAME}.s1.json").read_text())
    assert card.pop("author") == "Doe, J."
    assert card == json.loads((tmp_path / "new" / "run1" / "policy.json").read_text())
    source = (tmp_path / "new" / "run1" / "policy.onnx").read_bytes()
    assert (place / f"{NAME}.s1.onnx").read_bytes() == source


def changed(**settings: Any) -> dict[str, Any]:
    """Return a card's settings with some changed, of the preset as it is."""
    assignments = [f"{name.replace('__', '.')}={value}" for name, value in settings.items()]
    return configs.changed(configs.preset("PAM/KneeWalk-v0", "ppo"), assignments).as_dict()


REFUSED: dict[str, tuple[list[dict[str, Any]], str]] = {
    "none": ([], "no runs are given; name their folders"),
    "missing": ([{"seed": 0}, {"seed": 2}], "training seed 1 is missing, of 2 runs up to seed 2"),
    "not from the first": ([{"seed": 1}], "training seed 0 is missing"),
    "doubled": ([{"seed": 0}, {"seed": 0}], "run1 both are of training seed 0; leave one out"),
    "no seed": ([{"seed": None}], "its card says training seed None"),
    "of two": (
        [{"seed": 0}, {"seed": 1, "name": "KneeStairsUp-v0.ppo.s1"}],
        "of KneeStairsUp-v0.ppo and",
    ),
    "set by hand": (
        [{"seed": 0, "command": f"{COMMAND} --config policy.onnx"}],
        "as agents/configs/KneeWalk-v0.ppo-VARIANT.yaml",
    ),
    "an unknown preset": (
        [{"seed": 0, "command": f"{COMMAND} --variant mine"}],
        "KneeWalk-v0.ppo-mine.yaml, or train one of ppo, ppo-randomized, ppo-resid",
    ),
    "other settings": (
        [{"seed": 0, "config": changed(ppo__gamma=0.5, steps=7)}],
        "other values of ppo, steps than KneeWalk-v0.ppo.yaml has now; train it anew",
    ),
    "unknown settings": ([{"seed": 0, "config": {"stepps": 3}}], "run0: unknown setting 'stepps'"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_incomplete_or_mixed_set_is_refused(what, place, tmp_path, capsys):
    cards, message = REFUSED[what]
    given = [str(run_of(tmp_path / f"run{k}", **card)) for k, card in enumerate(cards)]
    assert main(["enter", *given]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    assert names(place) == []


def test_settings_without_effect_may_differ(place, tmp_path):
    config = changed(checkpoint_steps=1234, search__trials=3)
    assert main(["enter", str(run_of(tmp_path / "run", 0, config=config))]) == 0
    assert names(place) == both(f"{NAME}.s0")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda run: (run / "policy.onnx").unlink(), "holds no policy.onnx; give the folders of"),
        (
            lambda run: (run / "policy.json").unlink(),
            "policy.json is not the record of policy.onnx",
        ),
        (
            lambda run: (run / "policy.json").write_text("{}"),
            "policy.json is not the record of policy.onnx",
        ),
        (lambda run: (run / "policy.onnx").write_bytes(b"PK"), "is a zip file"),
        (lambda run: (run / "policy.onnx").write_bytes(b"no"), "is not an ONNX file"),
    ],
)
def test_unfinished_run_is_refused_with_its_folder(spoil, message, place, tmp_path, capsys):
    given = runs(tmp_path, [0, 1])
    spoil(Path(given[1]))
    assert main(["enter", *given]) == 2
    error = capsys.readouterr().err
    assert given[1] in error
    assert message in error
    assert names(place) == []


def test_users_preset_is_entered_under_its_own_name(place, tmp_path, monkeypatch, capsys):
    folder = tmp_path / "configs"
    folder.mkdir()
    for name in (NAME, "KneeWalk-v0.sac"):
        (folder / f"{name}.yaml").write_text((configs.FOLDER / f"{name}.yaml").read_text())
    (folder / f"{NAME}-mine.yaml").write_text(f"extends: {NAME}\nppo: {{gamma: 0.5}}\n")
    monkeypatch.setattr(configs, "FOLDER", folder)
    own = {"command": f"{COMMAND} --variant mine", "config": changed(ppo__gamma=0.5)}
    assert main(["enter", str(run_of(tmp_path / "run", 0, **own))]) == 0
    assert names(place) == both(f"{NAME}-mine.s0")
    assert capsys.readouterr().out.splitlines()[-1] == "ppo_mine_knee_walk: training seeds 0"
    catalogue.check_files(catalogue.offered())
