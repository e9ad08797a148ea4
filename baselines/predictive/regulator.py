"""Pressure regulators of a nominal plant over rows: response, inverse, and which one it is.

A setpoint takes effect after a dead time; a first-order lag with a rate limit follows it. The dead
time, lag and rate of a real regulator differ from the nominal ones, and a control that anticipates
needs them: an error of 50 ms of the dead time is an error of five control periods.

:class:`RegulatorBank` estimates them from setpoints and sensed pressure (multiple-model adaptive
estimation, magill1965): candidates over the declared ranges run side by side, each under the same
setpoints, and the one with the least squared deviation from the sensed pressure is used. A bank
with one candidate is the nominal regulator, whose state depends on no measurement.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import entry, kernel
from pam_envs.parameters import declarations

POINTS = {"dead_time": 9, "time_constant": 4, "slew_rate": 11}
"""Candidates over the declared range of each parameter."""
MEMORY = 500.0
"""Time constant [periods] of the sum of squared deviations."""
TRUST = 25.0
"""Weight of the nominal candidate: variances of the sensor that another one has to gain."""


@kernel
def regulated(
    pressure: float, set_point: float, lag: float, rate: float, time: float, unlimited: float
) -> float:
    """Return the pressure [Pa] after a time [s] under a setpoint: first-order lag, rate limit.

    ``unlimited`` is the share of a gap that is left after that time where the rate is no limit.
    """
    if not time > 0.0:
        return pressure
    gap = set_point - pressure
    ramp = min(max(abs(gap) / rate - lag, 0.0), time)
    left = abs(gap) - rate * ramp
    if ramp == 0.0:
        left *= unlimited
    elif ramp < time:
        left *= decay((time - ramp) / lag)
    return set_point - (left if gap > 0.0 else -left)


@entry
def decay_rows(ratios: Array, left: Array) -> None:
    """Write the shares that are left after times over time constants."""
    for m in range(len(ratios)):
        left[m] = decay(ratios[m])


@entry
def advance_rows(
    pressure: Array, commands: Array, whole: Any, times: Array, left: Array, lag: Array,
    rate: Array, after: Array,
) -> None:  # fmt: skip
    """Write the pressures of all candidates one control period later, newest command first.

    ``times``, shape (2, m), are those under the older and under the newer command [s], ``left`` the
    shares of a gap that are left after them.
    """
    for i in range(len(pressure)):
        for m in range(len(lag)):
            older, newer = commands[i, whole[m] + 1], commands[i, whole[m]]
            p = regulated(pressure[i, m], older, lag[m], rate[m], times[0, m], left[0, m])
            after[i, m] = regulated(p, newer, lag[m], rate[m], times[1, m], left[1, m])


@entry
def arrive_rows(
    pressure: Array, commands: Array, whole: Any, delay: Array, lag: Array, rate: Array,
    period: float, stages: Array,
) -> None:  # fmt: skip
    """Write the pressures at the ends of stages until a setpoint of now takes effect."""
    for i in range(len(pressure)):
        p = pressure[i]
        for k in range(len(stages)):
            share = (1.0 if k > 0 else delay[i] - whole[i]) if k <= whole[i] else 0.0
            command = commands[i, max(whole[i] - k, 0)]
            time = share * period
            p = regulated(p, command, lag[i], rate[i], time, decay(time / lag[i]))
            stages[k, i] = p


class BankState(NamedTuple):
    """Pressure [Pa] of each candidate, shape (n_env, m), and sum of its squared deviations.

    ``commands``, shape (n_env, k), are the last setpoints [Pa], the newest first.
    """

    pressure: Array
    deviation: Array
    commands: Array

    def grouped(self, count: int) -> "BankState":
        """Return the state of ``count`` regulators an environment, first axes (n_env, count)."""
        return BankState(*(part.reshape(-1, count, part.shape[-1]) for part in self))

    def flat(self) -> "BankState":
        """Return the state with one row for each regulator, from :meth:`grouped`."""
        return BankState(*(part.reshape(-1, part.shape[-1]) for part in self))


class Arrival(NamedTuple):
    """Regulator in use of each row: pressures [Pa] until a setpoint of now takes effect.

    Attributes
    ----------
    pressures : ndarray, shape (n_stages, n_env)
        Ends of the stages [Pa]; the last one is that at which the setpoint takes effect.
    delay : ndarray, shape (n_env,)
        Dead time [periods].
    lag, rate : ndarray, shape (n_env,)
        [s] and [Pa/s].
    """

    pressures: Array
    delay: Array
    lag: Array
    rate: Array

    def set_point(self, following: Array, period: float) -> Array:
        """Return the setpoints [Pa] that reach pressures one period after they take effect."""
        start = self.pressures[-1]
        return np.asarray(start - (following - start) / np.expm1(-period / self.lag))


@dataclass(frozen=True)
class RegulatorBank:
    """Candidates of a regulator, the nominal one first.

    Attributes
    ----------
    dead_time, lag, rate : ndarray, shape (m,)
        [s], [s] and [Pa/s].
    noise : float
        RMS error [Pa] of the pressure sensor.
    period : float
        Control period [s].
    """

    dead_time: Array
    lag: Array
    rate: Array
    noise: float
    period: float

    @classmethod
    def make(cls, plant: Any, adaptive: bool = False) -> "RegulatorBank":
        """Return the nominal regulator of a plant, or with candidates over declared ranges."""
        law, declared = plant.regulator, declarations(type(plant.regulator))
        nominal = [(plant.dead_time, law.time_constant, law.slew_rate)]
        axes = []
        for name, points in POINTS.items():
            low, high = declared[name].spread or (getattr(law, name),) * 2
            axes.append(np.geomspace(low, high, points) if high > low else [low])
        candidates = [*nominal, *(product(*axes) if adaptive else ())]
        noise = max(plant.pressure.noise, 1.0)
        dead_time, lag, rate = np.array(candidates, float).T.copy()
        return cls(dead_time, lag, rate, noise, plant.control_period)

    @cached_property
    def _whole(self) -> NDArray[np.int64]:
        return np.floor(self.dead_time / self.period + 1e-9).astype(np.int64)

    @cached_property
    def _laws(self) -> tuple[Array, Array]:
        """Times under the older and the newer command [s], and the gaps left, (2, m)."""
        part = self.dead_time / self.period - self._whole
        times = np.stack([part, 1.0 - part]) * self.period
        left = np.empty_like(times)
        decay_rows((times / self.lag).ravel(), left.reshape(-1))
        return times, left

    def start(self, set_point: Array) -> BankState:
        """Return the state at rest under setpoints [Pa], shape (n_env,)."""
        m, kept = len(self.lag), int(self._whole.max()) + 2
        deviation = np.full((len(set_point), m), TRUST)
        deviation[:, 0] = 0.0
        column = set_point[:, None]
        return BankState(np.repeat(column, m, axis=1), deviation, np.repeat(column, kept, axis=1))

    def observe(self, state: BankState, sensed: Array) -> BankState:
        """Return the state with the deviations of the candidates from sensed pressures [Pa]."""
        error = ((state.pressure - sensed[:, None]) / self.noise) ** 2
        kept = (1.0 - 1.0 / MEMORY) * state.deviation
        return state._replace(deviation=kept + error)

    def alike(self, state: BankState, count: int) -> BankState:
        """Return the state with deviations averaged over groups of ``count`` consecutive rows.

        A group then has one regulator.
        """
        members = state.deviation.reshape(-1, count, state.deviation.shape[1])
        mean = np.add.reduce(members, axis=1) / count
        return state._replace(deviation=np.repeat(mean, count, axis=0))

    def advance(self, state: BankState, set_point: Array) -> BankState:
        """Return the state one control period later, under setpoints [Pa], shape (n_env,)."""
        commands = np.concatenate([set_point[:, None], state.commands[:, :-1]], axis=1)
        pressure = np.empty_like(state.pressure, order="C")
        before, laws = np.ascontiguousarray(state.pressure), (*self._laws, self.lag, self.rate)
        advance_rows(before, commands, self._whole, *laws, pressure)
        return BankState(pressure, state.deviation, commands)

    def best(self, state: BankState) -> NDArray[np.int64]:
        """Return the candidate in use of each row."""
        return np.argmin(state.deviation, axis=1)

    def now(self, state: BankState) -> Array:
        """Return the pressure [Pa] of the candidate in use, shape (n_env,)."""
        return state.pressure[np.arange(len(state.pressure)), self.best(state)]

    def arrival(self, state: BankState) -> Arrival:
        """Return the pressures until a setpoint of now takes effect."""
        best, commands = self.best(state), np.ascontiguousarray(state.commands)
        whole, lag, rate = self._whole[best], self.lag[best], self.rate[best]
        delay = self.dead_time[best] / self.period
        stages = np.empty((int(whole.max()) + 1, len(best)))
        arrive_rows(self.now(state), commands, whole, delay, lag, rate, self.period, stages)
        return Arrival(stages, delay, lag, rate)
