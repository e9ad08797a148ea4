"""Verdicts on a fixed sample of rigs with and without hidden effects."""

import os
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import pytest

from benchmarks.diagnosis.cases import Case
from benchmarks.diagnosis.study import study
from tests.diagnosis.conftest import needs_kernels

pytestmark = [
    needs_kernels,
    pytest.mark.xdist_group("hidden effects"),  # one process makes the sample
    pytest.mark.timeout(2700),  # the first test waits for all of it
]

SIZE = 3.0
SEED, WORLD_SEED = 51_000_000, 61_000_000
"""No set of the benchmark has such seeds."""
EXPONENTIAL = "exponential_pressure_play_lag"
POLYNOMIAL = "polynomial_shift_bouc_wen_overdamped"
BUMPY = "bumpy_map_preisach_dead_time"
"""Rigs of other laws, friction and regulators, whose clock and start are unknown."""
SINGLE = [
    Case("single", SEED + k, (name,), (SIZE,), campaign="short")
    for k, name in (
        (1, "creep"),
        (4, "hysteresis_drive"),
        (8, "stick_slip"),
    )
]
ADEQUATE = [Case("clean", SEED)]
OTHER_WORLDS = [
    Case("single", WORLD_SEED + 1, ("creep",), (SIZE,), world=EXPONENTIAL),
    Case("single", WORLD_SEED + 3, ("leak",), (SIZE,), world=BUMPY),
]
CLEAN_WORLDS = [Case("clean", WORLD_SEED + 4, world=POLYNOMIAL)]
IDLE = Case("idle", SEED + 82, campaign="idle")


Records = Mapping[Case, dict[str, Any]]


@pytest.fixture(scope="module")
def records():
    """Study of every case of the sample, two at a time."""
    chosen = [*SINGLE, *ADEQUATE, *OTHER_WORLDS, *CLEAN_WORLDS, IDLE]
    with ProcessPoolExecutor(min(2, os.cpu_count() or 1), get_context("spawn")) as pool:
        return dict(zip(chosen, pool.map(study, chosen), strict=True))


@pytest.mark.parametrize("case", SINGLE, ids=lambda case: case.names[0])
def test_hidden_effect_is_named_first(case, records):
    found = records[case]
    assert found["failure"] is None
    assert found["truths"][0]["size"] == pytest.approx(SIZE, rel=0.05)
    assert found["verdict"] in ("named", "ambiguous")
    assert found["names"][0] == case.names[0]
    before, after = (found["held_out"][f"error_{when}"] for when in ("before", "after"))
    assert max(before[name] / after[name] for name in after) > 1.2


@pytest.mark.parametrize("case", OTHER_WORLDS, ids=lambda case: case.world)
def test_hidden_effect_is_found_in_a_rig_of_another_world(case, records):
    found = records[case]
    assert found["failure"] is None
    assert found["verdict"] in ("named", "ambiguous")
    assert [name for name in found["names"] if name not in found["nature"]][:1] == [case.names[0]]


@pytest.mark.parametrize("case", CLEAN_WORLDS, ids=lambda case: case.world)
def test_clean_rig_of_another_world_has_no_cause(case, records):
    found = records[case]
    assert found["failure"] is None
    assert set(found["names"]) <= set(found["nature"])


@pytest.mark.parametrize("case", ADEQUATE, ids=lambda case: case.kind)
def test_clean_rig_is_adequate(case, records):
    found = records[case]
    assert found["failure"] is None
    assert (found["verdict"], found["names"]) == ("adequate", [])


def test_recording_without_motion_is_insufficient(records):
    found = records[IDLE]
    assert (found["verdict"], found["names"]) == ("insufficient", [])


def test_sample_is_computed_in_one_process(request):
    if not request.config.getoption("loadgroup", False):
        pytest.skip("the tests are not spread over processes by group")
    assert request.node.nodeid.endswith("@hidden effects")
