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
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.parameters import declarations

POINTS = {"dead_time": 9, "time_constant": 4, "slew_rate": 11}
"""Candidates over the declared range of each parameter."""
MEMORY = 500.0
"""Time constant [periods] of the sum of squared deviations."""
TRUST = 25.0
"""Weight of the nominal candidate: variances of the sensor that another one has to gain."""


def regulated(
    pressure: Array, set_point: Array, lag: Array | float, rate: Array | float, time: Array | float
) -> Array:
    """Return pressures [Pa] after a time [s] under setpoints [Pa]: first-order lag, rate limit."""
    gap = set_point - pressure
    size = np.abs(gap)
    ramp = np.minimum(np.maximum(size / rate - lag, 0.0), time)
    left = (size - rate * ramp) * np.exp((ramp - time) / lag)
    return np.where(time > 0.0, set_point - np.copysign(left, gap), pressure)


class BankState(NamedTuple):
    """Pressure [Pa] of each candidate, shape (n_env, m), and sum of its squared deviations.

    ``commands``, shape (n_env, k), are the last setpoints [Pa], the newest first.
    """

    pressure: Array
    deviation: Array
    commands: Array


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
        dead_time, lag, rate = np.array(candidates, float).T
        return cls(dead_time, lag, rate, noise, plant.control_period)

    @property
    def _whole(self) -> NDArray[np.int64]:
        return np.floor(self.dead_time / self.period + 1e-9).astype(np.int64)

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

    def advance(self, state: BankState, set_point: Array) -> BankState:
        """Return the state one control period later, under setpoints [Pa], shape (n_env,)."""
        commands = np.hstack([set_point[:, None], state.commands[:, :-1]])
        whole = self._whole
        part = self.dead_time / self.period - whole
        older, newer = commands[:, whole + 1], commands[:, whole]
        pressure = regulated(state.pressure, older, self.lag, self.rate, part * self.period)
        rest = (1.0 - part) * self.period
        return BankState(
            regulated(pressure, newer, self.lag, self.rate, rest), state.deviation, commands
        )

    def best(self, state: BankState) -> NDArray[np.int64]:
        """Return the candidate in use of each row."""
        return np.argmin(state.deviation, axis=1)

    def now(self, state: BankState) -> Array:
        """Return the pressure [Pa] of the candidate in use, shape (n_env,)."""
        return state.pressure[np.arange(len(state.pressure)), self.best(state)]

    def arrival(self, state: BankState) -> Arrival:
        """Return the pressures until a setpoint of now takes effect."""
        best, rows = self.best(state), np.arange(len(state.pressure))
        whole, lag, rate = self._whole[best], self.lag[best], self.rate[best]
        delay = self.dead_time[best] / self.period
        pressure, made = self.now(state), []
        for k in range(int(whole.max()) + 1):
            command = state.commands[rows, np.maximum(whole - k, 0)]
            share = np.where(k <= whole, 1.0 if k else delay - whole, 0.0)
            pressure = regulated(pressure, command, lag, rate, share * self.period)
            made.append(pressure)
        return Arrival(np.array(made), delay, lag, rate)
