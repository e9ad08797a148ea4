"""Rig driven by a controller, one command at a time."""

import numpy as np

from .base import CONTRACTION_NOISE_MM, PRESSURE_NOISE_BAR, Base
from .catalogue import constants
from .effect import Effect
from .kernel import begin, one_period
from .records import STATE, blank
from .rig import CORRELATION, steps_in


class Stepper:
    """A rig under one declared load [N], stepped from rest at 0 bar.

    The period [s] between two commands is a whole number of milliseconds, ``noise_factor`` is over
    the usual sensor noise, and a slip happens within ``duration`` [s]. ``position_mm`` is the true
    contraction.
    """

    def __init__(
        self,
        base: Base,
        effects: list[tuple[Effect, float]],
        load_N: float,
        noise_seed: int,
        period: float = 0.01,
        *,
        noise_factor: float = 1.0,
        temperature_C: float = 20.0,
        duration: float = 30.0,
    ) -> None:
        self._constants = constants(base, effects, duration)
        self._base = base
        self._load = float(load_N)
        self._steps = steps_in(period)
        self._rms = noise_factor * np.array([CONTRACTION_NOISE_MM, PRESSURE_NOISE_BAR])
        self._keep = float(np.exp(-period / CORRELATION))
        self._temperature = float(temperature_C)
        self.reset(noise_seed)

    def reset(self, seed: int) -> None:
        """Put the rig to rest and restart its noise."""
        self._state = blank(STATE)
        self._rng = np.random.default_rng(seed)
        self._slow = self._rng.standard_normal(2)
        begin(self._constants, self._state, self._load)
        self.position_mm = 0.0

    def step(self, command_bar: float) -> tuple[float, float]:
        """Hold a command [bar] for one period; return the contraction [mm] and pressure [bar]."""
        place, pressure, self.position_mm = one_period(
            self._constants, self._state, float(command_bar), self._temperature, self._steps
        )
        noise = self._noise()
        return (
            self._grained(place + noise[0], self._base.grain_mm),
            self._grained(pressure + noise[1], self._base.grain_bar),
        )

    def _noise(self) -> np.ndarray:
        fresh = self._rng.standard_normal((2, 2))
        self._slow = self._keep * self._slow + np.sqrt(1.0 - self._keep**2) * fresh[0]
        share = self._base.coloured
        return self._rms * (np.sqrt(share) * self._slow + np.sqrt(1.0 - share) * fresh[1])

    @staticmethod
    def _grained(value: float, grain: float) -> float:
        return value if grain <= 0.0 else grain * round(value / grain)
