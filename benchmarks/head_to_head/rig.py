"""Simulated rig: mass-spring-damper with hidden dry friction.

Between two events the motion under a constant force is linear and computed in closed form; friction
is a set-valued Coulomb law with a higher breakaway force. No code is shared with the fitted model.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PERIOD = 0.01  # sampling period [s]
NOISE = 1e-3  # standard deviation of the position sensor's noise [m]
NOMINAL = {"mass": 1.0, "stiffness": 100.0, "damping": 2.0}
"""Median constants of rigs [kg], [N/m], [N s/m]."""
SPREAD = 1.25  # largest factor between constants of a rig and the median
BREAKAWAY = (1.0, 1.3)  # range of the breakaway force over the sliding force
LOOK = 1e-3  # interval of the checks for a change of the velocity's sign [s]
HALVINGS = 50
SETTLED = 2.0  # time without force at the start of an experiment [s]


@dataclass(frozen=True)
class Oscillator:
    """Constants of a rig in SI."""

    mass: float = NOMINAL["mass"]
    stiffness: float = NOMINAL["stiffness"]
    damping: float = NOMINAL["damping"]
    friction: float = 0.0  # sliding friction [N]
    breakaway: float = 1.0  # ratio of static to sliding friction
    delay: int = 0  # of the force [samples]
    bias: float = 0.0  # of the sensor [m]
    drift: float = 0.0  # of the sensor over an experiment [m]

    @classmethod
    def drawn(cls, seed: int, **hidden: float) -> "Oscillator":
        """Return a rig with drawn constants and given hidden effects."""
        rng = np.random.default_rng([seed, 1])
        factors = np.exp(rng.uniform(-1.0, 1.0, 3) * np.log(SPREAD))
        constants = {n: v * float(f) for (n, v), f in zip(NOMINAL.items(), factors, strict=True)}
        return cls(**constants, breakaway=float(rng.uniform(*BREAKAWAY)), **hidden)  # type: ignore[arg-type]

    def positions(self, force: Array) -> Array:
        """Return the position [m] at each sample, from rest, under a zero-order-held force [N]."""
        late = np.concatenate([np.zeros(self.delay), force])[: len(force)]
        state, found = (0.0, 0.0), np.empty(len(force))
        for k, value in enumerate(late.tolist()):
            found[k] = state[0]
            state = self._held(*state, value)
        return found

    def readings(self, force: Array, seed: int) -> Array:
        """Return sensor readings [m], shape (T,)."""
        noise = np.random.default_rng([seed, 2]).normal(0.0, NOISE, len(force))
        ramp = np.linspace(0.0, self.drift, len(force))
        return np.asarray(self.positions(force) + self.bias + ramp + noise)

    def _held(self, x: float, v: float, force: float) -> tuple[float, float]:
        """Return position and velocity after one period under a constant force."""
        left = PERIOD
        while left > 1e-12:
            if v == 0.0:
                pull = force - self.stiffness * x
                if abs(pull) <= self.breakaway * self.friction:
                    return x, 0.0
                way = math.copysign(1.0, pull)
            else:
                way = math.copysign(1.0, v)
            x, v, used = self._slide(x, v, force - way * self.friction, way, min(left, LOOK))
            left -= used
        return x, v

    def _slide(
        self, x: float, v: float, force: float, way: float, step: float
    ) -> tuple[float, float, float]:
        """Return position, velocity and time at the end of a step or at standstill."""
        x1, v1 = self._free(x, v, force, step)
        if v1 * way > 0.0:
            return x1, v1, step
        low, high = 0.0, step
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if self._free(x, v, force, middle)[1] * way > 0.0:
                low = middle
            else:
                high = middle
        return self._free(x, v, force, high)[0], 0.0, high

    def _free(self, x: float, v: float, force: float, time: float) -> tuple[float, float]:
        """Return position and velocity of the damped oscillation about its equilibrium."""
        decay = 0.5 * self.damping / self.mass
        turn = math.sqrt(self.stiffness / self.mass - decay**2)
        about = force / self.stiffness
        even, odd = x - about, (v + decay * (x - about)) / turn
        c, s = math.cos(turn * time), math.sin(turn * time)
        size = math.exp(-decay * time)
        gone = size * (even * c + odd * s)
        return about + gone, size * turn * (odd * c - even * s) - decay * gone


def experiment(*parts: Array) -> Array:
    """Return a sequence of forces [N] after a rest, each held from its sample to the next."""
    return np.concatenate([np.zeros(round(SETTLED / PERIOD)), *parts])


def campaign(seed: int) -> Array:
    """Return 60 s of random steps, a growing sine, a multisine and slow ramps [N]."""
    rng = np.random.default_rng([seed, 3])
    return experiment(
        steps(rng, 8, 2.0, 8.0),
        swelling_sine(12.0, 0.7, 6.0),
        many_sines(rng, 16.0, 2.5),
        ramps((9.0, -9.0, 4.0, -4.0, 0.0), 14.0),
    )


def another(seed: int) -> Array:
    """Return 40 s of another excitation: a chirp and small steps [N]."""
    rng = np.random.default_rng([seed, 4])
    time = times(26.0)
    tone = 4.0 * np.sin(2.0 * np.pi * (0.1 + 0.5 * 2.9 * time / time[-1]) * time)
    return experiment(tone, steps(rng, 8, 1.5, 5.0))


def times(seconds: float) -> Array:
    """Return the sampling times [s] of a duration."""
    return np.asarray(np.arange(round(seconds / PERIOD)) * PERIOD, np.float64)


def steps(rng: np.random.Generator, number: int, seconds: float, most: float) -> Array:
    """Return random forces up to ``most`` [N], each held for ``seconds``."""
    return np.repeat(rng.uniform(-most, most, number), round(seconds / PERIOD))


def swelling_sine(seconds: float, frequency: float, most: float) -> Array:
    """Return a sine [Hz] whose amplitude grows to ``most`` [N]."""
    time = times(seconds)
    return np.asarray(most * time / seconds * np.sin(2.0 * np.pi * frequency * time))


def many_sines(rng: np.random.Generator, seconds: float, spread: float) -> Array:
    """Return a multisine of random phases, 0.2 to 4 Hz, of a given RMS [N]."""
    time = times(seconds)
    tones = np.geomspace(0.2, 4.0, 12)[:, None]
    phases = rng.uniform(0.0, 2.0 * np.pi, (12, 1))
    total = np.sin(2.0 * np.pi * tones * time + phases).sum(axis=0)
    return np.asarray(spread * total / np.sqrt(np.mean(total**2)))


def ramps(corners: tuple[float, ...], seconds: float) -> Array:
    """Return ramps of equal rate from 0 through the corners [N]."""
    lengths = np.abs(np.diff((0.0, *corners)))
    at = np.concatenate([[0.0], np.cumsum(lengths)]) / lengths.sum() * seconds
    return np.interp(times(seconds), at, (0.0, *corners))
