"""Search of knobs: repeatable, resumable, never worse, and written for the catalogue."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from agents.settings import seeds
from baselines.core import tuned
from baselines.core.catalogue import PUBLISHED
from baselines.core.entry import Knobs
from benchmarks.runs import tuning
from benchmarks.runs.tuning import Course, Job, Measured, job_of, seeds_of, worth
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet

POSITIONING = "PAM/MusclePositioning-v0"
COSTS = {"pressure_travel": 2.0, "air_use": 1.0, "constraint_cost": 0.0}
PLAIN = Measured(error=1.0, mean=2.0, failures=0, costs=COSTS)


def bowl(knobs: Knobs) -> Measured:
    """Return a fake measurement: best at a closed loop of 0.5, dear where the reach is long."""
    off = abs(knobs.get("closed_loop_time", 1.0) - 0.5)
    travel = 2.0 * max(1.0, knobs.get("reach", 1.0))
    return Measured(0.5 + off, 1.0 + off, 0, {**COSTS, "pressure_travel": travel})


def job(folder: Path, trials: int = 12, seed: int = 0) -> Job:
    return job_of("pid", trials=trials, seed=seed, storage=folder / "tuning.db")


def tried(made: Job) -> list[tuple[Any, Any]]:
    return [(trial.params, trial.value) for trial in tuning._finished(tuning.open_study(made))]


def test_search_is_repeatable_resumable_and_never_worse(tmp_path):
    whole = tuning.search(job(tmp_path / "whole"), bowl)
    with pytest.raises(KeyboardInterrupt):
        tuning.search(job(tmp_path / "parts"), Stops(after=5))
    begun = tried(job(tmp_path / "parts"))
    assert len(begun) == 5  # the first trial is the controller as published, measured before it
    parts = tuning.search(job(tmp_path / "parts"), bowl)
    assert parts == dataclasses.replace(whole, command=parts.command)
    assert tried(job(tmp_path / "parts")) == tried(job(tmp_path / "whole"))
    first, *others = tried(job(tmp_path / "whole"))
    assert first == (dict.fromkeys(job(tmp_path).bounds, 1.0), 1.0)
    assert len(others) == 11
    assert whole.after < whole.before == 1.0
    assert whole.knobs["reach"] <= 1.1  # what is dearer is not chosen
    assert tuning.search(job(tmp_path / "whole"), fails) == whole
    other = tuning.search(job(tmp_path / "whole", seed=1), bowl)
    assert other.knobs != whole.knobs


class Stops:
    """Measures some times and is then interrupted."""

    def __init__(self, after: int) -> None:
        self.left = after

    def __call__(self, knobs: Knobs) -> Measured:
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt
        return bowl(knobs)


def fails(knobs: Knobs) -> Measured:
    raise AssertionError("nothing is left to measure")


def test_published_parameters_are_kept_if_no_trial_is_better(tmp_path):
    def worse_if_changed(knobs: Knobs) -> Measured:
        return dataclasses.replace(PLAIN, error=2.0 if knobs else 1.0)

    found = tuning.search(job(tmp_path, trials=4), worse_if_changed)
    assert (found.after, found.before, found.trials) == (1.0, 1.0, 4)
    assert set(found.knobs.values()) == {1.0}


def test_progress_counts_earlier_trials(tmp_path):
    tuning.search(job(tmp_path, trials=2), bowl)
    counted: list[int] = []

    def start(total: int) -> Any:
        counted.append(total)
        return lambda: counted.append(1)

    tuning.search(job(tmp_path, trials=3), bowl, start)
    assert counted == [3, 1, 1, 1]


@pytest.mark.parametrize(
    ("change", "value"),
    [
        ({}, 0.6),
        ({"costs": {**COSTS, "pressure_travel": 2.2}}, 0.6),
        ({"costs": {**COSTS, "pressure_travel": 2.42}}, 1.1),
        ({"costs": {**COSTS, "constraint_cost": 1e-3}}, 0.6),
        ({"costs": {**COSTS, "constraint_cost": 2.2e-3}}, 2.0),
        ({"mean": 2.2}, 1.1),
        ({"failures": 1}, 2.0),
        ({"error": 3.0, "failures": 1}, 6.0),
    ],
)
def test_higher_cost_is_worse_than_the_published_controller(change, value):
    found = dataclasses.replace(PLAIN, error=0.6)
    assert worth(dataclasses.replace(found, **change), PLAIN) == pytest.approx(value)


@pytest.mark.parametrize("name", [n for n in scenarios.names() if n.endswith("_nominal")])
def test_episodes_are_on_tuning_seeds_each_once(name):
    track = scenarios.available()[name]
    assert tuning.track_of(track.env).name == name
    shared = seeds_of(track, 30)
    used = [seed for of_one in shared.values() for seed in of_one]
    assert set(shared) == {scenario.name for scenario in track.scenarios()}
    assert len({len(of_one) for of_one in shared.values()}) == 1
    assert sorted(used) == seeds.tuning(len(used))
    assert 30 <= len(used) < 30 + len(shared)
    assert not set(used) & {seed for of_one in track.seeds.values() for seed in of_one}


@pytest.fixture
def short():
    """The track that positioning is tuned on, two kinds of reference and short."""
    content = dict(tuning.track_of(POSITIONING).content)
    content |= {"settle_seconds": 0.5, "hold_seconds": 0.2, "per_reference": {}}
    content["kwargs"] = {"episode_seconds": 1.5, "randomize": False}
    content["grid"] = {"reference": ["steps", "sines"], "load": [2.55]}
    return ScenarioSet(content)


def test_tuning_episodes_are_scored_like_the_board_with_knobs_applied(short):
    course = Course("pid", short, episodes=4)
    plain = course.measure({})
    assert course.measure({}) == plain == course.measure({"reach": 1.0})
    assert course.measure({"closed_loop_time": 4.0}).error > plain.error
    assert set(plain.costs) == {"pressure_travel", "air_use", "constraint_cost"}
    assert plain.failures == 0
    assert plain.error < plain.mean  # geometric over jumping and smooth references


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"controller": "table"}, "table has no knobs; choose from elbow_allocation, "),
        (
            {"controller": "pyd"},
            "pyd is no controller of the catalogue; choose from elbow_allocation",
        ),
        ({"controller": "knee_pid"}, "runs in several environments; give --env as one of PAM/Kn"),
        ({"controller": "pid", "env": "KneeWalk-v0"}, "runs not in KneeWalk-v0; give --env as"),
        ({"controller": "pid", "trials": 0}, "trials = 0 must be at least 1"),
        ({"controller": "pid", "episodes": 501}, "episodes = 501 from 1 to 500"),
    ],
)
def test_impossible_search_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        job_of(**arguments)


@pytest.mark.parametrize("name", [n for n in scenarios.names() if n.endswith("_randomised")])
def test_drawn_plants_are_those_of_the_randomised_track(name):
    assert tuning.track_of(scenarios.available()[name].env, "drawn").name == name


def test_search_on_drawn_plants_is_an_entry_of_its_own(tmp_path):
    nominal = tuning.search(job(tmp_path, trials=2), bowl)
    drawn = tuning.search(dataclasses.replace(job(tmp_path, trials=2), plants="drawn"), bowl)
    assert (nominal.name, drawn.name) == ("pid_tuned", "pid_tuned_drawn")
    assert drawn.command == nominal.command.replace(" --write", " --plants drawn --write")
    file = tmp_path / "tuned.yaml"
    file.write_text("schema: 1\ntuned: {}\n")
    for found in (nominal, drawn):
        tuning.write(found, file)
    assert tuned.read(file) == {"pid_tuned": nominal, "pid_tuned_drawn": drawn}
    assert file.read_text().count("plants: ") == 1
    made = tuned.entries(PUBLISHED, tuned.read(file))
    assert made["pid_tuned_drawn"].tuning.endswith("of drawn plants")


def test_command_repeats_the_search():
    made = job_of("knee_pid", "KneeWalk-v0", seed=3)
    assert made.command == (
        "python -m benchmarks tune knee_pid --env PAM/KneeWalk-v0 --trials 20 --seed 3 --write"
    )


def test_optimum_on_a_bound_is_reported(tmp_path):
    one = tuning.search(job(tmp_path, trials=3), bowl)
    inside, edge = (
        dataclasses.replace(one, knobs={"reach": r}, bounds={"reach": (0.5, 2.0)})
        for r in (1, 1.99)
    )
    assert "bound" not in tuning.sentence(inside)
    assert tuning.sentence(edge).endswith("; on a bound: reach: widen it")


def test_result_is_written_beside_earlier_ones(tmp_path):
    file = tmp_path / "tuned.yaml"
    file.write_text("# A head line.\nschema: 1\ntuned: {}\n")
    one = tuning.search(job(tmp_path, trials=3), bowl)
    said = f"pid_tuned: 1 to {one.after:.4g} in 3 trials, with closed_loop"
    assert tuning.sentence(one).startswith(said)
    assert one.bounds == PUBLISHED["pid"].knobs
    lead = {"knobs": {"lead": 1.25}, "bounds": {"lead": (0.5, 2.0)}}
    two = dataclasses.replace(one, controller="inverse", **lead)
    for found in (one, two, dataclasses.replace(one, trials=20)):
        tuning.write(found, file)
    assert file.read_text().startswith("# A head line.\nschema: 1\ntuned:\n  inverse_tuned:\n")
    assert "    knobs: {lead: 1.25}\n" in file.read_text()
    read = tuned.read(file)
    assert read == {"inverse_tuned": two, "pid_tuned": dataclasses.replace(one, trials=20)}
    before = file.read_text()
    with pytest.raises(ValueError, match="knob lead is 9"):
        tuning.write(dataclasses.replace(two, knobs={"lead": 9.0}), file)
    assert file.read_text() == before
