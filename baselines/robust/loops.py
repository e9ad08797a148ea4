"""Synthesised disturbance loops of joints, H-infinity and mu: fluidic_muscles, section 4.

The numbers are those of ``joint_robust.json``, written by :mod:`baselines.robust.synthesis`. Both
loops act on the angle of the model less that of the joint, and were designed for poles at 23 rad/s.
For a joint with other poles ``p`` the loop is ``C(23 s / p)``, scaled in time: with a double pole
at ``p`` the loop gain is the same at ``p / 23`` of the frequency. ``mu`` is then not larger, as the
bound on the neglected dynamics is unchanged while the loop gain decreases at that frequency.

In an arm the double pole only approximates a joint that oscillates and is coupled to the others: at
the base the error exceeds the bound of the design by a fifth, so that ``mu`` does not apply there.
With the arm straight and without friction all six loops together are stable over the whole sector
of gains, with 0.1 kg at the tip too, and at the nominal gain the sensitivity peaks at 1.24 (1.48
with the 0.1 kg), where one stage has 1.02.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from baselines.linear.systems import StateSpace, state_space
from baselines.robust.requirements import RobustDesign

Kind = Literal["hinf", "mu"]
Stage = Literal["full", "reduced"]


@cache
def frozen() -> dict[str, Any]:
    """Return the numbers of the synthesis."""
    text = Path(__file__).with_name("joint_robust.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def robust_controller(
    kind: Kind, stage: Stage = "reduced", pole: float | None = None
) -> StateSpace:
    """Return a controller in continuous time, from error [rad] to command [rad].

    ``stage``: as synthesised, or reduced as the controllers use it; ``pole`` of the joint [rad/s],
    by default that of the design.
    """
    numbers = frozen()[kind][stage]
    a, b, c = (np.array(numbers[name]) for name in "abc")
    pace = 1.0 if pole is None else pole / RobustDesign().pole
    return state_space(pace * a, pace * b, c, numbers["d"])
