"""Diagnosis of joints, orthoses and arms in worlds of other laws of force, friction and regulators.

The rigs are those of :mod:`tests.diagnosis.pair_worlds`, in the world with regulators of first
order; every one departs from the base in static law, loops, dead time and rate limit.
"""

import numpy as np
import pytest

from benchmarks.diagnosis.families.cases import start_of
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.diagnosis import Study, diagnose
from pam_envs.diagnosis.families.kinds import kind_named
from tests.diagnosis.conftest import needs_kernels
from tests.diagnosis.pair_worlds import HIDDEN, record

BY_NATURE = {"static_law", "hysteresis_shape", "slew_limit", "dead_time"}
"""Causes that every rig deserves."""


def diagnosed(seed, hidden=None, name="antagonistic_joint"):
    recording, sheet = record(name, "exponential", seed, hidden)
    return diagnose(recording, rig=sheet, closed_loop=False, progress=False)


@needs_kernels
def test_joint_of_another_world_without_a_hidden_effect_has_no_named_cause():
    found = diagnosed(11)
    assert found.verdict != "named" or set(found.causes) <= BY_NATURE
    before, after = found.report["error_before"], found.report["error_after"]
    assert after["angle"]["times_floor"] < 0.7 * before["angle"]["times_floor"]


@needs_kernels
def test_hidden_difference_of_the_muscles_is_found_alone_in_another_world():
    usual = HIDDEN["unequal_muscles"]
    found = diagnosed(12, {name: 0.5 * value for name, value in usual.items()})
    assert found.causes[0] == "unequal_muscles"
    assert set(found.causes) <= {"unequal_muscles", *BY_NATURE}
    before, after = found.report["error_before"], found.report["error_after"]
    assert after["angle"]["times_floor"] < 0.25 * before["angle"]["times_floor"]


@needs_kernels
def test_knee_of_another_world_has_friction_of_the_length_and_a_corrected_law():
    recording, sheet = record("knee_orthosis", "exponential", 13)
    kind = kind_named("knee_orthosis")
    data = recording, sheet, kind.start(sheet), noise_floor(recording, sheet), kind
    study = Study.begin(*data)
    study.make_flexible(kind.causes(kind.catalogue))
    assert study.family.plant.hysteresis.drive == "length"
    assert "static_law" in study.normal.names
    means = study.blocks.means(study.normal.errors)
    some = study.blocks.counts.sum(axis=1) > 0
    assert np.sqrt(means[some]).max() < 3.0


@needs_kernels
def test_elbow_of_another_world_has_another_law_and_other_loops():
    recording, sheet = record("elbow_orthosis", "exponential", 700_001)
    found = diagnose(recording, rig=sheet, closed_loop=False, progress=False)
    assert found.verdict == "named"
    assert set(found.causes) == {"static_law", "hysteresis_shape"}
    assert found.report["error_after"]["angle"]["times_floor"] < 1.2


@needs_kernels
def test_flexible_base_of_an_arm_has_a_corrected_law_and_friction_that_yields_in_another_world():
    recording, sheet = record("redundant_manipulator", "exponential", 700_002)
    kind, start = kind_named("redundant_manipulator"), start_of("redundant_manipulator")
    study = Study.begin(recording, sheet, start, noise_floor(recording, sheet), kind)
    study.make_flexible(kind.causes(kind.catalogue))
    assert set(study.normal.names) == {"static_law", "hysteresis_shape"}
    left = study.blocks.means(study.normal.errors)[:2]  # of the angles
    assert np.sqrt(left).max() < 4.0 < 10.0 < np.sqrt(study.blocks.means(study.base.errors)[0])


@needs_kernels
def test_hidden_dead_band_of_a_knee_is_named_alone_in_another_world():
    found = diagnosed(14, {"band": 0.1}, "knee_orthosis")
    assert found.verdict == "named"
    assert set(found.causes) - BY_NATURE == {"valve_dead_band"}


def test_motion_is_compared_once_friction_has_forgotten_how_a_run_began():
    angle = np.concatenate([np.zeros(20), np.linspace(0.0, 1.0, 41), np.ones(10)])
    angle = np.concatenate([angle, angle[::-1]])
    time = 0.02 * np.arange(len(angle))
    pressures = {f"set_point_{side}": np.full(len(time), 2e5) for side in "ab"}
    read = {"pressure_a": pressures["set_point_a"], "pressure_b": pressures["set_point_b"]}
    outputs = {"angle": angle, **read}
    inputs = {**pressures, "payload": np.zeros(len(time))}
    given = Recording.of_channels(time, inputs, outputs, plant="antagonistic_joint")
    kind, sheet = kind_named("antagonistic_joint"), Rig(plant="antagonistic_joint")
    family = kind.bind(kind.start(sheet), given, sheet)
    measured = np.full((len(family.channels), len(time)), np.nan)
    for name, values in outputs.items():
        measured[family.channels.index(name)] = values
    restart = np.zeros(len(time), bool)
    restart[[0, 71]] = True
    made = kind.compared(measured, family, restart)
    left = np.isfinite(made[family.channels.index("angle")])
    assert not left[:28].any() and left[29:71].all()  # 0.2 of the range, from 0
    assert not left[71:89].any() and left[90:].all()  # and from 1
    assert made[1:3] == pytest.approx(measured[1:3])
