"""Export of the best evaluated policy."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from short_runs import LOOK, NARROW, QUIET, killed_after, tiny

from agents.__main__ import main
from agents.policies.policy import OnnxPolicy
from agents.settings import presets as configs
from agents.training import best, callbacks, train
from agents.training.evaluation import Score
from agents.training.record import Run

NORMALIZED = {"observation": True, "reward": True}
WIDE = {"ppo": NARROW, "sac": NARROW, "tqc": NARROW, "recurrent_ppo": {"hidden": [16]}}


class Judge:
    """Values policies by their steps, and keeps their weights."""

    def __init__(self, values: dict[int, float]) -> None:
        self.values = values
        self.seen: dict[int, dict[str, torch.Tensor]] = {}

    def __call__(self, model: Any, config: configs.Config) -> Score:
        state = model.policy.state_dict()
        self.seen[model.num_timesteps] = {name: t.detach().clone() for name, t in state.items()}
        return Score(rms=self.values[model.num_timesteps], mean_return=0.0, failures=0)


def run_in(folder: Path, algo: str = "ppo", **changes: Any) -> Run:
    config = tiny(algo, **{"network": WIDE[algo], "evaluation": LOOK, **changes})
    return Run(config, 3, folder)


def judged(
    run: Run, values: dict[int, float], monkeypatch: pytest.MonkeyPatch
) -> tuple[Judge, Any, dict[str, Any]]:
    """Train under a judge; return it, the model in the end and the card."""
    judge = Judge(values)
    monkeypatch.setattr(callbacks, "score_of", judge)
    model = train.start(run)
    path = train.train(run, model, QUIET)
    return judge, model, OnnxPolicy.load(path).card


def same(mine: dict[str, torch.Tensor], theirs: dict[str, torch.Tensor]) -> bool:
    return all(torch.equal(mine[name], theirs[name]) for name in theirs)


@pytest.mark.parametrize("algo", configs.ALGORITHMS)
def test_best_policy_is_exported_instead_of_the_last(algo, tmp_path, monkeypatch):
    values = {0: 5.0, 512: 1.0, 1024: 3.0}
    judge, model, card = judged(run_in(tmp_path, algo), values, monkeypatch)
    assert card["chosen"] == {"steps": 512, "of": 3, "value": 1.0}
    assert card["steps"] == 1024
    assert [entry["value"] for entry in card["evaluation"]] == [5.0, 1.0, 3.0]
    assert same(model.policy.state_dict(), judge.seen[512])
    assert not same(judge.seen[1024], judge.seen[512])


def test_command_prints_the_evaluations(tmp_path, monkeypatch, capsys):
    judged(run_in(tmp_path), {0: 5.0, 512: 1.0, 1024: 3.0}, monkeypatch)
    capsys.readouterr()
    assert main(["evaluations", str(tmp_path / "policy.onnx")]) == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert head.endswith("3 evaluations")
    assert [line.split()[0] for line in lines] == ["0", "512", "1,024"]
    assert ["exported" in line for line in lines] == [False, True, False]


def test_exported_normaliser_belongs_to_the_best_policy(tmp_path, monkeypatch):
    run = run_in(tmp_path / "whole", normalize=NORMALIZED)
    _, model, _ = judged(run, {0: 5.0, 512: 1.0, 1024: 3.0}, monkeypatch)
    half = Run(run.config, 3, tmp_path / "half")
    _, other, _ = judged(half, {0: 5.0, 512: 4.0, 1024: 3.0}, monkeypatch)
    mine, theirs = (m.get_vec_normalize_env().obs_rms for m in (model, other))
    assert mine.count == theirs.count
    assert not np.array_equal(mine.mean, theirs.mean)


def test_untrained_policy_is_exported_only_if_none_is_better(tmp_path, monkeypatch):
    judge, model, card = judged(run_in(tmp_path), {0: 1.0, 512: 1.0, 1024: 2.0}, monkeypatch)
    assert card["chosen"] == {"steps": 0, "of": 3, "value": 1.0, "note": best.UNTRAINED}
    assert same(model.policy.state_dict(), judge.seen[0])


def test_policy_without_a_value_is_not_preferred(tmp_path, monkeypatch):
    values = {0: float("nan"), 512: float("nan"), 1024: float("nan")}
    _, _, card = judged(run_in(tmp_path), values, monkeypatch)
    assert card["chosen"] == {"steps": 1024, "of": 3}
    assert [entry["value"] for entry in card["evaluation"]] == [None] * 3


@pytest.mark.parametrize("normalize", [{}, {"normalize": NORMALIZED}], ids=["plain", "normalized"])
def test_resumed_run_keeps_its_best_policy(normalize, tmp_path, monkeypatch):
    values = {0: 5.0, 512: 1.0, 1024: 3.0}
    _, _, card = judged(run_in(tmp_path / "whole", **normalize), values, monkeypatch)
    assert card["chosen"]["steps"] == 512
    run = run_in(tmp_path / "killed", **normalize)
    killed_after(run, 800)
    train.train(run, train.resume(run), QUIET)
    files = [tmp_path / name / "policy.onnx" for name in ("whole", "killed")]
    assert files[0].read_bytes() == files[1].read_bytes()


def test_longer_training_continues_from_the_last_policy(tmp_path, monkeypatch):
    values = {0: 5.0, 512: 1.0, 1024: 3.0, 1536: 0.5}
    run = run_in(tmp_path)
    judge, _, _ = judged(run, values, monkeypatch)
    longer = train.saved_run(tmp_path, 1536)
    model = train.resume(longer)
    assert same(model.policy.state_dict(), judge.seen[1024])
    card = OnnxPolicy.load(train.train(longer, model, QUIET)).card
    assert card["chosen"] == {"steps": 1536, "of": 4, "value": 0.5}
