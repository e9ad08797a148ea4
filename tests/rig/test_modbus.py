"""Modbus driver against a pymodbus server on this machine."""

import asyncio
import socket
import threading

import pytest

pytest.importorskip("pymodbus")
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from pam_envs.rig.modbus import Channel, ModbusDriver
from sweeps.limits import scaled

INPUTS = {"pressure": Channel(0, 0.0, 1e6), "contraction": Channel(1, -0.01, 0.04)}
OUTPUTS = {"pressure_set_point": Channel(0, 0.0, 1e6)}
NUMBERS = [8294, 65536 - 100]


@pytest.fixture
def port():
    """Serve two input registers and 20 holding registers; return the port."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    loop, started = asyncio.new_event_loop(), threading.Event()
    servers = []

    async def serve():
        blank = SimData(0, values=[False] * 16, datatype=DataType.BITS)
        inputs = SimData(0, values=NUMBERS, datatype=DataType.REGISTERS)
        holding = SimData(0, values=[0] * 20, datatype=DataType.REGISTERS)
        device = SimDevice(1, simdata=([blank], [blank], [holding], [inputs]))
        servers.append(ModbusTcpServer(device, address=("127.0.0.1", number)))
        task = asyncio.ensure_future(servers[0].serve_forever(background=True))
        await task
        started.set()

    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    asyncio.run_coroutine_threadsafe(serve(), loop).result(scaled(30.0))
    yield number
    asyncio.run_coroutine_threadsafe(servers[0].shutdown(), loop).result(scaled(30.0))
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    loop.close()


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
