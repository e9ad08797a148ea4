"""Records of the kernels: constants of a rig, and its state.

Pressures are gauge pressures in bar, lengths are strains (contraction over rest length) unless the
name says mm, forces N, masses kg, times s. Every constant of an effect is neutral at zero.
"""

import hashlib
from pathlib import Path

import numpy as np

SLIDERS = 24
CREEP_ELEMENTS = 12
LAGS = 6
HISTORY = 1024  # of the sensor's moving average, in steps
TUBE = 256  # of the waves in a line, in steps: more than the way to its end and back
WAVES = 12

_BASE = """
    length gain approach force braid blend dome span rubber bend bulk grip grip_span mass damping
    friction
"""
_AIR = """
    leak overlap overlap_edge overlap_leak chain chain_lags slew slew_kind slew_rest slew_lean
    supply draw recovery throat critical exhaust line line_trip line_return line_wall
    neighbour neighbour_period neighbour_duty neighbour_decay dither dither_hz
"""
_FRICTION = """
    load_grip load_grip_sign pressure_grip pressure_grip_bend map map_kind strand
    breakaway kinetic stribeck bristle oil
"""
_MUSCLE = """
    creep creep_strain loss loss_pace heat virgin virgin_scale virgin_kind virgin_grip
    load_soft load_soft_power load_soft_sign threshold threshold_blur wander
    buckle buckle_up buckle_down
"""
_LOAD = """
    tray tray_rest tray_scale tray_rub slack slack_blur slip slip_time slip_blur slip_kind
    stop stop_at shake shake_hz shake_beat swing swing_omega swing_drive
    bump bump_cell bump_length bump_seed
"""
_SENSING = """
    bias_mm bias_bar drift_mm drift_bar drift_time drift_kind late late_kind late_lags
    bow_mm bow_bar bow_kind bow_curve target target_omega target_foot target_share target_lever
    target_zeta
    dropout dropout_cell dropout_seed
"""
_STATE = """
    pressure rate supply line line_end drive level strand_grip strain speed rest hang load weight
    travel bristle buckled angle angle_rate target target_rate foot foot_rate held integral
"""

Field = tuple[str, type] | tuple[str, type, tuple[int]]


def _numbers(names: str) -> list[Field]:
    return [(name, np.float64) for name in names.split()]


def _vectors(names: str, size: int) -> list[Field]:
    return [(name, np.float64, (size,)) for name in names.split()]


def _source_mark() -> str:
    """Return a mark of the jitted sources.

    The compiler's cache follows the file of a function, not of those that it calls. The mark
    is the name of a field, so a change in any of the files makes another type and a fresh start.
    """
    files = sorted(Path(__file__).parent.glob("kernel*.py"))
    text = b"".join(file.read_bytes() for file in files)
    return f"source_{hashlib.sha256(text).hexdigest()[:12]}"


_MARK: list[Field] = [(_source_mark(), np.int64)]
PARAMETERS = np.dtype(
    _MARK
    + _numbers(_BASE + _AIR + _FRICTION + _MUSCLE + _LOAD + _SENSING)
    + _vectors("stiffness breaks strand_stiffness strand_breaks", SLIDERS)
    + _vectors("creep_share creep_pace", CREEP_ELEMENTS)
    + _vectors("wave_size wave_hz wave_phase", WAVES)
)
STATE = np.dtype(
    _MARK
    + [(name, np.int64) for name in ("tick",)]
    + _numbers(_STATE)
    + _vectors("stops strands", SLIDERS)
    + _vectors("crept", CREEP_ELEMENTS)
    + _vectors("queue late", LAGS)
    + _vectors("history", HISTORY)
    + _vectors("sent returned", TUBE)
)


def blank(layout: np.dtype) -> np.ndarray:
    """Return one zeroed record of `layout`, shape (1,)."""
    return np.zeros(1, layout)
