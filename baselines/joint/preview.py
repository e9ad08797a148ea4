"""Preview of the reference by the delay of a loop.

A controller reads the reference later by its own delay for slow references and half a control
period of the hold, by linear interpolation of the previewed samples. Where the preview horizon is
too short, as for the slow joints of an arm, the line from the present to the last sample is
extrapolated.

The loop of the pole-cancelling PI and the nominal model (:mod:`baselines.joint.loop`) is, at a
damping of ``1 / sqrt(2)``,

    T(s) = 1 / (1 + 2 (s / p) + 2 (s / p)^2)

which equals ``exp(-2 s / p)`` up to the third order: for a smooth reference a pure delay of
``2 / p``. (The double pole without a loop has the same delay, up to the second order.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.core.controller import Array
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.joint.view import JointSignalMap

MAX_EXTRAPOLATION = 2.0
"""Largest extrapolation over the preview horizon."""
KNOBS: Bounds = {"lead": (0.25, 4.0)}
"""Factor on the compensated delays."""


def double_pole_delays(poles: Sequence[float]) -> list[float]:
    """Return the delays [s] of double poles [rad/s], and of the PI's loops around them."""
    return [2.0 / pole for pole in poles]


@dataclass(frozen=True)
class Lookahead:
    """Interpolation of a previewed reference, for each joint at its own time.

    Attributes
    ----------
    weights : ndarray, shape (n_joints or 1, n_samples)
        Of the samples of the reference, the present one first.
    """

    weights: NDArray[np.float64]

    def reference(self, samples: Array) -> Array:
        """Return the references [rad], shape (n_env, n_joints), from their samples."""
        return np.asarray(np.add.reduce(samples * self.weights, axis=-1))


def present(samples: int) -> Lookahead:
    """Return the weights of the present reference."""
    return Lookahead(np.eye(1, samples))


def ahead_by(leads: Sequence[float], times: Sequence[float]) -> Lookahead:
    """Return the weights of the reference later by a lead [s] of each joint.

    Parameters
    ----------
    leads : sequence of float
        Of the joints [s].
    times : sequence of float
        Of the samples [s] after the present one, which is the first: ascending.
    """
    return Lookahead(np.array([_weights(lead, np.asarray(times, float)) for lead in leads]))


def lookahead_for(
    signals: JointSignalMap,
    delays: Sequence[float] | None,
    period: float,
    knobs: Knobs = AS_DESIGNED,
) -> Lookahead:
    """Return the weights that compensate the delays of joints [s] and the hold.

    Parameters
    ----------
    signals : JointSignalMap
    delays : sequence of float or None
        Without that of the hold; None for the present reference.
    period : float
        Control period [s].
    knobs : mapping
        Of ``KNOBS``.
    """
    if delays is None:
        return present(len(signals.times))
    return ahead_by([knob(knobs, "lead") * delay + 0.5 * period for delay in delays], signals.times)


def _weights(lead: float, times: Array) -> Array:
    """Return the interpolation weights of samples at times [s] for a lead [s]."""
    made, last = np.zeros(len(times)), len(times) - 1
    if last == 0:
        made[0] = 1.0
    elif lead <= times[last]:
        k = int(np.clip(np.searchsorted(times, lead) - 1, 0, last - 1))
        share = (lead - times[k]) / (times[k + 1] - times[k])
        made[k : k + 2] = 1.0 - share, share
    else:
        beyond = min(lead / times[last] - 1.0, MAX_EXTRAPOLATION)
        made[0], made[last] = -beyond, 1.0 + beyond
    return made
