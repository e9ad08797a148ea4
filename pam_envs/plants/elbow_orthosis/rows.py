"""Row numbers of the elbow orthosis (see :mod:`pam_envs.plants.core.rows`).

Of pairs, the first row is that of bundle a, which straightens the elbow. ``DRIVE``: torque of the
intended motion; ``AT_A``: travel of the pulley, the hysteresis input (of both bundles, but for
friction driven by length, where each has an operator of its own); ``LEFT``, ``LIFT`` and
``OPENED``: coil time left, lift and state of each valve.
"""

from typing import TYPE_CHECKING, Any

from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.parameters import named_rows
from pam_envs.plants.core.muscle_path import DELAYED, PATH_STATE
from pam_envs.plants.core.rows import dotted, each, layout, path_effects
from pam_envs.plants.core.sensors import sensor_rows

VALVES = 4
"""Fill and exhaust valve of bundle a, then of bundle b."""
_BUNDLE = (
    "muscles nominal_length largest_contraction passive_base passive_each pressure_base "
    "pressure_each diameter line_volume gain"
)
BUNDLE = named_rows(*_BUNDLE.split())
"""Rows of bundle a; those of bundle b follow."""

globals().update(
    layout(
        each(
            "angle velocity pressure_a pressure_b command_a command_b intent intent_rate "
            "intent_acceleration disturbance force_a force_b contraction_a contraction_b torque "
            "stiffness felt wearer slack air_a air_b used switches clock drive at_a at_b lag_a "
            "lag_b"
        )
        | each("left lift opened", VALVES)
        | {"delay": 2 * DELAYED.end},
        dotted(
            bundle_a=_BUNDLE,
            bundle_b=_BUNDLE,
            regulator="max_pressure dead_time time_constant slew_rate",
            valve="supply_pressure conductance critical_ratio opening_time closing_time frequency",
            hysteresis="loop",
            pulley="radius lowest highest stop_stiffness",
            link="mass centre inertia damping gravity",
            wearer="mass centre inertia stiffness damping handle",
            angle="noise resolution bias",
            pressure="noise resolution bias",
        ),
        path_effects(
            *("bundle_a", "bundle_b"),
            bearing="link",
            sensors=("angle", "pressure"),
            law="muscle",
            yields="hysteresis",
            viscous="muscle",
        )
        | {"tail": ("hysteresis.yield_tail",)},
        each("effective crept deflection yielded stick more next steeper", 2)
        | {"paths": 2 * PATH_STATE.end, "stuck": 1, "sensors": sensor_rows(3)},
        {"model": NUMBERS, "largest_lag": 1},
        operators=2,
    )
)

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
