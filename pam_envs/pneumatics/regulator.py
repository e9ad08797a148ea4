"""Proportional pressure regulator: dead time, slew limit, first-order lag, saturation."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import kernel
from pam_envs.parameters import parameter

DELAY_PERIODS = 12
"""Longest dead time, in control periods, that a command history has to hold."""


@dataclass(frozen=True)
class Regulator:
    """A closed-loop pressure regulator as its user sees it.

    The set-point, held between 0 and ``max_pressure``, takes effect after ``dead_time``. The
    pressure then follows it by a first-order lag whose rate is limited to ``slew_rate``.
    No value was published for the regulator of the measured muscle (Festo MPPES-3-1/4-6-010): the
    defaults are assumed, within what two identified regulators of its class show.
    """

    max_pressure: float = parameter(
        6e5,
        "Pa",
        1e4,
        1.2e6,
        "published",
        "positioning2021, section 3.2: MPPES-3-1/4-6-010, 0 to 6 bar",
    )
    dead_time: float = parameter(
        0.045,
        "s",
        0.0,
        0.11,
        "assumed",
        "44 ms (DMSP-10-250 record, inflating), 45 ms (identified SMC ITV)",
        neutral=0.0,
        spread=(0.02, 0.1),
    )
    time_constant: float = parameter(
        0.05,
        "s",
        0.002,
        2.0,
        "assumed",
        "50 ms (DMSP-10-250 record, inflating), 83 ms (identified SMC ITV)",
        spread=(0.035, 0.12),
    )
    slew_rate: float = parameter(
        6.8e5,
        "Pa/s",
        1e4,
        1e9,
        "assumed",
        "6.8 bar/s (DMSP-10-250 record, raw step)",
        neutral=1e9,
        spread=(4e5, 1.2e6),
    )
    # effects, neutral unless a recording shows them
    gain: float = parameter(
        1.0, "1", 0.5, 1.5, "assumed", "pressure reached over set-point", neutral=1.0
    )
    slew_bend: float = parameter(
        0.0, "1", 0.0, 1.0, "assumed", "from a sharp slew limit to a rounded one", neutral=0.0
    )
    dead_band: float = parameter(
        0.0, "Pa", 0.0, 3e5, "assumed", "error that the valve does not answer", neutral=0.0
    )
    dead_close: float = parameter(
        1.0, "1", 0.0, 1.0, "assumed", "error at which the valve closes again, over dead_band"
    )
    overlap: float = parameter(
        0.0, "Pa", 0.0, 3e5, "assumed", "error up to which the spool only leaks", neutral=0.0
    )
    overlap_leak: float = parameter(
        0.01, "1", 1e-4, 1.0, "assumed", "gain within the overlap over that beyond it"
    )
    exhaust_ratio: float = parameter(
        1.0, "1", 0.1, 20.0, "assumed", "lag when exhausting over lag when filling", neutral=1.0
    )
    exhaust_taper: float = parameter(
        0.0, "1", 0.0, 1.0, "assumed", "how much of exhaust_ratio is gone at full pressure"
    )
    exhaust_rate: float = parameter(
        100.0,
        "1/s",
        0.05,
        100.0,
        "assumed",
        "fastest exhaust over absolute pressure (choked flow)",
        neutral=100.0,
    )
    leak: float = parameter(
        0.0, "1/s", 0.0, 10.0, "assumed", "pressure lost over pressure", neutral=0.0
    )
    supply_pressure: float = parameter(
        2e7, "Pa", 5e4, 2e7, "assumed", "of the reservoir at rest", neutral=2e7
    )
    supply_droop: float = parameter(
        0.0, "1", 0.0, 5.0, "assumed", "supply pressure lost over pressure filled", neutral=0.0
    )
    supply_time: float = parameter(
        0.01, "s", 0.001, 5.0, "assumed", "filling to the supply takes at full flow"
    )
    supply_recovery: float = parameter(
        10.0, "s", 0.1, 1e3, "assumed", "filling the empty reservoir takes at full flow"
    )
    ring_share: float = parameter(
        0.0, "1", 0.0, 1.0, "assumed", "share of the pressure behind a line that rings", neutral=0.0
    )
    ring_flow: float = parameter(
        0.0, "1", -2.0, 2.0, "assumed", "ringing that goes with the flow", neutral=0.0
    )
    ring_frequency: float = parameter(7.0, "Hz", 0.5, 20.0, "assumed", "of the line")
    ring_damping: float = parameter(0.1, "1", 0.005, 2.0, "assumed", "damping ratio of the line")


@kernel
def delayed_fraction(end: float, per_width: float, switch: float) -> float:
    """Return the share of an interval that lies after ``switch``.

    The interval ends at ``end`` and is ``1 / per_width`` wide; shares within 1e-9 of 0 and 1 are
    rounding errors and count as such.
    """
    share = (end - switch) * per_width
    if share < 1e-9:
        return 0.0
    if share > 1.0 - 1e-9:
        return 1.0
    return share


@kernel
def regulator_step(
    pressure: float,
    target: float,
    lag: float,
    per_lag: float,
    slew: float,
    per_slew: float,
    h: float,
) -> float:
    """Return the pressure after ``h`` seconds at a constant target: exact.

    While the gap to the target exceeds ``slew * lag`` the pressure ramps; the rest of the interval
    it decays exponentially.

    Parameters
    ----------
    pressure, target : float
        [Pa].
    lag, per_lag : float
        Time constant [s] and its reciprocal.
    slew, per_slew : float
        Largest rate [Pa/s] and its reciprocal.
    h : float
        Duration [s].
    """
    gap = target - pressure
    size = abs(gap)
    ramp = max(0.0, min(h, size * per_slew - lag))
    left = (size - slew * ramp) * decay((h - ramp) * per_lag)
    if gap < 0.0:
        return target + left
    return target - left
