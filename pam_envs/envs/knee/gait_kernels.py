"""Kernels of ``PAM/KneeWalk-v0`` and of stairs: sensors, references, wearer, report, start.

:mod:`gait_plan <pam_envs.envs.knee.gait_plan>` computes the references in advance for the planned
stride: the preview.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import change_of, sense
from pam_envs.envs.core.step import CHOICE, PERIOD
from pam_envs.envs.knee import gait_layout as L
from pam_envs.envs.knee.brace_kernels import advance_knee, report_brace
from pam_envs.envs.knee.gait_plan import (
    lean,
    nominal_tension,
    planned_reference,
    pressure_for,
    prime,
)
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import sine_and_cosine
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.muscle.emg import activation, excitation, left_of_gap
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.step import SENSED, begin_lane, replacements
from pam_envs.sensing.butterworth import butterworth
from pam_envs.sensing.shoe import estimated_torque
from pam_envs.tasks.gait_assistance import desired_assistance, over_assistance
from pam_envs.tasks.rewards import error_reward, excess

VENTED = 1e3
"""Gauge pressure [Pa] up to which a growing muscle draws ambient air, at no cost."""


@kernel
def read(rows: Any, fixed: Any, counts: Any, k: int, step: int, j: int) -> None:
    """Read sensor ``k`` of lane ``j`` at a control period."""
    true, noise = rows[SENSED[k]][j], L.SENSORS[k]
    rows[L.READ_TENSION + k][j] = sense(true, fixed, counts, noise, L.NOISE + k, step, j)


@kernel
def share_of_torque(rows: Any, fixed: Any, settings: Any, choices: Any, j: int) -> float:
    """Return the assistance [N m] of lane ``j`` before the low-pass; detect stance and swing."""
    rows[L.READ_GROUND][j] = max(0.0, rows[L.READ_GROUND][j])
    rows[L.READ_STANCE][j] = 1.0 if rows[L.READ_HEEL][j] > fixed[K.SHOE_THRESHOLD][j] else 0.0
    ankle, config = rows[L.READ_ANKLE][j], settings[0]
    shank = rows[K.SHANK][j] + (ankle - rows[K.ANKLE][j])
    sine, _ = sine_and_cosine(lean(shank, ankle, fixed[K.SHOE_FLAT_FOOT][j]))
    estimate = estimated_torque(
        rows[L.READ_GROUND][j], rows[L.READ_COP][j], sine, config[L.CONFIG.known_shank]
    )
    if choices[CHOICE.reference] == L.DEMAND:
        estimate = rows[K.DEMAND][j]
    return desired_assistance(estimate, config[L.CONFIG.ratio], config[L.CONFIG.lowest_torque])


@kernel
def set_references(rows: Any, fixed: Any, settings: Any, j: int) -> None:
    """Write the references of tension and angle of lane ``j``.

    Stance: the tension of the nominal brace for the desired torque, and the sensed angle. Swing:
    that for no torque, plus a mismatch, and the wearer's path.
    """
    config, torque, shift = settings[0], rows[L.DESIRED_TORQUE][j], 0.0
    angle = rows[L.READ_ANGLE][j]
    if rows[L.READ_STANCE][j] < 0.5:
        torque, shift = 0.0, config[L.CONFIG.mismatch]
        angle = fixed[K.LEVER_MOUNT_ANGLE][j] + rows[K.KNEE][j]
    rows[L.DESIRED_ANGLE][j] = angle
    tension = nominal_tension(config, rows[L.READ_ANGLE][j], torque)
    rows[L.DESIRED_TENSION][j] = shift + tension


@kernel
def work_of_wearer(rows: Any, fixed: Any, settings: Any, period: float, j: int) -> None:
    """Advance the calibrated activation of lane ``j``'s extensors, above the resting level."""
    demand = settings[0][L.CONFIG.demand_share] * rows[K.ESTIMATE][j]
    largest = fixed[K.ACTIVATION_LARGEST_TORQUE][j]
    risen = left_of_gap(period, fixed[K.ACTIVATION_RISE_TIME][j])
    fallen = left_of_gap(period, fixed[K.ACTIVATION_FALL_TIME][j])
    helped = excitation(demand - rows[K.TORQUE][j], largest, 0.0)
    alone = excitation(demand, largest, 0.0)
    rows[L.BEARS][j] = activation(rows[L.BEARS][j], helped, risen, fallen)
    rows[L.BEARS_FREE][j] = activation(rows[L.BEARS_FREE][j], alone, risen, fallen)


@kernel
def advance_leg(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance plant and wearer by a control period, read the sensors, set the references."""
    advance_knee(rows, fixed, counts, tables, samples, settings, choices, work)
    step, torque, period = counts[K.STEP], rows[L.DESIRED_TORQUE], settings[0][PERIOD]
    for k in range(len(L.SENSORS)):
        for j in range(LANES):
            read(rows, fixed, counts, k, step[j] + 1, j)
    for j in range(LANES):
        torque[j] = share_of_torque(rows, fixed, settings, choices, j)
    for j in range(LANES):
        torque[j] = butterworth(rows, L.FILTER, j, torque[j])
    if choices[CHOICE.reference] == L.SAMPLES:
        for j in range(LANES):
            torque[j] = samples[0][min(step[j] + 1, len(samples[0]) - 1)]
    for j in range(LANES):
        set_references(rows, fixed, settings, j)
    for j in range(LANES):
        work_of_wearer(rows, fixed, settings, period, j)


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write true references, rewards, costs, margins and efforts of a tile into ``work``."""
    config, first = settings[0], L.SIGNALS + choices[CHOICE.fixed]
    other = first + choices[CHOICE.preview] + 1
    for j in range(LANES):  # the present references are the true ones and not the planned ones
        work[first][j], work[other][j] = rows[L.DESIRED_TENSION][j], rows[L.DESIRED_ANGLE][j]
    for j in range(LANES):
        desired = rows[L.DESIRED_TENSION][j]
        stance, tension, off = rows[K.STANCE][j], rows[K.TENSION][j], abs(rows[K.DEVIATION][j])
        seen, demand = rows[L.READ_STANCE][j], rows[K.DEMAND][j]
        over = over_assistance(rows[K.TORQUE][j], demand)
        work[L.INFO.reference][j], work[L.INFO.output][j] = desired, tension
        work[L.INFO.state_torque_ideal][j] = config[L.CONFIG.ratio] * demand
        work[L.INFO.reward_tension][j] = error_reward(
            stance * seen * (tension - desired),
            config[L.CONFIG.tension_scale], config[L.CONFIG.tension_weight],
        )  # fmt: skip
        work[L.INFO.reward_angle][j] = error_reward(
            (1.0 - stance) * (1.0 - seen) * off,
            config[L.CONFIG.angle_scale], config[L.CONFIG.angle_weight],
        )  # fmt: skip
        work[L.INFO.reward_over_assistance][j] = error_reward(
            over, config[L.CONFIG.over_scale], config[L.CONFIG.over_weight]
        )
        report_brace(rows, fixed, config, work, L.INFO, L.CONFIG, j)
        work[L.INFO.cost_deviation][j] = excess(off, config[L.CONFIG.soft_deviation])
        work[L.INFO.margin_tension][j] = config[L.CONFIG.highest_tension] - tension
        work[L.INFO.margin_deviation][j] = config[L.CONFIG.largest_deviation] - off
        broken = min(work[L.INFO.margin_tension][j], work[L.INFO.margin_deviation][j])
        work[L.ENDED][j] = 1.0 if broken < 0.0 else 0.0
        work[L.INFO.effort_over_assistance][j] = over
        drawn = max(0.0, change_of(rows, K.AIR, K.OLD_AIR, j))
        work[L.INFO.effort_air][j] = drawn if rows[K.PRESSURE][j] > VENTED else 0.0


@routine
def begin_leg(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Start lane ``j`` at a phase of the stride, near the pressure that the reference needs."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    gait = settings[choices[CHOICE.at_own] :]
    start = config[L.CONFIG.start_phase]
    phase = uniform(key_a, key_b, L.START, 0) if start < 0.0 else start
    share = 1.0 + config[L.CONFIG.start_spread] * (2.0 * uniform(key_a, key_b, L.START, 1) - 1.0)
    torque = prime(rows, fixed, settings, choices, phase, j)
    pressure = share * pressure_for(fixed, gait, torque, phase, j)
    elements = choices[CHOICE.elements]
    begin_lane(rows, fixed, counts, tables, gait, L.HYSTERESIS, elements, j, phase, pressure)
    for k in range(len(L.SENSORS)):
        read(rows, fixed, counts, k, 0, j)
    share_of_torque(rows, fixed, settings, choices, j)
    given = choices[CHOICE.reference] == L.SAMPLES
    rows[L.DESIRED_TORQUE][j] = samples[0][0] if given else torque
    set_references(rows, fixed, settings, j)
    largest = fixed[K.ACTIVATION_LARGEST_TORQUE][j]
    demand = config[L.CONFIG.demand_share] * rows[K.ESTIMATE][j]
    rows[L.BEARS][j] = excitation(demand - rows[K.TORQUE][j], largest, 0.0)
    rows[L.BEARS_FREE][j] = excitation(demand, largest, 0.0)


@lru_cache(maxsize=16)
def kernels_for(kind: str, dynamics: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model and a dynamics, plain or with effects."""
    rows = L.HYSTERESIS + state_rows(kind)
    return Kernels(
        "gait",
        kernels_for,
        (kind, dynamics, extended),
        L.REPORT,
        evaluate,
        begin_leg,
        rows=rows + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        set_points=K.SET_POINT,
        old_set_points=K.OLD_SET_POINT,
        channels=L.CHANNELS,
        config=L.CONFIG,
        advance=advance_leg,
        reference=planned_reference,
        placeholders={
            "FIRST_HYSTERESIS": L.HYSTERESIS,
            **replacements(kind, "leg", dynamics, rows if extended else None),
        },
    )
