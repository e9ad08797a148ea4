"""Modbus driver against a pymodbus server on this machine."""

import pytest

pytest.importorskip("pymodbus")
from pam_envs.rig.modbus import Channel, ModbusDriver
from sweeps.limits import scaled
from tests.rig.register_bank import INPUTS, OUTPUTS, device, serving

NUMBERS = [8294, 65536 - 100]


@pytest.fixture
def port():
    """Serve two input registers and 20 holding registers; return the port."""
    with serving(device(NUMBERS)) as number:
        yield number


def test_registers_are_read_and_written_in_si(port):
    driver = ModbusDriver("127.0.0.1", INPUTS, OUTPUTS, watchdog=16, port=port, timeout=scaled(5.0))
    driver.open()
    sample = driver.read()
    assert sample is not None
    assert sample.values["pressure"] == pytest.approx(8294 / 27648 * 1e6)
    assert sample.values["contraction"] == pytest.approx(-0.01 - 0.05 * 100 / 27648)

    def holding(register):
        return driver._client.read_holding_registers(register, count=1, device_id=1).registers[0]

    driver.write({"pressure_set_point": 2.5e5})
    driver.feed()
    driver.feed()
    assert (holding(0), holding(16)) == (6912, 2)
    driver.stop()
    assert holding(0) == 0
    driver.close()


def test_register_that_the_device_lacks_is_lost_or_refused(port):
    far = {"pressure": Channel(500, 0.0, 1e6)}
    driver = ModbusDriver("127.0.0.1", far, OUTPUTS, watchdog=900, port=port, timeout=scaled(5.0))
    driver.open()
    assert driver.read() is None
    with pytest.raises(OSError, match="check the addresses"):
        driver.feed()
    driver.close()


def test_setpoint_is_limited_to_the_range_of_the_channel():
    assert OUTPUTS["pressure_set_point"].number(2e6) == 27648
    assert OUTPUTS["pressure_set_point"].number(-1e5) == 0
