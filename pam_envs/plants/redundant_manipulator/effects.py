"""Effects of the redundant manipulator: kernels in the place of the plain plant's placeholders.

Every muscle has the effects of its path (dead time, regulator, supply, leak, line, creep,
temperature, first cycles), with the same parameters, and every sensor has those of its kind.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import kernel
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES
from pam_envs.plants.core.muscle_path import PATH_STATE, begin_path, path_step
from pam_envs.plants.core.sensors import sensor_kernels
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.rows import EFFECT, STATE

EFFECTS_AT = 0  # placeholder: the row after the hysteresis state
FULL_ANGLE, FULL_PRESSURE = 0.5236, 6.5e5
"""Full scales of the sensors [rad, Pa]."""
WAS = 0
"""First row of scratch: effective pressures before a sub-step."""


@kernel
def regulate_extended(
    rows: Any, fixed: Any, counts: Any, m: int, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance pressure and effective pressure of muscle ``m`` of a tile through a sub-step."""
    path_step(
        rows, fixed, EFFECTS_AT + STATE.paths + m * PATH_STATE.end, EFFECT.path, M.MAX_PRESSURE,
        EFFECT.warm, rows[M.PRESSURE + m], rows[M.SET_POINT + m],
        rows[EFFECTS_AT + STATE.effective + m], work[WAS + m], counts[M.STEP], i, substeps, period,
    )  # fmt: skip


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the paths of all muscles of lane ``j`` at their pressures."""
    for m in range(2 * N_STAGES):
        state, pressure = EFFECTS_AT + STATE.paths + m * PATH_STATE.end, rows[M.PRESSURE + m][j]
        rows[EFFECTS_AT + STATE.effective + m][j] = begin_path(
            rows, fixed, j, state, EFFECT.path, EFFECT.warm, pressure
        )


def effect_kernels(stages: int, first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``."""
    sensors, muscles = first + STATE.sensors, 2 * stages
    measured = [M.ANGLE + k for k in range(stages)] + [M.PRESSURE + m for m in range(muscles)]
    effects = [EFFECT.angle] * stages + [EFFECT.pressure] * muscles
    full_scales = [FULL_ANGLE] * stages + [FULL_PRESSURE] * muscles
    return sensor_kernels(sensors, measured, effects, full_scales) | {
        "EFFECTS_AT": first,
        "EFFECTIVE": first + STATE.effective,
        "SENSED_ANGLE": sensors,
        "SENSED_PRESSURE": sensors + stages,
        "regulate": regulate_extended,
        "begin_muscles": begin_muscles,
    }
