"""Claims of rows, and each condition that prevents one."""

from typing import Any

import board_fakes as fakes
import numpy as np
import pytest

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings
from benchmarks.board.words import full_verdict
from benchmarks.runs import knowledge

TEN = np.linspace(0.4e-3, 0.6e-3, 10)
CLASSICAL = fakes.row("inverse", 1e-3, audit=1e-3, constraint_cost=0.01, air_use=1e-5)


def learned(public: Any = TEN, **changes: Any) -> dict[str, Any]:
    given = {"audit": public, "constraint_cost": 0.01, "air_use": 1e-5, **changes}
    return fakes.row("ppo", public, kind="learned", **given)


def in_round(*rows: dict[str, Any]) -> list[dict[str, Any]]:
    """Return rows that are all that their round has."""
    names = [row["controller"]["name"] for row in rows if row["audit"]]
    for row in rows:
        if row["audit"]:
            row["audit"]["entrants"] = dict.fromkeys(names, "a" * 64)
    return list(rows)


def verdict(row: dict[str, Any], rival: dict[str, Any] = CLASSICAL) -> tuple[str, str]:
    found = claims.claim(row, rival)
    return found.verdict, "; ".join(found.reasons)


def test_ten_seeds_with_lower_error_at_no_higher_cost_are_better():
    found = claims.claim(learned(), CLASSICAL)
    assert (found.verdict, found.reasons) == (claims.BETTER, ())
    assert found.split == "audit"
    assert found.probability.value == 1.0
    assert found.ratios["pressure travel"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"travel": 1.2e5}, "pressure travel 1.20x"),
        ({"air_use": 1.2e-5}, "air 1.20x"),
        ({"constraint_cost": 0.012}, "constraint cost 1.20x"),
    ],
)
def test_lower_error_at_higher_cost_has_its_own_verdict(changes, words):
    assert verdict(learned(**changes)) == (claims.DEARER, words)


def test_cost_ratio_up_to_1_1_is_allowed():
    assert verdict(learned(travel=1.0999e5))[0] == claims.BETTER


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (learned(TEN[:9]), "9 training seeds, a claim needs 10"),
        (learned(audit=None), "not audited"),
        (learned(failed_unseen=1), "1 of 60 episodes failed"),
        (learned([*TEN[:9], 2e-3]), "P 0.90, needs more than 0.95"),
        (learned(TEN * 3), "P 0.00, needs more than 0.95"),
    ],
)
def test_conditions_that_prevent_a_claim(row, words):
    found, reasons = verdict(row)
    assert found == claims.NOT_SHOWN
    assert words in reasons


def test_lower_error_in_most_episodes_but_not_in_mean_is_not_better():
    many = learned(np.full(40, 0.9e-3))
    one = [episode for episode in many["episodes"] if episode["training_seed"] == 0]
    for episode in one:
        episode["scores"]["rms_error"] = 0.025
    found, reasons = verdict(many)
    assert (found, reasons) == (claims.NOT_SHOWN, "lower in most episodes, not in the mean")


def test_gain_whose_interval_contains_zero_is_not_better():
    found = claims.claim(learned([*np.full(39, 0.99e-3), 1.2e-3]), CLASSICAL)
    assert found.probability.value > claims.PROBABILITY
    assert found.gain.low < 0.0 < found.gain.value
    assert found.reasons == ("the interval of the mean's gain holds zero",)


def test_gain_is_relative_to_the_classical_controllers_mean():
    found = claims.claim(learned(np.full(10, 0.75e-3)), CLASSICAL)
    assert found.gain.value == pytest.approx(0.25)
    assert found.gain.low <= found.gain.value <= found.gain.high


@pytest.mark.parametrize("knows", [knowledge.TRUE, knowledge.TRAINED])
def test_row_that_knows_the_plant_is_not_better_than_one_with_another_model(knows):
    found, reasons = verdict(learned(knowledge=knows))
    assert found == claims.NOT_SHOWN
    assert "that differs from the model of inverse" in reasons
    costs = {"constraint_cost": 0.01, "air_use": 1e-5}
    knowing = fakes.row("inverse", 1e-3, audit=1e-3, knowledge=knows, **costs)
    assert verdict(learned(knowledge=knows), knowing)[0] == claims.BETTER


@pytest.mark.parametrize(
    ("trials", "words"),
    [(60, "settings tried: 60, 0 for inverse"), (None, "tried: by hand, 0 for inverse")],
)
def test_unequal_budgets_are_shown_beside_the_verdict(trials, words):
    row = learned()
    row["controller"]["tuning"] = {"trials": trials, "how": "search"}
    found = claims.claim(row, CLASSICAL)
    assert found.verdict == claims.BETTER
    assert words in full_verdict(found)


# A maker can try public episodes until they suit him: nothing that he gains there may count.
GROUND = {
    "a hair below on the audit, half on the public episodes": (
        {"audit": 0.9995e-3, "public": np.full(10, 0.5e-3)},
        "P",
    ),
    "above on the audit, half on the public episodes": (
        {"audit": 1.5e-3, "public": np.full(10, 0.5e-3)},
        "P 0.00, needs more than 0.95",
    ),
    "fails on the audit alone": ({"failed_unseen": 24}, "24 of 60 episodes failed"),
    "costs more on the audit alone": (
        {"unseen": {"pressure_travel": 3e5}},
        "pressure travel 3.00x",
    ),
}


@pytest.mark.parametrize("kind", GROUND)
def test_row_selected_on_public_episodes_gains_no_claim(kind):
    changes, words = GROUND[kind]
    row = learned(**changes)
    if "hair" in kind:  # as good as the classical controller, with the scatter that episodes have
        random = np.random.default_rng(0)
        for episode in row["episodes"]:
            if episode["split"] == "audit":
                episode["scores"]["rms_error"] *= 1.0 + 0.02 * float(random.normal())
    (found,) = claims.learned_claims(in_round(CLASSICAL, row))
    assert found.verdict != claims.BETTER
    assert words in "; ".join(found.reasons)
    places = standings.ranks(standings.ordered([row, CLASSICAL]))
    better_unseen = views.mean_of(row, split="audit") < 1e-3
    first = standings.ordered([row, CLASSICAL])[0] is row
    assert first == better_unseen
    if "above" in kind:
        assert [str(place) for place in places] == ["1", "2"]
    if "hair" in kind:
        assert [str(place) for place in places] == ["1=", "1="]


def test_failures_on_public_episodes_do_not_count_in_audit():
    unlucky = learned(public=TEN * 4, audit=TEN, failed=3)
    (found,) = claims.learned_claims(in_round(CLASSICAL, unlucky))
    assert found.verdict == claims.BETTER


def test_without_a_round_nothing_is_better():
    rival = fakes.row("inverse", 1e-3)
    (found,) = claims.learned_claims([rival, learned(audit=None)])
    assert (found.verdict, found.split) == (claims.NOT_SHOWN, "public")
    assert found.reasons[0] == "not audited"


def test_better_classical_controller_outside_the_round_prevents_claims():
    outside = fakes.row("inverse", 1e-3, constraint_cost=0.01, air_use=1e-5)
    (found,) = claims.learned_claims(in_round(learned(audit=2.5e-3), outside))
    assert found.verdict == claims.NOT_SHOWN
    assert "inverse not audited" in found.reasons


def test_classical_controller_without_audit_is_still_compared():
    outside = fakes.row("inverse", 0.1e-3)
    pid = fakes.row("pid", 1e-3, audit=1e-3, constraint_cost=0.01, air_use=1e-5)
    (found,) = claims.learned_claims(in_round(pid, outside, learned()))
    assert views.name_of(found.rival) == "pid"
    assert found.reasons == ("inverse, not audited, is below pid on public episodes",)
    worse = fakes.row("inverse", 3e-3)
    (found,) = claims.learned_claims(in_round(pid, worse, learned()))
    assert found.verdict == claims.BETTER


def test_round_entrant_without_row_prevents_claims():
    rows = in_round(CLASSICAL, learned())
    for row in rows:
        row["audit"]["entrants"]["lost"] = "b" * 64
    (found,) = claims.learned_claims(rows)
    assert found.reasons == ("lost is in the audit round and has no row",)


def previewing(row: dict[str, Any]) -> dict[str, Any]:
    row["controller"]["preview_seconds"] = 0.2
    return row


def test_learned_row_with_preview_has_to_beat_the_best_classical_controller_with_preview():
    costs = {"constraint_cost": 0.01, "air_use": 1e-5}
    (alone,) = claims.learned_claims(in_round(CLASSICAL, previewing(learned())))
    reason = "uses 0.2 s of preview, no classical controller does"
    assert (alone.verdict, alone.reasons) == (claims.NOT_SHOWN, (reason,))
    worse = previewing(fakes.row("ahead", 2e-3, audit=2e-3, **costs))
    (beaten,) = claims.learned_claims(in_round(CLASSICAL, worse, previewing(learned())))
    assert (beaten.verdict, views.name_of(beaten.rival)) == (claims.BETTER, "inverse")
    # lower than ten seeds in most episodes, and higher in the mean than the controller without
    erratic = previewing(fakes.row("ahead", 1.1e-3, audit=1.1e-3, **costs))
    for episode in erratic["episodes"]:
        episode["scores"]["rms_error"] = 0.1e-3 if episode["scenario"] == "sines" else 3e-3
    (even,) = claims.learned_claims(in_round(CLASSICAL, erratic, previewing(learned())))
    reason = "P 0.50 against ahead, which uses preview as well"
    assert (even.verdict, even.reasons) == (claims.NOT_SHOWN, (reason,))


def test_learned_row_without_preview_may_beat_a_classical_controller_with_preview():
    rival = previewing(fakes.row("ahead", 1e-3, audit=1e-3, constraint_cost=0.01, air_use=1e-5))
    (found,) = claims.learned_claims(in_round(rival, learned()))
    assert found.verdict == claims.BETTER


def test_negligible_constraint_cost_counts_as_none():
    clean = fakes.row("inverse", 1e-3, constraint_cost=0.0)

    def ratio(cost: float) -> float:
        row = learned(constraint_cost=cost)
        return claims.cost_ratios(row, clean, "public")["constraint cost"]

    assert ratio(1e-6) == 1.0
    assert ratio(0.1) == pytest.approx(100.0)


def test_best_classical_controller_has_a_source():
    rows = [
        fakes.row("trivial", 0.1e-3, citation=""),
        learned(),
        fakes.row("pid", 2e-3),
        fakes.row("inverse", 1e-3),
    ]
    found = claims.best_classical(rows)
    assert views.name_of(found) == "inverse"
    assert claims.best_classical(rows[:2]) is None
    assert claims.learned_claims(rows[:2]) == []


def test_claims_are_ordered_by_verdict_audit_and_probability():
    worse, outside = learned(TEN * 3), learned(audit=None)
    worse["controller"]["name"], outside["controller"]["name"] = "sac", "td3"
    found = claims.learned_claims(in_round(worse, outside, CLASSICAL, learned()))
    assert [views.name_of(entry.row) for entry in found] == ["ppo", "sac", "td3"]
