"""Simulated rig: a plant behind a driver whose timing is imperfect, on a simulated clock."""

from collections.abc import Collection, Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from pam_envs.rig.driver import Sample


class SimulatedClock:
    """Clock that advances when it is asked to."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Return the time [s]."""
        return self._now

    def sleep_until(self, instant: float) -> None:
        """Advance to an instant [s], unless it has passed."""
        self._now = max(self._now, instant)

    def advance(self, seconds: float) -> None:
        """Advance by a duration [s]."""
        self._now += seconds


class SimulatedDriver:
    """Driver of a simulated plant, which may differ from the nominal one.

    Parameters
    ----------
    env : Env
        Environment of the true plant; its episode must be longer than the session.
    clock : SimulatedClock
        Clock that it shares with the real-time environment.
    sensors : tuple of str
        Signals to read.
    jitter : float
        Mean of the exponentially distributed time that a reading takes [s].
    drops : collection of int
        Numbers of the readings that are lost, counted from 0.
    stalls : mapping of float
        Seconds by which a reading is delayed, by its number.
    frozen : int, optional
        Number of the reading from which the acquisition repeats its last sample.
    watchdog : float
        Time without :meth:`feed` after which the output stage vents [s].
    seed : int
        Seed of plant and jitter.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any],
        clock: SimulatedClock,
        sensors: tuple[str, ...] = ("contraction", "pressure"),
        jitter: float = 0.0,
        drops: Collection[int] = (),
        stalls: Mapping[int, float] | None = None,
        frozen: int | None = None,
        watchdog: float = 0.1,
        seed: int = 0,
    ) -> None:
        self.env: Any = env.unwrapped
        self.clock, self._sensors = clock, sensors
        self.jitter, self.drops, self.stalls = jitter, frozenset(drops), dict(stalls or {})
        self.frozen, self.watchdog, self.seed = frozen, watchdog, seed
        self.vented = True
        self.readings = 0
        self._random = np.random.default_rng(seed)
        self._last: Sample | None = None

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the signals that :meth:`read` returns."""
        return self._sensors

    def open(self) -> None:
        """Start the plant from rest."""
        _, self._info = self.env.reset(seed=self.seed)
        self._begun = self._fed = self.clock.now()
        self._steps = 0
        self.stop()

    def read(self) -> Sample | None:
        """Advance the plant to the present and return its readings, None for a lost sample."""
        number, self.readings = self.readings, self.readings + 1
        self._advance()
        instant = self.clock.now()
        if self.jitter:
            self.clock.advance(float(self._random.exponential(self.jitter)))
        self.clock.advance(self.stalls.get(number, 0.0))
        if number in self.drops:
            return None
        if self._last is None or self.frozen is None or number < self.frozen:
            values = {name: float(self._info[f"sensor/{name}"]) for name in self.sensors}
            self._last = Sample(instant, values)
        return self._last

    def write(self, setpoints: Mapping[str, float]) -> None:
        """Apply setpoints from now on."""
        self._advance()
        self._action = self.env.action_signals.encode(setpoints)
        self.vented = False

    def feed(self) -> None:
        """Restart the watchdog."""
        self._advance()
        self._fed = self.clock.now()

    def stop(self) -> None:
        """Vent the muscles."""
        lowest = {signal.name: signal.low for signal in self.env.action_signals}
        self._action = self.env.action_signals.encode(lowest)
        self.vented = True

    def close(self) -> None:
        """Disconnect."""

    def _advance(self) -> None:
        """Advance the plant by the whole control periods that have passed."""
        period = self.env.control_period
        while self._begun + (self._steps + 1) * period <= self.clock.now() + 1e-9:
            if self._begun + self._steps * period - self._fed > self.watchdog:
                self.stop()
            *_, self._info = self.env.step(self._action)
            self._steps += 1
