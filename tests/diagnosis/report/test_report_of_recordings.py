"""Reports of real diagnoses: layout, held-out data, provenance, reasons."""

import json
from functools import cache

import jsonschema
import numpy as np
import pytest

from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import Diagnosis, diagnose
from pam_envs.plants.single_muscle.plant import SingleMuscle
from tests.diagnosis import hidden
from tests.diagnosis.conftest import needs_kernels, recorded
from tests.diagnosis.report import report_fakes as fakes
from tests.diagnosis.report.page_reader import Page

pytestmark = [needs_kernels, pytest.mark.xdist_group("reports")]  # each diagnosis is made once
CAUSES = ("leak", "temperature", "creep", "slip_step", "sensor_bias", "dead_time")


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """Return diagnoses by the effect that was hidden, each made once."""

    @cache
    def make(name: str) -> Diagnosis:
        size, folder = 0.0 if name == "none" else 4.0, tmp_path_factory.mktemp(name)
        recording, rig = recorded(folder, name, size, hidden.campaign_short(2))
        return diagnose(recording, rig=rig, causes=CAUSES, progress=False, closed_loop=False)

    return make


@pytest.mark.parametrize("name", ["temperature", "slip_step", "none"])
def test_real_report_is_valid_and_equals_written_file(diagnosed, name, tmp_path):
    found = diagnosed(name)
    assert found.causes == (() if name == "none" else (name,))
    jsonschema.validate(found.report, fakes.SCHEMA)
    found.write(tmp_path)
    assert json.loads((tmp_path / "report.json").read_text(encoding="utf-8")) == found.report
    read = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert found.text in read.text
    assert SingleMuscle.from_yaml(tmp_path / "plant.yaml").digest() == found.plant.digest()


def test_report_states_the_held_out_data(diagnosed):
    kinds, once = diagnosed("temperature"), diagnosed("slip_step")
    left = kinds.report["held_out"]
    assert left["by"] == "kinds"
    assert all(kind in kinds.text for kind in left["kinds"])
    assert set(kinds.report["error_before"]["contraction"]["kinds"]) == set(left["kinds"])
    assert left["share"] == pytest.approx(kinds.traces.held_out.mean(), abs=1e-5)
    assert once.report["held_out"] | {"share": 0.0} == {"by": "blocks", "kinds": [], "share": 0.0}
    assert "blocks of 4 s" in once.text


def test_gains_equal_held_out_error_ratios(diagnosed):
    report = diagnosed("temperature").report
    before, after = report["error_before"], report["error_after"]
    gain = sum(2.0 * np.log(before[c]["value"] / after[c]["value"]) for c in before)
    assert report["causes"][0]["gain"]["value"] == pytest.approx(gain, rel=1e-3)
    assert report["rivals"][0]["gain"] == report["causes"][0]["gain"]
    assert [r["why"] for r in report["rivals"]].count("the best") == 1
    on = {r["name"]: r["held_out"] for r in report["rivals"]}
    assert {name for name, by in on.items() if by == "blocks"} <= {"slip_step"}


def test_parameters_have_provenance(diagnosed):
    found = diagnosed("temperature")
    marks, report = found.plant.provenance, found.report
    source = report["provenance"]["recording"]["digest"][:12]
    for name in ("muscle.area", "regulator.gain", "muscle.temperature_gain"):
        assert marks[name][0] == "identified"
        assert source in marks[name][1]
    assert marks["muscle.rest_length"] == ("assumed", "declared, RIG.yaml")
    assert "published" not in {kind for kind, _ in marks.values()}


def test_rig_can_be_traced(diagnosed):
    report = diagnosed("temperature").report
    assert report["provenance"]["rig"]["source"].endswith("rig.yaml")
    rig = Rig(repeats=(("a", "b"),), tolerance={"mass.load": 0.02})
    assert rig.digest == Rig(repeats=(("a", "b"),), tolerance={"mass.load": 0.02}).digest
    assert len({Rig().digest, rig.digest, Rig(rezeroed=True).digest}) == 3


def test_missing_closed_loop_comparison_has_a_reason(diagnosed, tmp_path):
    assert diagnosed("temperature").report["closed_loop_reason"] == "it was not requested"
    recording, rig = recorded(tmp_path, "slip_step", 4.0, hidden.campaign_short(2))
    found = diagnose(recording, rig=rig, causes=CAUSES, progress=False)
    assert found.report["closed_loop"] is None
    assert "cannot compensate slip_step" in found.report["closed_loop_reason"]
