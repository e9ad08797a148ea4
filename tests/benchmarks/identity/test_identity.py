"""Identity by behaviour: changes that void no row, and changes that void exactly their rows."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baselines.core import catalogue
from benchmarks.identity import artefacts, behaviour, tasks
from benchmarks.identity.behaviour import FixedActions
from benchmarks.runs import rollout
from benchmarks.runs.controllers import find
from benchmarks.scenarios import scenario_env
from benchmarks.scenarios.scenario import ScenarioSet, available
from benchmarks.scoring import metrics
from benchmarks.scoring.groups import knee

SHORT = {"episode_seconds": 1.5}
PACKAGES = ("pam_envs", "baselines", "agents", "benchmarks", "sweeps")
NAMES = ("positioning_nominal", "knee_walk_nominal")
CLASSICAL = {"positioning_nominal": "inverse_pid", "knee_walk_nominal": "knee_inverse_ahead"}


def short(name: str, **changes: Any) -> ScenarioSet:
    """Return a track with a short episode of each reference."""
    content = dict(available()[name].content)
    content |= {"settle_seconds": 0.3, "hold_seconds": 0.1, **changes}
    content["kwargs"] = {**content["kwargs"], **SHORT, **changes.get("kwargs", {})}
    kept = {
        axis: len(points) if axis == "reference" else 1 for axis, points in content["grid"].items()
    }
    content["grid"] = {axis: points[: kept[axis]] for axis, points in content["grid"].items()}
    content["per_reference"] = {}
    return ScenarioSet(content)


def identities() -> dict[str, dict[str, Any]]:
    """Return the identity of two short tasks, and of a classical controller in each."""
    tasks.of.cache_clear()
    artefacts._answers.cache_clear()
    found = {}
    for name in NAMES:
        track = short(name)
        made = artefacts.of(find(CLASSICAL[name]), track).record()
        found[name] = {"task": tasks.of(track).identity.record(), "artefact": made}
    return found


@pytest.fixture(scope="module")
def before():
    return identities()


# --- changes that void nothing -------------------------------------------------------------------


def test_identity_reads_no_code_and_names_no_module(before, monkeypatch):
    """So docstrings, formatting and places of modules void no row."""
    read = Path.open

    def guarded(path, *arguments, **named):
        assert path.suffix != ".py", path
        return read(path, *arguments, **named)

    monkeypatch.setattr(Path, "open", guarded)
    monkeypatch.setattr("sweeps.files.sources_digest", None)
    assert identities() == before
    text = json.dumps(before)
    assert not [word for word in (*PACKAGES, "Controller", ".py") if word in text]


def test_changed_title_voids_no_row():
    assert short(NAMES[0], title="Another").digest == short(NAMES[0]).digest


def test_changed_reward_voids_no_row(before, monkeypatch):
    run = rollout.run

    def other(*arguments: Any) -> rollout.Episode:
        episode = run(*arguments)
        rewards = {k: v + 1.0 for k, v in episode.signals.items() if k.startswith("reward/")}
        assert rewards
        return dataclasses.replace(episode, signals={**episode.signals, **rewards})

    monkeypatch.setattr(rollout, "run", other)
    assert identities() == before


# --- changes that void exactly their rows --------------------------------------------------------


def changed(before: dict[str, dict[str, Any]]) -> dict[str, list[str]]:
    """Return the parts of each task that changed, of those that did."""
    now = {name: tasks.of(short(name)).identity for name in NAMES}
    found = {name: now[name].changes(before[name]["task"]) for name in NAMES}
    return {name: [line.partition(":")[0] for line in lines] for name, lines in found.items()}


def test_parameter_changed_by_1e_9_voids_its_task(before, monkeypatch):
    make = scenario_env.make_env

    def other(env: str, kwargs: Any) -> Any:
        made = make(env, kwargs)
        if "Positioning" not in env:
            return made
        plant = made.unwrapped.plant
        value = plant.value("regulator.time_constant") * (1.0 + 1e-9)
        return make(env, {**kwargs, "plant": plant.replace({"regulator.time_constant": value})})

    monkeypatch.setattr(tasks, "make_env", other)
    tasks.of.cache_clear()
    found = changed(before)
    assert found[NAMES[0]][:3] == ["plants changed", "models changed", "trajectories changed"]
    assert found[NAMES[1]] == []


def test_changed_metric_voids_the_tasks_that_use_it(before, monkeypatch):
    tasks.of.cache_clear()
    half = knee.half_range
    monkeypatch.setattr(knee, "half_range", lambda *a: half(*a) * (1.0 + 1e-8))
    assert changed(before) == {NAMES[0]: [], NAMES[1]: ["scores changed"]}


def test_changed_worst_case_rule_voids_all_tasks(before, monkeypatch):
    tasks.of.cache_clear()
    worst = metrics.worst_of
    monkeypatch.setattr(metrics, "worst_of", lambda *a: {**worst(*a), "rms_error": 1.0})
    assert changed(before) == {name: ["scores changed"] for name in NAMES}


def test_changed_scenario_voids_its_task(before):
    track = short(NAMES[0], kwargs={"load_disturbance": 1.0})
    changes = tasks.of(track).identity.changes(before[NAMES[0]]["task"])
    assert [line.partition(":")[0] for line in changes][:1] == ["scenarios changed"]


@pytest.mark.parametrize(("name", "controller"), CLASSICAL.items())
def test_every_knob_changes_the_recorded_actions(name, controller):
    track = short(name)
    (setting, *_) = tasks.of(track).settings
    (plain, *_) = artefacts.of(find(controller), track).answers
    base = setting.env.unwrapped
    for knob, (_, high) in catalogue.PUBLISHED[controller].knobs.items():
        turned = catalogue.make_controller(
            controller, setting.model, base.signals, base.action_signals, knobs={knob: high}
        )
        found = behaviour.of_controller(turned, setting.observations, setting.env.action_space)
        assert behaviour.difference(found, plain) > 100 * behaviour.TOLERANCE, knob


@pytest.mark.parametrize(("factor", "voids"), [(1.0 + 1e-8, False), (1.0 + 1e-4, True)])
def test_rounding_of_a_design_does_not_change_its_identity(factor, voids, before, monkeypatch):
    answers = behaviour.answers
    monkeypatch.setattr(behaviour, "answers", lambda *a: answers(*a) * np.float32(factor))
    artefacts._answers.cache_clear()
    made = artefacts.of(find("inverse_pid"), short(NAMES[0]))
    assert bool(made.changes(before[NAMES[0]]["artefact"])) is voids


@pytest.mark.parametrize(("flips", "voids"), [(1, False), (2, True)])
def test_one_rounded_setpoint_in_a_hundred_may_flip(flips, voids):
    first = np.zeros((100, 1), np.float32)
    second = first.copy()
    second[:flips] = 1e-3
    assert (behaviour.difference(first, second) > behaviour.TOLERANCE) is voids


def test_policy_is_identified_by_its_file_and_the_controller_that_it_corrects(monkeypatch):
    track = short("knee_tension_nominal")
    residual = find("residual_knee_tension")
    old = artefacts.of(residual, track)
    assert len(old.files) == len(residual.files)
    assert old.changes(old.record()) == []
    corrected = artefacts.of(find("knee_inverse_ahead_tuned_tension"), track)
    assert old.record()["answers"] == corrected.record()["answers"]
    swapped = ({**old.files[0], "sha256": "0" * 64}, *old.files[1:])
    other = dataclasses.replace(old, files=swapped)
    assert other.changes(old.record()) == ["policy files changed"]
    learned = artefacts.of(find("ppo_knee_walk"), short("knee_walk_nominal"))
    assert (len(learned.files), learned.answers) == (10, ())


# --- inputs ---------------------------------------------------------------------------------------


def test_fixed_actions_are_exact_and_within_the_range():
    class Space:
        low, high = np.array([-1.0, 0.0]), np.array([1.0, 4e5])

    held = FixedActions(Space)
    actions, state = [], None
    for _ in range(500):
        action, state = held.predict(None, state)
        actions.append(action)
    shares = (np.array(actions) - Space.low) / (Space.high - Space.low)
    assert shares.min() == pytest.approx(0.2)
    assert shares.max() == pytest.approx(0.8)
    assert len(np.unique(shares[:, 0].round(6))) > 4
    assert not np.array_equal(shares[:, 0], shares[:, 1])


@pytest.mark.parametrize("answers", [np.zeros((0, 1)), np.array([[0.1], [np.nan]])])
def test_packed_actions_keep_every_bit(answers):
    packed = behaviour.pack(answers.astype(np.float32))
    found = behaviour.unpack(json.loads(json.dumps(packed)))
    assert np.array_equal(found, answers.astype(np.float32), equal_nan=True)
    assert behaviour.difference(found, found) == 0.0
    assert behaviour.difference(found, found[:-1] if len(found) else np.ones((1, 1))) == np.inf


def test_non_finite_actions_identify_a_controller(folder, track):
    refused = artefacts.of(find("refused"), track)
    assert np.isnan(refused.answers[0]).all()
    assert refused.changes(refused.record()) == []
