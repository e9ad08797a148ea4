"""Rate-independent hysteresis as a library of its own: operators, inverses, maps.

Every operator is a frozen value with ``initial_state``, ``simulate`` (one history), ``step`` (rows
of a batch) and ``scaled``; what it remembers is handed in and out. The kernels ``play`` and
``preisach_step`` are what a plant calls, on rows of its own.
"""

from pam_envs.hysteresis.everett import symmetry_error, table_from_weights, weights_from_table
from pam_envs.hysteresis.maxwell_slip import (
    MaxwellSlip,
    PlayOperator,
    play,
    play_step,
    slip_step,
    stop,
)
from pam_envs.hysteresis.modified_maxwell_slip import (
    ModifiedMaxwellSlip,
    pressure_step,
    stiffness_step,
)
from pam_envs.hysteresis.preisach import Preisach, PreisachState, preisach_inverse, preisach_step

__all__ = [
    "MaxwellSlip",
    "ModifiedMaxwellSlip",
    "PlayOperator",
    "Preisach",
    "PreisachState",
    "play",
    "play_step",
    "preisach_inverse",
    "preisach_step",
    "pressure_step",
    "slip_step",
    "stiffness_step",
    "stop",
    "symmetry_error",
    "table_from_weights",
    "weights_from_table",
]
