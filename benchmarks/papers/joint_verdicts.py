"""What symmetry and congruency are of joints, and of one muscle alone: seed 002, section 3."""

from __future__ import annotations

from functools import cache

from pam_envs.identification.joint_forc import JointMemory, measure_joint, measure_memory
from pam_envs.identification.joint_muscle import HangingMuscle
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

PRESSURES = (0.5e5, 6.5e5)
"""Between which the single muscle is driven [Pa]: below, it does not lift its load."""


@cache
def verdicts() -> dict[str, JointMemory]:
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
    found["one DMSP-10 under 100 N"] = measure_memory(muscle.rest_contractions, *PRESSURES)
    return found
