"""Effects of the knee orthosis: kernels in the place of the plain plant's placeholders.

The muscle has the effects of its path: dead time, regulator, supply, leak and line behind the
regulator's lag, creep, temperature and first cycles with any dynamics; the hysteresis turns the
effective pressure into stiffness. The brace alone has a bearing that sticks and slips, and all
sensors have their effects.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import LANES, kernel, scratch
from pam_envs.mechanics.guide import turn_on_bearing
from pam_envs.plants.core.muscle_path import PATH_STATE, begin_path, path_air, path_muscle
from pam_envs.plants.core.sensors import sensor_kernels
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.rows import EFFECT, STATE
from pam_envs.sensing.sensor import SENSOR

EFFECTS_AT = 0  # placeholder: the row after the hysteresis state
plain_regulate: Any = None  # placeholder: the dynamics of the pressure of the plain plant

MEASURED = (K.TENSION, K.ANGLE, K.PRESSURE, K.HEEL, K.GROUND_Z, K.COP, K.ANKLE)
"""Rows of the quantities that ``SENSORS`` measure."""
FULL_SCALES = (300.0, 3.2, 4.5e5, 50.0, 1e3, 0.3, 1.0)
"""Full scales of the sensors: N, rad, Pa, kg, N, m, rad."""


@kernel
def regulate_with_lag(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float
) -> None:
    """Advance the pressures of a tile behind the lag of the regulator, with all effects."""
    path_air(
        rows, fixed, EFFECTS_AT + STATE.path, EFFECT.path, K.MAX_PRESSURE, rows[K.PRESSURE],
        rows[K.SET_POINT], counts[K.STEP], i, substeps, period,
    )  # fmt: skip
    advance_muscle(rows, fixed, period / substeps)


@kernel
def regulate_as_measured(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float
) -> None:
    """Advance the modes of the published frequency response; the muscle has its effects."""
    pressure, travel = rows[K.PRESSURE], rows[EFFECTS_AT + STATE.path + PATH_STATE.travel]
    was = scratch(1, LANES)
    for j in range(LANES):
        was[0][j] = pressure[j]
    plain_regulate(rows, fixed, counts, i, substeps, period)
    for j in range(LANES):
        travel[j] += abs(pressure[j] - was[0][j])
    advance_muscle(rows, fixed, period / substeps)


@kernel
def advance_muscle(rows: Any, fixed: Any, h: float) -> None:
    """Write the effective pressures of a tile after a sub-step, within the regulator's range."""
    own = scratch(2, LANES)
    path_muscle(
        rows,
        fixed,
        EFFECTS_AT + STATE.path,
        EFFECT.path,
        EFFECT.warm,
        rows[K.PRESSURE],
        h,
        own[0],
        own[1],
    )
    for j in range(LANES):
        effective = max(0.0, rows[K.PRESSURE][j] + own[0][j]) * own[1][j]
        rows[EFFECTS_AT + STATE.effective][j] = min(fixed[K.MAX_PRESSURE][j], effective)


@kernel
def begin_muscle(rows: Any, fixed: Any, j: int) -> None:
    """Begin the path of the muscle of lane ``j`` at its pressure."""
    effective = begin_path(
        rows, fixed, j, EFFECTS_AT + STATE.path, EFFECT.path, EFFECT.warm, rows[K.PRESSURE][j]
    )
    rows[EFFECTS_AT + STATE.effective][j] = min(fixed[K.MAX_PRESSURE][j], effective)
    rows[EFFECTS_AT + STATE.stuck][j] = 1.0


def effect_kernels(dynamics: str, plain: Any, first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``.

    ``plain`` is the dynamics of the pressure of the plain plant.
    """
    sensors = first + STATE.sensors
    effects = [EFFECT.sensors + k * len(SENSOR) for k in range(len(MEASURED))]
    return sensor_kernels(sensors, MEASURED, effects, FULL_SCALES) | {
        "EFFECTS_AT": first,
        "EFFECTIVE": first + STATE.effective,
        "SENSED": tuple(sensors + k for k in range(len(MEASURED))),
        "plain_regulate": plain,
        "regulate": regulate_with_lag if dynamics == "lag" else regulate_as_measured,
        "begin_muscle": begin_muscle,
        "STUCK": first + STATE.stuck,
        "BEARING": EFFECT.bearing,
        "turn": turn_on_bearing,
    }
