"""Interfaces between the real-time environment and the hardware: driver and clock."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class Sample:
    """Readings of all sensors at one instant.

    Attributes
    ----------
    time : float
        Instant of the acquisition [s], on the clock of the environment.
    values : mapping of float
        Readings in SI units by the name of their signal.
    """

    time: float
    values: Mapping[str, float]


class Driver(Protocol):
    """Driver of a rig; all quantities are in SI units.

    The output stage has a watchdog of its own: unless :meth:`feed` is called within its timeout it
    vents the muscles, whatever the computer does.
    """

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the signals that :meth:`read` returns."""
        ...

    def open(self) -> None:
        """Connect to the hardware, with vented muscles."""
        ...

    def read(self) -> Sample | None:
        """Return the latest readings at once; None if there are none."""
        ...

    def write(self, setpoints: Mapping[str, float]) -> None:
        """Apply setpoints, by the name of their action signal."""
        ...

    def feed(self) -> None:
        """Restart the watchdog."""
        ...

    def stop(self) -> None:
        """Vent the muscles; callable at any time, also several times."""
        ...

    def close(self) -> None:
        """Disconnect."""
        ...


class Clock(Protocol):
    """Monotonic time."""

    def now(self) -> float:
        """Return the time [s]."""
        ...

    def sleep_until(self, instant: float) -> None:
        """Return at an instant [s], at once if it has passed."""
        ...


class SystemClock:
    """Clock of the computer."""

    def now(self) -> float:
        """Return the time [s]."""
        return time.monotonic()

    def sleep_until(self, instant: float) -> None:
        """Return at an instant [s], at once if it has passed."""
        time.sleep(max(0.0, instant - time.monotonic()))
