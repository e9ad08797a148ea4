"""Knobs: factors on the numbers that a design leaves free.

A rule or a paper fixes most numbers of a controller by the nominal plant, and leaves some to
whoever applies it: how fast the closed loop is, how far ahead a reference is read. A knob is a
factor on one of them. At 1 it is the number as published or by the rule, to the last bit. An entry
of the catalogue names its knobs with their bounds (``Entry.knobs``), and the makers take them as
``knobs``; what is left out is 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

Knobs = Mapping[str, float]
Bounds = Mapping[str, tuple[float, float]]
"""Lowest and highest value by knob; 1 lies between them."""

AS_DESIGNED: Knobs = MappingProxyType({})


def knob(knobs: Knobs, name: str) -> float:
    """Return a knob's factor, 1 if it is not set."""
    return knobs.get(name, 1.0)


def check_knobs(controller: str, bounds: Bounds, knobs: Knobs) -> None:
    """Raise unless a controller has these knobs and every factor is within its bounds.

    Raises
    ------
    ValueError
        Naming the knob, its value and what is allowed.
    """
    for name, value in knobs.items():
        if name not in bounds:
            there = f"choose from {', '.join(bounds)}" if bounds else "it has none: leave them out"
            raise ValueError(f"{controller} has no knob {name!r}; {there}")
        low, high = bounds[name]
        if not low <= value <= high:
            raise ValueError(
                f"{controller}: knob {name} is {value!r}, and goes from {low:g} to {high:g}; "
                "give a factor in that range, 1 for the number as designed"
            )
