"""Driver for valve terminals and couplers with Modbus TCP, by pymodbus.

Analogue inputs are input registers, setpoints and the counter of the watchdog are holding
registers. Set the coupler's own watchdog so that it vents when this counter stops.

    driver = ModbusDriver(
        "192.168.0.10",
        inputs={"pressure": Channel(0, 0.0, 1e6), "contraction": Channel(1, -0.01, 0.04)},
        outputs={"pressure_set_point": Channel(0, 0.0, 1e6)},
        watchdog=16,
    )
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pam_envs.rig.driver import Clock, Sample, SystemClock


@dataclass(frozen=True)
class Channel:
    """Linear scale of a 16-bit register.

    Attributes
    ----------
    register : int
        Address.
    low, high : float
        Value in SI units at 0 and at ``counts``.
    counts : int
        Largest number of the converter.
    """

    register: int
    low: float
    high: float
    counts: int = 27648

    def value(self, number: int) -> float:
        """Return the value [SI] of a register, a signed 16-bit number."""
        signed = number - 65536 if number > 32767 else number
        return self.low + (self.high - self.low) * signed / self.counts

    def number(self, value: float) -> int:
        """Return the number of a value [SI], within 0 and ``counts``."""
        share = (value - self.low) / (self.high - self.low)
        return round(self.counts * min(max(share, 0.0), 1.0))


class ModbusDriver:
    """Driver of a rig behind a Modbus TCP device.

    Parameters
    ----------
    host : str
        Address of the device.
    inputs : mapping of Channel
        Input registers by the name of the signal.
    outputs : mapping of Channel
        Holding registers by the name of the action signal; :meth:`stop` writes 0 counts.
    watchdog : int
        Holding register of the counter.
    port, device : int
        TCP port and Modbus identifier of the device.
    timeout : float
        Time after which a request counts as lost [s].
    clock : Clock, optional
        That of the environment; default: the clock of the computer.

    Raises
    ------
    ImportError
        If pymodbus is not installed.
    """

    def __init__(
        self,
        host: str,
        inputs: Mapping[str, Channel],
        outputs: Mapping[str, Channel],
        watchdog: int,
        port: int = 502,
        device: int = 1,
        timeout: float = 0.02,
        clock: Clock | None = None,
    ) -> None:
        try:
            from pymodbus import client
        except ImportError as error:
            raise ImportError(
                'the Modbus driver needs pymodbus: pip install "pam-envs[rig]"'
            ) from error
        self.inputs, self.outputs, self.watchdog = dict(inputs), dict(outputs), watchdog
        self.device, self.host, self.port = device, host, port
        self.clock: Clock = SystemClock() if clock is None else clock
        self._client: Any = client.ModbusTcpClient(host, port=port, timeout=timeout, retries=0)
        registers = [channel.register for channel in self.inputs.values()]
        self._first, self._count = min(registers), max(registers) - min(registers) + 1
        self._beat = 0

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the signals that :meth:`read` returns."""
        return tuple(self.inputs)

    def open(self) -> None:
        """Connect, and vent the muscles.

        Raises
        ------
        OSError
            If the device does not answer.
        """
        if not self._client.connect():
            raise OSError(f"no Modbus device answers at {self.host}:{self.port}; check the address")
        self.stop()

    def read(self) -> Sample | None:
        """Return the readings of one request, None if it fails."""
        from pymodbus import ModbusException

        try:
            answer = self._client.read_input_registers(
                self._first, count=self._count, device_id=self.device
            )
        except ModbusException:
            return None
        if answer.isError():
            return None
        values = {
            name: channel.value(answer.registers[channel.register - self._first])
            for name, channel in self.inputs.items()
        }
        return Sample(self.clock.now(), values)

    def write(self, setpoints: Mapping[str, float]) -> None:
        """Apply setpoints."""
        for name, value in setpoints.items():
            self._write(self.outputs[name].register, self.outputs[name].number(value))

    def feed(self) -> None:
        """Increment the counter of the watchdog."""
        self._beat = (self._beat + 1) % 65536
        self._write(self.watchdog, self._beat)

    def stop(self) -> None:
        """Set all outputs to 0 counts, the remaining ones also if one of them fails.

        Raises
        ------
        OSError
            If an output is not set.
        """
        faults = []
        for name, channel in self.outputs.items():
            try:
                self._write(channel.register, 0)
            except OSError as error:
                faults.append(f"{name} is not vented: {error}")
        if faults:
            raise OSError(f"{'; '.join(faults)}; only the watchdog of the device vents it")

    def close(self) -> None:
        """Disconnect."""
        self._client.close()

    def _write(self, register: int, number: int) -> None:
        from pymodbus import ModbusException

        try:
            failed = self._client.write_register(register, number, device_id=self.device).isError()
        except ModbusException as error:
            raise OSError(
                f"register {register} of {self.host} cannot be written: {error}"
            ) from error
        if failed:
            raise OSError(f"{self.host} refuses register {register}; check the addresses")
