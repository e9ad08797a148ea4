"""Faults of a table that repeats cannot show, and comparison of published curves with readings.

A missed setpoint is missed in every repeat. Its cells have a much larger prediction error than
their neighbours for a model fitted to all other pressures, at several loads alike.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.tables import ContractionTable
from pam_envs.diagnosis.static.compare import Model, Study, pure_error
from pam_envs.diagnosis.static.fit import fit

OUTLYING = 3.5  # robust standard deviations above which a held-out cell is an outlier
SIZABLE = 2.0  # least error of a reported setpoint in standard deviations of a reading,
SIZABLE_SHARE = 0.01  # or as a share of the largest contraction if that deviation is unknown
FEWEST_STEPS = 10  # least number of pressures for an estimate of the usual error
MOST_OUTLIERS = 3
POOR_FIT = 1.3
"""Error of a curve over that of its refit above which it was fitted to other readings."""


@dataclass(frozen=True)
class SetPoint:
    """A pressure with outliers at several loads."""

    pressure: float  # [bar]
    falling: bool  # reached by deflation
    loads: tuple[float, ...]  # with outliers [kg]
    # reading less prediction from all other pressures at these loads [mm]
    missed: tuple[float, ...]
    others: tuple[float, ...]  # the same at the other loads

    @property
    def sentence(self) -> str:
        """Warning on it."""
        way = "deflating" if self.falling else "inflating"
        where = " and ".join(f"{load:g}" for load in self.loads)
        size = " and ".join(f"{abs(miss):.2f}" for miss in self.missed)
        side = "below" if self.missed[0] < 0.0 else "above"
        others = " and ".join(f"{value:+.2f}" for value in self.others)
        rest = f", the other loads by {others} mm" if others else ""
        more = "" if others else ", or an effect that all models lack"
        return (
            f"at {self.pressure:g} bar {way} the readings at {where} kg are {size} mm {side} the "
            f"prediction from all other pressures{rest}: probably a missed setpoint, which repeats "
            f"cannot show{more}; measure this pressure again"
        )


def missed_set_points(study: Study, model: Model) -> tuple[SetPoint, ...]:
    """Return outlying pressures of models fitted without them, the worst first.

    The cells of each one are then excluded, since they distort the predictions of neighbours.
    """
    cells, found = study.cells, list[SetPoint]()
    kept = study.lanes.weight[0].copy()
    while len(found) < MOST_OUTLIERS:
        keys = sorted({*zip(cells.falling[kept > 0], cells.pressure[kept > 0], strict=True)})
        if len(keys) < FEWEST_STEPS:
            break
        here = np.array([(cells.falling == f) & np.isclose(cells.pressure, p) for f, p in keys])
        data = np.broadcast_to(cells.mean, here.shape)
        fitted = fit(cells, model.terms, data, kept * ~here, [model.fit.theta[0]])
        missed = (cells.mean - fitted.predict(cells)) * cells.millimetres
        worst = _worst(study, keys, np.where(here & (kept > 0.0), missed, np.nan))
        if worst is None:
            break
        at, point = worst
        found.append(point)
        kept = np.where(here[at], 0.0, kept)
    return tuple(found)


def _worst(
    study: Study, keys: Sequence[tuple[bool, float]], missed: Array
) -> tuple[int, SetPoint] | None:
    """Return the worst outlying pressure, at two loads or the only one, if any."""
    cells, size = study.cells, np.full(missed.shape, np.nan)
    for group in range(len(cells.loads)):
        of = (cells.group == group) & np.isfinite(missed)
        values = missed[of]
        if len(values) < FEWEST_STEPS:
            continue
        middle = np.median(values)
        spread = 1.4826 * np.median(np.abs(values - middle))
        size[of] = (values - middle) / max(spread, 1e-12)
    noise, _ = pure_error(cells)
    least = SIZABLE_SHARE * cells.millimetres if np.isnan(noise) else SIZABLE * noise
    needed = min(2, len(cells.loads))
    best, found = 0.0, None
    for at, (falling, pressure) in enumerate(keys):
        for sign in (-1.0, 1.0):
            out = np.nan_to_num(sign * size[at]) > OUTLYING
            out &= np.nan_to_num(sign * missed[at]) > least
            groups = np.unique(cells.group[out])
            total = float(np.sum(np.abs(size[at][out])))
            if len(groups) < needed or total <= best:
                continue
            rest = np.isfinite(missed[at]) & ~np.isin(cells.group, groups)
            best = total
            found = (
                at,
                SetPoint(
                    float(pressure * cells.scale[1] / BAR),
                    bool(falling),
                    tuple(cells.loads[g] for g in groups),
                    tuple(float(np.mean(missed[at][out & (cells.group == g)])) for g in groups),
                    tuple(float(value) for value in missed[at][rest]),
                ),
            )
    return found


def audit_polynomials(
    table: ContractionTable, curves: Mapping[str, tuple[float, bool, Sequence[float]]]
) -> dict[str, object]:
    """Compare published polynomials with the readings that they describe.

    ``curves`` are load [kg], inflating, and coefficients (contraction [mm] over pressure [bar],
    highest power first) by the name of the equation. Returns ``equations``, for each its ``rms``
    [mm] on its mean readings, that of a ``refit``, the readings that it fits best (``best``), and
    the equation of which it is a copy (``copy_of``); and ``discrepancies``, sentences. A ValueError
    says that the table lacks the load of a curve.
    """
    equations = [_equation(table, name, *curve) for name, curve in curves.items()]
    for equation in equations:  # the one with the same coefficients that fits its readings better
        equation["copy_of"] = next(
            (
                other["name"]
                for other in equations
                if other["coefficients"] == equation["coefficients"]
                and _ratio(other) < _ratio(equation)
            ),
            None,
        )
    texts = [text for text in map(_discrepancy, equations) if text]
    return {"equations": equations, "discrepancies": texts}


def _equation(
    table: ContractionTable, name: str, load: float, inflating: bool, coefficients: Sequence[float]
) -> dict[str, Any]:
    def mean(place: tuple[float, bool]) -> tuple[Array, Array]:
        pressure, values = table.branch(*place)
        return pressure / BAR, values.mean(axis=1) / MM

    def error(coefficients: Any, place: tuple[float, bool]) -> float:
        pressure, values = mean(place)
        return float(np.sqrt(np.mean(np.square(np.polyval(coefficients, pressure) - values))))

    own = (load, inflating)
    errors = {
        (other, way): error(coefficients, (other, way))
        for other in table.loads
        for way in (True, False)
    }
    best = min(errors, key=lambda other: errors[other])
    return {
        "name": name,
        "load": load,
        "inflating": inflating,
        "coefficients": tuple(coefficients),
        "rms": error(coefficients, own),
        "refit": error(np.polyfit(*mean(own), len(coefficients) - 1), own),
        "best": {"load": best[0], "inflating": best[1], "rms": errors[best]},
    }


def _ratio(equation: Mapping[str, Any]) -> float:
    return float(equation["rms"] / max(equation["refit"], 1e-9))


def _discrepancy(equation: Mapping[str, Any]) -> str | None:
    way = "inflating" if equation["inflating"] else "deflating"
    missed = f"misses the readings at {equation['load']:g} kg {way} by {equation['rms']:.2f} mm RMS"
    best, refit = equation["best"], f"a refit by {equation['refit']:.2f} mm"
    if equation["copy_of"]:
        return (
            f"equation {equation['name']} is a copy of {equation['copy_of']}: it {missed}, those "
            f"at {best['load']:g} kg by {best['rms']:.2f} mm, and {refit}"
        )
    if _ratio(equation) > POOR_FIT:
        return (
            f"equation {equation['name']} {missed}, {refit}: it was fitted to other readings, or "
            "its coefficients are truncated"
        )
    return None
