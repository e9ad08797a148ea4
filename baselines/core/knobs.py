"""Knobs: factors on the free parameters of a design.

A rule or a paper fixes most parameters of a controller from the nominal plant, and leaves some
free, such as the bandwidth of the closed loop or the lead of the preview. A knob is a factor on one
of them; a factor of 1 gives the published or rule-based value to the last bit. An entry of the
catalogue declares its knobs with their bounds (``Entry.knobs``); makers read them by ``Spec.knob``.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

Knobs = Mapping[str, float]
Bounds = Mapping[str, tuple[float, float]]
"""Lowest and highest value by knob; 1 lies between them."""

AS_DESIGNED: Knobs = MappingProxyType({})


def check_knobs(controller: str, bounds: Bounds, knobs: Knobs) -> None:
    """Raise unless a controller has these knobs and every factor is within its bounds."""
    for name, value in knobs.items():
        if name not in bounds:
            there = f"choose from {', '.join(bounds)}" if bounds else "it has none: leave knobs out"
            raise ValueError(f"{controller} has no knob {name!r}; {there}")
        low, high = bounds[name]
        if not low <= value <= high:
            raise ValueError(
                f"{controller}: knob {name} is {value!r}, outside {low:g} to {high:g}; "
                "give a factor in that range, 1 for the number as designed"
            )
