"""Ranks, lists and rank changes from rows made by hand."""

import math

import board_fakes as fakes
import numpy as np
import pytest

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings


def places(rows: list[dict]) -> dict[str, str]:
    best_first = standings.ordered(rows)
    found = standings.ranks(best_first)
    return {views.name_of(row): str(place) for row, place in zip(best_first, found, strict=True)}


def jittered(name: str, middle: float, by: float, seed: int) -> dict:
    """Return a row whose errors are scattered by ``by``."""
    made = fakes.row(name, middle)
    random = np.random.default_rng(seed)
    for episode in made["episodes"]:
        episode["scores"]["rms_error"] += by * float(random.normal())
    return made


def test_ranks_follow_paired_differences_and_not_overlapping_intervals():
    wide = 0.3  # one set of seeds differs by far more than the controllers
    rows = []
    for name, middle in (("first", 1.0e-3), ("second", 1.05e-3)):
        row = fakes.row(name, middle)
        for k, episode in enumerate(row["episodes"]):
            episode["scores"]["rms_error"] += wide * 1e-3 * (k % 3)
        rows.append(row)
    first, second = (views.interval(row) for row in rows)
    assert second.low < first.high
    assert places(rows) == {"first": "1", "second": "2"}


def test_rows_share_a_place_if_their_difference_interval_contains_zero():
    rows = [jittered(name, 1e-3, 1e-4, k) for k, name in enumerate(("a", "b"))]
    rows.append(fakes.row("last", 5e-3))
    assert list(places(rows).values()) == ["1=", "1=", "3"]


def test_rows_of_other_episodes_are_not_compared():
    first, second = fakes.row("a", 1e-3), fakes.row("b", 1e-3)
    for episode in second["episodes"]:
        episode["seed"] += 7
    assert standings.difference(first, second) is None
    assert standings.improvement(first, second) is None
    other_task = fakes.row("c", 1e-3) | {"task": "another plant"}
    assert standings.difference(first, other_task) is None


def test_rows_outside_the_round_or_with_few_seeds_are_listed_apart():
    first, _ = standings.tracks(fakes.board()).values()
    found = standings.listing(first)
    assert [views.name_of(row) for row in found.ranked] == ["ppo", "inverse", "pid", "zero"]
    assert [views.name_of(row) for row in found.outside] == ["outside"]
    assert [views.name_of(row) for row in found.few] == ["young"]
    assert (found.split, found.missing) == ("audit", ())
    shorter = standings.listing([row for row in first if views.name_of(row) != "pid"])
    assert shorter.missing == ("pid",)


def test_controllers_with_the_plant_of_each_episode_are_listed_apart():
    nominal, informed = fakes.row("a", 2e-3, citation="x"), fakes.row("b", 1e-3, citation="x")
    informed["controller"]["claimed"] = "true model"
    found = standings.listing([nominal, informed])
    assert [views.name_of(row) for row in found.ranked] == ["a"]
    assert [views.name_of(row) for row in found.informed] == ["b"]
    best = claims.best_classical([nominal, informed])
    assert best is not None and views.name_of(best) == "a"


def test_without_a_round_all_rows_are_ranked_by_public_episodes():
    found = standings.listing([fakes.row("b", 2e-3), fakes.row("a", 1e-3)])
    assert [views.name_of(row) for row in found.ranked] == ["a", "b"]
    assert (found.split, found.outside, found.missing) == ("public", [], ())


def test_ranks_follow_the_audit_and_not_the_public_episodes():
    ground = fakes.row("ground", 0.5e-3, audit=1.5e-3)
    honest = fakes.row("honest", 1.1e-3, audit=1.0e-3)
    assert places([ground, honest]) == {"honest": "1", "ground": "2"}
    found = standings.difference(ground, honest)
    assert found.value == pytest.approx(0.5e-3)


def test_rows_inside_and_outside_the_round_are_compared_on_common_episodes():
    inside, outside = fakes.row("a", 2e-3, audit=1e-3), fakes.row("b", 3e-3)
    assert views.common_split(inside, outside) == "public"
    found = standings.difference(outside, inside)
    assert found.value == pytest.approx(1e-3)


def test_score_of_row_in_round_is_its_audit_score():
    row = fakes.row("pid", 2e-3, audit=2.6e-3)
    assert views.interval(row).value == pytest.approx(2.6e-3)
    assert views.mean_of(row, split=views.PUBLIC) == pytest.approx(2e-3)
    gap = views.gap(row)
    assert gap.value == pytest.approx(0.6e-3)
    assert views.is_worse_unseen(row)
    assert not views.is_worse_unseen(fakes.row("pid", 2e-3, audit=2e-3))
    assert views.gap(fakes.row("outside", 2e-3)) is None


def test_spread_of_policies_does_not_hide_a_common_gap():
    ten = np.linspace(0.4e-3, 1.2e-3, 10)
    row = fakes.row("ppo", ten, audit=ten + 0.05e-3, kind="learned")
    gap = views.gap(row)
    assert gap.value == pytest.approx(0.05e-3)
    assert gap.low > 0.03e-3
    assert views.is_worse_unseen(row)


def test_episode_without_metric_in_one_training_seed_is_omitted_in_all():
    row = fakes.row("ppo", [1e-3, 3e-3], kind="learned", steady_state_error=1.0)
    first, *_ = row["episodes"]
    for episode in row["episodes"]:
        if (episode["scenario"], episode["seed"]) == (first["scenario"], first["seed"]):
            episode["scores"]["steady_state_error"] = 9.0
    first["scores"]["steady_state_error"] = None
    assert views.mean_of(row, "steady_state_error") == 1.0
    assert views.interval(row, "steady_state_error").value == 1.0


def test_scores_of_each_training_seed():
    row = fakes.row("ppo", [1e-3, 3e-3], audit=[2e-3, 4e-3], kind="learned")
    assert views.by_training_seed(row) == {0: pytest.approx(2e-3), 1: pytest.approx(4e-3)}
    assert views.by_training_seed(row, views.PUBLIC)[1] == pytest.approx(3e-3)
    assert views.by_training_seed(fakes.row("pid", 1e-3)) == {}


def test_smooth_reference_score_excludes_steps():
    found = views.smooth(fakes.row("pid", 3e-3))  # 4 mm of steps, 2 mm of sines
    assert found.value == pytest.approx(2e-3)
    assert views.by_setting(fakes.row("pid", 3e-3)) == {
        ("reference", "steps"): pytest.approx(4e-3),
        ("reference", "sines"): pytest.approx(2e-3),
    }


def test_rank_changes_between_tracks_equal_those_by_hand():
    tracks = {name: standings.listing(rows).ranked for name, rows in tracks_of().items()}
    (found,) = standings.changes(tracks)
    assert found.tracks == ("short_nominal", "short_wrong_model")
    shown = {name: [str(place) for place in both] for name, both in found.places.items()}
    assert shown == {
        "ppo": ["1", "1"],
        "inverse": ["2", "3"],
        "pid": ["3", "2"],
        "zero": ["4", "4"],
    }
    # of six pairs one changes its order: (5 - 1) / 6
    assert found.agreement == (pytest.approx(1.0), pytest.approx(4 / 6))
    assert found.splits == ("audit", "audit")


def tracks_of() -> dict[str, list[dict]]:
    return standings.tracks(fakes.board())


def test_single_track_has_no_rank_changes():
    assert standings.changes({"short_nominal": [fakes.row("a", 1e-3)]}) == []


def test_single_controller_has_no_rank_correlation():
    tracks = {name: [fakes.row("a", 1e-3, track=name)] for name in ("nominal", "other")}
    (found,) = standings.changes(tracks)
    assert math.isnan(found.agreement[1])
