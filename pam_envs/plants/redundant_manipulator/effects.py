"""Effects of the redundant manipulator: kernels in the place of the plain plant's placeholders.

Every muscle has the effects of its path (dead time, regulator, supply, leak, line, creep,
temperature, first cycles), with the same parameters, and every sensor has those of its kind.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import kernel
from pam_envs.kernels.history import N_HISTORY
from pam_envs.mechanics.serial_chain.kinematics import N_STAGES
from pam_envs.plants.core.muscle_path import PATH_STATE, begin_path, path_step
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.plants.redundant_manipulator.rows import EFFECT, STATE
from pam_envs.sensing.sensor import begin_sensor, sense

EFFECTS_AT = 0  # placeholder: the row after the hysteresis's state
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


@kernel
def begin_sensors(rows: Any, fixed: Any, j: int) -> None:
    """Begin the sensors of lane ``j`` at rest."""
    for k in range(N_STAGES):
        begin_sensor(
            rows, fixed, j, EFFECTS_AT + STATE.angles + k, EFFECTS_AT + STATE.angle_rings + k * N_HISTORY,
            EFFECT.angle_sensor, rows[M.ANGLE + k][j], fixed[M.LIMIT][j],
        )  # fmt: skip
    for m in range(2 * N_STAGES):
        begin_sensor(
            rows, fixed, j, EFFECTS_AT + STATE.pressures + m,
            EFFECTS_AT + STATE.pressure_rings + m * N_HISTORY, EFFECT.pressure_sensor,
            rows[M.PRESSURE + m][j], fixed[M.MAX_PRESSURE][j],
        )  # fmt: skip


@kernel
def read_sensors(rows: Any, fixed: Any, j: int, step: int, period: float) -> None:
    """Write the undisturbed readings of lane ``j`` at the end of a control period."""
    time = step * period
    for k in range(N_STAGES):
        sense(
            rows, fixed, j, EFFECTS_AT + STATE.angles + k, EFFECTS_AT + STATE.angle_rings + k * N_HISTORY,
            EFFECT.angle_sensor, rows[M.ANGLE + k][j], fixed[M.LIMIT][j], step, time, period,
        )  # fmt: skip
    for m in range(2 * N_STAGES):
        sense(
            rows, fixed, j, EFFECTS_AT + STATE.pressures + m,
            EFFECTS_AT + STATE.pressure_rings + m * N_HISTORY, EFFECT.pressure_sensor,
            rows[M.PRESSURE + m][j], fixed[M.MAX_PRESSURE][j], step, time, period,
        )  # fmt: skip


def effect_kernels(first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``."""
    return {
        "EFFECTS_AT": first,
        "EFFECTIVE": first + STATE.effective,
        "SENSED_ANGLE": first + STATE.angles,
        "SENSED_PRESSURE": first + STATE.pressures,
        "regulate": regulate_extended,
        "begin_muscles": begin_muscles,
        "begin_sensors": begin_sensors,
        "read_sensors": read_sensors,
    }
