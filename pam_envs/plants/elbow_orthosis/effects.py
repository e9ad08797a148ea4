"""Effects of the elbow orthosis: kernels in the place of the plain plant's placeholders.

Both bundles have the effects of their path: dead time, regulator, supply, leak and line where
regulators drive them, creep, first cycles and their own temperature with any valves. The bearing
sticks and slips, and the sensors have their effects.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.history import N_HISTORY
from pam_envs.mechanics.guide import bearing_step
from pam_envs.plants.core.muscle_path import PATH_STATE, WARM, begin_path, path_air, path_muscle
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.air import AIR, GIVES_A, NOW_A, WAS_A, count_used_air
from pam_envs.plants.elbow_orthosis.rows import EFFECT, STATE
from pam_envs.sensing.sensor import begin_sensor, sense

EFFECTS_AT = 0  # placeholder: the row after the hysteresis's state
plain_breathe: Any = None  # placeholders: air of the plain plant
plain_settle: Any = None


@kernel
def path_of(side: int) -> int:
    """Return the first row of the state of a bundle's path."""
    return EFFECTS_AT + STATE.paths + side * PATH_STATE.end  # type: ignore[no-any-return]


@kernel
def effective_pressures(rows: Any, fixed: Any, side: int, h: float, work: Any) -> None:
    """Turn the pressures of a bundle before and after a sub-step into effective ones."""
    was, now, gives = work[WAS_A + side], work[NOW_A + side], work[GIVES_A + side]
    crept, factor = rows[EFFECTS_AT + STATE.crept + side], rows[EFFECTS_AT + STATE.factor + side]
    effective = rows[EFFECTS_AT + STATE.effective + side]
    path_muscle(
        rows,
        fixed,
        path_of(side),
        EFFECT.path,
        EFFECT.warm + side * len(WARM),
        now,
        h,
        crept,
        factor,
    )
    for j in range(LANES):
        was[j] = effective[j]
        now[j] = max(0.0, now[j] + crept[j]) * factor[j]
        gives[j] = gives[j] * factor[j]


@kernel
def breathe_regulated(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance both pressures of a tile towards their set-points, with all effects."""
    h = period / substeps
    for side in range(2):
        pressure = rows[K.PRESSURE_A + side]
        path_air(
            rows, fixed, path_of(side), EFFECT.path, K.MAX_PRESSURE, pressure,
            rows[K.COMMAND_A + side], counts[K.STEP], i, substeps, period,
        )  # fmt: skip
        for j in range(LANES):
            work[NOW_A + side][j] = pressure[j]
            work[GIVES_A + side][j] = 0.0
        effective_pressures(rows, fixed, side, h, work)


@kernel
def breathe_pulsed(
    rows: Any, fixed: Any, counts: Any, i: int, substeps: int, period: float, work: Any
) -> None:
    """Let air through the valves of a tile; the bundles have their effects."""
    plain_breathe(rows, fixed, counts, i, substeps, period, work)
    for side in range(2):
        travel = rows[path_of(side) + PATH_STATE.travel]
        for j in range(LANES):
            travel[j] += abs(work[NOW_A + side][j] - work[WAS_A + side][j])
        effective_pressures(rows, fixed, side, period / substeps, work)


@kernel
def settle_regulated(rows: Any, fixed: Any, work: Any) -> None:
    """Keep the pressures of regulated bundles and their effective pressures."""
    for side in range(2):
        for j in range(LANES):
            rows[EFFECTS_AT + STATE.effective + side][j] = work[NOW_A + side][j]
            count_used_air(rows, fixed, j, side)


@kernel
def settle_pulsed(rows: Any, fixed: Any, work: Any) -> None:
    """Write the pressures of the air that is inside, and the effective ones."""
    plain_settle(rows, fixed, work)
    for side in range(2):
        crept, factor = (
            rows[EFFECTS_AT + STATE.crept + side],
            rows[EFFECTS_AT + STATE.factor + side],
        )
        for j in range(LANES):
            pressure = max(0.0, rows[K.PRESSURE_A + side][j] + crept[j])
            rows[EFFECTS_AT + STATE.effective + side][j] = pressure * factor[j]


@kernel
def begin_muscles(rows: Any, fixed: Any, j: int) -> None:
    """Begin the paths of both bundles of lane ``j`` at their pressures."""
    for side in range(2):
        rows[EFFECTS_AT + STATE.effective + side][j] = begin_path(
            rows, fixed, j, path_of(side), EFFECT.path, EFFECT.warm + side * len(WARM),
            rows[K.PRESSURE_A + side][j],
        )  # fmt: skip
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
        rows[K.ANGLE][j], fixed[K.HIGHEST][j],
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
        rows[K.ANGLE][j], fixed[K.HIGHEST][j], step, time, period,
    )  # fmt: skip
    for side in range(2):
        sense(
            rows, fixed, j, EFFECTS_AT + STATE.pressures + side,
            EFFECTS_AT + STATE.pressure_rings + side * N_HISTORY, EFFECT.pressure_sensor,
            rows[K.PRESSURE_A + side][j], fixed[K.MAX_PRESSURE][j], step, time, period,
        )  # fmt: skip


def effect_kernels(valves: str, first: int) -> dict[str, Any]:
    """Return the kernels of the effects, whose state begins at row ``first``."""
    regulated = valves == "proportional"
    return {
        "EFFECTS_AT": first,
        "EFFECTIVE_A": first + STATE.effective,
        "SENSED_ANGLE": first + STATE.angle,
        "SENSED_PRESSURE": first + STATE.pressures,
        "plain_breathe": AIR[valves]["breathe"],
        "plain_settle": AIR[valves]["settle"],
        "breathe": breathe_regulated if regulated else breathe_pulsed,
        "settle": settle_regulated if regulated else settle_pulsed,
        "begin_muscles": begin_muscles,
        "begin_sensors": begin_sensors,
        "read_sensors": read_sensors,
        "turn": turn,
    }
