"""Training runs: exact resumption, checkpoints, cards and records."""

import dataclasses
import hashlib
import json
import os
import pickle
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml
from short_runs import ID, KINDS, QUIET, killed_after, kind, tiny, trained
from stable_baselines3.common.evaluation import evaluate_policy

from agents.__main__ import main
from agents.export.export import layer
from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import finished
from agents.settings import presets as configs
from agents.settings import seeds
from agents.settings.parts import Evaluation
from agents.settings.schema import SettingsError
from agents.training import checkpoint, record, train
from agents.training.building import make_env, make_model
from agents.training.checkpoint import MARK, CheckpointError
from agents.training.record import CHECKPOINT, Run
from agents.vec_envs.batch import make_batch_vec_env
from agents.vec_envs.widening import WideningVecEnv
from benchmarks.scenarios import scenario as scenarios
from tests.sweeps.processes_of import wait_until

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize("name", KINDS)
def test_resumed_run_equals_the_uninterrupted_one(name, tmp_path, short_run):
    whole, folder = short_run(name)
    run = Run(kind(name), 3, tmp_path)
    killed_after(run, 700)
    again = train.saved_run(tmp_path)
    assert again == run
    model = train.resume(again)
    assert 256 <= model.num_timesteps < 700
    train.train(again, model, QUIET)
    mine, theirs = model.policy.state_dict(), whole.policy.state_dict()
    assert all(torch.equal(mine[name], theirs[name]) for name in theirs)
    assert (tmp_path / "policy.onnx").read_bytes() == (folder / "policy.onnx").read_bytes()


def test_another_seed_gives_another_policy(tmp_path, ppo):
    other = trained(tmp_path, tiny(), seed=4)
    assert not torch.equal(other.policy.action_net.weight, ppo[0].policy.action_net.weight)


def test_a_killed_process_resumes_from_the_command_line(tmp_path):
    config = tmp_path / "tiny.yaml"
    config.write_text(yaml.safe_dump({**tiny().as_dict(), "steps": 10_000}))
    base = ["train", ID, "--seed", "5", "--config", str(config), "--out"]
    assert main([*base, str(tmp_path / "whole")]) == 0
    folder = tmp_path / "killed"
    process = subprocess.Popen(
        [sys.executable, "-m", "agents", *base, str(folder)],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    wait_until(lambda: (folder / CHECKPOINT).exists() or process.poll() is not None)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    (folder / "checkpoint.pt.1.tmp").write_bytes(b"half")
    saved = checkpoint.load(folder / CHECKPOINT)["snapshot"]["counters"]["num_timesteps"]
    assert 0 < saved < 10_000
    assert not (folder / "policy.onnx").exists()
    assert main(["train", ID, "--resume", "--out", str(folder)]) == 0
    assert not list(folder.glob("*.tmp"))
    whole = (tmp_path / "whole" / "policy.onnx").read_bytes()
    assert (folder / "policy.onnx").read_bytes() == whole


def test_run_without_a_checkpoint_starts_again_and_says_so(tmp_path, capsys):
    (tmp_path / "tensorboard").mkdir()  # of a process that was killed
    config = tmp_path / "tiny.yaml"
    config.write_text(yaml.safe_dump(tiny().as_dict()))
    given = ["train", ID, "--seed", "3", "--config", str(config), "--out", str(tmp_path)]
    assert main([*given, "--resume"]) == 0
    assert "the training starts again" in capsys.readouterr().err.replace("\n", " ")
    assert finished(tmp_path / "policy.onnx")["seed"] == 3


def test_second_training_in_one_folder_is_refused(tmp_path, capsys):
    with train.alone(tmp_path):
        for more in ([], ["--resume"]):
            assert main(["train", ID, "--out", str(tmp_path), *more]) == 2
            assert "another process trains in" in capsys.readouterr().err
    assert not (tmp_path / CHECKPOINT).exists()


def test_damaged_or_foreign_checkpoint_is_refused(tmp_path):
    file = tmp_path / CHECKPOINT
    checkpoint.save(file, {"a": np.arange(300)})
    good = file.read_bytes()
    for bad, message in (
        (good[:-1], "damaged"),
        (good[:60], "damaged"),
        (good[:-5] + b"\0" + good[-4:], "damaged"),
        (b"", "not a checkpoint"),
        (b"PK\x03\x04" + good, "may run code"),
    ):
        file.write_bytes(bad)
        with pytest.raises(CheckpointError, match=message):
            checkpoint.load(file)


@pytest.mark.filterwarnings("ignore:Detected pickle protocol")
def test_a_checkpoint_cannot_run_code(tmp_path):
    marker = tmp_path / "ran"

    class Doctored:
        def __reduce__(self) -> Any:
            return os.system, (f"touch {marker}",)

    torch.save({"settings": Doctored()}, tmp_path / "inner.pt")
    for payload in ((tmp_path / "inner.pt").read_bytes(), pickle.dumps(Doctored())):
        file = tmp_path / CHECKPOINT
        file.write_bytes(MARK + hashlib.sha256(payload).digest() + payload)
        with pytest.raises(CheckpointError, match="was not opened"):
            checkpoint.load(file)
        assert main(["train", ID, "--resume", "--out", str(tmp_path)]) == 2
    assert not marker.exists()


def test_a_run_is_neither_overwritten_nor_resumed_with_other_settings(ppo, tmp_path, capsys):
    folder = str(ppo[1])
    before = (ppo[1] / CHECKPOINT).read_bytes()
    assert main(["train", ID, "--out", folder]) == 2
    assert "already holds a training" in capsys.readouterr().err
    assert main(["train", ID, "--out", folder, "--resume", "--set", "ppo.gamma=0.5"]) == 2
    assert "keeps the settings" in capsys.readouterr().err
    assert main(["train", ID, "--out", str(tmp_path / "none"), "--resume"]) == 2
    assert "no checkpoint" in capsys.readouterr().err
    assert (ppo[1] / CHECKPOINT).read_bytes() == before


def test_run_is_not_resumed_on_a_changed_plant(ppo, tmp_path):
    content = checkpoint.load(ppo[1] / CHECKPOINT)
    digest = ppo[0].get_env().get_attr("plant")[0].digest()
    content["settings"] = content["settings"].replace(digest, "0123456789abcdef")
    checkpoint.save(tmp_path / CHECKPOINT, content)
    with pytest.raises(CheckpointError, match=r"trained on the plants .*train anew"):
        train.resume(train.saved_run(tmp_path))


@pytest.mark.parametrize(
    "given", [["PAM/KneeWalk-v0"], [ID, "--algo", "sac"], [ID, "--seed", "4"]], ids=str
)
def test_run_is_not_resumed_as_another(given, ppo, capsys):
    assert main(["train", *given, "--out", str(ppo[1]), "--resume"]) == 2
    assert f": leave {given[-1]} out" in capsys.readouterr().err


def test_log_and_card_are_written(ppo):
    folder = ppo[1]
    assert list((folder / "tensorboard").glob("events*"))
    card = OnnxPolicy.load(folder / "policy.onnx").card
    assert card["steps"] == 1024
    assert card["seed"] == 3
    assert card["command"].startswith(f"python -m agents train {ID} --algo ppo --steps 1024")
    assert card["plants"] == [ppo[0].get_env().get_attr("plant")[0].digest()]
    assert configs.from_mapping(card["config"]) == tiny()
    text = json.dumps(card) + (folder / "policy.json").read_text()
    assert str(folder) not in text
    assert str(ROOT) not in text


def test_training_tuning_and_scored_seeds_are_disjoint():
    config = tiny()
    env = make_env(config)
    make_model(config, 0, env)
    assert env.unwrapped._seeds == list(range(seeds.TRAINING, seeds.TRAINING + 8))
    tracks = scenarios.available().values()
    scored = {seed for track in tracks for own in track.seeds.values() for seed in own}
    tuned = set(seeds.tuning(seeds.MOST_TUNING))
    assert not scored & tuned
    assert max(scored | tuned) < seeds.first_training(0)


def test_record_holds_the_cost_of_the_training(short_run):
    _, folder = short_run("history")
    cost = json.loads((folder / "policy.json").read_text())["training"]
    card = OnnxPolicy.load(folder / "policy.onnx").card
    assert finished(folder / "policy.onnx") == card
    assert cost["steps"] == 1024
    assert cost["seconds"] > 0.0
    assert cost["frames_per_second"] == pytest.approx(1024 / cost["seconds"], rel=0.5, abs=2)
    assert "cores" in cost["hardware"]
    assert (cost["seed"], cost["first_env_seed"]) == (3, seeds.first_training(3))
    assert cost["tuning_seeds"] == [seeds.TUNING, 4]
    assert cost["tuning_trials"] is None
    assert cost["command"] == card["command"]
    assert [entry["steps"] for entry in card["evaluation"]] == [0, 512, 1024]
    assert all(entry["rms"] > 0.0 for entry in card["evaluation"])
    log = next((folder / "tensorboard").glob("events*")).read_bytes()
    assert b"tuning/rms" in log


def test_record_holds_the_ranges_at_the_end_of_widening(short_run):
    model, folder = short_run("widening")
    ranges = json.loads((folder / "policy.json").read_text())["training"]["ranges"]
    wrapper: Any = layer(model.get_env(), WideningVecEnv)
    assert ranges == wrapper.ranges()
    assert wrapper.widths.min() >= 0.2
    assert wrapper.widths.max() > 0.2


def test_evaluations_do_not_change_the_training(tmp_path, short_run):
    _, watched = short_run("history")
    trained(tmp_path, dataclasses.replace(kind("history"), evaluation=Evaluation()))
    ends = [checkpoint.load(folder / CHECKPOINT) for folder in (watched, tmp_path)]
    mine, theirs = (end["snapshot"]["parameters"]["policy"] for end in ends)
    assert all(torch.equal(mine[name], theirs[name]) for name in theirs)
    card = OnnxPolicy.load(tmp_path / "policy.onnx").card
    assert not {"evaluation", "chosen"} & set(card)


def test_finished_run_is_kept_and_another_refused(short_run):
    _, folder = short_run("ppo")
    before = (folder / "policy.json").stat().st_mtime_ns
    run = Run(kind("ppo"), 3, folder)
    assert train.train_to_the_end(run, QUIET) == folder / "policy.onnx"
    assert (folder / "policy.json").stat().st_mtime_ns == before
    with pytest.raises(CheckpointError, match="other settings"):
        train.train_to_the_end(Run(kind("ppo"), 4, folder), QUIET)


def test_the_command_names_the_variant():
    preset = configs.preset(ID, "ppo", "residual")
    command = Run(preset, 7, Path("x")).command()
    assert command.endswith(f"--steps {preset.steps} --seed 7 --variant residual")
    other = configs.changed(preset, ["residual.scale=0.123"])
    assert Run(other, 7, Path("x")).command().endswith("--config policy.onnx")


def test_learning_improves_the_return(tmp_path):
    config = configs.changed(
        configs.preset(ID, "ppo"),
        ["steps=200_000", "num_envs=64", "env_kwargs.load=2.55", "env_kwargs.episode_seconds=4.0"],
    )
    run = Run(config, 1, tmp_path)
    model = train.start(run)
    env = make_batch_vec_env(ID, 32, reference="mixed", episode_seconds=4.0)

    def score(policy: Any) -> float:
        env.seed(1)
        return float(evaluate_policy(policy, env, n_eval_episodes=32, warn=False)[0])

    untrained = score(model)
    train.train(run, model, QUIET)
    assert score(OnnxPolicy.load(tmp_path / "policy.onnx")) > 0.5 * untrained
    assert untrained < 0.0


def cost_of(config: configs.Config, steps: int) -> dict[str, Any]:
    return record.cost(record.Run(config, 3, Path("x")), {"wall": 2.0, "cpu": 1.0}, steps)


def test_record_counts_the_completed_steps():
    done = cost_of(tiny(), 1_030)
    assert (done["steps"], done["frames_per_second"]) == (1_030, 515)


def test_settings_chosen_by_hand_have_no_number_of_trials():
    by_hand = configs.from_mapping({"env": ID})
    assert json.loads(json.dumps(cost_of(by_hand, 7)))["tuning_trials"] is None
    searched = configs.changed(by_hand, ["search.trials=40"])
    assert cost_of(searched, 7)["tuning_trials"] == 40


def leaves(value: Any, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the places of all entries of nested dictionaries and lists."""
    if not isinstance(value, (dict, list)):
        return [place]
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    return [place, *(found for key, own in pairs for found in leaves(own, (*place, key)))]


def tampered(value: Any, random: np.random.Generator) -> Any:
    """Return a value of another structure, or one that is no number of a training."""
    if isinstance(value, torch.Tensor) and value.numel() and random.random() < 0.7:
        if value.is_floating_point() and random.random() < 0.5:
            other = value.clone(memory_format=torch.contiguous_format)
            other.view(-1)[int(random.integers(value.numel()))] = random.choice([np.nan, np.inf])
            return other
        return torch.cat([value.reshape(-1), value.reshape(-1)])
    return [None, "text", [1, 2], {"a": 1}, np.nan, 10**30][int(random.integers(6))]


@pytest.mark.parametrize("name", ["history", "residual_sac", "residual", "residual_recurrent"])
def test_tampered_checkpoints_are_refused(name, tmp_path, short_run):
    random = np.random.default_rng(0)
    run = Run(kind(name), 3, tmp_path)
    whole = short_run(name)[1] / CHECKPOINT
    content = checkpoint.load(whole)
    checkpoint.save(run.checkpoint, content)
    assert train.resume(run).num_timesteps == 1024
    places = [place for place in leaves(content["snapshot"]) if place]
    for place in [places[i] for i in random.choice(len(places), 40)]:
        content = checkpoint.load(whole)
        at = content["snapshot"]
        for key in place[:-1]:
            at = at[key]
        if isinstance(at, dict) and place[-2:-1] != ("state",) and random.random() < 0.3:
            del at[place[-1]]
        else:
            at[place[-1]] = [tampered(at[place[-1]], random), "text"][at[place[-1]] is None]
        checkpoint.save(run.checkpoint, content)
        with pytest.raises(CheckpointError):
            train.resume(run)
            raise AssertionError(f"{place} is {at.get(place[-1]) if isinstance(at, dict) else at}")


@pytest.mark.parametrize(
    ("name", "place", "value"),
    [
        ("history", ("replay",), "text"),
        ("residual_sac", ("parameters", "ent_coef_optimizer", "state", 0, "exp_avg_sq"), None),
    ],
)
def test_checkpoint_of_another_algorithm_or_optimizer_is_refused(
    name, place, value, tmp_path, short_run
):
    content = checkpoint.load(short_run(name)[1] / CHECKPOINT)
    *path, last = place
    at = content["snapshot"]
    for key in path:
        at = at[key]
    del at[last]
    if value is not None:
        at[last] = value
    run = Run(kind(name), 3, tmp_path)
    checkpoint.save(run.checkpoint, content)
    with pytest.raises(CheckpointError):
        train.resume(run)


@pytest.mark.parametrize(("key", "value"), [("counts", 2**40), ("rows", np.nan), ("fixed", 1e9)])
def test_checkpoint_with_a_state_beyond_its_bounds_is_refused(key, value, tmp_path, ppo, capsys):
    content = checkpoint.load(ppo[1] / CHECKPOINT)
    content["snapshot"]["env"][f"0/{key}"][0, 4, 0] = value
    checkpoint.save(tmp_path / CHECKPOINT, content)
    assert main(["train", ID, "--resume", "--out", str(tmp_path)]) == 2
    assert "does not fit its settings" in capsys.readouterr().err


def test_gpu_that_is_missing_is_named_with_its_remedy(tmp_path, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    run = Run(kind("ppo"), 3, tmp_path, "cuda")
    assert run.command().endswith("--device cuda")
    with pytest.raises(SettingsError, match=r"device = 'cuda'.*no GPU.*--device"):
        train.start(run)
