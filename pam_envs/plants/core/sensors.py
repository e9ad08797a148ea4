"""Readings of a plant's sensors, with their effects in an extended plant.

The kernels of a plant call :func:`begin_sensors` at the beginning and :func:`read_sensors` at the
end of each control period; :func:`effect_kernels` gives their replacements.
"""

from collections.abc import Sequence
from typing import Any

from pam_envs.kernels.build import LANES, kernel, scratch
from pam_envs.kernels.motion import N_HISTORY
from pam_envs.mechanics.guide import turn_on_bearing
from pam_envs.sensing.sensor import begin_sensor, sense

# placeholders, filled in for each plant
MEASURED: tuple[int, ...] = ()
SENSOR_EFFECTS: tuple[int, ...] = ()
FULL_SCALES: tuple[float, ...] = ()
READINGS = 0


@kernel
def full_scale(fixed: Any, k: int, j: int) -> float:
    """Return the full scale of sensor ``k``."""
    return FULL_SCALES[k]


@kernel
def begin_sensors(rows: Any, fixed: Any, j: int) -> None:
    """Begin the sensors of one lane: those of a plain plant have no effects."""


@kernel
def read_sensors(rows: Any, fixed: Any, step: Any, period: float) -> None:
    """Write readings with the effects of the sensors of a tile: a plain plant has none."""


@kernel
def begin_with_effects(rows: Any, fixed: Any, j: int) -> None:
    """Begin the sensors of lane ``j``. The readings are rows from ``READINGS``, a ring for each."""
    for k in range(len(MEASURED)):
        ring = READINGS + len(MEASURED) + k * N_HISTORY
        begin_sensor(
            rows, fixed, j, READINGS + k, ring, SENSOR_EFFECTS[k], rows[MEASURED[k]][j],
            full_scale(fixed, k, j),
        )  # fmt: skip


@kernel
def read_with_effects(rows: Any, fixed: Any, step: Any, period: float) -> None:
    """Write the undisturbed readings of a tile at the end of control period ``step``."""
    full = scratch(1, LANES)
    for k in range(len(MEASURED)):
        for j in range(LANES):
            full[0][j] = full_scale(fixed, k, j)
        sense(
            rows, fixed, READINGS + k, READINGS + len(MEASURED) + k * N_HISTORY, SENSOR_EFFECTS[k],
            rows[MEASURED[k]], full[0], step, period,
        )  # fmt: skip


def sensor_rows(sensors: int) -> int:
    """Return how many rows of state the readings of some sensors take."""
    return sensors * (1 + N_HISTORY)


def effect_kernels(
    first: int, layout: Any, measured: Sequence[int], effects: Sequence[int],
    full_scales: Sequence[float], angles: int = 1,
) -> dict[str, Any]:  # fmt: skip
    """Return the kernels of a plant's sensors and bearing, and the rows of their effects.

    ``first`` is the first row of the effects' state, ``layout`` the plant's module of rows;
    ``measured``, ``effects`` and ``full_scales`` hold the row of each measured quantity, the first
    row of each sensor's effects, and its full scale. The first ``angles`` sensors show angles.
    """
    sensors = first + layout.STATE.sensors
    found = {
        "MEASURED": tuple(measured),
        "SENSOR_EFFECTS": tuple(effects),
        "FULL_SCALES": tuple(full_scales),
        "READINGS": sensors,
        "begin_sensors": begin_with_effects,
        "read_sensors": read_with_effects,
        "EFFECTS_AT": first,
        "SENSED": tuple(range(sensors, sensors + len(measured))),
        "SENSED_ANGLE": sensors,
        "SENSED_PRESSURE": sensors + angles,
    }
    if "effective" in layout.STATE._fields:
        found["EFFECTIVE"] = first + layout.STATE.effective
    if "bearing" in layout.EFFECT._fields:
        stuck = first + layout.STATE.stuck
        found |= {"STUCK": stuck, "BEARING": layout.EFFECT.bearing, "turn": turn_on_bearing}
    return found
