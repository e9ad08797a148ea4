"""What may be claimed, and each thing that keeps it from being claimed."""

from __future__ import annotations

from typing import Any

import board_fakes as fakes
import numpy as np
import pytest

from benchmarks import claims, views

TEN = np.linspace(0.4e-3, 0.6e-3, 10)
PAPER = fakes.row("inverse", 1e-3, audit=1.0, constraint_cost=0.01, air_use=1e-5)


def learned(public: Any = TEN, **changes: Any) -> dict[str, Any]:
    given = {"audit": 1.0, "constraint_cost": 0.01, "air_use": 1e-5, **changes}
    return fakes.row("ppo", public, kind="learned", **given)


def verdict(row: dict[str, Any]) -> tuple[str, str]:
    found = claims.claim(row, PAPER)
    assert found is not None
    return found.verdict, "; ".join(found.reasons)


def test_ten_seeds_below_at_no_higher_cost_are_better() -> None:
    found = claims.claim(learned(), PAPER)
    assert found is not None
    assert (found.verdict, found.reasons) == (claims.BETTER, ())
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
def test_a_lower_error_at_a_higher_cost_says_so(changes: dict[str, float], words: str) -> None:
    assert verdict(learned(**changes)) == (claims.DEARER, words)


def test_a_cost_of_a_tenth_more_is_allowed() -> None:
    assert verdict(learned(travel=1.0999e5))[0] == claims.BETTER


@pytest.mark.parametrize(
    ("row", "words"),
    [
        (learned(TEN[:9]), "9 training seeds, a claim needs 10"),
        (learned(audit=None), "self-reported, a claim needs an audit"),
        (learned(audit=2.5), "not lower on the audit episodes"),
        (learned(failed=1), "1 of 60 episodes failed"),
        (learned([*TEN[:9], 2e-3]), "P 0.90, needs more than 0.95"),
        (learned(TEN * 3), "P 0.00, needs more than 0.95"),
    ],
)
def test_what_keeps_a_claim_from_being_made(row: dict[str, Any], words: str) -> None:
    found, reasons = verdict(row)
    assert found == claims.NOT_SHOWN
    assert words in reasons


def test_a_constraint_cost_that_is_next_to_nothing_is_none() -> None:
    clean = fakes.row("inverse", 1e-3, constraint_cost=0.0)
    assert claims.cost_ratios(learned(constraint_cost=1e-6), clean)["constraint cost"] == 1.0
    dear = claims.cost_ratios(learned(constraint_cost=0.1), clean)
    assert dear["constraint cost"] == pytest.approx(100.0)


def test_the_best_paper_controller_is_classical_and_has_a_source() -> None:
    rows = [
        fakes.row("trivial", 0.1e-3, citation=""),
        learned(),
        fakes.row("pid", 2e-3),
        fakes.row("inverse", 1e-3),
    ]
    found = claims.best_paper(rows)
    assert found is not None
    assert views.name_of(found) == "inverse"
    assert claims.best_paper(rows[:2]) is None
    assert claims.learned_claims(rows[:2]) == []


def test_the_likeliest_claim_comes_first() -> None:
    worse = learned(TEN * 3)
    worse["controller"]["name"] = "sac"
    found = claims.learned_claims([worse, PAPER, learned()])
    assert [views.name_of(entry.row) for entry in found] == ["ppo", "sac"]


def test_a_paper_controller_is_not_spared_for_want_of_an_audit() -> None:
    unaudited = fakes.row("inverse", 0.1e-3)
    found = claims.learned_claims([fakes.row("pid", 1e-3, audit=1.0), unaudited, learned()])
    assert found[0].paper is unaudited
    assert found[0].verdict == claims.NOT_SHOWN
