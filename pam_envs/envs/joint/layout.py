"""Rows, report, observation and configuration of the antagonistic joint kernels."""

from __future__ import annotations

from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.step import N_WORK
from pam_envs.references.trajectory import FAMILIES, SAMPLES
from pam_envs.references.trajectory import ROWS as REFERENCE_ROWS

# the environment's own state, after the plant's
ACTION = K.END
"""First row of the actions: angle [rad] and prestress [N], or two pressures [Pa]."""
OLD_ACTION = ACTION + 2
OLD_SET_A, OLD_SET_B, OLD_A, OLD_B, OLD_AIR = range(OLD_ACTION + 2, OLD_ACTION + 7)
DECLARED_PAYLOAD, CHANGE_TIME, CHANGE = range(OLD_AIR + 1, OLD_AIR + 4)
REFERENCE = CHANGE + 1
HYSTERESIS = REFERENCE + REFERENCE_ROWS
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
CHOICE = indices(("mode", "payloads"), FIRST_CHOICE)
"""The own row of the settings holds the payloads [kg] to draw from."""
MODES = ("angle", "angle_stiffness", "pressures")
BY_ANGLE, BY_BOTH, BY_PRESSURE = range(len(MODES))
"""Meaning of the actions."""
REFERENCES = (*FAMILIES, "sine", "step")
SINE, STEP = SAMPLES + 1, SAMPLES + 2
"""Numbers of the references that only this family has."""
STEP_SECONDS = 1.0
"""Time of the step of the reference "step"."""

PULSE_WINDOW, PULSE = 500, 100
"""Control periods between pulses of the disturbance, and duration of a pulse."""
NOISE_ANGLE, NOISE_A, NOISE_B, START, PULSES = 1, 2, 3, 5, 6
"""Random streams."""
