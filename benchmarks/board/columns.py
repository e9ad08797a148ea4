"""Columns of a track's tables: metrics with their headings and factors from SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.runs.rows import shown

Column = tuple[str, str, float]
"""Metric, heading and factor from SI."""

EFFORT: tuple[Column, ...] = (
    ("pressure_travel", "pressure travel [bar/s]", 1e-5),
    ("air_use", "air [mg/s]", 1e6),
)
SATURATED: Column = ("saturated_time", "true pressure at capacity [%]", 100.0)
GAIT: tuple[Column, ...] = (
    ("rms_percent", "RMS [% of half-range]", 1.0),
    ("angle_rms", "swing: angle RMS [deg]", float(np.degrees(1.0))),
    ("switch_error", "error at the switch [N]", 1.0),
    ("switch_excess", "excess after it [N]", 1.0),
    ("pressure_jump", "jump of pressure [bar]", 1e-5),
    ("torque_rms", "assistance RMS, as desired [N m]", 1.0),
    ("torque_ideal_rms", "of the true demand [N m]", 1.0),
    ("emg_ratio", "EMG ratio", 1.0),
    ("emg_extensors_ratio", "of extensors", 1.0),
    ("emg_flexors_ratio", "of flexors", 1.0),
    ("emg_ratio_fitted_a", "fitted, A", 1.0),
    ("emg_ratio_fitted_b", "fitted, B", 1.0),
    *EFFORT,
    SATURATED,
)
"""Columns of a gait after the headline."""

DEGREES = float(np.degrees(1.0))
MODEL: Column = ("model_rms_error", "error to its own model, RMS [deg]", DEGREES)
OUT_OF_REACH: Column = ("saturated_time", "out of reach [%]", 100.0)

ELBOW: tuple[Column, ...] = (
    ("rms_error", "torque RMS [N m]", 1.0),
    ("stiffness_rms", "stiffness RMS [N m/rad]", 1.0),
    ("p95_error", "p95 [N m]", 1.0),
    ("max_error", "max [N m]", 1.0),
    ("sensed_rms_error", "estimated RMS [N m]", 1.0),
    ("felt_rms", "felt beside the object, RMS [N m]", 1.0),
    ("free_felt_rms", "felt in free motion, RMS [N m]", 1.0),
    *EFFORT,
    ("switchings", "switchings [1/s]", 1.0),
    OUT_OF_REACH,
)
"""Columns of the elbow orthosis."""

CHAIN: tuple[Column, ...] = (
    ("rms_error", "tip RMS [mm]", 1e3),
    ("pointing_rms", "pointing RMS [deg]", DEGREES),
    ("p95_error", "p95 [mm]", 1e3),
    ("max_error", "max [mm]", 1e3),
    ("steady_state_error", "steady [mm]", 1e3),
    ("sensed_rms_error", "sensed RMS [mm]", 1e3),
    ("joint_rms", "joints RMS [deg]", DEGREES),
    ("largest_angle", "largest joint angle [deg]", DEGREES),
    MODEL,
    *EFFORT,
    OUT_OF_REACH,
)
"""Columns of a chain of joints whose tool follows a path."""


def columns_of(content: Mapping[str, Any]) -> tuple[Column, ...]:
    """Return the columns after the headline of a track, from the content of its file."""
    groups = content.get("metrics") or ()
    if "gait" in groups:
        return GAIT
    if "elbow" in groups:
        return ELBOW
    if "chain" in groups:
        return CHAIN
    unit, factor = shown(content)
    errors: tuple[Column, ...] = (
        ("p95_error", f"p95 [{unit}]", factor),
        ("max_error", f"max [{unit}]", factor),
        ("steady_state_error", f"steady [{unit}]", factor),
        ("sensed_rms_error", f"sensed RMS [{unit}]", factor),
    )
    if "range" in groups:
        errors = (("rms_percent", "RMS [% of half-range]", 1.0), *errors[:2], errors[3])
        return (*errors, *EFFORT, SATURATED)
    if "joint" in groups:
        errors = (("rms_percent", "RMS [% of half-range]", 1.0), *errors, MODEL)
        return (*errors, *EFFORT, OUT_OF_REACH)
    return (*errors, *EFFORT, ("constraint_cost", "constraint cost", 1.0))


def with_costs(columns: Sequence[Column]) -> tuple[Column, ...]:
    """Return the columns with the constraint cost, which claims depend on."""
    if any(metric == "constraint_cost" for metric, _, _ in columns):
        return tuple(columns)
    return (*columns, ("constraint_cost", "constraint cost", 1.0))
