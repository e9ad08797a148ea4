"""Rows, report and configuration of the kernels of the brace alone."""

from __future__ import annotations

from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.parameters import declarations
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.step import N_WORK
from pam_envs.references.trajectory import ROWS as REFERENCE_ROWS
from pam_envs.references.trajectory import SAMPLES
from pam_envs.tasks.gait_assistance import BraceTracking

REFERENCE = K.END
HYSTERESIS = K.END + REFERENCE_ROWS
"""First row of the state of the hysteresis."""

REPORT = Report(
    {
        **computed("reward", "tracking", "effort"),
        **computed("cost", "pressure"),
        **computed("margin", "tension", "pressure"),
        **computed("effort", "pressure_travel", "air"),
        **copied("state", K, "tension", "stiffness", "angle", "velocity", "length", "pressure"),
        **computed("sensor", "tension", "stiffness", "angle", "pressure"),
    },
    N_WORK,
    observed=(None, None, None, None, K.SET_POINT),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals

CONFIG = indices(
    (
        *declarations(BraceTracking),
        *("reference_low", "reference_high", "frequency", "start_low", "start_high"),
    ),
    FIRST_CONFIG,
)
CHOICE = indices(("quantity",), FIRST_CHOICE)
QUANTITIES = ("tension", "stiffness")
TENSION, STIFFNESS = range(len(QUANTITIES))
"""Tracked quantities."""

PAPER = SAMPLES + 1
"""Number of the reference of yeh2010: a sine that begins at its lowest value."""
NOISE_T, NOISE_A, NOISE_P, START = 8, 9, 10, 15
"""Random streams."""
