"""Metrics of an antagonistic joint and of a chain of joints.

The headline of a chain, ``tool_rms_error``, is over two points of its tool: the tip, and the point
one tool length behind it, so that an error of the direction counts. ``model_rms_error`` compares
the true angles with the output of a model-following controller's own model, ``model/0`` for the
first joint (NaN without a model).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.scoring import group
from pam_envs.arrays import Array

_COMMON = {"model_rms_error": "rad", "saturated_time": "1", "slack_time": "1"}
"""Shares of time are of a setpoint out of reach, and of a slack muscle."""
_MODEL: group.Column = ("model_rms_error", "error to its own model, RMS [deg]", group.DEGREES)
CHAIN_UNITS = {
    "tool_rms_error": "m",
    "pointing_rms": "1",
    "joint_rms": "rad",
    "largest_angle": "rad",
    **_COMMON,
}
"""``pointing_rms`` is of the tool's direction, a chord: radians where it is small."""
CHAIN_COLUMNS: tuple[group.Column, ...] = (
    ("rms_error", "tip RMS [mm]", 1e3),
    ("pointing_rms", "pointing RMS [deg]", group.DEGREES),
    ("p95_error", "p95 [mm]", 1e3),
    ("max_error", "max [mm]", 1e3),
    ("steady_state_error", "steady [mm]", 1e3),
    ("sensed_rms_error", "sensed RMS [mm]", 1e3),
    ("joint_rms", "joints RMS [deg]", group.DEGREES),
    ("largest_angle", "largest joint angle [deg]", group.DEGREES),
    _MODEL,
    *group.EFFORT,
    group.OUT_OF_REACH,
)
POSITION, DIRECTION = ("x", "y", "z"), ("point_x", "point_y", "point_z")


def _common(record: group.Record, angles: Sequence[str]) -> dict[str, float]:
    signals, window = record.signals, record.window
    models = [f"model/{k}" for k in range(len(angles))]
    error = np.array(
        [signals[a] - signals[m] for a, m in zip(angles, models, strict=True)]
        if set(models) <= set(signals)
        else np.empty((0, len(window)))
    )
    return {
        "model_rms_error": group.rms(error[:, window]),
        "saturated_time": float(np.mean(signals["saturated"][window])),
        "slack_time": float(np.mean(signals["state/slack"][window] > 0.0)),
    }


def of_joint(record: group.Record) -> dict[str, float]:
    """Return the metrics of a joint."""
    reference = record.signals["reference"][record.window]
    half = 0.5 * float(np.ptp(reference))
    error = group.rms(record.signals["output"][record.window] - reference)
    return {
        "rms_percent": 100.0 * error / half if half > 0.0 else float("nan"),
        **_common(record, ["state/angle"]),
    }


def path_length(signals: Mapping[str, Array]) -> Array:
    """Return the path length of the desired pose, shape (n,), constant while the pose rests."""
    desired = np.array([signals[f"state/reference_{k}"] for k in (*POSITION, *DIRECTION)])
    steps = np.linalg.norm(np.diff(desired, axis=1), axis=0)
    return np.concatenate([[0.0], np.cumsum(steps)])


def of_chain(record: group.Record) -> dict[str, float]:
    """Return the metrics of ``CHAIN_UNITS``."""
    signals, window = record.signals, record.window
    stages = sum(key.startswith("state/joint_reference_") for key in signals)
    angles = [f"state/angle_{k}" for k in range(stages)]
    turned = np.array([signals[key] for key in angles])[:, window]
    tip, turn = (
        np.array([(signals[f"state/{k}"] - signals[f"state/reference_{k}"])[window] for k in names])
        for names in (POSITION, DIRECTION)
    )
    length = record.content["tool_length"]
    return {
        "tool_rms_error": group.rms(np.linalg.norm([tip, tip - length * turn], axis=1)),
        "pointing_rms": group.rms(signals["state/pointing_error"][window]),
        "joint_rms": group.rms(signals["state/joint_error"][window]),
        "largest_angle": float(np.max(np.abs(turned))),
        **_common(record, angles),
    }


JOINT = group.Group(
    "joint",
    {"rms_percent": "%", **_COMMON},
    of_joint,
    lambda errors: (group.RMS_PERCENT, *errors, _MODEL, *group.EFFORT, group.OUT_OF_REACH),
)
CHAIN = group.Group(
    "chain",
    CHAIN_UNITS,
    of_chain,
    lambda errors: CHAIN_COLUMNS,
    needs=("tool_length",),
    path=path_length,
)
