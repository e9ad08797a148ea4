"""Kernels of ``PAM/AntagonisticJoint-v0``: actions, disturbance, report, start."""

from functools import lru_cache
from typing import Any

from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import (
    change_of,
    change_payload,
    draw_payload,
    report_end,
    report_pressure,
    report_tracking,
    sense,
    trajectory_at,
)
from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import CHOICE, FIRST_CHOICE, FIRST_CONFIG, PERIOD
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.arithmetic import sine_of_turns
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.random import uniform
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.pair import advance, command, leaked_air
from pam_envs.plants.antagonistic_joint.step import (
    N_WORK,
    SENSED_ANGLE,
    SENSED_PRESSURE,
    begin_lane,
    replacements,
)
from pam_envs.plants.core.rollout import start_hysteresis
from pam_envs.references import trajectory as T
from pam_envs.references.trajectory import draw_reference
from pam_envs.tasks.rewards import excess

# the environment's own state, after the plant's
ACTION = K.END
"""First row of the actions: angle [rad] and prestress [N], or two pressures [Pa]."""
OLD_ACTION = ACTION + 2
OLD_SET_A, OLD_SET_B, OLD_A, OLD_B, OLD_AIR = range(OLD_ACTION + 2, OLD_ACTION + 7)
DECLARED_PAYLOAD, CHANGE_TIME, CHANGE = range(OLD_AIR + 1, OLD_AIR + 4)
REFERENCE = CHANGE + 1
HYSTERESIS = REFERENCE + T.ROWS
"""First row of the state of the hysteresis."""

REPORT = Report(
    {
        **computed("reward", "tracking", "effort", "ended"),
        **computed("cost", "angle", "pressure"),
        **computed("margin", "angle", "pressure"),
        **computed("effort", "pressure_travel", "air"),
        **copied("state", K, "angle", "velocity", "pressure_a", "pressure_b", "set_point_a"),
        **copied("state", K, "set_point_b", "command", "prestress", "force_a", "force_b"),
        **copied("state", K, "torque", "stiffness", "slack", "disturbance", "payload"),
        **computed("sensor", "angle", "pressure_a", "pressure_b"),
    },
    N_WORK,
    observed=(
        *(None, None, None, K.SET_POINT_A, K.SET_POINT_B, DECLARED_PAYLOAD),
        *(ACTION, ACTION + 1),
    ),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals

CONFIG = indices(
    (
        *("tracking_weight", "error_scale", "effort_weight", "soft_angle", "soft_pressure"),
        *("largest_angle", "amplitude", "frequency", "start_angle", "prestress"),
        *("payload_change", "disturbance", "worst_period"),
    ),
    FIRST_CONFIG,
)
OWN = indices(("mode", "payloads"), FIRST_CHOICE)
"""The own row of the settings holds the payloads [kg] to draw from."""
MODES = ("angle", "angle_stiffness", "pressures")
BY_ANGLE, BY_BOTH, BY_PRESSURE = range(len(MODES))
"""Meaning of the actions."""
SINE, STEP = T.SAMPLES + 1, T.SAMPLES + 2
"""Numbers of the references that only this family has."""
STEP_SECONDS = 1.0
"""Time of the step of the reference "step"."""
PULSE_WINDOW, PULSE = 500, 100
"""Control periods between pulses of the disturbance, and duration of a pulse."""
NOISE_ANGLE, NOISE_A, NOISE_B, START, PULSES = 1, 2, 3, 5, 6
"""Random streams."""


@kernel
def pulse(key_a: int, key_b: int, step: int, size: float) -> float:
    """Return the disturbance [N m] in a control period: one pulse of 1 s in every 5 s.

    Its start, its sign and its size, between half of ``size`` and ``size``, are drawn.
    """
    window = step // PULSE_WINDOW
    first = int(0.2 * PULSE_WINDOW + 0.5 * PULSE_WINDOW * uniform(key_a, key_b, PULSES, 2 * window))
    since = step - window * PULSE_WINDOW - first
    if since < 0 or since >= PULSE:
        return 0.0
    drawn = 2.0 * uniform(key_a, key_b, PULSES, 2 * window + 1) - 1.0
    return size * (0.5 * drawn + (0.5 if drawn > 0.0 else -0.5))


@kernel
def apply_joint(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Change payload and disturbance at their times, and convert actions to pressures."""
    step, config, mode = counts[K.STEP], settings[0], choices[OWN.mode]
    change_payload(rows, step, config[PERIOD], DECLARED_PAYLOAD, K.PAYLOAD)
    for j in range(LANES):
        rows[OLD_SET_A][j], rows[OLD_SET_B][j] = rows[K.SET_POINT_A][j], rows[K.SET_POINT_B][j]
    if config[CONFIG.disturbance] > 0.0:
        for j in range(LANES):
            rows[K.DISTURBANCE][j] = pulse(
                counts[K.KEY_A][j], counts[K.KEY_B][j], step[j], config[CONFIG.disturbance]
            )
    for j in range(LANES):
        if mode == BY_PRESSURE:
            rows[K.SET_POINT_A][j], rows[K.SET_POINT_B][j] = rows[ACTION][j], rows[ACTION + 1][j]
        else:
            prestress = rows[ACTION + 1][j] if mode == BY_BOTH else config[CONFIG.prestress]
            short = command(
                rows, fixed, j, rows[ACTION][j], prestress, K.COMMAND, K.PRESTRESS, K.SET_POINT_A
            )
            work[INFO.saturated][j] = max(work[INFO.saturated][j], short)


@kernel
def reference_at(
    rows: Any, fixed: Any, counts: Any, samples: Any, settings: Any, choices: Any, step: int,
    lane: int, channel: int,
) -> float:  # fmt: skip
    """Return the reference [rad] of one lane at a control period."""
    config, family = settings[0], choices[CHOICE.reference]
    time = step * config[PERIOD]
    if family == SINE:
        turns = config[CONFIG.frequency] * time
        return config[CONFIG.amplitude] * sine_of_turns(turns)  # type: ignore[no-any-return]
    if family == STEP:
        return 0.0 if time < STEP_SECONDS else config[CONFIG.amplitude]
    return trajectory_at(rows, fixed, counts, samples, settings, choices, step, lane, channel)


@kernel
def read_joint(rows: Any, fixed: Any, counts: Any, work: Any, j: int) -> None:
    """Write the readings of lane ``j``."""
    step = counts[K.STEP][j]
    angle = sense(rows[SENSED_ANGLE][j], fixed, counts, K.ANGLE_NOISE, NOISE_ANGLE, step, j)
    work[INFO.sensor_angle][j] = work[SIGNALS][j] = angle
    for k in range(2):
        pressure = sense(
            rows[SENSED_PRESSURE + k][j], fixed, counts, K.PRESSURE_NOISE, NOISE_A + k, step, j
        )
        work[INFO.sensor_pressure_a + k][j] = work[SIGNALS + 1 + k][j] = pressure


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write readings, rewards, costs, margins and efforts of a tile into ``work``."""
    config, reference = settings[0], work[SIGNALS + choices[CHOICE.fixed]]
    for j in range(LANES):
        read_joint(rows, fixed, counts, work, j)
    for j in range(LANES):
        angle = rows[K.ANGLE][j]
        report_tracking(work, config, INFO, CONFIG, reference[j], angle, j)
        higher = max(rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j])
        moved = abs(rows[K.SET_POINT_A][j] - rows[OLD_SET_A][j])
        moved = moved + abs(rows[K.SET_POINT_B][j] - rows[OLD_SET_B][j])
        full = 2.0 * fixed[K.REGULATOR_MAX_PRESSURE][j]
        report_pressure(work, config, INFO, CONFIG, higher, moved, full, j)
        work[INFO.cost_angle][j] = excess(abs(angle), config[CONFIG.soft_angle])
        margin = config[CONFIG.largest_angle] - abs(angle)
        work[INFO.margin_angle][j] = margin
        report_end(work, config, INFO, CONFIG, ENDED, margin < 0.0, j)
        travel = abs(change_of(rows, K.PRESSURE_A, OLD_A, j))
        travel = travel + abs(change_of(rows, K.PRESSURE_B, OLD_B, j))
        work[INFO.effort_pressure_travel][j] = travel
        drawn = change_of(rows, K.AIR, OLD_AIR, j) + leaked_air(rows, fixed, j)
        work[INFO.effort_air][j] = max(0.0, drawn)


@routine
def begin_joint(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest at a drawn angle under a drawn payload, and draw its reference."""
    key_a, key_b, config = counts[K.KEY_A][j], counts[K.KEY_B][j], settings[0]
    draw_payload(
        rows, counts, settings, choices, START, choices[OWN.payloads],
        config[CONFIG.payload_change], DECLARED_PAYLOAD, K.PAYLOAD, j,
    )  # fmt: skip
    rows[K.DISTURBANCE][j] = 0.0
    angle = config[CONFIG.start_angle] * (2.0 * uniform(key_a, key_b, START, 3) - 1.0)
    prestress, elements = config[CONFIG.prestress], choices[CHOICE.elements]
    start_hysteresis(rows, counts, HYSTERESIS, j)
    begin_lane(rows, fixed, counts, tables, HYSTERESIS, elements, j, angle, prestress)
    by_pressure = choices[OWN.mode] == BY_PRESSURE
    rows[ACTION][j] = rows[K.SET_POINT_A][j] if by_pressure else angle
    rows[ACTION + 1][j] = rows[K.SET_POINT_B][j] if by_pressure else prestress
    rows[OLD_SET_A][j], rows[OLD_SET_B][j] = rows[K.SET_POINT_A][j], rows[K.SET_POINT_B][j]
    rows[OLD_A][j], rows[OLD_B][j] = rows[K.PRESSURE_A][j], rows[K.PRESSURE_B][j]
    rows[OLD_AIR][j] = rows[K.AIR][j]
    if choices[CHOICE.reference] < T.SAMPLES:
        low, high = -config[CONFIG.amplitude], config[CONFIG.amplitude]
        draw_reference(rows, REFERENCE, j, key_a, key_b, choices[CHOICE.reference], low, high)


@lru_cache(maxsize=16)
def kernels_for(kind: str, dynamics: str, extended: bool = False) -> Kernels:
    """Return the kernels for a hysteresis model and a dynamics, plain or with effects."""
    rows = HYSTERESIS + 2 * state_rows(kind)
    return Kernels(
        "joint",
        kernels_for,
        (kind, dynamics, extended),
        REPORT,
        evaluate,
        begin_joint,
        rows=rows + (K.STATE.end if extended else 0),
        parameters=K.N_PARAMETERS,
        counts=K.N_COUNTS,
        set_points=ACTION,
        old_set_points=OLD_ACTION,
        config=CONFIG,
        choices=OWN,
        apply=apply_joint,
        reference=reference_at,
        placeholders={
            "plant_advance": advance,
            "FIRST_HYSTERESIS": HYSTERESIS,
            "FIRST_REFERENCE": REFERENCE,
            **replacements(kind, dynamics, rows if extended else None),
        },
    )
