"""The classical controllers of the knee orthosis by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from baselines.core.entry import Entry
from baselines.knee.design import KNOBS as LOOP_KNOBS
from baselines.knee.inverse import make_knee_forward
from baselines.knee.ltr import make_knee_ltr
from baselines.knee.pid import make_knee_pid
from baselines.knee.preview import KNOBS as AHEAD_KNOBS
from baselines.knee.published import NOMINAL_PRESSURE
from baselines.linear.simc import PI_KNOBS
from baselines.positioning.trivial import Constant
from pam_envs.parameters import Signals
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

BRACE = ("PAM/KneeTension-v0", "PAM/KneeStiffness-v0")
GAIT = ("PAM/KneeWalk-v0", "PAM/KneeStairsUp-v0", "PAM/KneeStairsDown-v0")
KNEE = (*BRACE, *GAIT)
SEED_000 = (
    "T.-J. Yeh, M.-J. Wu, T.-J. Lu, F.-K. Wu, C.-R. Huang, Control of McKibben pneumatic muscles "
    "for a power-assist, lower-limb orthosis, Mechatronics 20 (2010)"
)
LTR = "M. Athans, A tutorial on the LQG/LTR method, American Control Conference 1986"
BUMPLESS = (
    "L. Zaccarian, A. R. Teel, A common framework for anti-windup, bumpless transfer and reliable "
    "designs, Automatica 38 (2002)"
)
SIMC = (
    "S. Skogestad, Simple analytic rules for model reduction and PID controller tuning, J. Process "
    "Control 13 (2003) 291-309"
)
MODEL = "nominal model"

KNEE_CONTROLLERS: dict[str, Entry] = {
    "knee_hold": Entry("2 bar always, the nominal pressure", "nothing", envs=KNEE),
    "knee_free": Entry(
        "inverse for no torque on the knee: neither helps nor hinders",
        MODEL,
        citation=SEED_000,
        envs=GAIT,
    ),
    "knee_pid": Entry(
        "PI of the tension, SIMC tuning",
        MODEL,
        feedback=True,
        citation=SIMC,
        envs=KNEE,
        knobs=PI_KNOBS,
    ),
    "knee_line": Entry(
        "straight line between the tips of the loop: hysteresis ignored", MODEL, envs=KNEE
    ),
    "knee_inverse": Entry(
        "inverse of the hysteresis at the present reference, as in the paper",
        MODEL,
        citation=SEED_000,
        envs=KNEE,
    ),
    "knee_inverse_ahead": Entry(
        "knee_inverse, at the reference one lag of the regulator ahead",
        MODEL,
        preview=True,
        citation=SEED_000,
        envs=KNEE,
        knobs=AHEAD_KNOBS,
    ),
    "knee_ltr": Entry(
        "loop transfer recovery on the identified plant, about 2 bar",
        MODEL,
        feedback=True,
        citation=f"{SEED_000}; {LTR}; {BUMPLESS}",
        envs=KNEE,
        knobs=LOOP_KNOBS,
    ),
    "knee_line_ltr": Entry(
        "knee_ltr and knee_line: how much of the gain is feed-forward alone",
        MODEL,
        feedback=True,
        citation=f"{LTR}; {BUMPLESS}",
        envs=KNEE,
        knobs=LOOP_KNOBS,
    ),
    "knee_inverse_ltr": Entry(
        "knee_ltr and knee_inverse: the paper's control system; compensator with K = L = 0,"
        " which its matrix inequality allows for a stable plant: the model following does the work",
        MODEL,
        feedback=True,
        citation=f"{SEED_000}; {LTR}; {BUMPLESS}",
        envs=KNEE,
        knobs=LOOP_KNOBS,
    ),
    "knee_inverse_ahead_ltr": Entry(
        "knee_inverse_ltr, its feed-forward one lag of the regulator ahead",
        MODEL,
        preview=True,
        feedback=True,
        citation=f"{SEED_000}; {LTR}; {BUMPLESS}",
        envs=KNEE,
        knobs={**LOOP_KNOBS, **AHEAD_KNOBS},
    ),
    "knee_inverse_ltr_bumpy": Entry(
        "knee_inverse_ltr without compensators: each loop integrates off-line, clamped in charge",
        MODEL,
        feedback=True,
        citation=f"{SEED_000}; {LTR}",
        envs=GAIT,
    ),
    "knee_printed": Entry(
        "knee_inverse_ltr with the printed tension controller (11) and compensator; meant for"
        ' dynamics="measured" (1.1 % on its sine), on plants with the regulator\'s lag it cycles',
        MODEL,
        feedback=True,
        citation=SEED_000,
        envs=KNEE,
    ),
}

Maker = Callable[..., Any]


def _forward(**how: Any) -> Maker:
    def make(plant: KneeOrthosis, signals: Signals, actions: Signals, **knobs: Any) -> Any:
        return make_knee_forward(plant, signals, actions, **how, **knobs)

    return make


def _ltr(**how: Any) -> Maker:
    def make(plant: KneeOrthosis, signals: Signals, actions: Signals, **knobs: Any) -> Any:
        return make_knee_ltr(plant, signals, actions, **how, **knobs)

    return make


KNEE_MAKERS: Mapping[str, Maker] = {
    "knee_hold": lambda _, __, actions: Constant(actions["pressure_set_point"], NOMINAL_PRESSURE),
    "knee_free": _forward(assist=False),
    "knee_pid": make_knee_pid,
    "knee_line": _forward(kind="line"),
    "knee_inverse": _forward(),
    "knee_inverse_ahead": _forward(preview=True),
    "knee_ltr": _ltr(forward="nominal"),
    "knee_line_ltr": _ltr(forward="line"),
    "knee_inverse_ltr": _ltr(),
    "knee_inverse_ahead_ltr": _ltr(preview=True),
    "knee_inverse_ltr_bumpy": _ltr(bumpless=False),
    "knee_printed": _ltr(printed=True),
}
"""From nominal plant, signals, action signals and perhaps ``knobs`` to the controller."""
