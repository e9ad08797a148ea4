"""Hyper-parameter search: proposals, resumption, budget in the preset's file."""

import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import optuna
import pytest
from optuna.trial import TrialState
from short_runs import ID, QUIET, tiny

from agents.search import tune
from agents.search.spaces import as_settings, from_settings, space_of, suggest, with_settings
from agents.settings import presets as configs
from agents.settings.parts import Plants, Search
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from agents.training.evaluation import Score, value_of

pytestmark = pytest.mark.filterwarnings("ignore::optuna.exceptions.ExperimentalWarning")
LOOK = {"episodes": 2, "settle_seconds": 0.1}
ROOT = Path(__file__).resolve().parents[3]


def small(**changes: Any) -> Config:
    """Return settings whose trials take a moment."""
    return tiny(network={"hidden": [32, 32], "gain": 10.0}, evaluation=LOOK, **changes)


def job(folder: Path, trials: int = 4, **changes: Any) -> tune.Job:
    return tune.Job(small(**changes), trials, 256, 0, folder / "s.db")


def tried(study: optuna.Study) -> list[tuple[Any, Any]]:
    trials = study.get_trials(states=tune.DONE)
    return [(trial.params, trial.value) for trial in trials]


def test_resumed_search_makes_the_same_proposals(tmp_path):
    for place in ("whole", "parts"):
        (tmp_path / place).mkdir()
    whole = tune.search(job(tmp_path / "whole", 3), QUIET)
    tune.search(job(tmp_path / "parts", 2), QUIET)
    parts = tune.search(job(tmp_path / "parts", 3), QUIET)
    assert tried(parts) == tried(whole)
    assert len(tried(whole)) == 3
    assert tried(whole)[0][0] == from_settings(small())
    assert tune.finished(tune.search(job(tmp_path / "whole", 3), QUIET)) == 3


def test_trial_of_a_killed_process_is_repeated(tmp_path, monkeypatch):
    code = f"""
import sys, time
sys.path[:0] = {[str(path) for path in Path(__file__).parents[:2]]!r}
import optuna
optuna.logging.disable_default_handler()
from pathlib import Path
from agents.search import tune
import test_tune
tune.HEARTBEAT = 1
def hang(*_):
    time.sleep(2)  # until the first sign of life is written
    print("running", flush=True)
    time.sleep(10_000)
tune.objective = hang
tune.search(test_tune.job(Path({str(tmp_path)!r}), 1), test_tune.QUIET)
"""
    process = subprocess.Popen(
        [sys.executable, "-W", "ignore", "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "running\n"
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    monkeypatch.setattr(tune, "HEARTBEAT", 1)
    study = tune.open_study(job(tmp_path, 1))
    assert [t.state for t in study.trials] == [TrialState.RUNNING]
    time.sleep(4)
    after = tune.search(job(tmp_path, 1), QUIET)
    states = [t.state for t in after.trials]
    assert states[0] == TrialState.FAIL
    assert states.count(TrialState.COMPLETE) == 1
    assert TrialState.RUNNING not in states
    done = after.get_trials(states=(TrialState.COMPLETE,))[0]
    assert done.params == from_settings(small())


def test_budget_includes_earlier_searches(tmp_path):
    path = tmp_path / "preset.yaml"
    path.write_text(configs.preset_path(ID, "ppo").read_text(encoding="utf-8"), encoding="utf-8")
    made = job(tmp_path, 1, search={"trials": 20, "earlier": 5})
    requested = dataclasses.replace(made, config=configs.read(path))
    first = tune.write(requested, tune.search(made, QUIET), path)
    assert (first.search.trials, first.search.earlier) == (1, 25)
    longer = dataclasses.replace(made, trials=2)  # the same search continues
    again = tune.write(requested, tune.search(longer, QUIET), path)
    assert (again.search.trials, again.search.earlier) == (2, 25)


def test_best_settings_and_budget_are_written(tmp_path):
    made = job(tmp_path, 2)
    study = tune.search(made, QUIET)
    path = tmp_path / "preset.yaml"
    path.write_text(
        "# why\n" + configs.preset_path(ID, "ppo").read_text(encoding="utf-8"), encoding="utf-8"
    )
    given = configs.read(path)
    requested = dataclasses.replace(made, config=given)
    after = tune.write(requested, study, path)
    assert configs.read(path) == after
    assert (after.search.trials, after.search.steps, after.search.seed) == (2, 256, 0)
    assert after.ppo.gamma != 0.0
    best = study.best_params["learning_rate"]
    assert after.ppo.learning_rate[0] == pytest.approx(best, rel=5e-3)
    again = dataclasses.replace(requested, config=after)
    assert again.name == requested.name
    text = path.read_text()
    assert text.startswith("# why\n")
    assert "# the untrained policy keeps the last setpoint" in text
    assert after.network.differences == given.network.differences
    assert after.env_kwargs == given.env_kwargs


@pytest.mark.parametrize("note", ["a: b # c", "a, b"])
@pytest.mark.parametrize("names", sorted(configs.presets()))
def test_every_preset_can_be_edited_in_place(names, note):
    path = configs.preset_path(*names)
    config = configs.read(path)
    changes = {
        **as_settings(config, _chosen(config)),
        "search.trials": 7,
        "search.note": note,
        "steps": 12_345,
    }
    text = tune.edited(path.read_text(encoding="utf-8"), changes)
    assert configs.from_text(text) == with_settings(config, changes)
    before = path.read_text(encoding="utf-8")
    assert before.splitlines()[0] == text.splitlines()[0]


def _chosen(config: Config) -> dict[str, Any]:
    return suggest(optuna.trial.FixedTrial(from_settings(config)), config)


def test_failed_episode_increases_the_value():
    good, bad = Score(0.1, -1.0, 0), Score(0.1, -1.0, 2)
    assert value_of(bad, small()) > 2 * value_of(good, small())
    assert value_of(Score(float("nan"), 0.0, 0), small()) == float("inf")
    by_return = tiny(evaluation={**LOOK, "objective": "return"})
    assert value_of(Score(0.1, -3.0, 0), by_return) == 3.0
    by_ratio = tiny(evaluation={**LOOK, "objective": "geometric"})
    score = Score(0.1, -3.0, 0, kinds=(0.01, 0.04))
    assert value_of(score, by_ratio) == pytest.approx(0.02)


def test_excess_travel_increases_the_value():
    assert value_of(Score(0.1, 0.0, 0, travel=105.0), small(), 100.0) == pytest.approx(0.1)
    assert value_of(Score(0.1, 0.0, 0, travel=210.0), small(), 100.0) == pytest.approx(0.2)
    assert value_of(Score(0.1, 0.0, 0, travel=210.0), small()) == pytest.approx(0.1)


@pytest.mark.parametrize("names", sorted(configs.presets()))
def test_the_first_trial_is_the_preset_itself(names):
    config = configs.preset(*names)
    assert set(from_settings(config)) == set(space_of(config))
    assert with_settings(config, as_settings(config, _chosen(config))) == config


def test_study_name_identifies_fixed_settings(tmp_path):
    one = job(tmp_path)

    def named(**changes: Any) -> str:
        return dataclasses.replace(one, config=dataclasses.replace(one.config, **changes)).name

    same = dataclasses.replace(one.config.ppo, gamma=0.9, learning_rate=(2e-4, 1e-5), n_epochs=3)
    assert named(ppo=same, steps=99, search=Search(trials=7)) == one.name
    evaluation = dataclasses.replace(one.config.evaluation, objective="geometric")
    others = (
        named(evaluation=evaluation),
        named(ppo=dataclasses.replace(one.config.ppo, target_kl=0.1)),
        named(plants=Plants(randomize=True)),
        named(env_kwargs={}),
    )
    assert len({one.name, *others}) == 5


def test_parallel_searches_propose_different_settings(tmp_path, monkeypatch):
    proposed = {}

    def objective(made: tune.Job, trial: optuna.Trial) -> float:
        proposed[trial.number] = suggest(trial, made.config)
        if trial.number == 1:  # while another process does the rest
            tune.search(job(tmp_path, 2), QUIET)
        return 1.0

    monkeypatch.setattr(tune, "objective", objective)
    tune.search(job(tmp_path, 2), QUIET)
    assert list(proposed) == [0, 1, 2]
    assert proposed[1] != proposed[2]


def test_search_needs_evaluations(tmp_path):
    blind = tune.Job(tiny(), 1, 256, 0, tmp_path / "s.db")
    with pytest.raises(SettingsError, match=r"evaluation.episodes = 0"):
        tune.search(blind, QUIET)
