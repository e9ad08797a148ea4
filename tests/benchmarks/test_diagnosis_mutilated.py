"""Mutilated recordings end in a report or in a clear error."""

import json

import numpy as np
import pytest

from benchmarks.diagnosis import mutilated
from benchmarks.diagnosis.cases import Case
from benchmarks.diagnosis.run import Options, run
from tests.diagnosis.conftest import needs_kernels

SEED = 91_000_000
"""No set of the benchmark has such seeds."""
WAYS = [(way,) for way in mutilated.SPOILS if way != "wrong_rig"]
STAGE = ("no_controllers",)


@pytest.fixture(autouse=True)
def short_diagnosis(monkeypatch):
    """Try two causes only, which takes a tenth of the time."""
    whole = mutilated.diagnose

    def quick(data, **more):
        return whole(data, causes=["creep", "leak"], **more)

    monkeypatch.setattr(mutilated, "diagnose", quick)


@needs_kernels
@pytest.mark.filterwarnings("default")  # extreme values overflow
@pytest.mark.parametrize("names", [*WAYS, STAGE], ids="+".join)
def test_spoiled_recording_is_reported_or_refused_with_a_remedy(names):
    made = mutilated.study(Case("mutilated", SEED, names, campaign="short"))
    assert made["failure"] is None
    assert made["outcome"] in ("report", "refused"), made["message"]
    if names == STAGE:
        assert made["outcome"] == "report"


def test_set_spoils_every_way_alone_and_in_pairs_and_fails_every_stage():
    drawn = mutilated.cases()
    assert len(drawn) == mutilated.NUMBER == len({case.seed for case in drawn})
    alone = {case.names[0] for case in drawn if len(case.names) == 1}
    assert alone == {*mutilated.SPOILS, *mutilated.STAGES}
    assert sum(len(set(case.names)) == 2 for case in drawn) > 200
    assert mutilated.cases(1)[0].seed not in {case.seed for case in drawn}


@pytest.mark.parametrize("way", mutilated.SPOILS)
def test_every_way_changes_the_files(way, tmp_path):
    texts = []
    for names in ((), (way,)):
        paths = mutilated.files(Case("mutilated", SEED + 1, names, campaign="short"), tmp_path)
        texts.append([path.read_text() for path in paths])
    assert texts[0] != texts[1]


def test_lost_reports_are_counted_and_listed(tmp_path):
    def act(case, stages):
        record = {"schema": 1, "case": case.record(), "failure": None, "volatile": {}}
        if case.names == ("no_plans",):
            return {**record, "failure": "RuntimeError: no_plans fails"}
        return {**record, "outcome": "report", "message": "named"}

    options = Options("mutilated", names=("no_plans", "no_experiment"), folder=tmp_path)
    report = run(options, act=act)
    made = mutilated.figures(report.records)
    n = sum(case.names == ("no_plans",) for case in mutilated.cases())
    assert made["lost"]["count"] == made["stages_lost"]["count"] == n > 0
    assert made["lost"]["n"] == len(report.records)
    text = mutilated.page(made, options.arguments)
    assert "**missed**" in text and "no_plans: RuntimeError: no_plans fails" in text
    paths = mutilated.write(report.records, tmp_path / "page")
    assert json.loads(paths[1].read_text())["figures"]["by_way"]["no_plans"] == {"lost": n}


def test_extreme_values_are_written_as_numbers(tmp_path):
    case = Case("mutilated", SEED + 2, ("extremes",), campaign="short")
    path, _ = mutilated.files(case, tmp_path)
    cells = [cell for row in path.read_text().splitlines()[1:] for cell in row.split(",")]
    numbers = [float(cell) for cell in cells if cell and not cell[0].isalpha()]
    assert np.abs(numbers).max() > 900.0 or "inf" in path.read_text()
