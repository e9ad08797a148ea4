"""Row numbers of the redundant manipulator (see :mod:`pam_envs.plants.core.rows`).

Rows of one kind are neighbours, ``ANGLE + k`` of joint ``k``, ``PRESSURE + 2 k`` of its muscle A
and ``PRESSURE + 2 k + 1`` of its muscle B. There is room for ``MOST_STAGES`` joints, however many a
chain has. The parameters of the muscles have the rows of those of a single joint, so that the
kernels of the pair serve both. ``MIDDLE`` and its rate are predictions, ``CHANGE`` is that of the
velocity in a sub-step, ``SHARE`` the payload over the links' common factor; after the parameters
follow the damping of each joint beside ``link.damping`` [N m s/rad], and the chain's rows.
"""

from typing import TYPE_CHECKING, Any

from pam_envs.hysteresis.protocol import NUMBERS
from pam_envs.plants.antagonistic_joint.rows import STAGE
from pam_envs.plants.core.muscle_path import DELAYED, PATH_STATE
from pam_envs.plants.core.rows import dotted, each, layout, path_effects
from pam_envs.plants.core.sensors import sensor_rows

MOST_STAGES = 8

globals().update(
    layout(
        each(
            "angle velocity command prestress disturbance torque stiffness middle middle_rate "
            "change",
            MOST_STAGES,
        )
        | each("pressure set_point force contraction lag at stick", 2 * MOST_STAGES)
        | each("payload slack air straight share")
        | {"delay": 2 * MOST_STAGES * DELAYED.end},
        (*STAGE, *dotted(arm="mass_factor damping_factor")),
        path_effects(
            "muscle",
            sensors=("angle", "pressure"),
            law="muscle",
            yields="muscle",
            pair="muscle",
        ),
        {
            **each("effective deflection yielded", 2 * MOST_STAGES),
            "paths": 2 * MOST_STAGES * PATH_STATE.end,
            "sensors": sensor_rows(3 * MOST_STAGES),
        },
        {"model": NUMBERS, "joint_damping": MOST_STAGES, "chain": 0},
        operators=2 * MOST_STAGES,
    )
)

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
