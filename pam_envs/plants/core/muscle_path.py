"""Path from a setpoint to the effective pressure of a muscle, with all effects on it.

    setpoint -> dead time -> regulator, supply, leak -> line -> creep -> temperature, first cycles

For plants whose hysteresis follows the contraction; each muscle has a state of its own, and all
muscles of a plant share the parameters.
"""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis.friction_effects import (
    CreepEffects,
    FirstCycles,
    begin_creep,
    creep_step,
    newness,
)
from pam_envs.kernels.build import LANES, kernel, scratch
from pam_envs.kernels.history import N_HISTORY
from pam_envs.muscle.effects import TemperatureEffects, temperature_factor
from pam_envs.parameters import declarations, parameter_rows, row_blocks
from pam_envs.pneumatics.regulator import (
    AIR_STATE,
    DelayedEffects,
    air_step,
    begin_air,
    delay_commands,
    delayed_fraction,
    line_effects_on,
    regulator_step,
    valve_effects_on,
)

PATH = parameter_rows(DelayedEffects, CreepEffects, FirstCycles)
"""Rows of the effects that all muscles of a plant share, from the first."""
WARM = parameter_rows(TemperatureEffects)
"""Rows of the temperature of a muscle and its effect, from the first."""
PATH_STATE = row_blocks(air=len(AIR_STATE), commands=N_HISTORY, travel=1, creep=4)
"""State of a muscle's path, from its first row."""
PATH_NAMES = (
    *(f"regulator.{name}" for name in declarations(DelayedEffects)),
    *(f"hysteresis.{name}" for name in (*declarations(CreepEffects), *declarations(FirstCycles))),
)
"""Parameters of the path in the order of ``PATH``."""


@kernel
def regulated(fixed: Any, plain: int, j: int, pressure: float, set_point: float, h: float) -> float:
    """Return the pressure [Pa] of one lane after ``h`` seconds, without effects.

    ``plain`` is the first row of full pressure, time constant and slew rate.
    """
    time, slew = fixed[plain + 1][j], fixed[plain + 2][j]
    target = max(0.0, min(fixed[plain][j], set_point))
    return regulator_step(pressure, target, time, 1.0 / time, slew, 1.0 / slew, h)


@kernel
def path_air(
    rows: Any, fixed: Any, state: int, effects: int, plain: int, pressure: Any, set_point: Any,
    step: Any, i: int, substeps: int, period: float,
) -> None:  # fmt: skip
    """Advance the pressures of one muscle of a tile through sub-step ``i``.

    ``state``, ``effects`` and ``plain`` are the first rows of the path's state (``PATH_STATE``), of
    its effects (``PATH``), and of full pressure, time constant and slew rate; ``pressure``,
    ``set_point`` [Pa] (below zero: the valve is shut) and ``step`` are rows.
    """
    h = period / substeps
    own = scratch(6, LANES)
    older, newer, switch, width = own[2], own[3], own[4], own[5]
    full, lag, slew = fixed[plain], fixed[plain + 1], fixed[plain + 2]
    delay_commands(
        rows, state + PATH_STATE.commands, set_point, fixed[effects + PATH.dead_time], step, period,
        older, newer, switch,
    )  # fmt: skip
    valve, lines = valve_effects_on(fixed, effects), line_effects_on(fixed, effects)
    for j in range(LANES):
        older[j], newer[j] = min(full[j], older[j]), min(full[j], newer[j])
    for stage in range(2):  # towards the older setpoint, then towards the newer one
        busy = 0
        for j in range(LANES):
            late = delayed_fraction((i + 1) * h, substeps / period, switch[j])
            width[j] = h * (late if stage == 1 else 1.0 - late)
            busy = busy + (1 if width[j] > 0.0 else 0)
        if busy == 0:
            continue
        air_step(
            rows, fixed, state + PATH_STATE.air, effects, pressure, full, lag, slew,
            newer if stage == 1 else older, width, own, valve, lines,
        )  # fmt: skip
        for j in range(LANES):
            rows[state + PATH_STATE.travel][j] += abs(pressure[j] - own[1][j])


@kernel
def path_muscle(
    rows: Any, fixed: Any, state: int, effects: int, warm: int, pressure: Any, h: float, crept: Any,
    factor: Any,
) -> None:  # fmt: skip
    """Advance creep [Pa], and write parts of the effective pressure, ``(pressure + crept) factor``.

    ``warm`` is the first row of the muscle's temperature (``WARM``), ``pressure`` are those after
    ``h`` seconds; otherwise see :func:`path_air`.
    """
    width = scratch(1, LANES)
    for j in range(LANES):
        width[0][j] = h
        crept[j] = 0.0
    creep_step(
        rows, fixed, state + PATH_STATE.creep, effects + PATH.creep_1, effects + PATH.creep_time_1,
        0, LANES, pressure, width[0], crept,
    )  # fmt: skip
    for j in range(LANES):
        factor[j] = path_factor(rows, fixed, j, state, effects, warm)


@kernel
def path_factor(rows: Any, fixed: Any, j: int, state: int, effects: int, warm: int) -> float:
    """Return the factor of temperature and first cycles on the pressure of one lane."""
    new = newness(rows[state + PATH_STATE.travel][j], fixed[effects + PATH.first_travel][j])
    gained = temperature_factor(
        fixed[warm + WARM.temperature][j], fixed[warm + WARM.temperature_gain][j]
    )
    return gained * (1.0 - fixed[effects + PATH.first_loss][j] * new)


@kernel
def path_step(
    rows: Any, fixed: Any, state: int, effects: int, plain: int, warm: int, pressure: Any,
    set_point: Any, effective: Any, was: Any, step: Any, i: int, substeps: int, period: float,
) -> None:  # fmt: skip
    """Advance pressures and effective pressures of one muscle of a tile through sub-step ``i``.

    ``was`` receives the effective pressures before it [Pa] (:func:`path_air`, :func:`path_muscle`).
    """
    own = scratch(2, LANES)
    path_air(rows, fixed, state, effects, plain, pressure, set_point, step, i, substeps, period)
    path_muscle(rows, fixed, state, effects, warm, pressure, period / substeps, own[0], own[1])
    for j in range(LANES):
        was[j] = effective[j]
        effective[j] = max(0.0, pressure[j] + own[0][j]) * own[1][j]


@kernel
def begin_path(
    rows: Any, fixed: Any, j: int, state: int, effects: int, warm: int, pressure: float
) -> float:
    """Begin the path of one muscle at rest; return its effective pressure [Pa]."""
    begin_air(rows, j, state + PATH_STATE.air, pressure)
    for k in range(N_HISTORY):
        rows[state + PATH_STATE.commands + k][j] = pressure
    rows[state + PATH_STATE.travel][j] = 0.0
    crept = begin_creep(rows, fixed, j, state + PATH_STATE.creep, effects + PATH.creep_1, pressure)
    factor = path_factor(rows, fixed, j, state, effects, warm)
    return max(0.0, pressure + crept) * factor
