"""Effects of the antagonistic joint: kernels in the place of the plain plant's placeholders.

Both muscles have the effects of their path (dead time, regulator, supply, leak, line, creep,
temperature, first cycles), the bearing sticks and slips, and the sensors have theirs. In the
reduced plant, which moves by its commands, only the pressures and the sensors have effects.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import kernel
from pam_envs.mechanics.guide import turn_on_bearing
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.rows import EFFECT, STATE
from pam_envs.plants.core.muscle_path import PATH_STATE, begin_path, path_step
from pam_envs.plants.core.sensors import sensor_kernels

EFFECTS_AT = 0  # placeholder: the row after the hysteresis state
FULL_SCALES = (0.5236, 6.5e5, 6.5e5)
"""Full scales of the sensors: rad, Pa, Pa."""


@kernel
def regulate_extended(
    rows: Any, fixed: Any, counts: Any, side: int, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance pressure and effective pressure of one muscle of a tile through a sub-step."""
    path_step(
        rows, fixed, EFFECTS_AT + STATE.paths + side * PATH_STATE.end, EFFECT.path, K.MAX_PRESSURE,
        EFFECT.warm, rows[K.PRESSURE_A + side], rows[K.SET_POINT_A + side],
        rows[EFFECTS_AT + STATE.effective + side], work[side], counts[K.STEP], i, substeps, period,
    )  # fmt: skip


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the paths of both muscles of lane ``j`` at their pressures."""
    for side in range(2):
        state = EFFECTS_AT + STATE.paths + side * PATH_STATE.end
        pressure = rows[K.PRESSURE_A + side][j]
        rows[EFFECTS_AT + STATE.effective + side][j] = begin_path(
            rows, fixed, j, state, EFFECT.path, EFFECT.warm, pressure
        )
    rows[EFFECTS_AT + STATE.stuck][j] = 1.0


def effect_kernels(first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``."""
    sensors = first + STATE.sensors
    measured = (K.ANGLE, K.PRESSURE_A, K.PRESSURE_A + 1)
    effects = (EFFECT.angle, EFFECT.pressure, EFFECT.pressure)
    return sensor_kernels(sensors, measured, effects, FULL_SCALES) | {
        "EFFECTS_AT": first,
        "EFFECTIVE_A": first + STATE.effective,
        "SENSED_ANGLE": sensors,
        "SENSED_PRESSURE": sensors + 1,
        "regulate": regulate_extended,
        "begin_muscles": begin_muscles,
        "STUCK": first + STATE.stuck,
        "BEARING": EFFECT.bearing,
        "turn": turn_on_bearing,
    }
