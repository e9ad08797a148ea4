"""Verdicts on a fixed sample of rigs with and without hidden effects."""

import os
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import pytest

from benchmarks.diagnosis.cases import Case, make
from benchmarks.diagnosis.study import diagnosed, study
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.hidden import EFFECTS

pytestmark = [
    needs_kernels,
    pytest.mark.xdist_group("hidden effects"),  # one process makes the sample
    pytest.mark.timeout(2700),  # the first test waits for all of it
]

SIZE = 3.0
SEED = 41_000_000
"""The first of the sample, chosen before any was run; no set of the benchmark has such seeds."""
SAMPLED = (
    *("creep", "leak", "dead_time", "slew_limit", "sensor_bias", "viscous_loss", "temperature"),
    *("threshold_pressure", "resonance", "slip_step", "supply_droop"),
)
REST = [name for name in EFFECTS if name not in SAMPLED]
NOT_FOUND = "stick_slip"
"""A fit by least squares cannot hold the phase of many small slips."""
SINGLE = [
    *(Case("single", SEED + k, (name,), (SIZE,)) for k, name in enumerate(SAMPLED)),
    *(Case("single", SEED + 50 + k, (name,), (SIZE,)) for k, name in enumerate(REST)),
]
FAINT = [
    Case("weak", SEED + 80, ("leak",), (0.15,)),
    Case("weak", SEED + 81, ("viscous_loss",), (0.15,)),
]
IDLE = Case("idle", SEED + 82, campaign="idle")
ADEQUATE = [Case("clean", SEED + 20), Case("clean", SEED + 21), Case("decoy", SEED + 22)]
PAIR = Case("pair", SEED + 30, ("creep", "exhaust_asymmetry"), (SIZE, SIZE))
UNKNOWN = Case("unknown", SEED + 40, ("vibration",), (SIZE,))


Records = Mapping[Case, dict[str, Any]]


@pytest.fixture(scope="module")
def records():
    """Study of every case of the sample, two at a time."""
    chosen = [*SINGLE, *ADEQUATE, *FAINT, PAIR, UNKNOWN, IDLE]
    with ProcessPoolExecutor(min(2, os.cpu_count() or 1), get_context("spawn")) as pool:
        return dict(zip(chosen, pool.map(study, chosen), strict=True))


def one(case: Case) -> Any:
    """Return a case as a parameter; an effect that is known not to be found fails strictly."""
    missed = pytest.mark.xfail(reason="stick-slip of this form is left unexplained", strict=True)
    marks = [missed] if case.names[0] == NOT_FOUND else []
    return pytest.param(case, id=case.names[0], marks=marks)


@pytest.mark.parametrize("case", [one(case) for case in SINGLE])
def test_hidden_effect_is_named_first(case, records):
    found = records[case]
    assert found["failure"] is None
    assert found["truths"][0]["size"] == pytest.approx(SIZE, rel=0.05)
    assert found["verdict"] in ("named", "ambiguous")
    assert found["names"][0] == case.names[0]
    before, after = (found["held_out"][f"error_{when}"] for when in ("before", "after"))
    assert max(before[name] / after[name] for name in after) > 1.2


@pytest.mark.parametrize("case", ADEQUATE, ids=lambda case: f"{case.kind}-{case.seed - SEED}")
def test_clean_rig_is_adequate(case, records):
    found = records[case]
    assert found["failure"] is None
    assert (found["verdict"], found["names"]) == ("adequate", [])


@pytest.mark.parametrize("case", FAINT, ids=lambda case: case.names[0])
def test_effect_below_noise_is_not_misnamed(case, records):
    found = records[case]
    assert found["failure"] is None
    assert found["verdict"] in ("adequate", "named", "ambiguous")
    assert found["verdict"] == "adequate" or found["names"] == list(case.names)


def test_recording_without_motion_is_insufficient(records):
    found = records[IDLE]
    assert (found["verdict"], found["names"]) == ("insufficient", [])


def test_wrong_base_parameter_is_calibrated_not_named():
    made = make(Case("decoy", SEED + 22))
    found = diagnosed(made.recording, made.sheet)
    calibrated = {entry["name"]: entry for entry in found.report["calibration"]}
    lag = calibrated["regulator.time_constant"]
    assert abs(made.ground.base.lag / lag["before"] - 1.0) > 0.15
    assert lag["after"] == pytest.approx(made.ground.base.lag, rel=0.1)
    assert found.verdict == "adequate"
    assert not found.causes


def test_two_hidden_effects_are_named(records):
    found = records[PAIR]
    assert found["failure"] is None
    assert found["verdict"] in ("named", "ambiguous")
    assert set(found["names"]) == set(PAIR.names)


def test_effect_outside_catalogue_is_unexplained(records):
    found = records[UNKNOWN]
    assert found["failure"] is None
    assert found["verdict"] == "unexplained"


def test_sample_is_computed_in_one_process(request):
    if not request.config.getoption("loadgroup", False):
        pytest.skip("the tests are not spread over processes by group")
    assert request.node.nodeid.endswith("@hidden effects")
