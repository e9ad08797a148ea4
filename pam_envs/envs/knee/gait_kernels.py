"""What sets ``PAM/KneeWalk-v0`` and the stairs apart in a step: sensors, references, wearer.

The step itself stands in :mod:`pam_envs.envs.core.step`. Each control period, once the plant has
moved, the sensors are read; the estimate of the knee torque passes the low-pass; the heel's load
says stance or swing; and the references follow from these. Beside that, :mod:`gait_plan
<pam_envs.envs.knee.gait_plan>` computes the same ahead of time from the planned stride: the
preview.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.step import (
    AT_OWN,
    MOST_PREVIEW,
    PERIOD,
    PREVIEW,
    SUBSTEPS,
    nothing_happens,
    write_references,
)
from pam_envs.envs.knee.gait_layout import (
    ANGLE_SCALE,
    ANGLE_WEIGHT,
    BEARS,
    BEARS_FREE,
    C_DEVIATION,
    C_PRESSURE,
    CHANNELS,
    COPIED_ROWS,
    DEMAND,
    DEMAND_SHARE,
    E_AIR,
    E_OVER,
    E_TRAVEL,
    EFFORT_WEIGHT,
    ENDED,
    FILTER,
    FIRST_COPIED,
    FIXED_SIGNALS,
    HIGHEST_TENSION,
    HYSTERESIS,
    INFO,
    KNOWN_ARM,
    KNOWN_RELAXED,
    KNOWN_SHANK,
    KNOWN_WIRE,
    LARGEST_DEVIATION,
    LOWEST_TORQUE,
    M_DEVIATION,
    M_PRESSURE,
    M_TENSION,
    MISMATCH,
    N_ELEMENTS,
    NOISE,
    OUTPUT,
    OVER_SCALE,
    OVER_WEIGHT,
    R_ANGLE,
    R_EFFORT,
    R_OVER,
    R_TENSION,
    RATIO,
    READ_ANGLE,
    READ_ANKLE,
    READ_COP,
    READ_GROUND,
    READ_HEEL,
    READ_STANCE,
    READ_TENSION,
    REF,
    S_IDEAL,
    SAMPLES,
    SEEN_ROWS,
    SENSORS,
    SIGNALS,
    SOFT_DEVIATION,
    SOFT_PRESSURE,
    SOURCE,
    START,
    START_PHASE,
    START_SPREAD,
    TENSION_SCALE,
    TENSION_WEIGHT,
    TIME,
    WANTED_ANGLE,
    WANTED_TENSION,
    WANTED_TORQUE,
)
from pam_envs.envs.knee.gait_plan import lean, planned_reference, pressure_for, prime
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import normal, uniform
from pam_envs.mechanics.knee_lever import wanted_tension
from pam_envs.mechanics.leg import sine_and_cosine
from pam_envs.muscle.emg import activation, excitation, left_of_gap
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.step import (
    N_WORK,
    advance,
    begin_lane,
    replacements,
)
from pam_envs.sensing.butterworth import butterworth
from pam_envs.sensing.sensor import read_sensor
from pam_envs.sensing.shoe import estimated_torque
from pam_envs.tasks.gait_assistance import assistance_wanted, gated_reward, over_assistance
from pam_envs.tasks.tracking import effort_reward, excess

VENTED = 1e3
"""Gauge pressure [Pa] up to which a muscle that grows draws ambient air, which costs nothing."""


@kernel
def sense(rows: Any, fixed: Any, counts: Any, k: int, step: int, j: int) -> None:
    """Read sensor ``k`` of lane ``j`` at a control period."""
    row, noise = SENSORS[k]
    rows[READ_TENSION + k][j] = read_sensor(
        rows[row][j],
        fixed[noise][j],
        fixed[noise + 1][j],
        fixed[noise + 2][j],
        normal(counts[K.KEY_A][j], counts[K.KEY_B][j], NOISE + k, step),
    )


@kernel
def share_of_torque(rows: Any, fixed: Any, settings: Any, choices: Any, j: int) -> float:
    """Return the assistance [N m] of lane ``j`` before the low-pass, and tell stance from swing."""
    rows[READ_GROUND][j] = max(0.0, rows[READ_GROUND][j])
    rows[READ_STANCE][j] = 1.0 if rows[READ_HEEL][j] > fixed[K.SHOE_THRESHOLD][j] else 0.0
    ankle, config = rows[READ_ANKLE][j], settings[0]
    shank = rows[K.SHANK][j] + (ankle - rows[K.ANKLE][j])
    sine, _ = sine_and_cosine(lean(shank, ankle, fixed[K.SHOE_FLAT_FOOT][j]))
    estimate = estimated_torque(rows[READ_GROUND][j], rows[READ_COP][j], sine, config[KNOWN_SHANK])
    if choices[SOURCE] == DEMAND:
        estimate = rows[K.DEMAND][j]
    return assistance_wanted(estimate, config[RATIO], config[LOWEST_TORQUE])


@kernel
def set_references(rows: Any, fixed: Any, settings: Any, j: int) -> None:
    """Write what tension and angle lane ``j`` should have, and what it should have off-line.

    In stance the tension gives the wanted torque at the angle as sensed, and the angle's reference
    is the angle itself; in swing the angle's reference is the wearer's path, and the tension's is
    that of no assistance, but for a mismatch. Where the brace was drawn, it is not the one that
    the tension is computed for.
    """
    config, torque, shift = settings[0], rows[WANTED_TORQUE][j], 0.0
    wanted = rows[READ_ANGLE][j]
    if rows[READ_STANCE][j] < 0.5:
        torque, shift = 0.0, config[MISMATCH]
        wanted = fixed[K.LEVER_MOUNT_ANGLE][j] + rows[K.KNEE][j]
    rows[WANTED_ANGLE][j] = wanted
    rows[WANTED_TENSION][j] = shift + wanted_tension(
        rows[READ_ANGLE][j],
        torque,
        config[KNOWN_ARM],
        config[KNOWN_WIRE],
        config[KNOWN_RELAXED],
    )


@kernel
def work_of_wearer(rows: Any, fixed: Any, settings: Any, period: float, j: int) -> None:
    """Move the calibrated activation of lane ``j``'s extensors: a share of the paper's estimate.

    It counts from the muscle's resting level, as the calibration does.
    """
    demand = settings[0][DEMAND_SHARE] * rows[K.ESTIMATE][j]
    largest = fixed[K.ACTIVATION_LARGEST_TORQUE][j]
    risen = left_of_gap(period, fixed[K.ACTIVATION_RISE_TIME][j])
    fallen = left_of_gap(period, fixed[K.ACTIVATION_FALL_TIME][j])
    helped = excitation(demand - rows[K.TORQUE][j], largest, 0.0)
    alone = excitation(demand, largest, 0.0)
    rows[BEARS][j] = activation(rows[BEARS][j], helped, risen, fallen)
    rows[BEARS_FREE][j] = activation(rows[BEARS_FREE][j], alone, risen, fallen)


@kernel
def advance_leg(
    rows: Any,
    fixed: Any,
    counts: Any,
    tables: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    work: Any,
) -> None:
    """Advance plant and wearer by a control period, read the sensors, set the references."""
    period = settings[0][PERIOD]
    advance(
        rows,
        fixed,
        counts,
        tables,
        settings[choices[AT_OWN] :],
        HYSTERESIS,
        choices[N_ELEMENTS],
        choices[SUBSTEPS],
        period,
        work,
    )
    step, wanted = counts[K.STEP], rows[WANTED_TORQUE]
    for k in range(len(SENSORS)):
        for j in range(LANES):
            sense(rows, fixed, counts, k, step[j] + 1, j)
    for j in range(LANES):
        wanted[j] = share_of_torque(rows, fixed, settings, choices, j)
    for j in range(LANES):
        wanted[j] = butterworth(rows, FILTER, j, wanted[j])
    if choices[SOURCE] == SAMPLES:
        for j in range(LANES):
            wanted[j] = samples[0][min(step[j] + 1, len(samples[0]) - 1)]
    for j in range(LANES):
        set_references(rows, fixed, settings, j)
    for j in range(LANES):
        work_of_wearer(rows, fixed, settings, period, j)


@kernel
def evaluate(
    rows: Any, fixed: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write what can be observed and reported of a tile into ``work``."""
    for k in range(len(COPIED_ROWS)):
        source, to = rows[COPIED_ROWS[k]], work[FIRST_COPIED + k]
        for j in range(LANES):
            to[j] = source[j]
    judge(rows, fixed, counts, settings, work)
    for k in range(FIXED_SIGNALS):
        source, to = rows[SEEN_ROWS[k]], work[SIGNALS + k]
        for j in range(LANES):
            to[j] = source[j]
    first = SIGNALS + FIXED_SIGNALS
    write_references(counts, ahead, choices, work, first)
    other = first + choices[PREVIEW] + 1
    for j in range(LANES):  # of the present, the true references and not the planned ones
        work[first][j] = rows[WANTED_TENSION][j]
        work[other][j] = rows[WANTED_ANGLE][j]


@kernel
def judge(rows: Any, fixed: Any, counts: Any, settings: Any, work: Any) -> None:
    """Write time, tension, rewards, costs, margins and efforts of a tile into ``work``."""
    config, step = settings[0], counts[K.STEP]
    pressure, set_point, older = rows[K.PRESSURE], rows[K.SET_POINT], rows[K.OLD_SET_POINT]
    for j in range(LANES):
        stance, tension, off = rows[K.STANCE][j], rows[K.TENSION][j], abs(rows[K.DEVIATION][j])
        seen, demand = rows[READ_STANCE][j], rows[K.DEMAND][j]
        over = over_assistance(rows[K.TORQUE][j], demand)
        work[TIME][j] = step[j] * config[PERIOD]
        work[REF][j] = rows[WANTED_TENSION][j]
        work[OUTPUT][j] = tension
        work[S_IDEAL][j] = config[RATIO] * demand
        work[R_TENSION][j] = gated_reward(
            tension - rows[WANTED_TENSION][j],
            stance * seen,
            config[TENSION_SCALE],
            config[TENSION_WEIGHT],
        )
        work[R_ANGLE][j] = gated_reward(
            off, (1.0 - stance) * (1.0 - seen), config[ANGLE_SCALE], config[ANGLE_WEIGHT]
        )
        work[R_OVER][j] = gated_reward(over, 1.0, config[OVER_SCALE], config[OVER_WEIGHT])
        work[R_EFFORT][j] = effort_reward(
            set_point[j] - older[j], fixed[K.MAX_PRESSURE][j], config[EFFORT_WEIGHT]
        )
        work[C_PRESSURE][j] = excess(pressure[j], config[SOFT_PRESSURE])
        work[C_DEVIATION][j] = excess(off, config[SOFT_DEVIATION])
        work[M_TENSION][j] = config[HIGHEST_TENSION] - tension
        work[M_DEVIATION][j] = config[LARGEST_DEVIATION] - off
        work[M_PRESSURE][j] = config[SOFT_PRESSURE] - pressure[j]
        broken = min(work[M_TENSION][j], work[M_DEVIATION][j])
        work[ENDED][j] = 1.0 if broken < 0.0 else 0.0
        work[E_OVER][j] = over
        work[E_TRAVEL][j] = abs(pressure[j] - rows[K.OLD_PRESSURE][j])
        drawn = max(0.0, rows[K.AIR][j] - rows[K.OLD_AIR][j])
        work[E_AIR][j] = drawn if pressure[j] > VENTED else 0.0
        rows[K.OLD_PRESSURE][j] = pressure[j]
        rows[K.OLD_AIR][j] = rows[K.AIR][j]


@routine
def begin_leg(
    rows: Any,
    fixed: Any,
    counts: Any,
    tables: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    work: Any,
    member: int,
    j: int,
) -> None:
    """Put lane ``j`` at a phase of the stride, under a pressure near that of no assistance."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    counts[K.MEMBER][j] = member
    gait = settings[choices[AT_OWN] :]
    phase = config[START_PHASE]
    if phase < 0.0:
        phase = uniform(key_a, key_b, START, 0)
    share = 1.0 + config[START_SPREAD] * (2.0 * uniform(key_a, key_b, START, 1) - 1.0)
    torque = prime(rows, fixed, settings, choices, phase, j)
    pressure = share * pressure_for(fixed, gait, torque, phase, j)
    begin_lane(
        rows, fixed, counts, tables, gait, HYSTERESIS, choices[N_ELEMENTS], j, phase, pressure
    )
    for k in range(len(SENSORS)):
        sense(rows, fixed, counts, k, 0, j)
    share_of_torque(rows, fixed, settings, choices, j)
    rows[WANTED_TORQUE][j] = torque
    if choices[SOURCE] == SAMPLES:
        rows[WANTED_TORQUE][j] = samples[0][0]
    set_references(rows, fixed, settings, j)
    largest = fixed[K.ACTIVATION_LARGEST_TORQUE][j]
    demand = config[DEMAND_SHARE] * rows[K.ESTIMATE][j]
    rows[BEARS][j] = excitation(demand - rows[K.TORQUE][j], largest, 0.0)
    rows[BEARS_FREE][j] = excitation(demand, largest, 0.0)


@lru_cache(maxsize=16)
def kernels_for(kind: str, dynamics: str) -> Kernels:
    """Return the kernels for a kind of hysteresis and the dynamics of the pressure."""
    functions = {
        "env_apply": nothing_happens,
        "env_advance": advance_leg,
        "env_reference": planned_reference,
        "env_evaluate": evaluate,
        "env_begin": begin_leg,
        **replacements(kind, "leg", dynamics),
    }
    return Kernels(
        f"gait_{kind}_{dynamics}",
        kernels_for,
        (kind, dynamics),
        functions,
        info=INFO,
        rows=HYSTERESIS + state_rows(kind),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        scratch=N_WORK,
        signals=FIXED_SIGNALS + CHANNELS * (1 + MOST_PREVIEW),
        set_points=K.SET_POINT,
        old_set_points=K.OLD_SET_POINT,
        channels=CHANNELS,
    )
