"""Where the numbers of the joint's environment stand: rows, report, observation, configuration."""

from __future__ import annotations

from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.step import N_WORK
from pam_envs.references.trajectory import FAMILIES, SAMPLES
from pam_envs.references.trajectory import ROWS as REFERENCE_ROWS

# the environment's own state, after the plant's
ACTION = K.END
"""First row of what the actions ask for: angle [rad] and prestress [N], or two pressures [Pa]."""
OLD_ACTION = ACTION + 2
OLD_SET_A, OLD_SET_B, OLD_A, OLD_B, OLD_AIR = range(OLD_ACTION + 2, OLD_ACTION + 7)
TOLD_PAYLOAD, CHANGE_TIME, CHANGE = range(OLD_AIR + 1, OLD_AIR + 4)
REFERENCE = CHANGE + 1
HYSTERESIS = REFERENCE + REFERENCE_ROWS
"""First row of the hysteresis's state."""

INFO = (
    "time",
    "reference",
    "output",
    "reward/tracking",
    "reward/effort",
    "reward/ended",
    "cost/angle",
    "cost/pressure",
    "margin/angle",
    "margin/pressure",
    "effort/pressure_travel",
    "effort/air",
    "state/angle",
    "state/velocity",
    "state/pressure_a",
    "state/pressure_b",
    "state/set_point_a",
    "state/set_point_b",
    "state/command",
    "state/prestress",
    "state/force_a",
    "state/force_b",
    "state/torque",
    "state/stiffness",
    "state/slack",
    "state/disturbance",
    "state/payload",
    "sensor/angle",
    "sensor/pressure_a",
    "sensor/pressure_b",
    "saturated",
)
(
    TIME,
    REF,
    OUTPUT,
    R_TRACKING,
    R_EFFORT,
    R_ENDED,
    C_ANGLE,
    C_PRESSURE,
    M_ANGLE,
    M_PRESSURE,
    E_TRAVEL,
    E_AIR,
    FIRST_COPIED,
) = range(N_WORK, N_WORK + 13)
COPIED_ROWS = (
    K.ANGLE,
    K.VELOCITY,
    K.PRESSURE_A,
    K.PRESSURE_B,
    K.SET_POINT_A,
    K.SET_POINT_B,
    K.COMMAND,
    K.PRESTRESS,
    K.FORCE_A,
    K.FORCE_B,
    K.TORQUE,
    K.STIFFNESS,
    K.SLACK,
    K.DISTURBANCE,
    K.PAYLOAD,
)
"""Rows of the state that are reported as they are."""
SENSOR_ANGLE, SENSOR_A, SENSOR_B, SATURATED = range(
    FIRST_COPIED + len(COPIED_ROWS), N_WORK + len(INFO)
)
ENDED = N_WORK + len(INFO)
SIGNALS = ENDED + 1
"""First work row of the observation, in SI: angle, pressures, their set-points, payload, then what
the actions asked for, then references."""
COMMON_SIGNALS = 6

CONFIG = (
    "tracking_weight",
    "error_scale",
    "effort_weight",
    "soft_angle",
    "soft_pressure",
    "largest_angle",
    "amplitude",
    "frequency",
    "start_angle",
    "prestress",
    "payload_change",
    "disturbance",
    "worst_period",
)
(
    TRACKING_WEIGHT,
    ERROR_SCALE,
    EFFORT_WEIGHT,
    SOFT_ANGLE,
    SOFT_PRESSURE,
    LARGEST_ANGLE,
    AMPLITUDE,
    FREQUENCY,
    START_ANGLE,
    PRESTRESS,
    PAYLOAD_CHANGE,
    DISTURBANCE,
    WORST_PERIOD,
) = range(FIRST_CONFIG, FIRST_CONFIG + len(CONFIG))
CHOICES = ("elements", "family", "sines", "mode", "payloads", "fixed_signals")
N_ELEMENTS, FAMILY, N_SINES, MODE, N_PAYLOADS, FIXED_SIGNALS = range(
    FIRST_CHOICE, FIRST_CHOICE + len(CHOICES)
)
"""The one own row of the settings holds the payloads [kg] to draw from."""
MODES = ("angle", "angle_stiffness", "pressures")
BY_ANGLE, BY_BOTH, BY_PRESSURE = range(len(MODES))
"""What the actions are."""
REFERENCES = (*FAMILIES, "sine", "step")
SINE, STEP = SAMPLES + 1, SAMPLES + 2
"""Numbers of the references that this family has beside those of all."""
STEP_SECONDS = 1.0
"""When the reference "step" leaves 0."""

PULSE_WINDOW, PULSE = 500, 100
"""Control periods: one pulse of the disturbance in so many, and how long it lasts."""
NOISE_ANGLE, NOISE_A, NOISE_B, START, PULSES = 1, 2, 3, 5, 6
"""Random streams."""
