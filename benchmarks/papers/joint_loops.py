"""Robustness, disturbance rejection and step response of each loop on a joint's angle.

For a controller with model-following this is the disturbance loop, for any other the loop itself.
All are evaluated around the same nominal plant with the same measure
(:mod:`baselines.robust.requirements`) in continuous time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.linear.systems import response
from baselines.robust.requirements import FREQUENCIES, RobustDesign, sensitivity
from benchmarks.papers.joint_studies import STEPPED, ReducedRig, StepFigures, controller, step

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LOW = (0.1, 1.0, 4.0)
"""Frequencies [rad/s] of the tabulated sensitivity."""


@dataclass(frozen=True)
class LoopFigures:
    """Figures of one controller.

    Attributes
    ----------
    name : str
    mu : float
        Largest structured singular value, 1 or less if the performance holds for all plants.
    sensitivity : tuple of float
        ``|S|`` at ``LOW``.
    peak : float
        Largest ``|S|``.
    step : StepFigures
        Of 10 degrees after a turn, with the assumed hysteresis.
    """

    name: str
    mu: float
    sensitivity: tuple[float, ...]
    peak: float
    step: StepFigures


def law_response(made: Any, frequency: Array) -> Complex:
    """Return the response of a controller's loop from error to command, shape (n,).

    Its discrete form follows from the bilinear rule, which is inverted by ``z = (1 + s T / 2) / (1
    - s T / 2)``.

    Parameters
    ----------
    made : JointFeedback or ModelFollowing
    frequency : ndarray, shape (n,)
        [rad/s].
    """
    loop = made.disturbance if hasattr(made, "disturbance") else made.loop
    bank, half = loop.controller, 0.5j * frequency * made.model.period
    eye = np.eye(bank.a.shape[1])
    z = (1.0 + half) / (1.0 - half)
    found = np.linalg.solve(z[:, None, None] * eye - bank.a[0], bank.b[0][:, None])
    return np.asarray(found[..., 0] @ bank.c[0] + bank.d[0])


@cache
def loop_figures(name: str) -> LoopFigures:
    """Return the figures of a controller of the catalogue."""
    design, made = RobustDesign(), controller(name, ReducedRig())
    loop = response(design.plant, FREQUENCIES) * law_response(made, FREQUENCIES)
    size = sensitivity(loop)
    low = tuple(float(np.interp(f, FREQUENCIES, size)) for f in LOW)
    value = float(design.structured_value(loop).max())
    return LoopFigures(name, value, low, float(size.max()), step(name))


def table() -> tuple[LoopFigures, ...]:
    """Return the figures of every controller of the step study."""
    return tuple(loop_figures(name) for name in STEPPED)
