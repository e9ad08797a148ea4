"""Effects of the antagonistic joint: kernels in the place of the plain plant's placeholders.

Both muscles have the effects of their path (dead time, regulator, supply, leak, line, creep,
temperature, first cycles), the bearing sticks and slips, and the sensors have theirs. In the
reduced plant, which moves by its commands, only the pressures and the sensors have effects.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import kernel
from pam_envs.kernels.history import N_HISTORY
from pam_envs.mechanics.guide import bearing_step
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.rows import EFFECT, STATE
from pam_envs.plants.core.muscle_path import PATH_STATE, begin_path, path_step
from pam_envs.sensing.sensor import begin_sensor, sense

EFFECTS_AT = 0  # placeholder: the row after the hysteresis's state


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


@kernel
def turn(
    rows: Any, fixed: Any, j: int, velocity: float, acceleration: float, jerk: float,
    stiffness: float, damping: float, per_inertia: float, h: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the turn [rad] of a joint on a bearing that sticks and slips, and its velocity."""
    return bearing_step(
        rows, fixed, j, EFFECTS_AT + STATE.stuck, EFFECT.bearing, velocity, acceleration, jerk,
        stiffness, damping, per_inertia, h,
    )  # fmt: skip


@kernel
def begin_sensors(rows: Any, fixed: Any, j: int) -> None:
    """Begin the sensors of lane ``j`` at rest."""
    begin_sensor(
        rows, fixed, j, EFFECTS_AT + STATE.angle, EFFECTS_AT + STATE.angle_ring, EFFECT.angle_sensor,
        rows[K.ANGLE][j], fixed[K.LIMIT][j],
    )  # fmt: skip
    for side in range(2):
        begin_sensor(
            rows, fixed, j, EFFECTS_AT + STATE.pressures + side,
            EFFECTS_AT + STATE.pressure_rings + side * N_HISTORY, EFFECT.pressure_sensor,
            rows[K.PRESSURE_A + side][j], fixed[K.MAX_PRESSURE][j],
        )  # fmt: skip


@kernel
def read_sensors(rows: Any, fixed: Any, j: int, step: int, period: float) -> None:
    """Write the undisturbed readings of lane ``j`` at the end of a control period."""
    time = step * period
    sense(
        rows, fixed, j, EFFECTS_AT + STATE.angle, EFFECTS_AT + STATE.angle_ring, EFFECT.angle_sensor,
        rows[K.ANGLE][j], fixed[K.LIMIT][j], step, time, period,
    )  # fmt: skip
    for side in range(2):
        sense(
            rows, fixed, j, EFFECTS_AT + STATE.pressures + side,
            EFFECTS_AT + STATE.pressure_rings + side * N_HISTORY, EFFECT.pressure_sensor,
            rows[K.PRESSURE_A + side][j], fixed[K.MAX_PRESSURE][j], step, time, period,
        )  # fmt: skip


def effect_kernels(first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``."""
    return {
        "EFFECTS_AT": first,
        "EFFECTIVE_A": first + STATE.effective,
        "SENSED_ANGLE": first + STATE.angle,
        "SENSED_PRESSURE": first + STATE.pressures,
        "regulate": regulate_extended,
        "begin_muscles": begin_muscles,
        "begin_sensors": begin_sensors,
        "read_sensors": read_sensors,
        "turn": turn,
    }
