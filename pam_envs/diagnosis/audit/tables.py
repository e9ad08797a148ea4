"""Checks of a table of settled readings: drift over repeats, copies, unequal scatter."""

import dataclasses

import numpy as np
from scipy import stats

from pam_envs.arrays import Array
from pam_envs.constants import MM
from pam_envs.data.tables import ContractionTable, one_path

SIGNIFICANT = 0.05
TREND = 2.5  # absolute t value above which a trend over the repeats is reported
FEW_LOADS = {
    1: "there is one load: causes that act with the load cannot be decided",
    2: "there are two loads: whether an effect is in proportion to the load is not known",
    3: "there are three loads: a quadratic load law cannot be separated from a dead zone; measure "
    "at least five",
}


@dataclasses.dataclass(frozen=True)
class Trend:
    """Drift of the contraction over the repeats at one load."""

    slope: float  # drift per repeat [m]
    t: float  # slope over its standard error, from the scatter of the readings
    t_means: float  # the same from the means of the repeats; NaN for fewer than three repeats


def repeat_trend(table: ContractionTable, load: float) -> Trend:
    """Return the drift over repeats of the same path at ``load`` [kg]."""
    left = _deviations(table, load)
    cells, repeats = left.shape
    if repeats < 2:
        raise ValueError(f"one repeat at {load:g} kg shows no trend; measure at least two")
    x = np.arange(repeats) - 0.5 * (repeats - 1)
    slope = float(np.sum(left @ x) / (cells * (x @ x)))
    rest = left - slope * x
    error = np.sqrt(np.sum(rest**2) / max(1, left.size - cells - 1) / (cells * (x @ x)))
    means = left.mean(axis=0)
    freedom = repeats - 2
    spread = np.sqrt(np.sum((means - slope * x) ** 2) / max(1, freedom) / (x @ x))
    t_means = slope / spread if freedom > 0 and spread > 0.0 else np.nan
    return Trend(slope, float(slope / error) if error > 0.0 else 0.0, float(t_means))


def scatter(table: ContractionTable, load: float) -> float:
    """Return the standard deviation [m] of the repeats about their means at ``load`` [kg]."""
    left = _deviations(table, load)
    cells, repeats = left.shape
    return float(np.sqrt(np.sum(left**2) / max(1, cells * (repeats - 1))))


def scatter_homogeneity(table: ContractionTable) -> float:
    """Return the p-value of equal scatter at all loads (Levene test about medians)."""
    groups = [_deviations(table, load).ravel() for load in table.loads]
    groups = [group for group in groups if group.size and np.any(group)]
    return float(stats.levene(*groups).pvalue) if len(groups) > 1 else 1.0


def audit_table(table: ContractionTable) -> list[str]:
    """Return warnings on a table of settled readings."""
    warnings = [FEW_LOADS[n]] if (n := len(table.loads)) in FEW_LOADS else []
    if not one_path(table):
        return [
            *warnings,
            "the repeats follow different paths: their scatter and drift were not checked",
        ]
    for load in table.loads:
        warnings += _copied(table, load)
    several = [load for load in table.loads if len(table.repeats(load)) > 1]
    if not several:
        return [*warnings, "every reading was taken once: the noise floor is not known"]
    for load in several:
        trend = repeat_trend(table, load)
        means = "" if np.isnan(trend.t_means) else f", {trend.t_means:.1f} from the repeats' means"
        if abs(trend.t) >= TREND:
            warnings.append(
                f"the readings at {load:g} kg drift by {trend.slope / MM:+.3f} mm a repeat "
                f"(t = {trend.t:.1f}{means}): the muscle was not yet cycled in, or the zero moved"
            )
    if len(several) == len(table.loads) > 1 and (p := scatter_homogeneity(table)) < SIGNIFICANT:
        sizes = ", ".join(
            f"{scatter(table, load) / MM:.3f} mm at {load:g} kg" for load in table.loads
        )
        warnings.append(
            f"the repeats scatter differently between loads (Levene p = {p:.2g}): {sizes}"
        )
    return warnings


def _deviations(table: ContractionTable, load: float) -> Array:
    """Return readings less their mean over repeats, without those that are zero by definition."""
    _, contraction = table.cycles(load)
    cells = contraction[np.any(contraction != 0.0, axis=1)]
    return np.asarray(cells - cells.mean(axis=1, keepdims=True))


def _copied(table: ContractionTable, load: float) -> list[str]:
    _, contraction = table.cycles(load)
    numbers = table.repeats(load)
    return [
        f"repeats {numbers[j]} and {numbers[i]} at {load:g} kg are equal digit by digit: one is a "
        "copy; remove it, or the noise is underestimated"
        for i in range(len(numbers))
        for j in range(i)
        if np.array_equal(contraction[:, i], contraction[:, j])
    ]
