"""Rows, report, observation and configuration of the gait kernels."""

from pam_envs.envs.core.layout import Report, computed, copied, indices
from pam_envs.envs.core.step import FIRST_CONFIG
from pam_envs.parameters import declarations
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.motion import N_WORK
from pam_envs.sensing.butterworth import ROWS as FILTER_ROWS
from pam_envs.tasks.gait_assistance import GaitAssistance

# the environment's own state, after the plant's
READ_TENSION, READ_ANGLE, READ_PRESSURE, READ_HEEL, READ_GROUND, READ_COP, READ_ANKLE = range(
    K.END, K.END + 7
)
READ_STANCE, DESIRED_TORQUE, DESIRED_TENSION, DESIRED_ANGLE, BEARS, BEARS_FREE, FILTER = range(
    READ_ANKLE + 1, READ_ANKLE + 8
)
PLAN_FILTER = FILTER + FILTER_ROWS
HYSTERESIS = PLAN_FILTER + FILTER_ROWS
"""First row of the state of the hysteresis."""

SENSORS = (
    *(K.TENSION_NOISE, K.ANGLE_NOISE, K.PRESSURE_NOISE, K.HEEL_NOISE, K.GROUND_NOISE),
    *(K.COP_NOISE, K.ANKLE_NOISE),
)
"""First row of the parameters of each reading's sensor, from ``READ_TENSION`` on."""

REPORT = Report(
    {
        **computed("reward", "tension", "angle", "over_assistance", "effort"),
        **computed("cost", "pressure", "deviation"),
        **computed("margin", "tension", "deviation", "pressure"),
        **computed("effort", "pressure_travel", "air", "over_assistance"),
        **computed("state", "torque_ideal"),
        "effort/extensors": K.QUADS,
        "effort/extensors_free": K.QUADS_FREE,
        "effort/extensors_calibrated": BEARS,
        "effort/extensors_free_calibrated": BEARS_FREE,
        "effort/flexors": K.FLEXORS,
        "effort/flexors_free": K.FLEXORS_FREE,
        **copied("state", K, "tension", "stiffness", "length", "angle", "velocity"),
        "state/angle_reference": DESIRED_ANGLE,
        **copied("state", K, "deviation", "pressure", "torque"),
        "state/torque_reference": DESIRED_TORQUE,
        **copied("state", K, "demand", "estimate"),
        "state/ground_force": K.GROUND_Z,
        "state/ground_force_ahead": K.GROUND_X,
        **copied("state", K, "cop", "knee", "shank", "ankle", "phase", "stance"),
        "sensor/tension": READ_TENSION,
        "sensor/angle": READ_ANGLE,
        "sensor/pressure": READ_PRESSURE,
        "sensor/ground_force": READ_GROUND,
        "sensor/stance": READ_STANCE,
    },
    N_WORK,
    observed=(
        *(READ_TENSION, READ_ANGLE, READ_PRESSURE, K.SET_POINT, READ_STANCE, READ_GROUND),
        DESIRED_TORQUE,
    ),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals
CHANNELS = 2
TENSION_CHANNEL, ANGLE_CHANNEL = range(CHANNELS)

CONFIG = indices(
    (
        *declarations(GaitAssistance),
        *("ratio", "lowest_torque", "mismatch", "demand_share", "start_phase", "start_spread"),
        *("known_arm", "known_wire", "known_relaxed", "known_shank", "known_mass"),
    ),
    FIRST_CONFIG,
)
"""The last five are the orthosis' knowledge of itself and its wearer, in SI: the parameters of the
plant before any is drawn. Its references follow from these."""
SOURCES = ("estimate", "demand")
ESTIMATE, DEMAND, SAMPLES = range(len(SOURCES) + 1)
"""Torque of which the assistance is a share, or samples of the assistance."""

NOISE, START = 8, 15
"""Random streams: of the first sensor, and of the start."""
PRIMING = 100
"""Control periods that the low-pass runs before an episode."""
