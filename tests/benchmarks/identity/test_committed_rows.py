"""Committed rows: in the last round of their track, of the present behaviour, verified."""

import pytest

from benchmarks.identity import audit
from benchmarks.runs import rows, verified
from benchmarks.runs.verify import void

pytestmark = pytest.mark.xdist_group("committed rows")  # rows are read once

CHEAP = {
    "positioning_disturbed": ("inverse_pid", "pid_tuned", "table"),
    "knee_walk_nominal": ("knee_inverse", "knee_hold", "knee_ltr"),
    "elbow_valves": ("elbow_allocation_early_tuned", "elbow_pid"),
    "joint_payload": ("joint_inverse_ahead", "joint_pid"),
    "manipulator_payload": ("joint_inverse_kinematics", "joint_pi"),
}
"""A track of every family of plants, and controllers that are quickly designed."""


def test_every_row_is_in_its_round(committed):
    assert committed
    assert [row["row"] for row in committed if not audit.in_last_round(row)] == []


def test_every_row_is_verified(committed):
    noted = verified.read(rows.RESULTS)
    assert [row["row"] for row in committed if not verified.of(row, noted)] == []


def test_no_round_of_an_earlier_commit_has_changed():
    assert audit.altered() == []


@pytest.mark.parametrize("track", CHEAP)
def test_no_row_is_void(track):
    found = [rows.load(rows.path_of(rows.row_name(track, name))) for name in CHEAP[track]]
    assert {row["row"]: void(row) for row in found} == {row["row"]: [] for row in found}
