"""Rows, report and configuration of the muscle positioning kernels."""

from __future__ import annotations

from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.parameters import declarations
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.step import N_WORK
from pam_envs.references.trajectory import ROWS as REFERENCE_ROWS
from pam_envs.tasks.tracking import Tracking

REFERENCE = R.END
HYSTERESIS = R.END + REFERENCE_ROWS
"""First row of the state of the hysteresis."""

REPORT = Report(
    {
        **computed("reward", "tracking", "effort"),
        **computed("cost", "contraction", "pressure"),
        **computed("margin", "contraction", "pressure"),
        **computed("effort", "pressure_travel", "air"),
        **computed("state", "contraction"),
        **copied("state", R, "velocity", "pressure", "drive", "load"),
        **computed("sensor", "contraction", "pressure"),
    },
    N_WORK,
    observed=(None, None, R.SET_POINT, R.TOLD_LOAD),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals

CONFIG = indices(
    (*declarations(Tracking), "reference_low", "reference_high", "start_share", "load_change"),
    FIRST_CONFIG,
)
CHOICE = indices(("loads",), FIRST_CHOICE)
"""The own row of the settings holds the loads [kg] to draw from."""

NOISE_X, NOISE_P, START = 1, 2, 3
"""Random streams."""
