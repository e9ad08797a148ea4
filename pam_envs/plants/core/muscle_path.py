"""Path from a setpoint to the effective pressure of a muscle, with all effects on it.

    setpoint -> dead time -> regulator, supply, leak -> line -> creep -> temperature, first cycles

With ``regulator.flow`` the regulator is the flow of air into the muscle's volume; the plant calls
:func:`path_squeeze` before the path and after the motion (``pneumatics.enclosed_air``).

For plants whose hysteresis follows the contraction; each muscle has a state of its own, and all
muscles of a plant share the parameters. A plain plant has dead time and regulator
(:func:`follow_set_point`), an extended one all of the path (:func:`path_step`).
"""

from typing import Any

from pam_envs.hysteresis.friction_effects import (
    CreepEffects,
    FirstCycles,
    begin_creep,
    creep_left,
    creep_step,
    newness,
)
from pam_envs.kernels.arithmetic import count_on
from pam_envs.kernels.build import LANES, kernel, routine, scratch
from pam_envs.kernels.motion import N_HISTORY, fill_ring
from pam_envs.muscle.effects import TemperatureEffects, temperature_factor
from pam_envs.parameters import declarations, named_rows, parameter_rows, row_blocks
from pam_envs.pneumatics.enclosed_air import AHEAD, flow_step, flows_on, squeeze, without_flow
from pam_envs.pneumatics.regulator import (
    AIR_STATE,
    RegulatorEffects,
    air_step,
    begin_air,
    begin_leak,
    delay_commands,
    late_shares,
    line_effects_on,
    regulator_step,
    stage_widths,
    valve_effects_on,
)

REGULATOR = named_rows("max_pressure", "dead_time", "time_constant", "slew_rate")
"""Rows of a regulator's plain parameters, from the first."""
DELAYED = row_blocks(commands=N_HISTORY, older=1, newer=1, switch=1, per_lag=1, per_slew=1)
"""State of a dead time, from its first row: the last setpoints; the two that take effect in a
control period [Pa], and the time between them [s]. Then the reciprocals of time constant and slew
rate, of a regulator without effects."""
PATH = parameter_rows(RegulatorEffects, CreepEffects, FirstCycles)
"""Rows of the effects that all muscles of a plant share, from the first."""
WARM = parameter_rows(TemperatureEffects)
"""Rows of the temperature of a muscle and its effect, from the first."""
PATH_STATE = row_blocks(air=len(AIR_STATE), travel=1, creep=4, factor=1)
"""State of a muscle's path, from its first row."""
PATH_NAMES = (
    *(f"regulator.{name}" for name in declarations(RegulatorEffects)),
    *(f"hysteresis.{name}" for name in (*declarations(CreepEffects), *declarations(FirstCycles))),
)
"""Parameters of the path in the order of ``PATH``."""


@kernel
def delay(
    rows: Any, fixed: Any, delayed: int, plain: int, set_point: Any, step: Any, period: float
) -> None:
    """Note the setpoints [Pa] of a tile, and write those that take effect in a control period."""
    older, newer = rows[delayed + DELAYED.older], rows[delayed + DELAYED.newer]
    delay_commands(
        rows, delayed + DELAYED.commands, set_point, fixed[plain + REGULATOR.dead_time], step,
        period, older, newer, rows[delayed + DELAYED.switch],
    )  # fmt: skip
    full = fixed[plain + REGULATOR.max_pressure]
    for j in range(LANES):
        older[j], newer[j] = min(full[j], older[j]), min(full[j], newer[j])


@kernel
def begin_delay(rows: Any, j: int, delayed: int, set_point: float) -> None:
    """Begin the dead time of one lane under a setpoint [Pa] that was held."""
    fill_ring(rows, delayed + DELAYED.commands, j, set_point)


@routine
def follow_set_point(
    rows: Any, fixed: Any, delayed: int, plain: int, pressure: Any, set_point: Any, step: Any,
    i: int, substeps: int, period: float,
) -> None:  # fmt: skip
    """Advance the pressures of one muscle of a tile through sub-step ``i``, without effects.

    ``delayed`` and ``plain`` are the first rows of the dead time's state (``DELAYED``) and of the
    regulator (``REGULATOR``); ``pressure``, ``set_point`` [Pa] and ``step`` are rows.
    """
    lag, slew = fixed[plain + REGULATOR.time_constant], fixed[plain + REGULATOR.slew_rate]
    per_lag, per_slew = rows[delayed + DELAYED.per_lag], rows[delayed + DELAYED.per_slew]
    if i == 0:
        delay(rows, fixed, delayed, plain, set_point, step, period)
        for j in range(LANES):
            per_lag[j] = 1.0 / lag[j]
        for j in range(LANES):
            per_slew[j] = 1.0 / slew[j]
    own = scratch(2, LANES)
    late, width = own[0], own[1]
    late_shares(rows[delayed + DELAYED.switch], i, substeps, period, late)
    earlier = count_on(late, 1.0)  # lanes whose newer setpoint is not yet in effect, or in part
    if earlier == 0 or count_on(late, 0.0) == 0:  # one setpoint in all lanes
        target = rows[delayed + (DELAYED.newer if earlier == 0 else DELAYED.older)]
        for j in range(LANES):
            pressure[j] = regulator_step(
                pressure[j], max(0.0, target[j]), lag[j], per_lag[j], slew[j], per_slew[j],
                period / substeps,
            )  # fmt: skip
        return
    for stage in range(2):  # towards the older setpoint, then towards the newer one
        if stage_widths(late, stage, period / substeps, width) == 0:
            continue
        target = rows[delayed + (DELAYED.newer if stage == 1 else DELAYED.older)]
        for j in range(LANES):
            reached = regulator_step(
                pressure[j], max(0.0, target[j]), lag[j], per_lag[j], slew[j], per_slew[j],
                width[j],
            )  # fmt: skip
            pressure[j] = reached if width[j] > 0.0 else pressure[j]


@routine
def path_air(
    rows: Any, fixed: Any, state: int, effects: int, delayed: int, plain: int, pressure: Any,
    set_point: Any, step: Any, i: int, substeps: int, period: float,
) -> None:  # fmt: skip
    """Advance the pressures of one muscle of a tile through sub-step ``i``, with all effects.

    ``state`` and ``effects`` are the first rows of the path's state (``PATH_STATE``) and of its
    effects (``PATH``); a setpoint below zero shuts the valve. See :func:`follow_set_point`.
    """
    if i == 0:
        delay(rows, fixed, delayed, plain, set_point, step, period)
        begin_leak(rows, state + PATH_STATE.air)
    own = scratch(4, LANES)
    late, width = own[2], own[3]
    full, lag, slew = (
        fixed[plain + REGULATOR.max_pressure],
        fixed[plain + REGULATOR.time_constant],
        fixed[plain + REGULATOR.slew_rate],
    )
    valve, lines = valve_effects_on(fixed, effects), line_effects_on(fixed, effects)
    flows, travel = flows_on(fixed, effects), rows[state + PATH_STATE.travel]
    late_shares(rows[delayed + DELAYED.switch], i, substeps, period, late)
    if flows > 0:
        flow_step(
            rows, fixed, state + PATH_STATE.air, effects, pressure, rows[delayed + DELAYED.older],
            rows[delayed + DELAYED.newer], late, period / substeps, own, valve, lines,
        )  # fmt: skip
        for j in range(LANES):
            travel[j] = travel[j] + abs(pressure[j] - own[1][j])
    for stage in range(0 if flows == LANES else 2):  # towards the older, then the newer setpoint
        if stage_widths(late, stage, period / substeps, width) == 0:
            continue
        if flows > 0:
            without_flow(fixed, effects, width)
        air_step(
            rows, fixed, state + PATH_STATE.air, effects, pressure, full, lag, slew,
            rows[delayed + (DELAYED.newer if stage == 1 else DELAYED.older)], width, own, valve,
            lines,
        )  # fmt: skip
        for j in range(LANES):
            travel[j] += abs(pressure[j] - own[1][j])


@routine
def path_squeeze(
    rows: Any, fixed: Any, state: int, effects: int, pressure: Any, effective: Any, share: float
) -> None:
    """Move the air of one muscle of a tile with the motion (:func:`squeeze`), where air flows.

    ``share`` is ``AHEAD`` before the path of a sub-step, ``REACHED`` after the motion. Effective
    pressures change with the pressures; creep stays.
    """
    if flows_on(fixed, effects) == 0:
        return
    own, factor = scratch(1, LANES), rows[state + PATH_STATE.factor]
    squeeze(rows, fixed, state + PATH_STATE.air, effects, pressure, own[0], share)
    for j in range(LANES):
        effective[j] = max(0.0, effective[j] + factor[j] * own[0][j])


@routine
def path_muscle(
    rows: Any, fixed: Any, state: int, effects: int, warm: int, pressure: Any, h: float, crept: Any,
    factor: Any,
) -> None:  # fmt: skip
    """Advance creep [Pa], and write parts of the effective pressure, ``(pressure + crept) factor``.

    ``warm`` is the first row of the muscle's temperature (``WARM``), ``pressure`` are those after
    ``h`` seconds; otherwise see :func:`path_air`.
    """
    own = scratch(5, LANES)
    for j in range(LANES):
        own[4][j] = h
        crept[j] = 0.0
        factor[j] = 1.0
    creep_left(fixed, effects + PATH.creep_1, effects + PATH.creep_time_1, 0, LANES, own[4], own)
    creep_step(
        rows, fixed, state + PATH_STATE.creep, effects + PATH.creep_1, 0, LANES, pressure, own,
        crept,
    )  # fmt: skip
    if factors_on(fixed, effects, warm) > 0:
        for j in range(LANES):
            factor[j] = path_factor(rows, fixed, j, state, effects, warm)


@kernel
def factors_on(fixed: Any, effects: int, warm: int) -> int:
    """Return the number of lanes whose pressure has a factor of temperature or first cycles."""
    return count_on(fixed[effects + PATH.first_loss], 0.0) + count_on(  # type: ignore[no-any-return]
        fixed[warm + WARM.temperature_gain], 0.0
    )


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
    rows: Any, fixed: Any, state: int, effects: int, delayed: int, plain: int, warm: int,
    pressure: Any, set_point: Any, effective: Any, was: Any, step: Any, i: int, substeps: int,
    period: float,
) -> None:  # fmt: skip
    """Advance pressures and effective pressures of one muscle of a tile through sub-step ``i``.

    ``was`` receives the effective pressures before it [Pa] (:func:`path_air`, :func:`path_muscle`).
    """
    own, factor = scratch(1, LANES), rows[state + PATH_STATE.factor]
    path_squeeze(rows, fixed, state, effects, pressure, effective, AHEAD)
    path_air(
        rows, fixed, state, effects, delayed, plain, pressure, set_point, step, i, substeps, period
    )
    path_muscle(rows, fixed, state, effects, warm, pressure, period / substeps, own[0], factor)
    for j in range(LANES):
        was[j] = effective[j]
        effective[j] = max(0.0, pressure[j] + own[0][j]) * factor[j]


@kernel
def begin_path(
    rows: Any, fixed: Any, j: int, state: int, effects: int, warm: int, pressure: float
) -> float:
    """Begin the path of one muscle at rest; return its effective pressure [Pa]."""
    begin_air(rows, j, state + PATH_STATE.air, pressure)
    rows[state + PATH_STATE.travel][j] = 0.0
    crept = begin_creep(rows, fixed, j, state + PATH_STATE.creep, effects + PATH.creep_1, pressure)
    factor = path_factor(rows, fixed, j, state, effects, warm)
    rows[state + PATH_STATE.factor][j] = factor
    return max(0.0, pressure + crept) * factor
