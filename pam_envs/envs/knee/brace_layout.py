"""Rows, report and configuration of the kernels of the brace alone."""

from __future__ import annotations

from pam_envs.envs.core.layout import Report, computed, indices
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
        "state/tension": K.TENSION,
        "state/stiffness": K.STIFFNESS,
        "state/angle": K.ANGLE,
        "state/velocity": K.VELOCITY,
        "state/length": K.LENGTH,
        "state/pressure": K.PRESSURE,
        **computed("sensor", "tension", "stiffness", "angle", "pressure"),
    },
    N_WORK,
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals
FIXED_SIGNALS = 5
"""Readings of tension, stiffness, angle and pressure, set-point; the references follow."""

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
