"""Metrics of the elbow orthosis: errors of torque and stiffness, and the torque that is felt.

``impedance_rms``, the headline, is the RMS error of the torque over two angles, ``NEAR`` on either
side of the present one. ``rms_error`` is of the torque alone, which is best where the bundles are
nearly slack, since friction grows with their forces. Errors are against the references at the true
angle.
"""

import numpy as np

from benchmarks.scoring.group import EFFORT, OUT_OF_REACH, Column, Group, Record, rms
from pam_envs.tasks.torque_stiffness import FREE

NEAR = 0.2  # angle [rad] at which an error of the stiffness counts: 11 degrees
LEAST = 1e-6  # smallest clipping [N m], [N m/rad] that counts as one
UNITS = {
    "impedance_rms": "N m",
    "stiffness_rms": "N m/rad",
    "felt_rms": "N m",
    "free_felt_rms": "N m",
    "switchings": "1/s",
    "saturated_time": "1",
    "torque_clipped": "N m",
    "stiffness_clipped": "N m/rad",
    "slack_time": "1",
}
"""``felt_rms`` is of the torque that the orthosis puts on the wearer less that of the virtual
object; ``free_felt_rms`` of free motion alone (transparency), NaN where there is none.
``switchings`` counts coils switched on; ``saturated_time`` and the clippings (RMS) are of an
infeasible torque or stiffness."""
COLUMNS: tuple[Column, ...] = (
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


def of_elbow(record: Record) -> dict[str, float]:
    """Return the metrics of ``UNITS``."""
    signals, window = record.signals, record.window

    def error(signal: str, reference: str) -> np.ndarray:
        return np.asarray(signals[signal])[window] - np.asarray(signals[reference])[window]

    torque = np.asarray(signals["state/torque_clipped"])[window]
    stiffness = np.asarray(signals["state/stiffness_clipped"])[window]
    wrong = error("output", "reference")
    soft = error("state/stiffness", "state/stiffness_reference")
    felt = error("state/felt", "state/object_torque")
    free = np.asarray(signals["state/object"])[window] == FREE
    return {
        "impedance_rms": rms(np.array([wrong + NEAR * soft, wrong - NEAR * soft])),
        "stiffness_rms": rms(soft),
        "felt_rms": rms(felt),
        "free_felt_rms": rms(felt[free]),
        "switchings": record.rate("effort/switchings"),
        "saturated_time": float(np.mean((np.abs(torque) > LEAST) | (np.abs(stiffness) > LEAST))),
        "torque_clipped": rms(torque),
        "stiffness_clipped": rms(stiffness),
        "slack_time": float(np.mean(np.asarray(signals["state/slack"])[window] > 0.0)),
    }


ELBOW = Group("elbow", UNITS, of_elbow, lambda errors: COLUMNS)
