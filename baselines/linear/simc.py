"""SIMC tuning rule for PI and PID (skogestad2003).

A plant of two lags and a dead time, ``K exp(-theta s) / ((tau_1 s + 1) (tau_2 s + 1))``, has the
cascade form

    K_c = tau_1 / (K (tau_c + theta)),  tau_I = min(tau_1, 4 (tau_c + theta)),  tau_D = tau_2

The rule's one choice is the time constant ``tau_c`` of the closed loop; its recommendation, "fast,
with good robustness", is ``tau_c = theta``.

``theta`` includes one and a half control periods besides the plant's dead time: half a period of
the hold, and one of computing on a real rig. The environments have no computing delay (an action
acts from the instant of its observation), so that there the whole period is margin.
"""

from __future__ import annotations

from typing import NamedTuple

from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob

DELAY_PERIODS = 1.5
"""Control periods of dead time: hold and computing."""
PI_KNOBS: Bounds = {"closed_loop_time": (0.25, 4.0), "integral_time": (0.25, 4.0)}
PID_KNOBS: Bounds = {**PI_KNOBS, "derivative_time": (0.25, 4.0)}
"""Factors on ``tau_c``, ``tau_I`` and ``tau_D``."""


class Simc(NamedTuple):
    """Parameters of the cascade form.

    Attributes
    ----------
    gain : float
        ``K_c`` [unit of the command over that of the output].
    integral_time, derivative_time : float
        [s].
    """

    gain: float
    integral_time: float
    derivative_time: float


def simc_rule(
    gain: float,
    slow: float,
    fast: float,
    dead_time: float,
    closed_loop_time: float | None = None,
    knobs: Knobs = AS_DESIGNED,
) -> Simc:
    """Return the parameters of the rule; see the module.

    Parameters
    ----------
    gain : float
        ``K`` of the plant.
    slow, fast : float
        ``tau_1`` and ``tau_2`` [s]; a ``fast`` of 0 gives a PI.
    dead_time : float
        ``theta`` [s].
    closed_loop_time : float, optional
        ``tau_c`` [s]; default ``theta``.
    knobs : mapping
        Of ``PID_KNOBS``; the factor on ``tau_c`` acts before the rule.
    """
    chosen = dead_time if closed_loop_time is None else closed_loop_time
    total = dead_time + knob(knobs, "closed_loop_time") * chosen
    return Simc(
        slow / (gain * total),
        knob(knobs, "integral_time") * min(slow, 4.0 * total),
        knob(knobs, "derivative_time") * fast,
    )
