"""Common base of the single environment and of the batch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.setup import Setup
from pam_envs.parameters import Signals


def space_of(signals: Signals) -> gym.spaces.Box[np.float32]:
    """Return the Box of a vector of signals."""
    low = [-1.0 if s.normalized else s.low for s in signals]
    high = [1.0 if s.normalized else s.high for s in signals]
    return gym.spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)


def fresh_seed() -> int:
    """Return a seed from the operating system's entropy."""
    return int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)


class Configured:
    """Environment whose keyword arguments ``make_setup`` turns into its setup."""

    make_setup: Callable[..., Setup]
    setup: Setup
    plant: Any
    signals: Signals
    action_signals: Signals
    control_period: float
    render_mode: str | None

    def _configure(self, setup: Setup | None, arguments: Mapping[str, Any]) -> Setup:
        """Set the attributes from a setup, or from that of the arguments."""
        setup = self.make_setup(**arguments) if setup is None else setup
        self.setup, self.plant, self.signals = setup, setup.plant, setup.signals
        self.action_signals, self.render_mode = setup.action_signals, setup.render_mode
        self.control_period = setup.control_period
        return setup

    def _numbers(self, given: Any, shape: tuple[int, ...], word: str) -> NDArray[np.float64]:
        """Return actions as an array, or raise an error that names the fault."""
        try:
            if np.iscomplexobj(given):
                raise TypeError("complex numbers")
            made = np.asarray(given, np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(
                f"{word} {str(given)[:60]!r}: not an array of shape {shape}: {error}"
            ) from error
        if made.shape != shape:
            raise ValueError(
                f"{word} of shape {made.shape}, expected {shape}: one number for each of "
                + ", ".join(self.action_signals.names())
            )
        if not np.isfinite(made).all():
            place = np.argwhere(~np.isfinite(made))[0].tolist()
            signal = self.action_signals[place[-1]]
            low, high = (-1.0, 1.0) if signal.normalized else (signal.low, signal.high)
            raise ValueError(
                f"{word}{place} ({signal.name}) is {made[tuple(place)]}; "
                f"give a finite number between {low:g} and {high:g}"
            )
        return made
