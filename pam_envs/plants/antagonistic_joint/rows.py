"""Row numbers of the antagonistic joint (see :mod:`pam_envs.plants.core.rows`).

Of pairs, the first row is muscle A's. ``AT``: contraction beyond that of the straight joint
(``STRAIGHT``), the hysteresis input.
"""

from typing import TYPE_CHECKING, Any

from pam_envs.plants.core.muscle_path import DELAYED, PATH_STATE
from pam_envs.plants.core.rows import dotted, each, layout, path_effects
from pam_envs.plants.core.sensors import sensor_rows

STAGE = dotted(
    regulator="max_pressure dead_time time_constant slew_rate",
    hysteresis="width base rate",
    muscle="area taper threshold braid_force braid_strain stiffness stretch gain imbalance "
    "viscosity rest_length diameter",
    lever="r_u r_o l_u l_o fittings",
    link="damping limit stop stop_stiffness",
    nominal="prestress",
    angle="noise resolution bias",
    pressure="noise resolution bias",
)
"""Parameters of a stage, alone and in a chain."""

globals().update(
    layout(
        each(
            "angle velocity pressure_a pressure_b set_point_a set_point_b command prestress "
            "disturbance payload force_a force_b contraction_a contraction_b lag_a lag_b slack "
            "torque stiffness air at_a at_b stick_a stick_b straight"
        )
        | {"delay": 2 * DELAYED.end},
        (*STAGE, *dotted(link="length mass centre gyration gravity", nominal="pole stiffness")),
        path_effects(
            *("muscle",),
            bearing="link",
            sensors=("angle", "pressure"),
            law="muscle",
            yields="muscle",
            pair="muscle",
        ),
        {
            **each("effective deflection yielded", 2),
            "paths": 2 * PATH_STATE.end,
            "stuck": 1,
            "sensors": sensor_rows(3),
        },
        operators=2,
    )
)

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
