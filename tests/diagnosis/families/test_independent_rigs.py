"""Diagnosis of joints in worlds whose laws of force, friction and regulators are not the package's.

The rigs are those of :mod:`tests.diagnosis.pair_worlds`, in the world with regulators of first
order; every one departs from the base in static law, loops, dead time and rate limit.
"""

from pam_envs.diagnosis.diagnosis import diagnose
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.pair_worlds import HIDDEN, record

BY_NATURE = {"static_law", "hysteresis_shape", "slew_limit", "dead_time"}
"""Causes that every rig deserves."""


def diagnosed(seed, hidden=None):
    recording, sheet = record("antagonistic_joint", "exponential", seed, hidden)
    return diagnose(recording, rig=sheet, closed_loop=False, progress=False)


@needs_kernels
def test_joint_of_another_world_without_a_hidden_effect_has_no_named_cause():
    found = diagnosed(11)
    assert found.verdict != "named" or set(found.causes) <= BY_NATURE
    before, after = found.report["error_before"], found.report["error_after"]
    assert after["angle"]["times_floor"] < 0.7 * before["angle"]["times_floor"]


@needs_kernels
def test_hidden_difference_of_the_muscles_is_found_first_in_another_world():
    usual = HIDDEN["unequal_muscles"]
    found = diagnosed(12, {name: 0.5 * value for name, value in usual.items()})
    assert found.verdict == "named" and found.causes[0] == "unequal_muscles"
    before, after = found.report["error_before"], found.report["error_after"]
    assert after["angle"]["times_floor"] < 0.25 * before["angle"]["times_floor"]
