"""Resonance of line or mount: decaying oscillations after steps.

The air column of a long feed line oscillates against the muscle's volume, or the target of the
position sensor is on a soft bracket. A share of the pressure, or of the position, then follows
through a lightly damped second-order system of a few hertz.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.starting_values import grid

_SHARES, _DAMPINGS, _FLOWS = (0.1,), (0.03, 0.1), (0.1,)
_TILTS, _TILT_DAMPINGS = (0.05, -0.05), (0.05,)
"""A target that tilts with its mount moves either way."""
_FLOW = Term("regulator.ring_flow", (0.1,), scale=0.05)
_HERTZ = (3.0, 3.5, 4.0, 4.6, 5.2, 5.8, 6.5, 7.2, 8.0, 8.8, 9.6, 10.5, 11.5, 12.6, 14.0)


def _ring(component: str, low: float, *more: Term) -> tuple[Term, ...]:
    return (
        Term(f"{component}.ring_share", (0.1,), low=low, high=0.8, scale=0.05),
        Term(f"{component}.ring_frequency", (7.0,), log=True, amount=False),
        Term(f"{component}.ring_damping", (0.1,), high=0.2, log=True, amount=False),
        *more,
    )


CAUSE = Cause(
    name="resonance",
    title="a resonance of line or mount",
    forms=(
        Form("line", _ring("regulator", 0.0, _FLOW), grid(_SHARES, _HERTZ, _DAMPINGS, _FLOWS)),
        Form("mount", _ring("mass", -0.8), grid(_TILTS, _HERTZ, _TILT_DAMPINGS)),
    ),
    signature="a decaying oscillation of one frequency after every step, absent in holds",
    contains=("sensor_delay", "dead_time"),
    neighbours=("dead_time", "viscous_loss"),
    experiment=(
        "Sharp steps sampled at 50 Hz or more, under two loads: ringing keeps its frequency, the "
        "oscillation of load and muscle slows with the load's mass; in the pressure it is the "
        "line, in the contraction alone the mount. Between steps it decays, unlike a vibration."
    ),
    source="Acoustics of tubes (340 m/s over four lengths); sizes and frequencies are assumed.",
    sensor="an accelerometer on the mount, or a fast pressure sensor at either end of the line",
    # not compensable: at or above the bandwidth of regulator and load
)
