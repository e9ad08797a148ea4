"""Row numbers of the single muscle (see :mod:`pam_envs.plants.core.rows`).

``REST`` to ``CHANGE`` are drawn at reset; ``STRAIN`` to ``STICK`` belong to friction driven by
length; ``HISTORY`` is the ring of the last setpoints.
"""

from typing import TYPE_CHECKING, Any

from pam_envs.hysteresis import elements as plays
from pam_envs.hysteresis.friction_effects import (
    CreepEffects,
    FirstCycles,
    FrictionEffects,
    StartEffects,
    Threshold,
    YieldEffects,
)
from pam_envs.kernels.motion import N_HISTORY
from pam_envs.mechanics.guide import GuideEffects
from pam_envs.mechanics.hanging_mass import MOUNT_STATE, MountEffects, SupportEffects
from pam_envs.muscle.effects import (
    LengthCreepEffects,
    LengthYieldTailEffects,
    LoadEffects,
    StaticMapEffects,
    StrandEffects,
    TemperatureEffects,
    ViscosityEffects,
)
from pam_envs.parameters import declarations
from pam_envs.plants.core.rows import dotted, each, layout
from pam_envs.plants.core.sensors import sensor_rows
from pam_envs.pneumatics.regulator import AIR, AIR_STATE
from pam_envs.sensing.sensor import SENSOR

_EFFECTS: dict[str, tuple[Any, ...]] = {
    "regulator": AIR._fields,
    "hysteresis": (
        FrictionEffects,
        CreepEffects,
        *("first_width", "first_stiffness"),
        FirstCycles,
        Threshold,
        YieldEffects,
        StartEffects,
    ),
    "muscle": (
        *("area_curve", "softening", "stiffening"),
        *(TemperatureEffects, LoadEffects, LengthCreepEffects, StrandEffects, ViscosityEffects),
        *(StaticMapEffects, LengthYieldTailEffects),
    ),
    "mass": ("carried", "load_error", SupportEffects, GuideEffects, MountEffects),
    "position": SENSOR._fields,
    "pressure": SENSOR._fields,
}
"""Parameters of the effects of each component, or classes that declare them."""


def _names(part: str, members: tuple[Any, ...]) -> tuple[str, ...]:
    each_of = ((m,) if isinstance(m, str) else declarations(m) for m in members)
    return tuple(f"{part}.{name}" for names in each_of for name in names)


_ROWS = layout(
    each(
        "contraction velocity pressure drive set_point old_set_point load old_pressure old_air "
        "rest declared_load change_time change strain lag stick"
    )
    | {"history": N_HISTORY},
    dotted(
        regulator="max_pressure dead_time time_constant slew_rate",
        muscle="rest_length diameter braid_angle area area_taper braid_force braid_strain "
        "stiffness hardening",
        mass="load moving_mass damping",
        position="noise resolution bias",
        pressure="noise resolution bias",
        hysteresis="stretch width_per_load friction limit_per_pressure limit_per_load",
    ),
    {part: _names(part, members) for part, members in _EFFECTS.items()},
    {
        "air": len(AIR_STATE),
        **each("friction travel"),
        **each("creep stretch strands", 4),
        **each("stuck shown"),
        "mount": len(MOUNT_STATE),
        **each("kelvin hung hangs position deflection"),
        **each("yielding", 2),
        "sensors": sensor_rows(2),
    },
)
globals().update(_ROWS)

LINEAR, THRESHOLD, WEIGHT = (
    _ROWS["MODEL"] + row for row in (plays.LINEAR, plays.THRESHOLD, plays.WEIGHT)
)
"""Rows of the numbers of play operators."""

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
