"""Rate-independent hysteresis as a library of its own: operators, inverses, maps, registry.

Every operator is a frozen value with ``initial_state``, ``simulate`` (one history), ``step`` (rows
of a batch) and ``scaled``; its state is passed in and returned. Importing the package imports each
of its modules, and a module registers the model that it holds
(:mod:`~pam_envs.hysteresis.protocol`).
"""

from importlib import import_module as _import_module
from pkgutil import iter_modules as _iter_modules

from pam_envs.hysteresis.elements import play, play_step, slip_step, stop
from pam_envs.hysteresis.everett import symmetry_error, table_from_weights, weights_from_table
from pam_envs.hysteresis.extrema import preisach_inverse, preisach_step
from pam_envs.hysteresis.maxwell_slip import MaxwellSlip, PlayOperator
from pam_envs.hysteresis.modified_maxwell_slip import (
    ModifiedMaxwellSlip,
    pressure_step,
    stiffness_step,
)
from pam_envs.hysteresis.none import NoHysteresis
from pam_envs.hysteresis.preisach import Preisach, PreisachState
from pam_envs.hysteresis.protocol import HysteresisModel, Kernels, kinds, register

for _module in _iter_modules(__path__):
    _import_module(f"{__name__}.{_module.name}")

__all__ = [
    "HysteresisModel",
    "Kernels",
    "MaxwellSlip",
    "ModifiedMaxwellSlip",
    "NoHysteresis",
    "PlayOperator",
    "Preisach",
    "PreisachState",
    "kinds",
    "play",
    "play_step",
    "preisach_inverse",
    "preisach_step",
    "pressure_step",
    "register",
    "slip_step",
    "stiffness_step",
    "stop",
    "symmetry_error",
    "table_from_weights",
    "weights_from_table",
]
