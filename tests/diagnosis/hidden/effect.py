"""Hidden effect: name, drawn shape, and its entry in the constants of a rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

Shape = dict[str, float]
Draw = Callable[[np.random.Generator], Shape]
Write = Callable[[np.ndarray, float, Shape], None]


@dataclass(frozen=True)
class Effect:
    """An effect with its shape drawn.

    Attributes
    ----------
    name : str
    shape : mapping of secondary constants, in the units of `records`
    reference : float, strength at amplitude 1, where the trace moves by one to two noise RMS
    exponent : float, the strength grows with amplitude ** exponent, so that the trace grows
        about linearly
    write : enters a strength into the constants of a rig
    """

    name: str
    shape: Mapping[str, float]
    reference: float
    exponent: float
    write: Write

    def strength(self, amplitude: float) -> float:
        """Return the strength at an amplitude, 0 at 0."""
        if amplitude < 0.0:
            raise ValueError(f"amplitude {amplitude} of {self.name} is negative; give 0 or more")
        return self.reference * amplitude**self.exponent


@dataclass(frozen=True)
class Kind:
    """A kind of effect: how its shape is drawn and how a strength is written into a record.

    The reference strength is drawn within +-25 % of the one given here.
    """

    draw: Draw
    write: Write
    reference: float
    exponent: float = 1.0

    def effect(self, name: str, rng: np.random.Generator) -> Effect:
        """Draw one effect of this kind."""
        reference = self.reference * float(rng.uniform(0.8, 1.25))
        return Effect(name, self.draw(rng), reference, self.exponent, self.write)


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a plain float."""
    return float(rng.uniform(low, high))


def sign(rng: np.random.Generator) -> float:
    """Draw -1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def coin(rng: np.random.Generator, share: float = 0.5) -> float:
    """Draw 1 with the given probability, else 0."""
    return float(rng.random() < share)


def put(record: np.ndarray, **values: float) -> None:
    """Write named constants."""
    for name, value in values.items():
        record[name] = value
