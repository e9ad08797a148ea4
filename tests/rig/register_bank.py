"""Modbus TCP server on this machine: fixed registers, or a simulated rig behind them."""

import asyncio
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from pam_envs.rig.modbus import Channel
from pam_envs.rig.simulated import SimulatedDriver
from sweeps.limits import scaled

INPUTS = {"pressure": Channel(0, 0.0, 1e6), "contraction": Channel(1, -0.01, 0.04)}
OUTPUTS = {"pressure_set_point": Channel(0, 0.0, 1e6)}
WATCHDOG = 16
READ_INPUTS = 4  # function code


def device(inputs: list[int], action=None) -> SimDevice:
    """Return a device with input registers and 20 holding registers."""
    blank = SimData(0, values=[False] * 16, datatype=DataType.BITS)
    readings = SimData(0, values=inputs, datatype=DataType.REGISTERS)
    holding = SimData(0, values=[0] * 20, datatype=DataType.REGISTERS)
    return SimDevice(1, simdata=([blank], [blank], [holding], [readings]), action=action)


class RigBank:
    """Register bank of a simulated rig: valve terminal, sensors and watchdog.

    A read of the input registers samples the sensors, a written holding register is a setpoint
    or restarts the watchdog. A setpoint of 0 counts vents.
    """

    def __init__(self, rig: SimulatedDriver) -> None:
        self.rig = rig
        self.setpoints: list[int] = []
        self.beats: list[int] = []
        rig.open()

    async def act(self, code, _start, address, count, registers, written) -> None:
        """Handle a request; ``registers`` are all of its block."""
        if code == READ_INPUTS:
            values = self.rig.read().values
            for name, channel in INPUTS.items():
                share = (values[name] - channel.low) / (channel.high - channel.low)
                registers[channel.register] = round(share * channel.counts) % 65536
        elif written is None:
            return  # a written register is read back
        elif address == WATCHDOG:
            self.beats += written
            self.rig.feed()
        else:
            self.setpoints += written
            (channel,) = OUTPUTS.values()
            if written == [0]:
                self.rig.stop()
            else:
                self.rig.write({"pressure_set_point": channel.value(written[0])})


@contextmanager
def serving(served: SimDevice) -> Iterator[int]:
    """Serve a device on a free port of this machine; yield the port."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    loop, servers = asyncio.new_event_loop(), []

    async def serve():
        servers.append(ModbusTcpServer(served, address=("127.0.0.1", port)))
        await servers[0].serve_forever(background=True)

    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    try:
        asyncio.run_coroutine_threadsafe(serve(), loop).result(scaled(30.0))
        yield port
    finally:
        for server in servers:
            asyncio.run_coroutine_threadsafe(server.shutdown(), loop).result(scaled(30.0))
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
