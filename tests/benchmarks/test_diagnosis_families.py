"""Study over families: cases, one case, statistics, page."""

import json
from collections import Counter
from typing import Any

import pytest
from diagnosis_fakes import counted, record

from benchmarks.diagnosis.cases import Case, Unmade
from benchmarks.diagnosis.families import study as studying
from benchmarks.diagnosis.families.cases import BY_NATURE, PLACES, cases, effects_of
from benchmarks.diagnosis.families.page import figures, page, write
from benchmarks.diagnosis.run import Options, Task, select

JOINT, KNEE = "antagonistic_joint.braid", "knee_orthosis.exponential"


def of_place(place: str, kind: str = "single", truth: Any = None, **more: Any) -> dict:
    """Return a record of a rig of a family in a world."""
    made = record(kind, truth, **more)
    made["case"]["world"] = place
    return {"nature": list(BY_NATURE), **made}


def test_every_place_has_every_effect_ten_times_and_fifty_clean_rigs():
    drawn = cases()
    single = Counter((case.world, *case.names) for case in drawn if case.kind == "single")
    expected = {(p, name): 10 for p in PLACES for name in effects_of(p.partition(".")[0])}
    assert single == expected
    assert Counter(c.world for c in drawn if c.kind == "clean") == dict.fromkeys(PLACES, 50)
    assert all(1.0 <= size <= 5.0 for case in drawn for size in case.sizes)
    assert "unequal_muscles" not in effects_of("knee_orthosis")
    assert "viscous_loss" in effects_of("knee_orthosis")
    assert "viscous_loss" not in effects_of("antagonistic_joint")  # of its base
    seeds = {place: {c.seed for c in drawn if c.world == place} for place in PLACES}
    assert sum(len(own) for own in seeds.values()) == len(set().union(*seeds.values()))
    assert not {case.seed for case in cases(1)} & set().union(*seeds.values())


def test_part_of_the_study_has_the_cases_of_the_whole():
    few = select(Options("families", kinds=("clean",), worlds=(JOINT,), each={"clean": 3}))
    assert len(few) == 3 and set(few) <= set(cases())
    assert len({Task(case, "verdict").key for case in few}) == 3
    with pytest.raises(ValueError, match=r"--each pair 1: there are single \(at most 10\)"):
        cases(each={"pair": 1})


def test_failed_and_unmade_cases_are_recorded(monkeypatch):
    def refuse(*_: Any) -> Any:
        raise Unmade("too small")

    monkeypatch.setattr(studying, "ground_of", refuse)
    made = studying.study(Case("single", 1, ("creep",), (2.0,), world=JOINT))
    assert made["unmade"] and made["failure"] == "Unmade: too small"
    monkeypatch.setattr(studying, "recorded", lambda *_: 1 / 0)
    made = studying.study(Case("clean", 1, world=JOINT))
    assert not made["unmade"] and made["failure"].startswith("ZeroDivisionError")


def test_families_are_counted_apart_and_names_by_nature_left_out(tmp_path):
    records = [
        of_place(JOINT, names=["static_law", "creep"]),
        of_place(JOINT, names=["leak"]),
        of_place(JOINT, "clean", {}, names=["static_law"]),
        of_place(JOINT, "clean", {}, verdict="unexplained"),
        of_place(KNEE, "clean", {}, names=["leak"]),
        {**of_place(KNEE), "unmade": True, "failure": "Unmade: too small"},
    ]
    made = figures(records)
    joint, knee = (made["families"][p.partition(".")[0]] for p in (JOINT, KNEE))
    assert counted(joint["right_first"]) == (1, 2) and counted(joint["wrong"]) == (1, 2)
    assert counted(joint["false_names"]) == (0, 2)
    assert counted(joint["unexplained_clean"]) == (1, 2)
    assert counted(knee["false_names"]) == (1, 1) and knee["alarms"] == {"leak": 1}
    assert made["unmade"] == {f"{KNEE} creep": 1}
    text = page(made, "--chosen families")
    assert f"| `{JOINT}`" in text and "`leak` 1" in text
    one, two = (write(records, tmp_path / name, "--chosen families") for name in "ab")
    assert [path.name for path in one] == ["diagnosis_families.md", "diagnosis_families.json"]
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]
    assert len(json.loads(one[1].read_text())["cases"]) == 5
