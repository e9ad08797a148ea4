"""Real-time environment: an episode on a rig, with the signals of a simulated environment.

The simulated environment runs beside the rig as its twin, under the same actions. It supplies the
spaces, the reference with its preview, the declared load and the nominal plant; the sensors of the
rig replace the simulated readings. Every controller that is built from these signals runs
unchanged.

An episode stops, with vented muscles, if a sample is lost, a reading is outside its limits, or a
deadline is missed by more than ``longest_delay``.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from pam_envs.rig.driver import Clock, Driver, Sample, SystemClock

OVERRUN = 0.1
"""Lateness from which a control period counts as overrun, as a share of the period."""


class Log(Protocol):
    """Recorder of an episode; see :class:`pam_envs.rig.log.RecordingLog`."""

    def add(
        self, segment: str, time: float, setpoints: Mapping[str, float], values: Mapping[str, float]
    ) -> None:
        """Record the readings at ``time`` [s] and the setpoints in force from then on."""
        ...

    def close(self) -> None:
        """Finish the record."""
        ...


class RealTimeEnv(gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Episodes on a rig.

    ``info`` holds, in SI units: ``time``, ``reference``, ``output`` (measured), ``twin/output``
    (simulated), ``sensor/...``, ``late`` (delay of the last deadline [s]), ``overruns`` (periods
    with a delay of more than a tenth of the period, since the reset) and, after a stop, its reason
    under ``stop``. The reward is minus the tracking error, as a share of the range of the output.

    Parameters
    ----------
    twin : Env
        Simulated environment, from ``gymnasium.make``; for comparisons with ``start="rest"``.
    driver : Driver
        Driver of the rig.
    limits : mapping of (float, float)
        Lowest and highest admissible reading of every sensor, in SI units.
    output : str
        Sensor of the tracked output.
    log : Log, optional
        Record of all episodes.
    clock : Clock, optional
        Default: the clock of the computer.
    rest_seconds : float
        Time with vented muscles before an episode [s], at least one control period.
    zeroed : sequence of str
        Sensors whose reading at the end of this rest is taken as zero.
    longest_delay : float, optional
        Delay of a deadline that stops the episode [s]; default: three control periods.
    oldest_sample : float, optional
        Age at which a sample counts as lost [s]; default: one control period.

    Raises
    ------
    ValueError
        If a sensor has no limits, no signal has its name, or the rest is too short.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  (as Gymnasium declares it)

    def __init__(
        self,
        twin: gym.Env[Any, Any],
        driver: Driver,
        limits: Mapping[str, tuple[float, float]],
        output: str = "contraction",
        log: Log | None = None,
        clock: Clock | None = None,
        rest_seconds: float = 5.0,
        zeroed: Sequence[str] = (),
        longest_delay: float | None = None,
        oldest_sample: float | None = None,
    ) -> None:
        inner: Any = twin.unwrapped
        self.twin = inner
        self.driver, self.limits, self.output, self.log = driver, dict(limits), output, log
        self.signals, self.action_signals = inner.signals, inner.action_signals
        self.plant = inner.plant
        self.observation_space = inner.observation_space
        self.action_space = inner.action_space
        self.control_period: float = inner.control_period
        self.clock: Clock = SystemClock() if clock is None else clock
        self.rest_seconds, self.zeroed = rest_seconds, tuple(zeroed)
        period = self.control_period
        self.longest_delay = 3.0 * period if longest_delay is None else longest_delay
        self.oldest_sample = period if oldest_sample is None else oldest_sample
        self._check()
        self._open = self._running = False
        self._episode, self._begun, self._due, self._newest = -1, 0.0, 0.0, -math.inf
        self._late, self._overruns = 0.0, 0
        self._zeros: dict[str, float] = {}
        self._values: dict[str, float] = {}

    def _check(self) -> None:
        sensors, known = self.driver.sensors, list(self.signals.names())
        for name in sensors:
            if name not in known:
                raise ValueError(f"sensor {name!r} is no signal; there are: {', '.join(known)}")
            low, high = self.limits.get(name, (math.nan, math.nan))
            if not low < high:
                raise ValueError(f"limits of {name!r}: give its lowest and highest reading in SI")
        if not self.rest_seconds >= self.control_period:
            raise ValueError(
                f"rest_seconds = {self.rest_seconds:g} s is below the control period of "
                f"{self.control_period:g} s; give the time in which the vented muscle settles"
            )
        for word, names in (("output", (self.output,)), ("zeroed", self.zeroed)):
            for name in names:
                if name not in sensors:
                    raise ValueError(f"{word} = {name!r} is no sensor: {', '.join(sensors)}")

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Vent and settle the muscles, then start an episode.

        Raises
        ------
        RuntimeError
            If a sample is lost while the muscles settle, or outside its limits afterwards.
        """
        super().reset(seed=seed)
        observation, info = self.twin.reset(seed=seed, options=options)
        self._halt()
        if not self._open:
            self.driver.open()
            self._open = True
        self._zeros, self._newest, self._overruns = {}, -math.inf, 0
        self._episode += 1
        try:
            self._settle()
        except BaseException:
            self._halt()
            raise
        self._running, self._late = True, 0.0
        self._begun = self._newest
        self._due = self._begun + self.control_period
        return self._observe(observation), self._info(info)

    def _settle(self) -> None:
        """Wait with vented muscles and fed watchdog; zero the sensors, then check the limits."""
        begun, periods = self.clock.now(), math.ceil(self.rest_seconds / self.control_period)
        for k in range(1, periods + 2):
            self.clock.sleep_until(begun + k * self.control_period)
            reason = self._take(limited=k > periods)
            if reason:
                raise RuntimeError(f"the rig cannot start: {reason}")
            self.driver.feed()
            if k == periods:
                self._zeros = {name: self._values[name] for name in self.zeroed}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Apply an action for one control period, and return at its end.

        Raises
        ------
        ResetNeeded
            If no episode is running.
        OSError
            If the rig does not accept setpoints.
        """
        if not self._running:
            raise gym.error.ResetNeeded("no episode is running on the rig; call reset()")
        try:
            return self._step(action)
        except BaseException:
            self._halt()
            raise

    def _step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        period = self.control_period
        observation, _, _, truncated, info = self.twin.step(action)
        setpoints = self._setpoints(action)
        self.driver.write(setpoints)
        self._record(setpoints)
        self.clock.sleep_until(self._due)
        self._late = max(0.0, self.clock.now() - self._due)
        self._overruns += self._late > OVERRUN * period
        reason = self._take()
        if self._late > self.longest_delay:
            reason = (
                f"deadline missed by {1e3 * self._late:.1f} ms, more than "
                f"{1e3 * self.longest_delay:.1f} ms; shorten the computation of the action"
            )
        for _ in range(int(self._late / period)):  # whole periods in which the action was held
            self._due += period
            if not truncated:
                observation, _, _, truncated, info = self.twin.step(action)
        self._due += period
        if reason:
            self._halt()
        else:
            self.driver.feed()
        told = self._info(info)
        if reason:
            told["stop"] = reason
        elif truncated:
            self._record(setpoints)
            self._halt()
        low, high = self.signals[self.output].low, self.signals[self.output].high
        reward = -abs(told["output"] - told["reference"]) / (high - low)
        return self._observe(observation), reward, bool(reason), truncated, told

    def _setpoints(self, action: Any) -> dict[str, float]:
        """Return the setpoints of an action in SI, within their ranges."""
        made = {}
        for signal in self.action_signals:
            value = float(signal.decode(np.asarray(action, np.float64)))
            made[signal.name] = min(max(value, signal.low), signal.high)
        return made

    def _take(self, limited: bool = True) -> str:
        """Take a sample; return why it stops the episode, empty if it does not."""
        sample: Sample | None = self.driver.read()
        if sample is None:
            return "sample lost: the driver has none"
        age = self.clock.now() - sample.time
        if sample.time <= self._newest or age > self.oldest_sample:
            return f"sample lost: the latest one is {1e3 * age:.1f} ms old"
        self._newest = sample.time
        for name in self.driver.sensors:
            value = sample.values.get(name, math.nan) - self._zeros.get(name, 0.0)
            if not math.isfinite(value):
                return f"sample lost: {name} is {value}"
            self._values[name] = value
            low, high = self.limits[name]
            if limited and not low <= value <= high:
                unit = self.signals[name].unit
                return f"limit: {name} = {value:.6g} {unit} is outside [{low:g}, {high:g}] {unit}"
        return ""

    def _observe(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the twin's observation with the readings of the rig."""
        made = observation.copy()
        for name, value in self._values.items():
            made[self.signals[name].index] = self.signals[name].encode(value)
        return made

    def _info(self, info: Mapping[str, Any]) -> dict[str, Any]:
        return {
            "time": info["time"],
            "reference": info["reference"],
            "output": self._values[self.output],
            "twin/output": info["output"],
            **{f"sensor/{name}": value for name, value in self._values.items()},
            "late": self._late,
            "overruns": float(self._overruns),
        }

    def _record(self, setpoints: Mapping[str, float]) -> None:
        if self.log is not None:
            time = self._newest - self._begun
            self.log.add(f"episode_{self._episode}", time, setpoints, self._values)

    def _halt(self) -> None:
        """Vent the muscles and end the episode."""
        self._running = False
        if self._open:
            self.driver.stop()

    def close(self) -> None:
        """Vent the muscles, disconnect, and close the log, also if the device does not answer.

        Raises
        ------
        OSError
            If the muscles cannot be vented.
        """
        try:
            self._halt()
        finally:
            if self._open:
                self.driver.close()
                self._open = False
            if self.log is not None:
                self.log.close()
