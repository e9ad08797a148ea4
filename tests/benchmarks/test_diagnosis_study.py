"""Diagnosis benchmark: cases, resumed runs, studies."""

import json
import os
from collections.abc import Collection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnosis_fakes import counted, loop, record
from joblib.externals.loky import get_reusable_executor

from benchmarks.diagnosis import run as diagnosis
from benchmarks.diagnosis import study as diagnosis_study
from benchmarks.diagnosis.cases import NOISE, Case, cases, make
from benchmarks.diagnosis.next import DrivenRig, OracleRig
from benchmarks.diagnosis.report import figures
from benchmarks.diagnosis.run import Options, run, select
from benchmarks.diagnosis.study import study, trace_errors
from benchmarks.runs.runner import Computing
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.closed_loop.gain import COMPENSABLE
from pam_envs.diagnosis.decide.rule import Rule
from tests.diagnosis import hidden

ROOT = Path(__file__).resolve().parents[2]

# --- which cases ---------------------------------------------------------------------------------


def test_kinds_and_causes_are_mixed():
    chosen = select(Options("tune"))
    assert sorted(case.seed for case in chosen) == sorted(case.seed for case in cases("tune"))
    half = chosen[: len(chosen) // 2]
    assert {case.kind for case in half} == {case.kind for case in chosen}
    assert select(Options("tune")) == chosen


def test_kinds_and_names_are_chosen_and_wrong_ones_refused():
    chosen = select(Options("tune", kinds=("single", "pair"), names=("creep",)))
    assert {case.kind for case in chosen} == {"single", "pair"}
    assert all("creep" in case.names for case in chosen)
    with pytest.raises(ValueError, match="no kind is called 'double'"):
        select(Options(kinds=("double",)))
    with pytest.raises(ValueError, match="no effect is called 'magic'"):
        select(Options(names=("magic",)))


def test_options_reproduce_the_command_arguments():
    options = Options("tune", 3, ("single",), ("creep", "leak"), 2, True)
    assert options.arguments == (
        "--chosen tune --offset 3 --kind single --name creep leak --loops 2 --next"
    )
    assert Options("final").whole and not options.whole


# --- runs ----------------------------------------------------------------------------------------


def answer(case: Case, stages: Collection[str]) -> dict[str, Any]:
    """Answer as a study does; the first weak ones fail."""
    made = record(
        case.kind,
        dict(zip(case.names, case.sizes, strict=True)),
        "ambiguous" if case.kind == "pair" else "named",
        case.names,
        experiment={"name": "long_hold", "separation": 2.0, "enough": case.seed % 2 == 0},
    )
    made["case"] = case.record()
    if "next" in stages:
        made["next"] = {"plan": "long_hold", "verdict": "named", "names": list(case.names)}
    if "loop" in stages:
        made["loop"] = loop(1.0, 0.5, 0.4)
    if case.kind == "decoy":
        made = {"case": case.record(), "failure": "ValueError: no", "volatile": {}}
    return made


class Counting:
    """Answers as a study does, with a record of the requests."""

    def __init__(self) -> None:
        self.asked: list[tuple[Case, str]] = []

    def __call__(self, case: Case, stages: Collection[str]) -> dict[str, Any]:
        (stage,) = stages
        self.asked.append((case, stage))
        return answer(case, stages)


def test_run_resumes_after_interruption(tmp_path):
    class Stopped(BaseException):
        pass

    def stopping(case: Case, stages: Collection[str]) -> dict[str, Any]:
        if len(list(tmp_path.glob("*.json"))) == 10:
            raise Stopped
        return answer(case, stages)

    options = Options(folder=tmp_path)
    with pytest.raises(Stopped):
        run(options, act=stopping)
    counting, ticks = Counting(), []
    report = run(options, lambda total: lambda: ticks.append(total), act=counting)
    total = len(cases("small"))
    assert (report.found, report.computed) == (10, total - 10)
    assert len(counting.asked) == len(ticks) == total - 10
    assert [r["case"]["seed"] for r in report.records] == [c.seed for c in cases("small")]
    again = Counting()
    assert run(options, act=again).records == report.records
    assert again.asked == []
    assert run(Options(folder=tmp_path, force=True), act=again).computed == total


def test_failed_case_is_stored_and_counts_as_wrong(tmp_path):
    report = run(Options(kinds=("decoy",), folder=tmp_path), act=answer)
    assert len(report.failed) == 2 and report.failed[0].endswith(": ValueError: no")
    assert counted(figures(report.records)["false_alarms"]) == (2, 2)


def test_corrupt_record_is_recomputed(tmp_path):
    options = Options(kinds=("pair",), folder=tmp_path)
    before = run(options, act=answer).records
    sorted(tmp_path.glob("*.json"))[0].write_text("{}")
    report = run(options, act=answer)
    assert (report.computed, len(report.quarantined)) == (1, 1)
    assert report.records == before


def test_records_belong_to_the_numbers_of_rule_and_causes(tmp_path, monkeypatch):
    options = Options(kinds=("pair",), folder=tmp_path)
    run(options, act=answer)
    known = diagnosis.engine_digest()
    diagnosis.engine_digest.cache_clear()
    assert diagnosis.engine_digest() == known
    for name, value in (
        ("Rule", lambda: Rule(doubt=0.06)),
        ("catalogue", lambda: catalogue()[1:]),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(diagnosis, name, value)
            diagnosis.engine_digest.cache_clear()
            assert diagnosis.engine_digest() != known
            assert run(options, act=answer).computed == 2
    diagnosis.engine_digest.cache_clear()
    assert run(options, act=answer).computed == 0


def test_closed_loops_and_experiments_run_for_their_cases(tmp_path, monkeypatch):
    monkeypatch.setattr(diagnosis, "cases", lambda *_: cases("tune")[::10])
    counting = Counting()
    options = Options("tune", folder=tmp_path, loops=2, next=True)
    report = run(options, act=counting)
    looped = [case for case, stage in counting.asked if stage == "loop"]
    shown = set(COMPENSABLE) & set(hidden.EFFECTS)  # a static law differs by nature
    assert {case.names[0] for case in looped} == shown
    assert len(looped) == 2 * len(shown)
    ahead = [case for case, stage in counting.asked if stage == "next"]
    pairs = [case for case in select(options) if case.kind == "pair"]
    assert ahead and set(ahead) == {case for case in pairs if case.seed % 2 == 0}
    made = figures(report.records)
    assert made["loop"]["n"] == len(looped)
    assert counted(made["next"]["resolved"]) == (len(ahead), len(ahead))


def test_failed_closed_loop_keeps_verdict(tmp_path):
    def failing(case: Case, stages: Collection[str]) -> dict[str, Any]:
        return {**answer(case, stages), "failure": "no loop" if "loop" in stages else None}

    options = Options(kinds=("single",), names=("creep",), folder=tmp_path, loops=1)
    (made,) = run(options, act=failing).records
    assert made["failure"] is None and made["loop"] == {"failure": "no loop"}


def deadly(case: Case, stages: Collection[str]) -> dict[str, Any]:
    """Kill the worker on one case."""
    if case.names == ("leak",):
        os._exit(3)
    return answer(case, stages)


def test_case_that_kills_its_worker_is_recorded_as_failed(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(Path(__file__).parent)]))
    get_reusable_executor().shutdown(wait=True)
    options = Options(
        kinds=("single",), names=("creep", "leak"), folder=tmp_path, computing=Computing(jobs=2)
    )
    report = run(options, act=deadly)
    get_reusable_executor().shutdown(wait=True)
    assert [bool(record["failure"]) for record in report.records] == [False, True]
    assert "its worker died 3 times" in report.failed[0]


# --- a study -------------------------------------------------------------------------------------


def test_impossible_case_is_a_failed_record(monkeypatch):
    def never(case: Case) -> None:
        raise ValueError("on none can the effect be so large")

    monkeypatch.setattr(diagnosis_study, "make", never)
    case = Case("single", 3, ("creep",), (2.0,))
    made = study(case, ("verdict", "next", "loop"))
    assert made["failure"] == "ValueError: on none can the effect be so large"
    assert made["case"] == json.loads(json.dumps(case.record()))
    with pytest.raises(ValueError, match="no stage is called 'loops'"):
        study(case, ("loops",))


def test_traces_are_compared_on_the_output_with_the_largest_effect():
    rng = np.random.default_rng(0)
    true = np.stack(
        [0.1 * NOISE[0] * rng.standard_normal(400), NOISE[1] * rng.standard_normal(400)]
    )
    constant = np.ones((2, 1)) * NOISE[:, None]

    def left(trace: np.ndarray, name: str) -> np.ndarray:
        assert name == "creep"
        rows = trace / NOISE[:, None]
        return rows - rows.mean(axis=1, keepdims=True)

    found = 0.8 * true + 5.0 * constant  # the base can take up a constant
    effects = {"creep": {"contraction": found[0], "pressure": found[1]}}
    made = SimpleNamespace(
        ground=SimpleNamespace(left=left),
        truths=(
            SimpleNamespace(name="creep", trace=true),
            SimpleNamespace(name="leak", trace=true),
        ),
    )
    errors = trace_errors(
        made, SimpleNamespace(causes=("creep",), traces=SimpleNamespace(effects=effects))
    )
    assert set(errors) == {"creep"}
    assert errors["creep"]["output"] == "pressure"
    assert errors["creep"]["error"] == pytest.approx(0.2)
    assert errors["creep"]["found"] == pytest.approx(0.8 * errors["creep"]["true"])
    assert errors["creep"]["found_raw"] > 4.0


@pytest.mark.parametrize("name", ["creep", "dead_time", "sensor_delay"])
def test_oracle_equals_the_driven_rig_without_noise(name):
    effect = hidden.draw_effect(name, np.random.default_rng(1))
    base = hidden.draw_base(np.random.default_rng(3))
    ground = SimpleNamespace(base=base)
    made = SimpleNamespace(ground=ground, effects=[(effect, 3.0)], noise=NOISE)
    rig, oracle = DrivenRig(made, 30.0, 24.0), OracleRig(made, 30.0, 24.0)
    commands = np.repeat(np.random.default_rng(0).uniform(0.0, 5e5, 6), 30)
    ahead = oracle.try_ahead(np.stack([commands, 0.5 * commands], axis=1), len(commands))
    assert oracle.position == 0.0
    together = oracle.batch(2)
    rows = []
    for command in commands:
        reading, pressure = rig.step(command)
        rows.append([reading - oracle.step(command)[0], pressure, rig.position])
        together.step([command, 0.5 * command])
        assert oracle.position == rig.position
    apart, pressures, positions = np.array(rows).T
    assert np.array_equal(ahead[:, 0], positions)
    assert together.position == pytest.approx([positions[-1], ahead[-1, 1]])
    assert np.ptp(positions) > 1e-3 and pressures.max() > 1e5
    assert np.std(apart) == pytest.approx(NOISE[0], rel=0.5)
    rig.reset(1)
    oracle.reset(None)
    assert rig.position == oracle.position == 0.0


@pytest.mark.parametrize("seconds", [30.0, 60.0])
def test_brief_recording_is_the_start_of_a_whole_one(seconds):
    brief = make(Case("brief", 11, campaign="short", seconds=seconds))
    whole = make(Case("clean", 11, campaign="short"))
    n = len(brief.recording.time)
    assert n == round(seconds / brief.recording.period)
    assert brief.recording.command.tolist() == whole.recording.command[:n].tolist()
    assert not brief.truths
    assert {label for group in brief.sheet.repeats for label in group} <= set(
        brief.recording.segments
    )
