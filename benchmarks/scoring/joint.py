"""Metrics of an antagonistic joint and of a chain of joints, in addition to the common ones.

Which of these a track has is written in its scenario file (``metrics: [joint]`` or ``[chain]``).
The headline of a joint is of the true output and the external reference. A tool has a place and a
direction, five numbers: the headline of a chain, ``tool_rms_error``, is over two points of it, the
tip and the one a link's length behind it along the tool, so that a direction that is given up for
the tip shows. How well a model-following controller
keeps to its own model is another question: ``model_rms_error`` compares the true angles with what
the controller says its model does (NaN for one that has no model), and is never the headline.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from benchmarks.scoring.errors import rms

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

COMMON: dict[str, str] = {"model_rms_error": "rad", "saturated_time": "1", "slack_time": "1"}
"""Error to the controller's own model; shares of time with a set-point out of reach, and with a
slack muscle."""
JOINT: dict[str, str] = {"rms_percent": "%", **COMMON}
"""Error over half the range of the reference, and what is common."""
CHAIN: dict[str, str] = {
    "tool_rms_error": "m",
    "pointing_rms": "1",
    "joint_rms": "rad",
    "largest_angle": "rad",
    **COMMON,
}
"""Of two points of the tool, of its direction (a chord: radians where it is small), of the planned
joint angles, the largest angle of a joint, and what is common."""
POSITION, DIRECTION = ("x", "y", "z"), ("point_x", "point_y", "point_z")
MODEL = "model/"
"""Prefix of the keys of a controller's model: ``model/0`` is of the first joint."""


def _common(signals: Mapping[str, Array], window: Mask, angles: list[str]) -> dict[str, float]:
    models = [f"{MODEL}{k}" for k in range(len(angles))]
    pairs = list(zip(angles, models, strict=True)) if set(models) <= set(signals) else []
    return {
        "model_rms_error": rms(np.array([signals[a] - signals[m] for a, m in pairs])[:, window])
        if pairs
        else float("nan"),
        "saturated_time": float(np.mean(signals["saturated"][window])),
        "slack_time": float(np.mean(signals["state/slack"][window] > 0.0)),
    }


def of_joint(signals: Mapping[str, Array], window: Mask) -> dict[str, float]:
    """Return the metrics of ``JOINT``.

    Parameters
    ----------
    signals : mapping of (n,) array
    window : (n,) array of bool
        After settling.
    """
    reference = signals["reference"][window]
    half = 0.5 * float(np.ptp(reference))
    error = rms(signals["output"][window] - reference)
    return {
        "rms_percent": 100.0 * error / half if half > 0.0 else float("nan"),
        **_common(signals, window, ["state/angle"]),
    }


def tool_error(signals: Mapping[str, Array], window: Mask, length: float) -> float:
    """Return the RMS distance [m] of two points of the tool from where they should be.

    Parameters
    ----------
    signals : mapping of (n,) array
    window : (n,) array of bool
    length : float
        From the tip back to the other point [m].
    """
    tip, turn = (_off(signals, names)[:, window] for names in (POSITION, DIRECTION))
    return rms(np.linalg.norm([tip, tip - length * turn], axis=1))


def _off(signals: Mapping[str, Array], names: tuple[str, ...]) -> Array:
    """Return true minus desired parts of a pose, shape (3, n)."""
    return np.array([signals[f"state/{k}"] - signals[f"state/reference_{k}"] for k in names])


def way(signals: Mapping[str, Array]) -> Array:
    """Return the path length of the desired pose, shape (n,), constant while the pose rests.

    Parameters
    ----------
    signals : mapping of (n,) array
    """
    desired = np.array([signals[f"state/reference_{k}"] for k in (*POSITION, *DIRECTION)])
    steps = np.linalg.norm(np.diff(desired, axis=1), axis=0)
    return np.concatenate([[0.0], np.cumsum(steps)])


def of_chain(signals: Mapping[str, Array], window: Mask, tool_length: float) -> dict[str, float]:
    """Return the metrics of ``CHAIN``.

    Parameters
    ----------
    signals, window
        As of :func:`of_joint`.
    tool_length : float
        As of :func:`tool_error` [m].
    """
    stages = sum(key.startswith("state/joint_reference_") for key in signals)
    angles = [f"state/angle_{k}" for k in range(stages)]
    turned = np.array([signals[key] for key in angles])[:, window]
    return {
        "tool_rms_error": tool_error(signals, window, tool_length),
        "pointing_rms": rms(signals["state/pointing_error"][window]),
        "joint_rms": rms(signals["state/joint_error"][window]),
        "largest_angle": float(np.max(np.abs(turned))),
        **_common(signals, window, angles),
    }
