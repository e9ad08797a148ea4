"""Statistics of the diagnosis benchmark and their bounds."""

import numpy as np
import pytest
from diagnosis_fakes import counted, failed, loop, record, sample
from scipy import stats

from benchmarks.diagnosis.counts import Answer, share
from benchmarks.diagnosis.report import figures, page

# --- shares --------------------------------------------------------------------------------------


def test_300_clean_rigs_without_alarm_bound_it_at_one_percent():
    assert share([False] * 300)["upper"] < 0.01 < share([False] * 290)["upper"]
    assert share([True, *[False] * 299])["upper"] > 0.01


def test_share_of_no_cases_is_none():
    assert share([]) == {"count": 0, "n": 0, "value": None, "interval": None, "upper": None}
    assert share([True, False, True, True])["value"] == 0.75


# --- what a record says --------------------------------------------------------------------------

WORDS = ("right_first", "exact", "both", "wrong", "extra", "listed", "alarm")


@pytest.mark.parametrize(
    ("verdict", "names", "others", "holds"),
    [
        ("named", ["creep"], [], {"right_first", "exact", "both", "listed", "alarm"}),
        ("named", ["leak"], [], {"wrong", "alarm"}),
        ("named", ["creep", "leak"], [], {"right_first", "wrong", "extra", "alarm"}),
        ("named", ["leak", "creep"], [], {"wrong", "extra", "alarm"}),
        ("ambiguous", ["creep"], ["leak"], {"right_first", "both", "listed", "alarm"}),
        ("ambiguous", ["leak"], ["creep"], {"listed", "alarm"}),
        ("ambiguous", ["leak"], ["creep+leak"], {"alarm"}),
        ("unexplained", ["creep"], [], {"listed", "alarm"}),
        ("unexplained", [], [], {"alarm"}),
        ("adequate", [], [], set()),
        ("insufficient", [], [], set()),
    ],
)
def test_outcome_of_a_single_effect(verdict, names, others, holds):
    found = Answer.of(record(verdict=verdict, names=names, others=others))
    assert {word for word in WORDS if getattr(found, word)} == holds


def test_outcome_of_two_effects():
    truth = {"creep": 2.0, "leak": 1.0}
    one = Answer.of(record("pair", truth, "named", ["leak"]))
    assert one.right_first and not (one.exact or one.both or one.wrong or one.extra)
    both = Answer.of(record("pair", truth, "ambiguous", ["leak", "creep"], ["creep+slip_step"]))
    assert both.both and both.listed and not both.exact
    third = Answer.of(record("pair", truth, "named", ["leak", "creep", "slip_step"]))
    assert third.wrong and third.extra and not third.both


def test_failed_run_counts_as_wrong():
    made = figures(
        [
            failed(),
            failed("weak", {"creep": 0.2}),
            failed("loud", {"creep": 4.0}),
            failed("clean", {}),
            failed("decoy", {}),
            failed("unknown", {"vibration": 2.0}),
            failed("pair", {"creep": 2.0, "leak": 1.0}),
            failed("idle", {}),
        ]
    )
    for never in ("right_first", "exact", "loud", "unknown", "idle", "pair", "pair_exact"):
        assert counted(made[never]) == (0, 1), never
    assert counted(made["wrong"]) == (2, 2)
    assert counted(made["extra"]) == (1, 1)
    assert counted(made["false_alarms"]) == counted(made["false_names"]) == (2, 2)
    assert made["verdicts"]["creep"] == {
        **{size: {} for size in ("0.3-1", "1-2")},
        **{size: {"failed": 1} for size in ("0.1-0.3", "2-5")},
    }
    assert made["confusion"]["creep"] == {"failed": 1}
    assert len(made["failures"]) == 8 and "ValueError: no use" in made["failures"][0]
    assert "## Failed runs" in page(made, "")


# --- counts --------------------------------------------------------------------------------------


def test_counts_of_a_sample_are_complete():
    made = figures(sample())
    expected = {
        "right_first": (3, 5),
        "exact": (1, 5),
        "wrong": (3, 9),
        "wrong_first": (2, 9),
        "extra": (1, 5),
        "extra_weak": (0, 4),
        "ambiguous_with_truth": (2, 3),
        "loud": (1, 2),
        "loud_wrong": (1, 2),
        "false_alarms": (2, 4),
        "false_alarms_clean": (1, 2),
        "false_alarms_decoy": (1, 2),
        "false_names": (1, 4),
        "unknown": (1, 2),
        "idle": (1, 2),
        "pair": (2, 4),
        "pair_exact": (1, 4),
        "pair_one": (1, 4),
        "pair_wrong": (1, 4),
        "pair_first": (4, 4),
        "least_right_first": (0, 1),
    }
    assert {name: counted(made[name]) for name in expected} == expected
    assert made["least_right_first"]["name"] == "stick_slip"
    assert made["alarms"] == {"unexplained": 1, "temperature": 1}
    assert made["unknown_by_kind"]["vibration"]["others"] == {"resonance": 1}
    twos = dict.fromkeys(("clean", "decoy", "idle", "loud", "unknown"), 2)
    assert made["cases"] == {**twos, "pair": 4, "single": 5, "weak": 4}
    assert made["rule_versions"] == ["7"]


def test_verdicts_and_confusions_of_a_sample():
    made = figures(sample())
    assert made["verdicts"]["creep"]["0.1-0.3"] == {"adequate": 1}
    assert made["verdicts"]["creep"]["1-2"] == {"named": 1}
    assert made["verdicts"]["leak"] == {
        **{"0.1-0.3": {"named": 1}, "0.3-1": {"ambiguous": 1}},
        **{"1-2": {"named": 1}, "2-5": {"ambiguous": 1}},
    }
    assert made["confusion"]["leak"] == {"creep": 1, "leak": 1}
    assert made["confusion"]["stick_slip"] == {"viscous_loss": 1}
    confused = made["confused"]
    assert confused["first"][0] == ["leak", "creep", 2]
    assert ["leak", "slip_step", 2] in confused["first"]
    assert ["stick_slip", "viscous_loss", 1] in confused["first"]
    assert confused["extra"] == [["creep", "leak", 1]]
    assert ["leak", "slip_step", 2] in confused["open"] and ["leak", "creep", 2] in confused["open"]
    assert ["stick_slip", "stick_slip", 1] not in confused["open"]


def test_trace_errors_recovery_and_times_of_a_sample():
    made = figures(sample())
    assert made["trace"]["n"] == 3
    assert made["trace"]["median"] == pytest.approx(0.2)
    assert made["by_cause"]["creep"]["trace"]["median"] == pytest.approx(0.2)
    found, true = [1.8, 1.5, 3.6, 0.4], [2.0, 1.5, 3.0, 0.5]
    assert made["recovery"]["rank_correlation"] == stats.spearmanr(found, true).statistic
    assert made["recovery"]["median_ratio"] == pytest.approx(np.median(np.divide(found, true)))
    named = [one for one in sample() if one["verdict"] == "named"]
    assert counted(made["held_out"]) == (2, len(named))
    assert made["held_out_spread"]["n"] == 3
    assert made["held_out_spread"]["most"] == 1.2
    assert made["runtime_s"]["median"] == 5.0
    assert made["runtime_s"]["most"] == 9.0


def test_detection_curve_of_a_sample():
    by_size = {(c["low"], c["high"]): c for c in figures(sample())["curve"]}
    assert counted(by_size[0.2, 0.35]["detected"]) == (1, 2)
    assert counted(by_size[0.2, 0.35]["wrong"]) == (1, 2)
    assert counted(by_size[0.35, 0.6]["exact"]) == (1, 1)
    assert counted(by_size[2.2, 3.3]["right_first"]) == (1, 1)
    assert sum(c["exact"]["n"] for c in by_size.values()) == 9


def test_resolved_experiments_are_counted():
    ahead = figures(sample())["next"]
    assert (ahead["ambiguous"], ahead["promised"]) == (4, 2)
    assert counted(ahead["resolved"]) == (1, 2)
    assert counted(ahead["told_none"]) == (1, 2)
    assert ahead["unresolved"][0].endswith("after long_hold: named viscous_loss")
    broken = record(verdict="ambiguous", names=["creep"], next={"failure": "ValueError: no"})
    assert counted(figures([broken])["next"]["resolved"]) == (0, 1)
    assert "did not resolve" in page(figures([broken]), "")


def test_closed_loops_count_only_with_a_gap():
    loops = [loop(1.0, 0.6, 0.5), loop(1.0, 0.9, 0.5), loop(1.0, 1.2, 0.8), loop(1.0, 1.1, 0.9)]
    made = figures([record(names=["creep"], loop=made) for made in loops])["loop"]
    assert (made["n"], made["gap"]) == (4, 3)
    assert made["recovered"]["median"] == pytest.approx(0.2)
    assert counted(made["worse"]) == (1, 3)
    assert counted(made["worse_of_all"]) == (2, 4)
    assert made["by_cause"]["creep"]["gap"] == 3
    assert made["by_cause"]["leak"]["n"] == 0
    broken = record(names=["creep"], loop={"failure": "ValueError: no"})
    made = figures([broken])["loop"]
    assert made["failed"] == 1 and counted(made["worse"]) == (1, 1)
