"""Record of a joint with shut valves: mapped to the columns of an antagonistic joint."""

import numpy as np
import pytest

from pam_envs.data.recording.formats.mapped import sheet_of
from pam_envs.data.rig_file import Rig
from pam_envs.data.stick_slip import load_stick_slip, recording_and_rig

JOINT = ("time_s", "angle_deg", "disturbance_Nm", "pressure_a_bar", "pressure_b_bar")
RADIUS = 6.875e-3  # pulley [m]


@pytest.fixture(scope="module")
def columns() -> dict[str, np.ndarray]:
    record, rig = recording_and_rig()
    sheet = sheet_of(record, Rig.from_yaml(rig).channels, JOINT, ("time_s",), "a recording")
    return {name: sheet.numbers(name)[0] for name in JOINT}


def test_columns_are_those_of_the_record_about_its_pulley(columns):
    record = load_stick_slip()
    np.testing.assert_allclose(columns["time_s"], record.time)
    np.testing.assert_allclose(
        np.radians(columns["angle_deg"]), record.displacement / RADIUS, rtol=1e-6
    )
    np.testing.assert_allclose(columns["disturbance_Nm"], RADIUS * record.force, rtol=1e-9)
    for name, pressure in zip("ab", record.pressures, strict=True):
        np.testing.assert_allclose(1e5 * columns[f"pressure_{name}_bar"], pressure, rtol=1e-9)
    # the work of torque on angle is that of force on displacement: dissipated by friction
    work = np.trapezoid(columns["disturbance_Nm"], np.radians(columns["angle_deg"]))
    assert work == pytest.approx(np.trapezoid(record.force, record.displacement), rel=1e-5)
    assert work > 0.2


def test_joint_rests_and_steps_under_a_steady_torque(columns):
    record = load_stick_slip()
    speed = np.abs(record.velocity)
    assert np.mean(speed < 5e-5) > 0.45
    peaks = [
        k
        for k in range(25, len(speed) - 25)
        if speed[k] > 5e-4 and speed[k] == speed[k - 25 : k + 25].max()
    ]
    assert 30 <= len(peaks) <= 42
    # muscle A is shortened and B stretched as the angle grows; their air follows
    slopes = [np.polyfit(columns["angle_deg"], columns[f"pressure_{n}_bar"], 1)[0] for n in "ab"]
    assert slopes[0] == pytest.approx(-slopes[1], rel=0.01)
    assert slopes[0] < 0.0
