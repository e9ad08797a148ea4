"""Distance from the oracle: share of the gap, its conditions, and controllers beyond the papers."""

import dataclasses
import re
from pathlib import Path
from typing import Any

import board_fakes as fakes
import numpy as np
import pytest

from baselines.core.catalogue import PUBLISHED
from benchmarks.__main__ import main
from benchmarks.board import accessors as views
from benchmarks.board import gap, leaderboard
from benchmarks.board.words import short_env
from benchmarks.bounds import run as bounding
from benchmarks.bounds.run import Bound, Bounds
from benchmarks.runs import rows
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scoring.metrics import headline_of

NAMES = sorted({track.env for track in scenarios.available().values()})
PAGE = Path(__file__).parents[3] / "docs" / "controllers.md"


def oracle(of: dict[str, Any], share: float, **changes: Any) -> Bounds:
    """Return bounds with a share of the error of a row, in two episodes of each scenario."""
    episodes = [
        Bound(
            one["scenario"],
            one["seed"],
            False,
            {"rms_error": share * one["scores"]["rms_error"], "pressure_travel": 1e5},
        )
        for one in of["episodes"]
        if one["split"] == "public" and one["seed"] % 100 < 3
    ]
    return Bounds(**{"task": of["task"], "horizon": 60, "episodes": tuple(episodes), **changes})


def previewing(row: dict[str, Any]) -> dict[str, Any]:
    row["controller"]["preview_seconds"] = 0.2
    return row


def track() -> list[dict[str, Any]]:
    """Return a paper's controller, its tuned form, one with preview, and one beyond the papers."""
    tuned = fakes.row("pid_tuned", 1.8e-3, audit=1.8e-3)
    tuned["controller"]["tuning"]["trials"] = 20
    informed = fakes.row("inverse_informed", 0.1e-3, audit=0.1e-3)
    informed["controller"]["claimed"] = "true model"
    return [
        fakes.row("pid", 2e-3, audit=2e-3),
        tuned,
        previewing(fakes.row("inverse", 1.5e-3, audit=1.5e-3)),
        previewing(fakes.row("predictive_inverse", 1e-3, audit=1e-3, travel=1.5e5)),
        fakes.row("zero", 8e-3, audit=8e-3, citation=""),
        fakes.row("ppo", [0.3e-3] * 10, audit=[0.3e-3] * 10, kind="learned"),
        informed,
    ]


def test_share_is_that_between_the_papers_controller_and_the_oracle():
    made = track()
    found = gap.gap_of_best(made, oracle(made[0], 0.25))
    assert found is not None
    assert (views.name_of(found.paper), views.name_of(found.row)) == ("pid", "predictive_inverse")
    # (2 - 1) / (2 - 0.5), the same in every episode
    assert found.closed.value == pytest.approx(2.0 / 3.0)
    assert found.closed.low == pytest.approx(2.0 / 3.0)
    assert found.closed.high == pytest.approx(2.0 / 3.0)
    assert found.travel == pytest.approx(1.5)


def test_interval_covers_the_share_of_each_half_of_the_episodes():
    made = track()
    for number, episode in enumerate(made[3]["episodes"]):
        episode["scores"]["rms_error"] *= 0.5 if number % 2 else 1.5
    found = gap.gap_of_best(made, oracle(made[0], 0.25))
    assert found is not None
    assert found.closed.low < found.closed.value < found.closed.high
    assert found.errors["oracle"].low < found.errors["oracle"].value


def test_one_episode_of_a_scenario_gives_no_interval():
    made = track()
    bounds = oracle(made[0], 0.25)
    first = {episode.scenario: episode for episode in reversed(bounds.episodes)}
    few = oracle(made[0], 0.25, episodes=tuple(first.values()))
    found = gap.gap_of_best(made, few)
    assert found is not None
    assert found.closed.value == pytest.approx(2.0 / 3.0)
    assert np.isnan(found.closed.low)
    page = gap.page_text({"fake_nominal": made}, {"fake_nominal": few})
    assert "+67 % |" in page
    assert "mm [" not in page


def test_bounds_of_another_task_give_no_share():
    made = track()
    assert gap.gap_of_best(made, oracle(made[0], 0.25, task="other")) is None
    assert gap.gap_of_best(made, None) is None


def test_without_distance_between_paper_and_oracle_there_is_no_share():
    made = track()
    found = gap.gap_of_best(made, oracle(made[0], 1.0))
    assert found is not None and np.isnan(found.closed.value)


def test_matched_preview_separates_controllers_with_and_without():
    made = track()
    text = gap.page_text({"short_nominal": made}, {"short_nominal": oracle(made[0], 0.25)})
    matched = text.partition("## Matched preview")[2].partition("\n## ")[0]
    (line,) = re.findall(r"^\| `short_nominal`.*$", matched, re.MULTILINE)
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[1].startswith("`pid_tuned`<br>") and cells[3].startswith("`predictive_inverse`")
    assert cells[2].startswith("+13 %") and cells[4].startswith("+67 %")


def test_gain_beyond_the_papers_is_against_the_best_other_classical_controller():
    found = gap.gain(track())
    assert found is not None and found.holds
    assert (views.name_of(found.row), views.name_of(found.rival)) == (
        "predictive_inverse",
        "inverse",
    )
    assert found.lower_by.value == pytest.approx(1.0 / 3.0)
    close = [row for row in track() if views.name_of(row) != "predictive_inverse"]
    assert gap.gain(close) is None
    for k, episode in enumerate((worse := fakes.row("koopman", 1.5e-3, audit=1.5e-3))["episodes"]):
        episode["scores"]["rms_error"] *= 0.99 if k % 2 else 1.02
    even = gap.gain([*close, worse])
    assert even is not None and not even.holds


def test_tracks_are_counted_by_kind():
    made = track()
    text = gap.page_text({"a_randomised": made, "b_randomised": made[:1], "c_payload": made}, {})
    assert "Better on 1 of 2 randomised tracks, 1 of 1 payload tracks." in text
    assert "The oracle has not run" in text


def test_controllers_beyond_the_papers_are_those_of_their_page():
    listed = re.findall(r"^\| `(\w+)` \| ", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert set(gap.beyond()) == {name for name in listed if name in PUBLISHED}


def test_page_of_the_board_and_of_the_command_are_equal(tmp_path, capsys, monkeypatch):
    made = track()
    monkeypatch.setattr(leaderboard, "load", lambda folder: made)
    bound = dataclasses.replace(oracle(made[0], 0.25), start="inverse_ahead")
    bounding.write({"short_nominal": bound}, tmp_path)
    assert main(["gap", "--results", str(tmp_path)]) == 0
    page = leaderboard.files(made, bounding.read(tmp_path))["leaderboard/gap.md"]
    assert capsys.readouterr().out == page
    assert "the actions of `inverse_ahead` are a candidate of every search" in page


def test_written_bounds_are_read_back_beside_earlier_ones(tmp_path):
    made = track()
    first, second = (oracle(made[0], share) for share in (0.25, 0.5))
    second = dataclasses.replace(second, start="inverse")
    bounding.write({"a": first, "b": first}, tmp_path)
    bounding.write({"b": second}, tmp_path)
    assert bounding.read(tmp_path) == {"a": first, "b": second}


@pytest.mark.parametrize("env", NAMES)
def test_every_environment_has_a_valid_bound_and_a_reason_below_60_per_cent(env):
    made = scenarios.available().values()
    (track,) = (t.name for t in made if t.env == env and t.name.endswith("_nominal"))
    held = [rows.load(path) for path in rows.files() if path.parent.name == track]
    found = gap.gap_of_best(held, bounding.read().get(track))
    assert found is not None
    assert found.closed.value >= gap.ENOUGH or gap.reasons().get(short_env(env))


def test_no_controller_has_a_smaller_mean_than_the_oracle_on_the_same_episodes():
    better = []
    nominal = {name: b for name, b in bounding.read().items() if name.endswith("_nominal")}
    for track, bounds in nominal.items():
        for row in (rows.load(path) for path in rows.files() if path.parent.name == track):
            headline = headline_of(views.content_of(row))
            least = np.mean([episode.scores[headline] for episode in bounds.episodes])
            if gap._scores(row, headline, bounds).mean() < least:
                better.append(row["row"])
    assert better == []
