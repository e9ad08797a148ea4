"""Reference ahead of time: what a loop has to be given so that its output is not late.

A controller reads the reference as it will be when its own delay for slow references, and half a
control period of the hold, have gone by: by straight lines between the previewed samples. Where the
previews end before, as they do for the slow joints of an arm, the straight line from the present to
the last sample is prolonged.

The loop of the pole-cancelling PI and the nominal model (:mod:`baselines.joint.loop`) is, at a
damping of ``1 / sqrt(2)``,

    T(s) = 1 / (1 + 2 (s / p) + 2 (s / p)^2)

which is ``exp(-2 s / p)`` up to the third order: for a smooth reference a delay of ``2 / p`` and
nothing else. (Of the double pole without a loop the delay is the same, up to the second order.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.core.controller import Array
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.joint.view import JointSignalMap

MOST = 2.0
"""How far the previewed stretch is prolonged at most, in its own length."""
KNOBS: Bounds = {"lead": (0.25, 4.0)}
"""On the delays that are made up for."""


def double_lags(poles: Sequence[float]) -> list[float]:
    """Return the delays [s] of double poles [rad/s], and of the PI's loops around them."""
    return [2.0 / pole for pole in poles]


@dataclass(frozen=True)
class Lookahead:
    """Reads a reference ahead of time, for each joint by another time.

    Attributes
    ----------
    weights : ndarray, shape (n_joints or 1, n_samples)
        Of the samples of the reference, the present one first.
    """

    weights: NDArray[np.float64]

    def wanted(self, samples: Array) -> Array:
        """Return the references [rad], shape (n_env, n_joints), from all their samples."""
        return np.asarray(np.add.reduce(samples * self.weights, axis=-1))


def present(samples: int) -> Lookahead:
    """Return what reads the present reference."""
    return Lookahead(np.eye(1, samples))


def ahead_by(leads: Sequence[float], times: Sequence[float]) -> Lookahead:
    """Return what reads the reference of each joint so much later [s].

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
    """Return what makes up for the delays of joints [s] and for the hold, or reads the present.

    Parameters
    ----------
    signals : JointSignalMap
    delays : sequence of float or None
        Without that of the hold; None for the present.
    period : float
        Control period [s].
    knobs : mapping
        Of ``KNOBS``.
    """
    if delays is None:
        return present(len(signals.times))
    return ahead_by([knob(knobs, "lead") * delay + 0.5 * period for delay in delays], signals.times)


def _weights(lead: float, times: Array) -> Array:
    """Return the weights of samples at times [s] that give the value at another."""
    made, last = np.zeros(len(times)), len(times) - 1
    if last == 0:
        made[0] = 1.0
    elif lead <= times[last]:
        k = int(np.clip(np.searchsorted(times, lead) - 1, 0, last - 1))
        share = (lead - times[k]) / (times[k + 1] - times[k])
        made[k : k + 2] = 1.0 - share, share
    else:
        beyond = min(lead / times[last] - 1.0, MOST)
        made[0], made[last] = -beyond, 1.0 + beyond
    return made
