"""The classical controllers of the antagonistic joint and of the manipulator by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from baselines.core.entry import Entry
from baselines.core.knobs import Bounds
from baselines.joint.feedback import make_joint_feedback
from baselines.joint.inverse import make_joint_inverse
from baselines.joint.model_following import KNOBS as FOLLOWING_KNOBS
from baselines.joint.model_following import make_model_following
from baselines.joint.preview import KNOBS as AHEAD_KNOBS
from baselines.joint.trivial import make_joint_random, make_straight
from baselines.knee.catalogue import SIMC
from baselines.linear.simc import PID_KNOBS
from baselines.manipulator.redundancy import make_inverse_kinematics
from pam_envs.parameters import Signals

ARM = ("PAM/RedundantManipulator-v0",)
JOINT = ("PAM/AntagonisticJoint-v0", *ARM)
SEED_002 = (
    "fluidic_muscles: Nonlinear Model-Based Control Architecture for Antagonistic Pairs of Fluidic "
    "Muscles in Manipulator Motion Control"
)
FOLLOWING = (
    "S. Skoczowski, S. Domek, K. Pietrusewicz, B. Broel-Plater, A method for improving the "
    "robustness of PID control, IEEE Trans. Industrial Electronics 52 (2005)"
)
DK = "A. K. Packard, J. C. Doyle, The complex structured singular value, Automatica 29 (1993)"
MODEL = "nominal model"


def _entry(
    summary: str,
    citation: str,
    feedback: bool = True,
    ahead: bool = False,
    knobs: Bounds | None = None,
) -> Entry:
    own = {**(knobs or {}), **(AHEAD_KNOBS if ahead else {})}
    return Entry(summary, MODEL, ahead, feedback, citation, JOINT, knobs=own)


def _pid(summary: str, ahead: bool = False) -> Entry:
    return _entry(summary, SIMC, ahead=ahead, knobs=PID_KNOBS)


def _mfc(summary: str, ahead: bool = False) -> Entry:
    return _entry(summary, MFC, ahead=ahead, knobs=FOLLOWING_KNOBS)


MFC = f"{SEED_002}; {FOLLOWING}; {DK}"
AHEAD = "; carries gravity, and follows the preview ahead by its own delay"
JOINT_CONTROLLERS: dict[str, Entry] = {
    "joint_straight": Entry("set-points of 0 always", "nothing", envs=JOINT),
    "joint_random": Entry(
        "set-points drawn evenly from the whole range, seeded", "nothing", envs=JOINT
    ),
    "joint_line": _entry(
        "line between the tips of the loop: hysteresis ignored", SEED_002, feedback=False
    ),
    "joint_inverse": _entry(
        "exact inverse of the identified hysteresis, without feedback", SEED_002, feedback=False
    ),
    "joint_inverse_gravity": _entry(
        "joint_inverse, and a feed-forward that carries gravity", SEED_002, feedback=False
    ),
    "joint_inverse_ahead": _entry(f"joint_inverse{AHEAD}", SEED_002, feedback=False, ahead=True),
    "joint_inverse_kinematics": Entry(
        "set-points that give the wanted pose of the tool, found anew each period; no inverse",
        MODEL,
        citation=SEED_002,
        envs=ARM,
    ),
    "joint_pi": _entry("PI that cancels a pole, damping 0.71, as in the paper", SEED_002),
    "joint_pi_slow": _entry("PI that cancels a pole, crossover 4 rad/s", SEED_002),
    "joint_pi_ahead": _entry(f"joint_pi{AHEAD}", SEED_002, ahead=True),
    "joint_pid": _pid(
        "PID, SIMC tuning with tau_c = theta; in an arm at most twice as fast as the joint"
    ),
    "joint_pid_smooth": _pid("PID, SIMC tuning, closed loop as fast as the plant"),
    "joint_pid_gravity": _pid("joint_pid, and a feed-forward that carries gravity"),
    "joint_pid_ahead": _pid(f"joint_pid{AHEAD}", ahead=True),
    "joint_pid_smooth_ahead": _pid(f"joint_pid_smooth{AHEAD}", ahead=True),
    "joint_mfc_hinf": _mfc("model-following control with inverse and H-infinity disturbance loop"),
    "joint_mfc_mu": _mfc(
        "model-following control with inverse and mu-synthesised disturbance loop: the paper's"
    ),
    "joint_mfc_mu_plain": _mfc("joint_mfc_mu without the inverse"),
    "joint_mfc_mu_wrong": _mfc("joint_mfc_mu with an inverse 30 % too narrow"),
    "joint_mfc_mu_gravity": _mfc("joint_mfc_mu, and a feed-forward that carries gravity"),
    "joint_mfc_mu_ahead": _mfc(f"joint_mfc_mu{AHEAD}", ahead=True),
}

Maker = Callable[..., Any]
WRONG = 0.7
"""Width of the wrong inverse's loops over the right one's."""


def _feedback(**how: Any) -> Maker:
    def make(plant: Any, signals: Signals, actions: Signals, **knobs: Any) -> Any:
        return make_joint_feedback(plant, signals, actions, **how, **knobs)

    return make


def _inverse(**how: Any) -> Maker:
    def make(plant: Any, signals: Signals, actions: Signals, **knobs: Any) -> Any:
        return make_joint_inverse(plant, signals, actions, **how, **knobs)

    return make


def _following(**how: Any) -> Maker:
    def make(plant: Any, signals: Signals, actions: Signals, **knobs: Any) -> Any:
        return make_model_following(plant, signals, actions, **how, **knobs)

    return make


AHEAD_TOO: Mapping[str, Any] = {"gravity": True, "ahead": True}
JOINT_MAKERS: Mapping[str, Maker] = {
    "joint_straight": make_straight,
    "joint_random": make_joint_random,
    "joint_line": _inverse(inverse=0.0),
    "joint_inverse": _inverse(),
    "joint_inverse_gravity": _inverse(gravity=True),
    "joint_inverse_ahead": _inverse(**AHEAD_TOO),
    "joint_inverse_kinematics": make_inverse_kinematics,
    "joint_pi": _feedback(kind="pi"),
    "joint_pi_slow": _feedback(kind="pi_slow"),
    "joint_pi_ahead": _feedback(kind="pi", **AHEAD_TOO),
    "joint_pid": _feedback(kind="pid"),
    "joint_pid_smooth": _feedback(kind="pid_smooth"),
    "joint_pid_gravity": _feedback(kind="pid", gravity=True),
    "joint_pid_ahead": _feedback(kind="pid", **AHEAD_TOO),
    "joint_pid_smooth_ahead": _feedback(kind="pid_smooth", **AHEAD_TOO),
    "joint_mfc_hinf": _following(kind="hinf"),
    "joint_mfc_mu": _following(),
    "joint_mfc_mu_plain": _following(inverse=0.0),
    "joint_mfc_mu_wrong": _following(inverse=WRONG),
    "joint_mfc_mu_gravity": _following(gravity=True),
    "joint_mfc_mu_ahead": _following(**AHEAD_TOO),
}
"""From nominal plant, signals, action signals and perhaps ``knobs`` to the controller."""
