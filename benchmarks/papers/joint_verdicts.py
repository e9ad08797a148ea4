"""What symmetry and congruency are of joints, and of one muscle alone: fluidic_muscles, section 3."""

from __future__ import annotations

from functools import cache

from pam_envs.identification.joint_forc import JointHysteresis, measure_hysteresis, measure_joint
from pam_envs.identification.joint_muscle import HangingMuscle
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

PRESSURES = (0.5e5, 6.5e5)
"""Between which the single muscle is driven [Pa]: below, it does not lift its load."""


@cache
def verdicts() -> dict[str, JointHysteresis]:
    """Return what is found on the simulated rigs: two joints, and one of their muscles."""
    joints = {
        "paper joint": AntagonisticJoint.paper(),
        "measured joint": AntagonisticJoint.measured(),
    }
    found = {
        name: measure_joint(joint.rest_angles, joint.angle_range[1])
        for name, joint in joints.items()
    }
    muscle = HangingMuscle(joints["paper joint"])
    found["one DMSP-10 under 100 N"] = measure_hysteresis(muscle.rest_contractions, *PRESSURES)
    return found
