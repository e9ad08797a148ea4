"""Units of log files: conversion to the unit in the name of a column."""

from typing import NamedTuple

from pam_envs.constants import CELSIUS, GRAVITY


class Unit(NamedTuple):
    """A unit: its quantity, and ``SI value = factor * value + shift``."""

    quantity: str
    factor: float
    shift: float = 0.0


PSI = 6894.757293168361
INCH, POUND = 0.0254, 4.4482216152605
DEGREE = 0.017453292519943295
UNITS = {
    **dict.fromkeys(("s", "sec", "second", "seconds"), Unit("time", 1.0)),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), Unit("time", 1e-3)),
    **dict.fromkeys(("us", "microsecond", "microseconds"), Unit("time", 1e-6)),
    **dict.fromkeys(("ns", "nanosecond", "nanoseconds"), Unit("time", 1e-9)),
    "min": Unit("time", 60.0),
    **dict.fromkeys(("bar", "barg"), Unit("pressure", 1e5)),
    **dict.fromkeys(("mbar", "hPa"), Unit("pressure", 1e2)),
    **dict.fromkeys(("Pa", "pascal"), Unit("pressure", 1.0)),
    "kPa": Unit("pressure", 1e3),
    "MPa": Unit("pressure", 1e6),
    "mPa": Unit("pressure", 1e-3),
    **dict.fromkeys(("psi", "psig", "lbf/in^2"), Unit("pressure", PSI)),
    "atm": Unit("pressure", 101325.0),
    **dict.fromkeys(("m", "meter", "metre", "meters", "metres"), Unit("length", 1.0)),
    **dict.fromkeys(("mm", "millimeter", "millimetre"), Unit("length", 1e-3)),
    "cm": Unit("length", 1e-2),
    "um": Unit("length", 1e-6),
    **dict.fromkeys(("in", "inch", "inches"), Unit("length", INCH)),
    **dict.fromkeys(("N", "newton", "newtons"), Unit("force", 1.0)),
    "mN": Unit("force", 1e-3),
    "kN": Unit("force", 1e3),
    **dict.fromkeys(("kg", "kgf"), Unit("force", GRAVITY)),
    **dict.fromkeys(("g", "gf"), Unit("force", 1e-3 * GRAVITY)),
    **dict.fromkeys(("lb", "lbf"), Unit("force", POUND)),
    "Nm": Unit("torque", 1.0),
    "mNm": Unit("torque", 1e-3),
    "Nmm": Unit("torque", 1e-3),
    **dict.fromkeys(("rad", "radian", "radians"), Unit("angle", 1.0)),
    **dict.fromkeys(("deg", "degree", "degrees"), Unit("angle", DEGREE)),
    **dict.fromkeys(("C", "degC", "celsius"), Unit("temperature", 1.0, CELSIUS)),
    **dict.fromkeys(("K", "kelvin"), Unit("temperature", 1.0)),
    **dict.fromkeys(("F", "degF"), Unit("temperature", 5.0 / 9.0, CELSIUS - 160.0 / 9.0)),
}
"""Units by name; a mass is the weight that it has on earth."""
_ALIKE = {name.lower(): name for name in reversed(UNITS) if name not in ("mN", "mNm", "mPa", "F")}
_PLAIN = str.maketrans({"°": "deg", "µ": "u", "μ": "u", " ": "", "*": "", "·": "", "⋅": ""})


def unit_of(name: str) -> Unit | None:
    """Return the unit of a name, None if it is not known; letters may be of another case."""
    plain = name.strip().strip("[]()").translate(_PLAIN)
    return UNITS.get(plain) or UNITS.get(_ALIKE.get(plain.lower(), ""))


def conversion(source: Unit, target: Unit) -> tuple[float, float]:
    """Return ``(factor, shift)`` with ``target value = factor * source value + shift``."""
    return source.factor / target.factor, (source.shift - target.shift) / target.factor


def known(quantity: str) -> str:
    """Return the names of the units of a quantity, for messages."""
    return ", ".join(name for name, unit in UNITS.items() if unit.quantity == quantity)
