"""Hidden effect: name, drawn shape, and its entry in the constants of a rig."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Shape = dict[str, float]
Draw = Sequence[Any]
Write = str | Callable[[np.ndarray, float, Shape], None]


@dataclass(frozen=True)
class Effect:
    """An effect with its shape drawn."""

    name: str
    shape: Mapping[str, float]
    reference: float  # strength at amplitude 1, where the trace moves by one to two noise RMS
    exponent: float  # of the amplitude in the strength, so that the trace grows about linearly
    write: Write

    def strength(self, amplitude: float) -> float:
        """Return the strength at an amplitude, 0 at 0."""
        if amplitude < 0.0:
            raise ValueError(f"amplitude {amplitude} of {self.name} is negative; give 0 or more")
        return self.reference * amplitude**self.exponent

    def enter(self, record: np.ndarray, amplitude: float) -> None:
        """Write the effect into the constants of a rig, nothing at amplitude 0."""
        strength = self.strength(amplitude)
        if strength > 0.0 and isinstance(self.write, str):
            put(record, **{self.write: strength}, **self.shape)
        elif strength > 0.0:
            self.write(record, strength, dict(self.shape))


@dataclass(frozen=True)
class Kind:
    """A kind of effect: its entry in a record, reference strength (within 25 %) and shape.

    A shape is drawn from a range, or as its first entry names (:data:`DRAWS`). It is written by a
    function of record, strength and shape, or, with the name of the constant of the strength, under
    its own names.
    """

    write: Write
    reference: float
    shape: Mapping[str, Draw] = field(default_factory=dict)
    exponent: float = 1.0

    def effect(self, name: str, rng: np.random.Generator) -> Effect:
        """Draw one effect of this kind."""
        reference = self.reference * float(rng.uniform(0.8, 1.25))
        shape = {key: drawn(rng, *draw) for key, draw in self.shape.items()}
        return Effect(name, shape, reference, self.exponent, self.write)


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a plain float."""
    return float(rng.uniform(low, high))


DRAWS: dict[str, Callable[..., Any]] = {
    "sign": lambda rng: rng.choice([-1.0, 1.0]),
    "coin": lambda rng, share=0.5: rng.random() < share,
    "whole": lambda rng, low, high: rng.integers(low, high),
    "log_uniform": lambda rng, low, high: np.exp(uniform(rng, np.log(low), np.log(high))),
    "either": lambda rng, *ranges: rng.choice([uniform(rng, *ends) for ends in ranges]),
}
"""-1 or 1; 1 or 0; an integer below ``high``; even in the logarithm; from one of two ranges."""


def drawn(rng: np.random.Generator, how: str | float, *given: Any) -> float:
    """Draw a plain float."""
    return float(DRAWS[how](rng, *given)) if isinstance(how, str) else uniform(rng, how, *given)


def put(record: np.ndarray, **values: float) -> None:
    """Write named constants."""
    for name, value in values.items():
        record[name] = value
