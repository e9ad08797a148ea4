"""The disturbance loops of joints as they were synthesised: H-infinity and mu, seed 002, section 4.

The numbers come from ``joint_robust.json``, which :mod:`baselines.joint_synthesis` writes. Both
loops act on the angle of the model less that of the joint, and were designed for poles at 23 rad/s.
For a joint with other poles ``p`` the loop is ``C(23 s / p)``: time runs slower, and gain, ``mu``
and peaks stay what they are, at ``p / 23`` of the bandwidth.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from baselines.linear import DiscreteSystem, LinearSystem
from baselines.robust_design import RobustDesign

Kind = Literal["hinf", "mu"]
Stage = Literal["full", "reduced"]


@cache
def frozen() -> dict[str, Any]:
    """Return what the synthesis wrote."""
    text = Path(__file__).with_name("joint_robust.json").read_text(encoding="utf-8")
    return dict(json.loads(text))


def robust_controller(
    kind: Kind, stage: Stage = "reduced", pole: float | None = None
) -> LinearSystem:
    """Return a controller in continuous time, from error [rad] to command [rad].

    Parameters
    ----------
    kind : {"hinf", "mu"}
    stage : {"full", "reduced"}
        As synthesised, or as the controllers use it.
    pole : float, optional
        Of the joint [rad/s]; that of the design if not given.
    """
    numbers = frozen()[kind][stage]
    a, b, c = (np.array(numbers[name]) for name in "abc")
    pace = 1.0 if pole is None else pole / RobustDesign().pole
    return LinearSystem(pace * a, pace * b, c, numbers["d"])


def frozen_loop(kind: Kind) -> DiscreteSystem:
    """Return a controller at the control period for which it was frozen."""
    numbers = frozen()[kind]["discrete"]
    a, b, c = (np.array(numbers[name]) for name in "abc")
    return DiscreteSystem(a, b, c, numbers["d"], float(frozen()["period"]))
