"""Static models of a muscle on pressure cycles: a load-blind base, and terms that extend it.

Base: play operators on the pressure (hysteresis) and a spring with a stiff start and a hardening
end, which converts the effective pressure to contraction,

    c (1 - exp(-x / x0)) + k1 x + k3 x^3 = p - sum(weights * stop_i(p)).

It is independent of the load. A *term* adds one parameter with a neutral value, so that every model
with a term contains the model without it. Pressures, contractions and loads are relative to the
largest of the table; :func:`units` gives the scales. All cells of a table are computed at once for
many parameter sets (lanes).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.diagnosis.static.cells import THRESHOLDS, Cells, stops

WEIGHTS = tuple(f"weight_{i}" for i in range(1, len(THRESHOLDS) + 1))
SPRING = ("start_force", "start_length", "stiffness", "hardening")
CREEP_READINGS = 4.0
"""Time constant of residual creep [readings]; faster creep has settled before a reading."""


@dataclass(frozen=True)
class Number:
    """A parameter of a model, relative to the largest values of the table."""

    name: str
    neutral: float  # value without effect; a plausible one in the base
    low: float
    high: float
    size: float  # meaningful change, for finite differences and starting values
    unit: str = "1"  # for display


@dataclass(frozen=True)
class Term:
    """One form of a cause; its fit needs so many ``loads``, and deflation if ``both_ways``."""

    cause: str
    form: str
    number: Number
    loads: int = 1
    both_ways: bool = False

    @property
    def title(self) -> str:
        """A short sentence."""
        return TITLES[self.form]


BASE = (
    Number("start_force", 0.2, 0.0, 1.0, 0.1, "bar"),
    Number("start_length", 0.12, 0.02, 2.0, 0.05, "mm"),
    Number("stiffness", 0.6, 0.02, 4.0, 0.2, "bar/mm"),
    Number("hardening", 0.1, 0.0, 4.0, 0.1, "bar/mm3"),
    *(Number(name, 0.15, 0.0, 0.9, 0.1) for name in WEIGHTS),
)
"""Parameters of the load-blind base."""

COMPLIANCE = "load_dependent_compliance"
TITLES = {
    "pressure shift": "The load acts as a pressure shift, with a zero common to all loads",
    "pressure shift, zeroed at each load": (
        "The load acts as a pressure shift, with the rest length of each load as its zero"
    ),
    "stretch at rest": "The load lengthens the muscle equally at every pressure",
    "smaller stroke": "The contraction is divided by a factor that grows with the load",
    "stiffness growing with load": "The spring stiffens with the load",
    "width linear in load": "The hysteresis loop widens or narrows with the load",
    "bent pressure scale": (
        "Friction changes along the pressure range, uniform on a bent pressure scale"
    ),
    "residual creep over readings": "A part of each step appears only in the next readings",
    "soft threshold": "The first part of the pressure has no effect",
}


def _compliance(form: str, name: str, low: float, high: float, unit: str) -> Term:
    return Term(COMPLIANCE, form, Number(name, 0.0, low, high, 0.05, unit), loads=2)


_WIDTH = Number("width", 0.0, -0.95, 2.0, 0.1, "1/kg")
_BEND = Number("bend", 0.0, -0.8, 0.8, 0.1)
_CREEP = Number("creep", 0.0, -0.5, 0.5, 0.02)
_THRESHOLD = Number("threshold", 0.0, 0.0, 0.3, 0.03, "bar")
TERMS = (
    _compliance("pressure shift", "shift", -1.0, 1.0, "bar/kg"),
    _compliance("pressure shift, zeroed at each load", "zeroed_shift", -1.0, 1.0, "bar/kg"),
    _compliance("stretch at rest", "stretch", -2.0, 2.0, "mm/kg"),
    _compliance("smaller stroke", "stroke", -0.4, 2.0, "1/kg"),
    _compliance("stiffness growing with load", "stiffening", -0.4, 2.0, "1/kg"),
    Term("load_dependent_hysteresis", "width linear in load", _WIDTH, loads=2, both_ways=True),
    Term("pressure_dependent_friction", "bent pressure scale", _BEND, both_ways=True),
    Term("creep", "residual creep over readings", _CREEP),
    Term("threshold_pressure", "soft threshold", _THRESHOLD),
)
"""All forms of causes that a table of readings can show, the best established first."""
EXPONENT = Term("load law", "power", Number("exponent", 1.0, 0.3, 6.0, 0.3), loads=3)
DEAD_LOAD = Term("load law", "dead zone", Number("dead_load", 0.0, 0.0, 0.95, 0.1, "kg"), loads=3)

Values = Mapping[str, Array]  # parameters by name, each of shape (L, 1); missing ones are neutral


def numbers_of(terms: Sequence[Term]) -> tuple[Number, ...]:
    """Return the parameters of the base and of some terms."""
    return (*BASE, *(term.number for term in terms))


def _bent(pressure: Array, bend: Array) -> Array:
    return np.asarray(pressure * (1.0 + bend * (1.0 - pressure)))


def _straight(value: Array, bend: Array) -> Array:
    s = 1.0 + bend
    root = np.sqrt(np.maximum(s * s - 4.0 * bend * value, 1e-12))
    return np.asarray(2.0 * value / (s + root))


def load_law(load: Array, values: Values) -> Array:
    """Return the relative strength of load effects in each cell: 0 without load, at most 1."""
    dead, exponent = values.get("dead_load"), values.get("exponent")
    if dead is not None:
        load = np.maximum(load - dead, 0.0) / (1.0 - dead)
    return np.asarray(load if exponent is None else load**exponent)


def lags_of(cells: Cells, values: Values) -> Array:
    """Return the lag of the play operators behind the bent pressure, shape (plays, L or 1, C)."""
    bend = values.get("bend")
    return cells.lags if bend is None else stops(_bent(cells.pressure, bend), cells.order)


def effective_pressure(cells: Cells, values: Values, lags: Array) -> Array:
    """Return the pressure after the hysteresis without effects of the load, shape (L, C)."""
    bend = values.get("bend")
    lost = sum(values[name] * lag for name, lag in zip(WEIGHTS, lags, strict=True))
    if "width" in values:
        lost = lost * np.maximum(0.0, 1.0 + values["width"] * load_law(cells.load, values))
    if bend is None:
        return np.asarray(cells.pressure - lost)
    return _straight(_bent(cells.pressure, bend) - lost, bend)


def contraction(force: Array, values: Values, start: Array | None = None) -> Array:
    """Return the contraction at which the spring balances ``force``, by Newton's method."""
    c, x0, k1, k3 = (values[name] for name in SPRING)
    x = np.maximum(force, 0.0) if start is None else start
    for _ in range(60):
        decay = c * np.exp(np.minimum(-x / x0, 40.0))
        square = x * x
        miss = c - decay + (k1 + k3 * square) * x - force
        step = miss / (decay / x0 + k1 + 3.0 * k3 * square)
        x = x - np.clip(step, -0.3, 0.3)
        if np.abs(step).max() < 1e-9:
            break
    return x


def _above(force: Array, values: Values) -> Array:
    """Return the force less a soft threshold, zero without force."""
    if "threshold" not in values:
        return force
    level = np.maximum(values["threshold"], 1e-9)
    return np.asarray(force + level * np.expm1(-np.maximum(force, 0.0) / level))


def crept(cells: Cells) -> Array:
    """Return the matrix (C, C) from contractions to their crept part at each reading."""
    behind = np.subtract.outer(np.arange(len(cells.load)), np.arange(len(cells.load)))
    keep = np.exp(-1.0 / CREEP_READINGS)
    seen = (behind >= 0) & (cells.group[:, None] == cells.group[None, :])
    return np.where(seen, (1.0 - keep) * keep ** np.abs(behind), 0.0)


def predict(
    cells: Cells, values: Values, start: Array | None = None, lags: Array | None = None
) -> Array:
    """Return contractions in relative units (L, C); nearby ``start`` and ``lags`` save time."""
    acts = load_law(cells.load, values)
    force = effective_pressure(cells, values, lags_of(cells, values) if lags is None else lags)
    for name in ("shift", "zeroed_shift"):
        if name in values:
            force = force - values[name] * acts
    if "stiffening" in values:
        force = force / (1.0 + values["stiffening"] * acts)
    x = contraction(_above(force, values), values, start)
    if "zeroed_shift" in values:
        x = x - contraction(_above(-values["zeroed_shift"] * acts, values), values)
    if "stroke" in values:
        x = x / (1.0 + values["stroke"] * acts)
    if "stretch" in values:
        x = x - values["stretch"] * acts
    if "creep" in values:
        x = x + values["creep"] * (x @ crept(cells).T - x)
    return x


def units(number: Number, scale: tuple[float, float, float]) -> float:
    """Return the scale of a parameter from relative units to its display unit."""
    load, pressure, length = scale[0], scale[1] / BAR, scale[2] / MM
    return {
        "1": 1.0,
        "kg": load,
        "mm": length,
        "bar": pressure,
        "bar/mm": pressure / length,
        "bar/mm3": pressure / length**3,
        "bar/kg": pressure / load,
        "mm/kg": length / load,
        "1/kg": 1.0 / load,
    }[number.unit]
