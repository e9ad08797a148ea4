"""Air flow through the orifices of a proportional valve, ISO 6358.

The valve opens in proportion to the error of its pressure control, fully beyond ``opening_band``:
its supply orifice fills the muscle, its exhaust orifice empties it. The controller may have an
integral part, and the spool a lag. The flow of an orifice is

    m' = C rho_0 p_1 f(p_2 / p_1),    f(x) = 1 for x <= b,  sqrt(1 - ((x - b) / (1 - b))^2) above

with absolute pressures, upstream first, at 20 degrees C: choked up to the critical ratio ``b``.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from pam_envs.constants import ATMOSPHERE, REFERENCE_DENSITY
from pam_envs.kernels.arithmetic import clip
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, effect

AIRS = ("regulator", "flow")
"""Values of ``air=``: a closed-loop regulator, or the flow through its orifices."""
SWITCH = "regulator.flow"
"""Parameter that selects one of ``AIRS``, 0 or 1."""
REPLACED = (
    *("slew_bend", "slew_ratio", "overlap", "exhaust_ratio", "exhaust_rate", "pilot_lag"),
    *("pilot_damping", "rate_lag", "overlap_leak", "exhaust_taper", "dead_close", "supply_time"),
    *("time_constant", "slew_rate", "supply_effect"),
    *("speed_2", "speed_6", "speed_20", "speed_60", "integral", "integral_release"),
)
"""Parameters of a regulator that the orifices replace."""


@dataclass(frozen=True, kw_only=True)
class FlowEffects:
    """Orifices of a regulator and the air behind them.

    With ``flow`` 1 they replace the parameters in ``REPLACED``. Dead time, gain, dead band,
    pressure and droop of the supply, leak and line keep their effects.
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        (
            *("flow", "conductance", "exhaust_share", "critical_ratio", "opening_band"),
            *("opening_bend", "polytropic", "source_pressure"),
            *("opening_integral", "opening_windup", "opening_lag"),
        ),
    )

    flow: float = effect("1", 0.0, 1.0, "1: flow through orifices; 0: closed-loop regulator")
    conductance: float = assumed(
        1.3e-10, "m3/(s Pa)", 1e-12, 1e-6, "sonic, of the supply orifice: fills 14 ml at 7 bar/s"
    )
    exhaust_share: float = assumed(
        1.0, "1", 0.02, 10.0, "conductance of the exhaust orifice over the supply's"
    )
    critical_ratio: float = assumed(0.3, "1", 0.0, 0.9, "usual of pneumatic valves, ISO 6358")
    opening_band: float = assumed(
        3.4e4, "Pa", 1e3, 5e5, "error that opens fully: lag of 50 ms times 6.8e5 Pa/s"
    )
    opening_bend: float = effect("1", -0.9, 1.0, "shape of opening by error: 0 linear, 1 quadratic")
    opening_integral: float = effect(
        "1/s", 0.0, 100.0, "integral gain of the controller over its proportional gain"
    )
    opening_windup: float = assumed(
        1.0, "1", 0.01, 1.0, "anti-windup: largest integral part over opening_band"
    )
    opening_lag: float = effect("s", 0.0, 1.0, "lag of the opening, of the spool")
    polytropic: float = assumed(
        1.0, "1", 1.0, 1.4, "of compression by motion alone; 1: isothermal, 1.4: adiabatic"
    )
    source_pressure: float = assumed(7e5, "Pa", 5e4, 2e6, "gauge, upstream of the supply orifice")


def usual_conductance(value: float, source: str) -> float:
    """Return the conductance [m3/(s Pa)] of the orifices of one kind of regulator."""
    return assumed(value, "m3/(s Pa)", 1e-12, 1e-6, source)


@kernel
def mass_flow(upstream: float, downstream: float, conductance: float, critical: float) -> float:
    """Return the flow [kg/s] between absolute pressures [Pa], ISO 6358; never backwards."""
    part = max(0.0, downstream / upstream - critical) / (1.0 - critical)
    choked = conductance * REFERENCE_DENSITY * upstream
    return choked * math.sqrt(max(0.0, 1.0 - part * part))


@kernel
def answered_error(pressure: float, goal: float, dead: float) -> float:
    """Return the error of the pressure control beyond the ``dead`` band [Pa]."""
    error = goal - pressure
    return max(0.0, error - dead) + min(0.0, error + dead)


@kernel
def bent(opened: float, bend: float) -> float:
    """Return the opening, from -1 to 1, that ``opening_bend`` makes of a linear one."""
    return opened * (1.0 + bend * (abs(opened) - 1.0))


@kernel
def valve_opening(pressure: float, goal: float, dead: float, per_band: float, bend: float) -> float:
    """Return the opening of the valve, from -1 (exhaust) to 1 (supply).

    ``dead`` is the error [Pa] that it does not answer, ``per_band`` one over the further error that
    opens it fully, ``bend`` the ``opening_bend``.
    """
    return bent(clip(answered_error(pressure, goal, dead) * per_band, -1.0, 1.0), bend)  # type: ignore[no-any-return]


@kernel
def integrated_opening(
    pressure: float, goal: float, dead: float, per_band: float, bend: float, gathered: float
) -> float:
    """Return the opening of :func:`valve_opening` of a controller with an integral part.

    ``gathered`` is the integral part [Pa]. A valve with a ``dead`` band is shut within it.
    """
    answered = answered_error(pressure, goal, dead)
    gathered = 0.0 if dead > 0.0 and answered == 0.0 else gathered
    return bent(clip((answered + gathered) * per_band, -1.0, 1.0), bend)  # type: ignore[no-any-return]


@kernel
def gathered_rate(answered: float, gathered: float, band: float, gain: float) -> float:
    """Return the rate of the integral part [Pa/s]: 0 where it would open a full valve further."""
    total = answered + gathered
    return 0.0 if abs(total) >= band and total * answered > 0.0 else gain * answered


@kernel
def inflow(
    opened: float, pressure: float, source: float, supply: float, exhaust: float, critical: float,
    per_span: float,
) -> float:  # fmt: skip
    """Return the flow [kg/s] into a muscle at a pressure [Pa]; negative: to the atmosphere.

    ``source`` is the absolute pressure [Pa] upstream, ``supply`` and ``exhaust`` are the
    conductances [m3/(s Pa)], ``per_span`` is ``1 / (1 - critical)``. The flow is that of
    :func:`mass_flow`, in a form without division.
    """
    inside = pressure + ATMOSPHERE
    upstream = source if opened > 0.0 else inside
    downstream = inside if opened > 0.0 else ATMOSPHERE
    size = supply if opened > 0.0 else exhaust
    beyond = max(0.0, downstream - critical * upstream)
    span = upstream - critical * upstream
    drop = math.sqrt(max(0.0, span * span - beyond * beyond))
    return opened * (size * REFERENCE_DENSITY * per_span) * drop


@kernel
def power_of_ratio(ratio: float, exponent: float) -> float:
    """Return ``ratio ** exponent`` to 1e-11, for ratios from 0.8 to 1.25 and exponents up to 1."""
    s = (ratio - 1.0) / (ratio + 1.0)
    y = s * s
    t = y * (1.0 / 9.0) + 1.0 / 7.0
    t = t * y + 1.0 / 5.0
    t = t * y + 1.0 / 3.0
    t = t * y + 1.0
    x = 2.0 * exponent * s * t  # exponent * log(ratio), at most 0.23
    u = x * (1.0 / 40320.0) + 1.0 / 5040.0
    u = u * x + 1.0 / 720.0
    u = u * x + 1.0 / 120.0
    u = u * x + 1.0 / 24.0
    u = u * x + 1.0 / 6.0
    u = u * x + 0.5
    u = u * x + 1.0
    return u * x + 1.0
