"""Tests of one family of environments run in one process, which then alone compiles its kernels."""

from __future__ import annotations

import pytest

FAMILIES = {
    "MusclePositioning": "positioning",
    "KneeTension": "brace",
    "KneeStiffness": "brace",
    "KneeWalk": "gait",
    "KneeStairsUp": "gait",
    "KneeStairsDown": "gait",
    "ElbowOrthosis": "elbow",
    "AntagonisticJoint": "joint",
    "RedundantManipulator": "manipulator",
}
"""Environments with machine code in common."""


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group the tests that have an environment's name among their arguments (see ``make test``)."""
    for item in items:
        name = getattr(getattr(item, "callspec", None), "params", {}).get("name", "")
        family = FAMILIES.get(str(name).removeprefix("PAM/").removesuffix("-v0"))
        if family:
            item.add_marker(pytest.mark.xdist_group(family))
