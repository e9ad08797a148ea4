"""Row numbers of the knee orthosis (see :mod:`pam_envs.plants.core.rows`).

Brace and muscle, then stride and wearer, then the modes of the measured dynamics.
"""

from typing import TYPE_CHECKING, Any

from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.plants.core.muscle_path import DELAYED, PATH_STATE
from pam_envs.plants.core.rows import dotted, each, layout, path_effects
from pam_envs.plants.core.sensors import sensor_rows
from pam_envs.pneumatics.measured_dynamics import MODE_ROWS, MODES

SENSORS = ("tension", "angle", "pressure", "heel", "ground", "cop", "ankle")

PARTS = 8
"""Parts of a stride of which an adaptive wearer expects assistance."""

globals().update(
    layout(
        each(
            "angle velocity pressure stiffness set_point old_set_point tension length torque air "
            "old_pressure old_air start_phase phase knee knee_rate knee_acceleration deviation "
            "deviation_rate shank ankle ground_z ground_x cop demand estimate heel stance hold "
            "hold_rate quads quads_free flexors flexors_free at lag stick rub stride_number early "
            "next_early heavy next_heavy reflex felt felt_count felt_part"
        )
        | {"mode": MODES, "expected": PARTS, "delay": DELAYED.end},
        dotted(
            regulator="max_pressure dead_time time_constant slew_rate",
            hysteresis="width friction empty",
            muscle="shortest_length stiffness_ratio full_volume gain",
            lever="arm fittings stiffness relaxed_angle mount_angle inertia damping",
            fixture="length",
            leg="body_mass mass inertia centre shank thigh ankle_height aim_height damping "
            "stiffness hold_stiffness hold_damping stance_stiffness stance_damping habituation "
            "reflex adaptation forgetting",
            stride="time variability load_variability",
            shoe="heel tip threshold flat_foot",
            activation="largest_torque floor rise_time fall_time",
            **dict.fromkeys(SENSORS, "noise resolution bias"),
        ),
        path_effects(
            "muscle",
            bearing="lever",
            sensors=SENSORS,
            law="muscle",
            yields="muscle",
            viscous="muscle",
        )
        | {"tail": ("muscle.yield_tail",)},
        {
            "effective": 1,
            "beyond": 1,
            "deflection": 1,
            "yielded": 1,
            "path": PATH_STATE.end,
            "stuck": 1,
            "sensors": sensor_rows(len(SENSORS)),
        },
        {"mode_table": MODE_ROWS, "model": NUMBERS},
    )
)

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
