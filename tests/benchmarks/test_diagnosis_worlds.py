"""Study over worlds: cases, statistics, page."""

import json
from collections import Counter
from typing import Any

import numpy as np
import pytest
from diagnosis_fakes import counted, record

from benchmarks.diagnosis.cases import LACKING, STRONG, Case, Unmade, make
from benchmarks.diagnosis.counts import Answer
from benchmarks.diagnosis.run import Options, select
from benchmarks.diagnosis.sources import HELD_OUT, TUNED, WORLDS, deserved, draw_rig
from benchmarks.diagnosis.study import COMMON, needs_oracle
from benchmarks.diagnosis.worlds.counts import figures, over_oracle
from benchmarks.diagnosis.worlds.draws import LATE, cases
from benchmarks.diagnosis.worlds.page import page, targets, write
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.hidden import EFFECTS

OURS, THEIRS = TUNED[0], HELD_OUT[0]
NATURE = ["static_law", "hysteresis_shape"]


def of_world(world: str = OURS, kind: str = "single", truth: Any = None, **more: Any) -> dict:
    """Return a record of a rig of a world."""
    made = record(kind, truth, **more)
    made["case"]["world"] = world
    return {"nature": NATURE, **made}


# --- cases ---------------------------------------------------------------------------------------


def test_every_world_has_every_effect_four_times_and_fifty_clean_rigs():
    drawn = cases()
    assert len({case.seed for case in drawn}) == len(drawn)
    single = Counter((case.world, *case.names) for case in drawn if case.kind == "single")
    assert single == {(world, name): 4 for world in WORLDS for name in EFFECTS}
    kinds = Counter((case.world, case.kind) for case in drawn)
    number = {"clean": 50, "pair": 10, "triple": 10, "unknown": 6, "clock": 5, "untestable": 8}
    assert all(kinds[world, kind] == n for world in WORLDS for kind, n in number.items())
    assert all(1.0 <= size <= 5.0 for case in drawn for size in case.sizes)
    assert all(len(set(c.names)) == 3 == len(c.sizes) for c in drawn if c.kind == "triple")
    late = [case.late for case in drawn if case.kind == "clock"]
    assert sorted(set(late)) == sorted(LATE) and len(late) == 5 * len(WORLDS)
    lacking = {case.names[0] for case in drawn if case.kind == "untestable"}
    assert lacking == set(LACKING)


def test_part_of_the_study_has_the_cases_of_the_whole():
    whole = set(cases())
    few = cases(each={"single": 1, "clean": 6})
    assert set(few) <= whole
    number = {"single": len(WORLDS) * len(EFFECTS), "clean": 6 * len(WORLDS)}
    assert Counter(case.kind for case in few) == number
    chosen = select(Options("worlds", kinds=("clean",), worlds=(THEIRS,)))
    assert len(chosen) == 50 and {case.world for case in chosen} == {THEIRS}
    assert not {case.seed for case in cases(1)} & {case.seed for case in whole}
    with pytest.raises(ValueError, match="--each is for the set worlds"):
        select(Options("small", each={"single": 2}))
    with pytest.raises(ValueError, match=r"--each clean 51: there are .*clean \(at most 50\)"):
        select(Options("worlds", each={"clean": 51}))
    with pytest.raises(ValueError, match="no world is called 'mars'"):
        select(Options("worlds", worlds=("mars",)))


def test_a_third_of_the_worlds_is_held_out():
    assert len(HELD_OUT) == 7 and len(TUNED) == 14
    assert {*HELD_OUT, *TUNED} == set(WORLDS)


@needs_kernels
def test_late_readings_are_those_of_the_same_rig_some_rows_before():
    world = WORLDS[0]
    early, late = (
        make(Case("clock", 71, campaign="short", world=world, late=rows)) for rows in (-2.0, 2.0)
    )
    one, two = (made.ground.clean[:, 100:-100] for made in (early, late))
    apart = np.abs(one[:, 4:] - two[:, :-4]).max(axis=1)  # readings that are taken later are ahead
    assert np.all(apart < 1e-9 * np.abs(one).max(axis=1))
    assert early.recording.command.tolist() == late.recording.command.tolist()
    assert early.sheet.clock_tolerance is None


@needs_kernels
@pytest.mark.parametrize("name", LACKING)
def test_recording_of_an_untestable_effect_lacks_its_experiment(name, monkeypatch):
    from benchmarks.diagnosis import cases as drawing
    from pam_envs.diagnosis.audit.audit import undecidable

    monkeypatch.setattr(drawing, "solve", lambda ground, effect, size: (3.0, ground.clean))
    monkeypatch.setattr(drawing, "ground_of", _clean_ground)
    made = make(Case("untestable", 72, (name,), (2.0,), campaign="short", world=WORLDS[0]))
    assert name in undecidable(made.recording, made.sheet)
    assert "creep" not in undecidable(made.recording, made.sheet)


def _clean_ground(case: Case, base: Any, campaign: Any) -> Any:
    from benchmarks.diagnosis.cases import Ground
    from benchmarks.diagnosis.sources import outputs_of

    clean = outputs_of(base, [], campaign)
    return Ground(base, campaign, clean, None)


def test_effect_that_never_reaches_its_size_is_unmade(monkeypatch):
    from benchmarks.diagnosis import cases as drawing

    monkeypatch.setattr(drawing, "solve", lambda ground, effect, size: None)
    monkeypatch.setattr(drawing, "ground_of", _clean_ground)
    with pytest.raises(Unmade, match="too small on all of 12 drawn rigs"):
        make(Case("single", 73, ("creep",), (2.0,), campaign="short", world=WORLDS[0]))
    made = make(Case("untestable", 73, ("leak",), (2.0,), campaign="short", world=WORLDS[0]))
    assert made.effects[0][1] == STRONG


def test_rig_deserves_a_rate_limit_only_if_it_has_one():
    rate = draw_rig("sine_maxwell_slip_rate_limit", np.random.default_rng(1))
    lag = draw_rig("exponential_pressure_play_lag", np.random.default_rng(1))
    assert {"static_law", "hysteresis_shape"} <= set(deserved(rate)) & set(deserved(lag))
    assert "slew_limit" in deserved(rate) and "slew_limit" not in deserved(lag)


# --- counts --------------------------------------------------------------------------------------


def test_names_by_nature_are_left_out_unless_hidden():
    found = Answer.of(of_world(names=["static_law", "creep"]))
    assert found.right_first and found.exact and not found.extra
    clean = Answer.of(of_world(kind="clean", truth={}, names=["static_law"]))
    assert clean.verdict == "adequate" and not clean.claims
    hidden = Answer.of(of_world(truth={"hysteresis_shape": 2.0}, names=["hysteresis_shape"]))
    assert hidden.exact
    wrong = Answer.of(of_world(kind="clean", truth={}, names=["static_law", "leak"]))
    assert wrong.claims and wrong.first == "leak"
    doubt = Answer.of(
        of_world(kind="clean", truth={}, verdict="ambiguous", names=["static_law"], others=["leak"])
    )
    assert not doubt.claims and doubt.verdict == "ambiguous"


def test_held_out_worlds_are_counted_apart():
    records = [
        of_world(OURS, names=["creep"]),
        of_world(OURS, names=["leak"]),
        of_world(THEIRS, names=["creep", "slip_step"]),
        of_world(THEIRS, "clean", {}, names=["sensor_drift"]),
        of_world(OURS, "clean", {}, verdict="adequate"),
        of_world(OURS, "clock", {}, names=["resonance"]),
        of_world(OURS, "clock", {}, names=["static_law"]),
        of_world(OURS, "untestable", {"leak": 2.0}, names=["supply_droop"], truths=[{"raw": 3.0}]),
        of_world(OURS, "untestable", {"leak": 2.0}, names=["supply_droop"], truths=[{"raw": 0.3}]),
        of_world(
            *(OURS, "untestable", {"leak": 2.0}),
            **{"verdict": "ambiguous", "names": ["supply_droop"], "truths": [{"raw": 3.0}]},
        ),
        of_world(OURS, "triple", {"creep": 2.0, "leak": 2.0, "slip_step": 2.0}, names=["creep"]),
        {**of_world(THEIRS), "unmade": True, "failure": "Unmade: too small"},
    ]
    made = figures(records)
    ours, theirs = made["groups"]["tuned"], made["groups"]["held_out"]
    assert counted(ours["right_first"]) == (1, 2) and counted(theirs["right_first"]) == (1, 1)
    assert counted(ours["extra"]) == (0, 2) and counted(theirs["extra"]) == (1, 1)
    assert counted(ours["false_names"]) == (0, 1) and counted(theirs["false_names"]) == (1, 1)
    assert counted(ours["clock_delays"]) == (1, 2)
    assert counted(ours["untestable"]) == (1, 2) and made["invisible"] == 1
    assert counted(ours["triple"]) == (0, 1)
    assert ours["least_world"]["name"] == OURS
    assert made["unmade"] == {"creep": 1}
    assert counted(made["worlds"][THEIRS]["exact"]) == (0, 1)
    assert made["causes"]["creep"]["all"]["mistaken"] == {"leak": 1}
    rows = {row[0]: row[1:] for row in targets(made, "held_out")}
    assert rows["false alarm: a wrong name on a clean rig"][2:] == (1, False)
    assert rows["two effects: both"][1:] == ("not run", 0, None)
    text = page(made, "--chosen worlds")
    assert "**missed**" in text and f"**`{THEIRS}`**" in text and f"| `{OURS}`" in text


def test_oracle_is_the_same_model_unless_the_names_differ():
    held = {"error_before": {}, "error_after": {"contraction": 1.2, "pressure": 1.0}}
    same = of_world(names=["creep", COMMON[0]], held_out=held)
    assert not needs_oracle(same) and over_oracle(Answer.of(same)) == 1.0
    other = of_world(names=["leak"], held_out=held)
    assert needs_oracle(other) and over_oracle(Answer.of(other)) is None
    other["oracle"] = {"held_out": {"error_after": {"contraction": 1.0, "pressure": 0.9}}}
    assert over_oracle(Answer.of(other)) == pytest.approx(1.2)
    doubt = of_world(verdict="ambiguous", names=["leak"], held_out=held)
    assert not needs_oracle(doubt) and over_oracle(Answer.of(doubt)) is None
    assert figures([same, other])["groups"]["tuned"]["oracle"]["median"] == pytest.approx(1.1)


def test_same_records_give_same_files(tmp_path):
    records = [of_world(names=["creep"]), of_world(THEIRS, "clean", {}, verdict="adequate")]
    one, two = (write(records, tmp_path / name, "--chosen worlds") for name in "ab")
    assert [path.name for path in one] == ["diagnosis_worlds.md", "diagnosis_worlds.json"]
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]
    assert len(json.loads(one[1].read_text())["cases"]) == 2


class Flat:
    """Problem whose residuals are in the order of the samples."""

    @staticmethod
    def vectors(rows):
        return np.asarray(rows)

    @staticmethod
    def rows(vector):
        return np.reshape(vector, (2, -1))


def test_refit_absorbs_what_other_differences_of_the_base_can_make():
    """A hidden effect may call for a difference that the clean rig did not need."""
    from benchmarks.diagnosis.absorbed import Absorbed

    rng = np.random.default_rng(3)
    base, friction, own = rng.normal(size=(3, 80))
    twice = np.stack([friction, friction, np.zeros(80)])  # spans one direction
    found = Absorbed(Flat(), base[None], {"hysteresis_drive": twice})
    trace = 2.0 * base + 3.0 * friction + own
    both = found.left(trace.reshape(2, -1), "stick_slip").ravel()
    alone = found.left(trace.reshape(2, -1), "hysteresis_drive").ravel()
    assert both @ base == pytest.approx(0.0, abs=1e-9)
    assert both @ friction == pytest.approx(0.0, abs=1e-9)
    assert alone @ base == pytest.approx(0.0, abs=1e-9)
    assert abs(alone @ friction) > 3.0


def test_refit_absorbs_one_offset_of_the_clock():
    from benchmarks.diagnosis.absorbed import Absorbed

    rng = np.random.default_rng(4)
    base, early, late = rng.normal(size=(3, 80))
    found = Absorbed(Flat(), base[None], {}, [early, late])
    assert np.abs(found.left((late + 2.0 * base).reshape(2, -1))).max() < 1e-9
    both = found.left((early + late).reshape(2, -1)).ravel()
    assert np.linalg.norm(both) > 0.8 * min(np.linalg.norm(early), np.linalg.norm(late))


def test_zero_and_parallel_rows_add_nothing_to_an_orthonormal_basis():
    from benchmarks.diagnosis.absorbed import orthonormal

    rows = np.random.default_rng(5).normal(size=(3, 50))
    basis = orthonormal(np.vstack([rows, 1e-6 * rows[:2], np.zeros((4, 50))]))
    assert basis.shape == (3, 50)
    assert basis @ basis.T == pytest.approx(np.eye(3), abs=1e-9)
