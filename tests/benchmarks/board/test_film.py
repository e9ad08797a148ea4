"""Film of the best controllers side by side: frames, captions, running error."""

import dataclasses

import board_fakes as fakes
import numpy as np
import pytest

from benchmarks.__main__ import main
from benchmarks.board import film, standings, summary
from benchmarks.runs import controllers, rollout
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario_env import make_env

TRACK = "knee_tension_nominal"


@pytest.fixture(scope="module")
def track():
    return scenarios.available()[TRACK]


def test_running_error_starts_after_the_settling_window_and_ends_at_the_score(track):
    time = np.arange(1, 11) * 0.5
    signals = {"time": time, "output": np.full(10, 3.0), "reference": np.zeros(10)}
    words = film.running_error(signals, {**track.content, "settle_seconds": 2.0, "gate": None})
    assert words[:4] == [""] * 4
    assert set(words[4:]) == {"RMS so far 3.00 N"}


def test_error_where_the_gate_is_closed_does_not_count(track):
    signals = {
        "time": np.arange(4.0),
        "output": np.array([9.0, 1.0, 9.0, 1.0]),
        "reference": np.zeros(4),
        "on": np.array([0.0, 1.0, 0.0, 1.0]),
    }
    words = film.running_error(signals, {**track.content, "settle_seconds": -1.0, "gate": ["on"]})
    assert words == ["", *["RMS so far 1.00 N"] * 3]


def test_one_row_on_two_sides_is_shown_once():
    rows = standings.tracks(fakes.board())["short_nominal"]
    best = summary.best_of("short_nominal", rows, {})
    assert best.paper is best.classical
    track = scenarios.available()["positioning_nominal"]
    found = [
        (side, name) for side, name, _ in film.sides(track, replaced(best), track.scenarios()[0])
    ]
    assert found == [("paper's controller, best classical", "inverse")]


def replaced(best: summary.Best) -> summary.Best:
    """Return the best without the learned controller, which has no policy."""
    return dataclasses.replace(best, learned=None, claim=None)


def test_pictures_are_tiled_in_two_columns():
    one, other = np.zeros((4, 6, 3), np.uint8), np.full((4, 6, 3), 7, np.uint8)
    assert film.tiled([one]).shape == (4, 6, 3)
    assert film.tiled([one, other]).shape == (4, 12, 3)
    three = film.tiled([one, other, one])
    assert three.shape == (8, 12, 3)
    assert (three[4:, 6:] == 255).all() and (three[:4, 6:] == 7).all()


def test_replayed_actions_give_the_recorded_episode(track):
    one = track.scenarios()[0]
    seed = track.seeds[one.name][0]
    env = make_env(track.env, one.kwargs)
    made = controllers.make(controllers.find("knee_inverse"), env.unwrapped.plant, env)
    recorded = rollout.run(env, made, seed)
    again = rollout.run(env, film.Replay(recorded.actions), seed)
    assert np.array_equal(again.signals["output"], recorded.signals["output"])
    frames = film.played(track, one, seed, "a", "b", film.Replay(recorded.actions))
    assert len({frame.tobytes() for frame in frames[:20]}) > 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "nowhere"),
        ([TRACK, "--scenario", "x"], "scenario = 'x' is none of knee_tension_nominal: "),
    ],
)
def test_unknown_track_and_scenario_are_named(arguments, message, capsys):
    assert main(["film", *arguments]) != 0
    assert message in "".join(capsys.readouterr())
