"""Effects of a normal day: ranges of creep, leak, supply, regulators and drift, with sources.

``randomize="everyday"`` of an environment draws them in every episode. The ranges are those of
recordings of Festo muscles and identified regulators, of several rigs each. The recordings are
public but have no licence and no paper: only the figures that stand here are taken from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pam_envs.parameters import declarations

if TYPE_CHECKING:
    from pam_envs.plants.core.plant import Plant


@dataclass(frozen=True)
class Range:
    """Range of a parameter in its unit (SI), or over a scale of the plant, and its source."""

    low: float
    high: float
    source: str
    over: str = ""
    """Parameter of the plant that the range is a multiple of."""


_CREEP = "two Kelvin-Voigt elements of force after a pressure step at held length, 10 and 20 mm"
_SUPPLY = "peaks of 5.65 and 5.13 bar fall by 0.54 and 0.58 bar in four cycles, 10 mm muscle"
FULL = "regulator.max_pressure"

EVERYDAY: dict[str, Range] = {
    "hysteresis.creep_2": Range(0.07, 0.14, _CREEP),
    "hysteresis.creep_time_2": Range(1.0, 2.6, _CREEP),
    "hysteresis.creep_3": Range(0.12, 0.17, _CREEP),
    "hysteresis.creep_time_3": Range(8.0, 14.0, _CREEP),
    "regulator.leak": Range(2e-4, 1.3e-2, "time constants of 75 to 5,200 s of 20 mm muscles"),
    "regulator.supply_pressure": Range(1.05, 1.2, _SUPPLY, FULL),
    "regulator.supply_droop": Range(0.01, 0.04, _SUPPLY),
    "regulator.supply_time": Range(0.2, 0.5, "0.73 to 1.07 s to 90 % of 6.3 bar, 20 mm muscle"),
    "regulator.dead_time": Range(0.04, 0.096, "40 ms inflating and 96 ms deflating, 10 mm muscle"),
    "regulator.slew_rate": Range(
        4.9e5 / 6.8e5, 1.0, "6.8 bar/s, and 70 % of it for a slower valve", "regulator.slew_rate"
    ),
    "regulator.exhaust_ratio": Range(1.0, 1.7, "lags of 84 against 50 ms, 10 mm muscle"),
}
"""Ranges by parameter; of those that a plant has not it has no effect."""
SENSOR_SHARE = 1e-3 / 60.0
"""Largest drift of a sensor over its full scale [1/s], assumed: 0.1 % in a minute."""


def everyday(plant: Plant) -> dict[str, tuple[float, float]]:
    """Return the ranges (low, high) of the effects of a normal day that a plant has, by name."""
    ranges: dict[str, tuple[float, float]] = {}
    for name, span in EVERYDAY.items():
        if name in plant.names:
            scale = plant.value(span.over) if span.over else 1.0
            ranges[name] = (span.low * scale, span.high * scale)
    for name in plant.names:
        if name.endswith(".drift"):
            declared: Any = declarations(getattr(plant, name.partition(".")[0]))["drift"]
            ranges[name] = (SENSOR_SHARE * declared.low, SENSOR_SHARE * declared.high)
    return ranges
