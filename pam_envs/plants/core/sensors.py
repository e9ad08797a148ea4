"""Readings of a plant's sensors: none of their own in a plain plant, with effects in an extended.

The kernels of a plant call :func:`read_sensors` at the beginning (period 0) and at the end of each
control period; ``sensor_kernels`` gives what takes its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pam_envs.kernels.build import kernel
from pam_envs.kernels.history import N_HISTORY
from pam_envs.sensing.sensor import begin_sensor, sense

# placeholders, filled in for each plant
MEASURED: tuple[int, ...] = ()
SENSOR_EFFECTS: tuple[int, ...] = ()
FULL_SCALES: tuple[float, ...] = ()
READINGS = 0


@kernel
def read_sensors(rows: Any, fixed: Any, j: int, step: int, period: float) -> None:
    """Write readings with the effects of the sensors: a plain plant has none."""


@kernel
def read_with_effects(rows: Any, fixed: Any, j: int, step: int, period: float) -> None:
    """Write the undisturbed readings of lane ``j``; those of period 0 begin the sensors.

    The readings are rows from ``READINGS``, followed by a ring for each.
    """
    for k in range(len(MEASURED)):
        ring = READINGS + len(MEASURED) + k * N_HISTORY
        value, effects, full = rows[MEASURED[k]][j], SENSOR_EFFECTS[k], FULL_SCALES[k]
        if step == 0:
            begin_sensor(rows, fixed, j, READINGS + k, ring, effects, value, full)
        else:
            sense(
                rows, fixed, j, READINGS + k, ring, effects, value, full, step, step * period,
                period,
            )  # fmt: skip


def sensor_rows(sensors: int) -> int:
    """Return how many rows of state the readings of some sensors take."""
    return sensors * (1 + N_HISTORY)


def sensor_kernels(
    first: int, measured: Sequence[int], effects: Sequence[int], full_scales: Sequence[float]
) -> dict[str, Any]:
    """Return the kernel of a plant's sensors and its placeholders.

    Parameters
    ----------
    first : int
        First row of their state, of :func:`sensor_rows`.
    measured, effects, full_scales : sequence
        Row of each measured quantity, first row of each sensor's effects, and full scale.
    """
    return {
        "MEASURED": tuple(measured),
        "SENSOR_EFFECTS": tuple(effects),
        "FULL_SCALES": tuple(full_scales),
        "READINGS": first,
        "read_sensors": read_with_effects,
    }
