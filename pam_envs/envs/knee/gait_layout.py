"""Where the numbers of the gait's environments stand: rows, report, observation, configuration."""

from __future__ import annotations

from pam_envs.envs.core.step import FIRST_CHOICE, FIRST_CONFIG
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.step import N_WORK
from pam_envs.sensing.butterworth import ROWS as FILTER_ROWS

# the environment's own state, after the plant's
(
    READ_TENSION,
    READ_ANGLE,
    READ_PRESSURE,
    READ_HEEL,
    READ_GROUND,
    READ_COP,
    READ_ANKLE,
    READ_STANCE,
    WANTED_TORQUE,
    WANTED_TENSION,
    WANTED_ANGLE,
    BEARS,
    BEARS_FREE,
    FILTER,
) = range(K.END, K.END + 14)
PLAN_FILTER = FILTER + FILTER_ROWS
HYSTERESIS = PLAN_FILTER + FILTER_ROWS
"""First row of the hysteresis's state."""

SENSORS = (
    (K.TENSION, K.TENSION_NOISE),
    (K.ANGLE, K.ANGLE_NOISE),
    (K.PRESSURE, K.PRESSURE_NOISE),
    (K.HEEL, K.HEEL_NOISE),
    (K.GROUND_Z, K.GROUND_NOISE),
    (K.COP, K.COP_NOISE),
    (K.ANKLE, K.ANKLE_NOISE),
)
"""What each reading from ``READ_TENSION`` on is of, and the first row of its sensor's parameters:
noise, resolution, bias."""

COPIED = {
    "effort/extensors": K.QUADS,
    "effort/extensors_free": K.QUADS_FREE,
    "effort/extensors_calibrated": BEARS,
    "effort/extensors_free_calibrated": BEARS_FREE,
    "effort/flexors": K.FLEXORS,
    "effort/flexors_free": K.FLEXORS_FREE,
    "state/tension": K.TENSION,
    "state/stiffness": K.STIFFNESS,
    "state/length": K.LENGTH,
    "state/angle": K.ANGLE,
    "state/velocity": K.VELOCITY,
    "state/angle_reference": WANTED_ANGLE,
    "state/deviation": K.DEVIATION,
    "state/pressure": K.PRESSURE,
    "state/torque": K.TORQUE,
    "state/torque_reference": WANTED_TORQUE,
    "state/demand": K.DEMAND,
    "state/estimate": K.ESTIMATE,
    "state/ground_force": K.GROUND_Z,
    "state/ground_force_ahead": K.GROUND_X,
    "state/cop": K.COP,
    "state/knee": K.KNEE,
    "state/shank": K.SHANK,
    "state/ankle": K.ANKLE,
    "state/phase": K.PHASE,
    "state/stance": K.STANCE,
    "sensor/tension": READ_TENSION,
    "sensor/angle": READ_ANGLE,
    "sensor/pressure": READ_PRESSURE,
    "sensor/ground_force": READ_GROUND,
    "sensor/stance": READ_STANCE,
}
"""Keys of ``info`` that hold a row of the state as it is."""
COPIED_ROWS = tuple(COPIED.values())
JUDGED = (
    "time",
    "reference",
    "output",
    "reward/tension",
    "reward/angle",
    "reward/over_assistance",
    "reward/effort",
    "cost/pressure",
    "cost/deviation",
    "margin/tension",
    "margin/deviation",
    "margin/pressure",
    "effort/pressure_travel",
    "effort/air",
    "effort/over_assistance",
    "state/torque_ideal",
)
(
    TIME,
    REF,
    OUTPUT,
    R_TENSION,
    R_ANGLE,
    R_OVER,
    R_EFFORT,
    C_PRESSURE,
    C_DEVIATION,
    M_TENSION,
    M_DEVIATION,
    M_PRESSURE,
    E_TRAVEL,
    E_AIR,
    E_OVER,
    S_IDEAL,
    FIRST_COPIED,
) = range(N_WORK, N_WORK + len(JUDGED) + 1)
INFO = (*JUDGED, *COPIED, "saturated")
ENDED = N_WORK + len(INFO)
SIGNALS = ENDED + 1
"""First work row of the observation, in SI."""
SEEN_ROWS = (
    READ_TENSION,
    READ_ANGLE,
    READ_PRESSURE,
    K.SET_POINT,
    READ_STANCE,
    READ_GROUND,
    WANTED_TORQUE,
)
"""Rows of the state that are observed as they are."""
FIXED_SIGNALS = len(SEEN_ROWS)
CHANNELS = 2
TENSION_CHANNEL, ANGLE_CHANNEL = range(CHANNELS)

CONFIG = (
    "tension_weight",
    "tension_scale",
    "angle_weight",
    "angle_scale",
    "over_weight",
    "over_scale",
    "effort_weight",
    "soft_pressure",
    "soft_deviation",
    "highest_tension",
    "largest_deviation",
    "ratio",
    "lowest_torque",
    "mismatch",
    "demand_share",
    "start_phase",
    "start_spread",
    "known_arm",
    "known_wire",
    "known_relaxed",
    "known_shank",
    "known_mass",
)
"""The last five are what the orthosis knows of itself and its wearer, in SI: the parameters of the
plant before any is drawn. Its references follow from these."""
(
    TENSION_WEIGHT,
    TENSION_SCALE,
    ANGLE_WEIGHT,
    ANGLE_SCALE,
    OVER_WEIGHT,
    OVER_SCALE,
    EFFORT_WEIGHT,
    SOFT_PRESSURE,
    SOFT_DEVIATION,
    HIGHEST_TENSION,
    LARGEST_DEVIATION,
    RATIO,
    LOWEST_TORQUE,
    MISMATCH,
    DEMAND_SHARE,
    START_PHASE,
    START_SPREAD,
    KNOWN_ARM,
    KNOWN_WIRE,
    KNOWN_RELAXED,
    KNOWN_SHANK,
    KNOWN_MASS,
) = range(FIRST_CONFIG, FIRST_CONFIG + len(CONFIG))
CHOICES = ("elements", "source")
N_ELEMENTS, SOURCE = range(FIRST_CHOICE, FIRST_CHOICE + len(CHOICES))
SOURCES = ("estimate", "demand")
ESTIMATE, DEMAND, SAMPLES = range(len(SOURCES) + 1)
"""What the wanted assistance is a share of, or samples of it."""

NOISE, START = 8, 15
"""Random streams: of the first sensor, and of the start."""
PRIMING = 100
"""Control periods that the low-pass has run before an episode."""
