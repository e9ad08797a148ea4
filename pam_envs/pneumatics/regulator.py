"""Path of the air to a muscle through a proportional pressure regulator.

Dead time, slew limit, first-order lag, saturation.

Its effects are those of valve, supply and line: static gain, rounded slew limit, dead band of a
valve that closes, overlap of a spool, nonlinear characteristic (rate against error), lag of the
rate, integral part of the controller, slower and choked exhaust, leak.
"""

import math
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar

from pam_envs.constants import ATMOSPHERE
from pam_envs.kernels.arithmetic import TURN, count_on, decay
from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.motion import damped_motion, note, noted, resonator_step
from pam_envs.parameters import assumed, derived, effect, named_rows, parameter_rows, published
from pam_envs.pneumatics.flow import FlowEffects, usual_conductance

AMPLE = 2e7
"""Supply pressure [Pa] that limits nothing."""


@dataclass(frozen=True, kw_only=True)
class SupplyEffects:
    """Supply of a regulator, without limit by default.

    A drop of the supply lowers every setpoint by ``supply_effect`` (the pressure regulation
    characteristic of a regulator, ISO 6953).
    """

    supply_pressure: float = assumed(AMPLE, "Pa", 5e4, AMPLE, "reservoir at rest", neutral=AMPLE)
    supply_droop: float = effect("1", 0.0, 5.0, "supply pressure lost over pressure filled")
    supply_time: float = assumed(0.01, "s", 0.001, 5.0, "filling time at full flow")
    supply_recovery: float = assumed(10.0, "s", 0.1, 1e3, "filling time of the empty reservoir")
    supply_effect: float = effect(
        "1", 0.0, 5.0, "share of the setpoint lost over drop of the supply per full pressure"
    )


@kernel
def norm_8(a: float, b: float) -> float:
    """Return the eighth root of the sum of eighth powers: a slightly rounded maximum."""
    a2, b2 = a * a, b * b
    a4, b4 = a2 * a2, b2 * b2
    return math.sqrt(math.sqrt(math.sqrt(a4 * a4 + b4 * b4)))


@kernel
def supplied(
    pressure: float, reached: float, rest: float, drop: float, time: float, h: float
) -> float:
    """Return the pressure [Pa] after ``h`` seconds, limited by the flow of the supply.

    ``reached`` is the pressure without the limit, ``rest`` the supply pressure at rest, ``drop``
    its drop, ``time`` the ``supply_time`` [s]. The flow is choked, and goes with the root of the
    difference near the supply's pressure.
    """
    supply = rest - drop
    most = (supply + ATMOSPHERE) / time
    head = math.sqrt(max(0.0, supply - pressure))
    head = max(0.0, head - h * most / math.sqrt(2.0 * max(1.0, supply + ATMOSPHERE)))
    throat = max(0.0, min(h * most, supply - head * head - pressure))
    filling = max(1e-9, reached - pressure)
    share = throat / norm_8(filling, throat)  # the narrower of valve and throat, hardly rounded
    ample = reached <= pressure or rest >= AMPLE
    return reached if ample else pressure + filling * share


@kernel
def supply_drop(
    drop: float, filled: float, rest: float, droop: float, recovery: float, h: float
) -> float:
    """Return the drop of the supply pressure [Pa] after a muscle was filled by ``filled`` [Pa].

    The reservoir is filled through an orifice, as the root of the drop.
    """
    lacks = math.sqrt(drop + droop * max(0.0, filled))
    full = math.sqrt(0.5 * (rest + ATMOSPHERE))
    lacks = max(0.0, lacks - full * h / recovery)
    return lacks * lacks


@dataclass(frozen=True, kw_only=True)
class LineEffects:
    """Resonance of the line behind a regulator."""

    ring_share: float = effect("1", 0.0, 1.0, "share of the pressure behind a line that rings")
    ring_flow: float = effect("1", -2.0, 2.0, "ringing that goes with the flow")
    ring_frequency: float = assumed(7.0, "Hz", 0.5, 20.0, "of the line")
    ring_damping: float = assumed(0.1, "1", 0.005, 2.0, "damping ratio of the line")


LINE = parameter_rows(LineEffects)
"""Rows of a line's effects, from its first."""


@kernel
def line_step(
    rows: Any, fixed: Any, j: int, state: int, effects: int, was: float, now: float, h: float
) -> float:
    """Return the pressure [Pa] behind the line whose input went from ``was`` to ``now``."""
    turns, ratio = fixed[effects + LINE.ring_frequency][j], fixed[effects + LINE.ring_damping][j]
    swung, rate = resonator_step(rows, j, state, was, now, turns, ratio, h)
    part = fixed[effects + LINE.ring_share][j]
    flow = fixed[effects + LINE.ring_flow][j] * rate / (TURN * turns)
    return max(0.0, (1.0 - part) * now + part * swung + flow)


DELAY_PERIODS = 12
"""Longest dead time, in control periods, that a command history has to hold."""
NO_SLEW_LIMIT = 1e9
"""Slew rate [Pa/s] that limits nothing."""
UNCHOKED = 100.0
"""Exhaust rate [1/s] that limits nothing."""


@dataclass(frozen=True, kw_only=True)
class ValveEffects:
    """Effects of a regulator's valve."""

    gain: float = assumed(1.0, "1", 0.5, 1.5, "pressure reached over setpoint", neutral=1.0)
    slew_bend: float = effect("1", 0.0, 1.0, "from a sharp slew limit to a rounded one")
    slew_ratio: float = assumed(
        1.0, "1", 0.05, 20.0, "slew rate of exhaust over that of filling", neutral=1.0
    )
    dead_band: float = effect("Pa", 0.0, 3e5, "error that the valve does not answer")
    dead_close: float = assumed(1.0, "1", 0.0, 1.0, "closing error over dead_band")
    overlap: float = effect("Pa", 0.0, 3e5, "error up to which the spool only leaks")
    overlap_leak: float = assumed(0.01, "1", 1e-4, 1.0, "gain within the overlap over the full one")
    exhaust_ratio: float = assumed(1.0, "1", 0.1, 20.0, "exhaust lag over filling lag", neutral=1.0)
    exhaust_taper: float = assumed(0.0, "1", 0.0, 1.0, "loss of exhaust_ratio at full pressure")
    integral: float = effect("1/s2", 0.0, 1e4, "integral gain: rate gained per second, over error")
    integral_release: float = assumed(
        0.3, "s", 0.005, 1e3, "anti-windup: time constant by which rate limits drain it"
    )
    speed_2: float = assumed(
        1.0,
        "1",
        0.02,
        20.0,
        "rate over error at an error of 2 % of full pressure, relative to that at a small error",
        neutral=1.0,
    )
    speed_6: float = assumed(1.0, "1", 0.02, 20.0, "as speed_2, at 6 %", neutral=1.0)
    speed_20: float = assumed(1.0, "1", 0.02, 20.0, "as speed_2, at 20 %", neutral=1.0)
    speed_60: float = assumed(1.0, "1", 0.02, 20.0, "as speed_2, at 60 % and above", neutral=1.0)
    exhaust_rate: float = assumed(
        UNCHOKED, "1/s", 0.05, UNCHOKED, "choked exhaust over absolute pressure", neutral=UNCHOKED
    )
    leak: float = effect("1/s", 0.0, 10.0, "pressure lost over pressure")
    pilot_lag: float = effect("s", 0.0, 1.0, "one over the natural frequency of a pilot stage")
    pilot_damping: float = assumed(1.0, "1", 0.1, 5.0, "damping ratio of the pilot stage")
    rate_lag: float = effect("s", 0.0, 1.0, "lag of the rate, which stays within slew_rate")


@dataclass(frozen=True, kw_only=True)
class RegulatorEffects(FlowEffects, LineEffects, SupplyEffects, ValveEffects):
    """Effects of a regulator with its supply, its line and its orifices."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("gain",),
        ("slew_bend",),
        ("slew_ratio",),
        ("dead_band", "dead_close"),
        ("overlap", "overlap_leak"),
        ("exhaust_ratio", "exhaust_taper"),
        ("speed_2", "speed_6", "speed_20", "speed_60"),
        ("integral", "integral_release"),
        ("exhaust_rate",),
        ("leak",),
        ("pilot_lag", "pilot_damping"),
        ("rate_lag",),
        ("supply_pressure", "supply_droop", "supply_time", "supply_recovery"),
        ("supply_effect",),
        ("ring_share", "ring_flow", "ring_frequency", "ring_damping"),
        *FlowEffects.effects,
    )


def usual_dead_time() -> float:
    """Return the dead time of a regulator that was measured, for regulators of its class."""
    return assumed(
        0.045, "s", 0.0, 0.11, "45 ms: DMSP-10-250 record, SMC ITV", neutral=0.0, spread=(0.02, 0.1)
    )


def usual_slew_rate() -> float:
    """Return the slew rate of a regulator that was measured, for regulators of its class."""
    return assumed(
        6.8e5, "Pa/s", 1e2, 1e9, "DMSP-10-250 record, raw step", neutral=1e9, spread=(4e5, 1.2e6)
    )


@dataclass(frozen=True)
class Regulator(RegulatorEffects):
    """Closed-loop pressure regulator.

    The setpoint, held between 0 and ``max_pressure``, takes effect after ``dead_time``. The
    pressure then follows it by a first-order lag whose rate is limited to ``slew_rate``. No value
    was published for the regulator of the measured muscle (Festo MPPES-3-1/4-6-010): the defaults
    are assumed, within what two identified regulators of its class show.
    """

    max_pressure: float = published(6e5, "Pa", 1e4, 3e6, "positioning2021, section 3.2: 0 to 6 bar")
    dead_time: float = usual_dead_time()
    time_constant: float = assumed(
        0.05, "s", 0.002, 2.0, "DMSP-10-250 record; 83 ms: SMC ITV", spread=(0.035, 0.12)
    )
    slew_rate: float = usual_slew_rate()


@dataclass(frozen=True)
class JointRegulator(RegulatorEffects):
    """A proportional regulator for each muscle: dead time, limited rate, first-order lag."""

    max_pressure: float = assumed(6.5e5, "Pa", 1e4, 1.2e6, "highest of the measured force map")
    dead_time: float = usual_dead_time()
    time_constant: float = derived(
        1.0 / 23.0,
        "s",
        0.002,
        2.0,
        "one of two poles, fluidic_muscles, Fig. 12",
        spread=(0.03, 0.06),
    )
    slew_rate: float = usual_slew_rate()
    _: KW_ONLY
    conductance: float = usual_conductance(2.3e-10, "fills 25 ml of a DMSP-10-150N at 7 bar/s")


@dataclass(frozen=True)
class BundleRegulator(RegulatorEffects):
    """A closed-loop pressure regulator instead of the paper's valves."""

    max_pressure: float = published(6e5, "Pa", 1e4, 1.2e6, "largest: chakarov2018, section 2")
    dead_time: float = usual_dead_time()
    time_constant: float = assumed(
        0.05, "s", 0.002, 2.0, "of its class; see regulator.py", spread=(0.035, 0.12)
    )
    slew_rate: float = assumed(
        1.5e6, "Pa/s", 1e4, 1e9, "200 l/min into seven muscles", neutral=1e9, spread=(0.8e6, 3e6)
    )
    _: KW_ONLY
    conductance: float = usual_conductance(4.7e-9, "fills 0.24 l of seven muscles at 15 bar/s")
    opening_band: float = assumed(
        7.5e4, "Pa", 1e3, 5e5, "error that opens fully: lag of 50 ms times 1.5e6 Pa/s"
    )


AIR = parameter_rows(RegulatorEffects)
"""Rows of the effects of valve, supply and line, from the first."""
AIR_STATE = named_rows(
    *("regulated", "opened", "drop", "lost", "line", "line_rate", "pilot", "pilot_rate"),
    *("integral", "rate", "space", "here", "gives", "ahead", "slope"),
)
"""Rows of the state of valve, supply and line, from the first, with the pressure that the leak has
lost in the control period [Pa] (``lost``); then those of the air in the muscle:
volume of its pressure [m3] (0 before the first sub-step), volume at the present position, change of
the volume with the displacement, predicted displacement to the middle of a sub-step, and rise of
the pressure with the displacement (:mod:`pam_envs.pneumatics.enclosed_air`)."""


@kernel
def delayed_fraction(end: float, per_width: float, switch: float) -> float:
    """Return the share of an interval after ``switch``.

    The interval ends at ``end`` and is ``1 / per_width`` wide; shares within 1e-9 of 0 and 1 count
    as these, as rounding errors.
    """
    share = (end - switch) * per_width
    if share < 1e-9:
        return 0.0
    if share > 1.0 - 1e-9:
        return 1.0
    return share


@kernel
def late_shares(switch: Any, i: int, substeps: int, period: float, late: Any) -> None:
    """Write the share of sub-step ``i`` after the ``switch`` [s] to the newer setpoint."""
    for j in range(LANES):
        late[j] = delayed_fraction((i + 1) * (period / substeps), substeps / period, switch[j])


@kernel
def stage_widths(late: Any, stage: int, h: float, width: Any) -> int:
    """Write for how long [s] of a sub-step a setpoint holds; return the number of such lanes.

    ``stage`` is 0 for the older setpoint and 1 for the newer one.
    """
    busy = 0
    for j in range(LANES):
        width[j] = h * (late[j] if stage == 1 else 1.0 - late[j])
        busy = busy + (1 if width[j] > 0.0 else 0)
    return busy


@kernel
def switch_substeps(switch: Any, substeps: int, period: float, at: Any, late: Any) -> None:
    """Write in which sub-step the setpoint switches, and the share of it after the ``switch`` [s].

    Where it does not switch within the period, that is sub-step ``substeps`` with share 1.
    """
    for j in range(LANES):
        at[j], late[j] = float(substeps), 1.0
    for i in range(substeps):
        for j in range(LANES):
            share = delayed_fraction((i + 1) * (period / substeps), substeps / period, switch[j])
            found, part = at[j], late[j]
            first = share > 0.0 and found == substeps
            at[j] = float(i) if first else found
            late[j] = share if first else part


@kernel
def interval_of(
    n: int, at: Any, late: Any, older: Any, newer: Any, h: float, target: Any, width: Any
) -> None:
    """Write setpoints and durations [s] of interval ``n`` of a control period.

    A lane has the intervals of its sub-steps, with the sub-step of the switch divided in two.
    """
    for j in range(LANES):
        passed, share = n - at[j], late[j]
        first, second = older[j], newer[j]
        part = 1.0 - share if passed == 0.0 else 1.0
        part = share if passed == 1.0 else part
        width[j] = h * part
        target[j] = first if passed <= 0.0 else second


@kernel
def regulator_step(
    pressure: float, goal: float, lag: float, per_lag: float, slew: float, per_slew: float, h: float
) -> float:
    """Return the pressure [Pa] after ``h`` seconds at a constant goal: exact.

    While the gap to the goal exceeds ``slew * lag`` the pressure ramps; the rest of the interval
    it decays exponentially. ``per_lag`` and ``per_slew`` are the reciprocals of the time constant
    [s] and the largest rate [Pa/s].
    """
    gap = goal - pressure
    size = abs(gap)
    ramp = max(0.0, min(h, size * per_slew - lag))
    left = (size - slew * ramp) * decay((h - ramp) * per_lag)
    if gap < 0.0:
        return goal + left
    return goal - left


@kernel
def lag_towards(
    fixed: Any, j: int, effects: int, lag: float, pressure: float, goal: float, full: float
) -> float:
    """Return the lag [s] towards a goal: exhaust is slower than filling."""
    slower = (fixed[effects + AIR.exhaust_ratio][j] - 1.0) * (
        1.0 - fixed[effects + AIR.exhaust_taper][j] * min(full, pressure) / full
    )
    return lag * (1.0 + slower if goal < pressure else 1.0)


@kernel
def speed_at(fixed: Any, j: int, effects: int, error: float) -> float:
    """Return the rate over error, relative to that at a small error.

    ``error`` is a share of full pressure; between the given shares the ratio is linear.
    """
    at_2, at_6 = fixed[effects + AIR.speed_2][j], fixed[effects + AIR.speed_6][j]
    at_20, at_60 = fixed[effects + AIR.speed_20][j], fixed[effects + AIR.speed_60][j]
    speed = 1.0 + (at_2 - 1.0) * min(1.0, error * 50.0)
    speed = speed + (at_6 - at_2) * min(1.0, max(0.0, error - 0.02) * 25.0)
    speed = speed + (at_20 - at_6) * min(1.0, max(0.0, error - 0.06) / 0.14)
    return speed + (at_60 - at_20) * min(1.0, max(0.0, error - 0.2) * 2.5)  # type: ignore[no-any-return]


@kernel
def leaked(
    rows: Any, fixed: Any, j: int, state: int, effects: int, rest: float, pressure: float,
    reached: float, h: float,
) -> float:  # fmt: skip
    """Return the pressure [Pa] ``reached`` less its leak, and lower the supply by what it took.

    ``rest`` is the pressure of the supply at rest [Pa]. The lost pressure is added to ``lost``.
    """
    drop = rows[state + AIR_STATE.drop]
    fallen = supply_drop(
        drop[j],
        reached - pressure,
        rest,
        fixed[effects + AIR.supply_droop][j],
        fixed[effects + AIR.supply_recovery][j],
        h,
    )
    drop[j] = fallen if h > 0.0 else drop[j]  # lanes that wait keep their bits
    kept = reached * decay(fixed[effects + AIR.leak][j] * h)
    lost = rows[state + AIR_STATE.lost]
    lost[j] = lost[j] + (reached - kept)
    return kept  # type: ignore[no-any-return]


SHORTEST = 0.25
"""Shortest lag of second order that an interval of integration follows, over the interval."""


@kernel
def pilot_step(
    rows: Any, fixed: Any, j: int, state: int, effects: int, target: float, pressure: float,
    h: float,
) -> float:  # fmt: skip
    """Return the mean setpoint [Pa] behind the pilot stage of lane ``j`` over ``h`` seconds.

    A second-order lag; the setpoint itself without a pilot. While the valve is shut (a target below
    zero) the pilot follows the ``pressure``.
    """
    lag = fixed[effects + AIR.pilot_lag][j]
    if lag <= 0.0 or h <= 0.0:
        return target
    if target < 0.0:
        rows[state + AIR_STATE.pilot][j] = pressure
        rows[state + AIR_STATE.pilot_rate][j] = 0.0
        return target
    slow = max(lag, SHORTEST * h, 1e-9)
    turns = 1.0 / (TURN * slow)
    ratio = fixed[effects + AIR.pilot_damping][j]
    before, pace = rows[state + AIR_STATE.pilot][j], rows[state + AIR_STATE.pilot_rate][j]
    behind, rate = resonator_step(rows, j, state + AIR_STATE.pilot, target, target, turns, ratio, h)
    # the equation of the lag, integrated over the step
    missing = slow * (slow * (rate - pace) + 2.0 * ratio * (behind - before))
    return max(0.0, target - missing / h)


PARTS = 4
"""Parts of a step in which the rate may reach its limit."""


@kernel
def lagged_step(
    rows: Any, fixed: Any, j: int, state: int, effects: int, aim: float, lag: float, low: float,
    high: float, h: float,
) -> float:  # fmt: skip
    """Return the pressure [Pa] of lane ``j`` after ``h`` seconds with a lag of its rate.

    The rate follows ``(aim - pressure) / lag`` with the time constant ``rate_lag``, between ``low``
    and ``high`` [Pa/s].
    """
    pressure, rate = rows[state + AIR_STATE.regulated][j], rows[state + AIR_STATE.rate][j]
    part = h / PARTS
    damping = 1.0 / max(fixed[effects + AIR.rate_lag][j], SHORTEST * part)
    k, damped = damping / max(lag, SHORTEST * part), decay(0.5 * damping * part)
    for _ in range(PARTS):
        moved, rate = damped_motion(rate, k * (aim - pressure), 0.0, k, damping, damped, part)
        pressure = pressure + max(low * part, min(high * part, moved))
        rate = max(low, min(high, rate))
    rows[state + AIR_STATE.rate][j] = rate
    return pressure


@kernel
def regulate_with_effects(
    rows: Any, fixed: Any, j: int, state: int, effects: int, lag: float, slew: float, full: float,
    target: float, h: float,
) -> float:  # fmt: skip
    """Return the regulated pressure [Pa] of lane ``j`` after ``h`` seconds, with all effects.

    ``state`` and ``effects`` are the first rows of the air's state (``AIR_STATE``) and effects
    (``AIR``). A target below zero shuts the valve.
    """
    pressure = rows[state + AIR_STATE.regulated][j]
    drop = rows[state + AIR_STATE.drop][j]
    target = pilot_step(rows, fixed, j, state, effects, target, pressure, h)
    lost = min(1.0, fixed[effects + AIR.supply_effect][j] * drop / full)
    goal = fixed[effects + AIR.gain][j] * target * (1.0 - lost)
    wide = fixed[effects + AIR.dead_band][j]
    band = wide * fixed[effects + AIR.dead_close][j]
    off, before = abs(goal - pressure), rows[state + AIR_STATE.opened][j]
    opened = 1.0 if off > wide else (before if off > band * 1.0000001 else 0.0)
    goal = goal if opened > 0.0 else pressure
    stop_low, stop_high = min(pressure, goal + band), max(pressure, goal - band)
    lag = lag_towards(fixed, j, effects, lag, pressure, goal, full)
    error = abs(goal - pressure) / full
    middle = error * decay(0.5 * h * speed_at(fixed, j, effects, error) / lag)
    lag = lag / speed_at(fixed, j, effects, middle)
    # a spool opens by the error beyond its overlap; within the overlap it leaks
    over, within = fixed[effects + AIR.overlap][j], fixed[effects + AIR.overlap_leak][j]
    shift = over * (1.0 - within) if abs(goal - pressure) > over else 0.0
    lag = lag / within if abs(goal - pressure) < over else lag
    aim = goal + shift if goal < pressure else goal - shift
    gathered, gain = rows[state + AIR_STATE.integral][j], fixed[effects + AIR.integral][j]
    if gain > 0.0:  # the exhaust slows the whole rate, with the integral part
        lag = lag / lag_towards(fixed, j, effects, 1.0, pressure, goal, full)
        aim = aim + (lag * gathered if wide == 0.0 or opened > 0.0 else 0.0)
        lag = lag_towards(fixed, j, effects, lag, pressure, aim, full)
    low, high = -slew * fixed[effects + AIR.slew_ratio][j], slew
    slew = -low if aim < pressure else high
    reached = regulator_step(pressure, aim, lag, 1.0 / lag, slew, 1.0 / slew, h)
    free = (aim - pressure) * (1.0 - decay(h / lag))
    late = fixed[effects + AIR.rate_lag][j] > 0.0 and h > 0.0
    if late:
        most, rate = NO_SLEW_LIMIT, rows[state + AIR_STATE.rate][j]
        free = lagged_step(rows, fixed, j, state, effects, aim, lag, -most, most, h) - pressure
        rows[state + AIR_STATE.rate][j] = rate
        reached = lagged_step(rows, fixed, j, state, effects, aim, lag, low, high, h)
        if wide > 0.0 and opened == 0.0:  # closed: the air stays
            free, reached = 0.0, pressure
    moved, most = reached, slew * max(h, 1e-9)
    rounded = pressure + free * most / math.sqrt(free * free + most * most)
    bend = fixed[effects + AIR.slew_bend][j] if slew < NO_SLEW_LIMIT else 0.0
    reached = reached + bend * (rounded - reached)
    choke = fixed[effects + AIR.exhaust_rate][j]
    choked = (pressure + ATMOSPHERE) * decay(choke * h) - ATMOSPHERE
    reached = reached if choke >= UNCHOKED else max(reached, min(pressure, choked))
    rest = fixed[effects + AIR.supply_pressure][j]
    reached = supplied(pressure, reached, rest, drop, fixed[effects + AIR.supply_time][j], h)
    # the valve closes when the error has fallen to the band
    stopped = min(reached, stop_high) if goal > pressure else max(reached, stop_low)
    swings = gain > 0.0 or late
    stopped = reached if swings and wide == 0.0 else stopped
    stopped = max(0.0, stopped) if swings else stopped
    stays = opened if stopped == reached else 0.0
    rows[state + AIR_STATE.opened][j] = stays if h > 0.0 else before
    reached = stopped
    reached = pressure if target < 0.0 else reached
    if late:  # what else limits the motion slows it; a closed valve ends it
        rate = rows[state + AIR_STATE.rate][j] + (reached - moved) / h
        closed = target < 0.0 or (wide > 0.0 and stays == 0.0)
        rows[state + AIR_STATE.rate][j] = 0.0 if closed else max(low, min(high, rate))
    # anti-windup: limits of the rate drain the integral
    missed = (reached - pressure - free) / max(h, fixed[effects + AIR.integral_release][j])
    summed = gathered + h * gain * (goal - 0.5 * (pressure + reached)) + missed
    summed = summed if gain > 0.0 and target >= 0.0 else 0.0
    rows[state + AIR_STATE.integral][j] = summed if h > 0.0 else gathered
    return leaked(rows, fixed, j, state, effects, rest, pressure, reached, h)


@kernel
def regulate_with_leak(
    rows: Any, fixed: Any, j: int, state: int, effects: int, lag: float, slew: float, full: float,
    target: float, h: float,
) -> float:  # fmt: skip
    """Return the same as :func:`regulate_with_effects` with the effects of a normal day.

    These are gain, evenly slower exhaust, supply and leak.
    """
    pressure = rows[state + AIR_STATE.regulated][j]
    drop, rest = rows[state + AIR_STATE.drop][j], fixed[effects + AIR.supply_pressure][j]
    goal = fixed[effects + AIR.gain][j] * target
    slower = fixed[effects + AIR.exhaust_ratio][j] - 1.0
    lag = lag * (1.0 + slower if goal < pressure else 1.0)
    reached = regulator_step(pressure, goal, lag, 1.0 / lag, slew, 1.0 / slew, h)
    reached = supplied(pressure, reached, rest, drop, fixed[effects + AIR.supply_time][j], h)
    reached = pressure if target < 0.0 else reached
    return leaked(rows, fixed, j, state, effects, rest, pressure, reached, h)


@kernel
def regulate_with_gain(
    rows: Any, fixed: Any, j: int, state: int, effects: int, lag: float, slew: float, target: float,
    h: float,
) -> float:  # fmt: skip
    """Return the same as :func:`regulate_with_effects` where no effect but the gain is on."""
    pressure, goal = rows[state + AIR_STATE.regulated][j], fixed[effects + AIR.gain][j] * target
    reached = regulator_step(pressure, goal, lag, 1.0 / lag, slew, 1.0 / slew, h)
    return pressure if target < 0.0 else reached  # type: ignore[no-any-return]


@kernel
def begin_air(rows: Any, j: int, state: int, pressure: float) -> None:
    """Begin valve, supply and line of one lane at rest at a pressure [Pa]."""
    rows[state + AIR_STATE.regulated][j] = rows[state + AIR_STATE.line][j] = pressure
    rows[state + AIR_STATE.pilot][j], rows[state + AIR_STATE.pilot_rate][j] = pressure, 0.0
    rows[state + AIR_STATE.opened][j] = rows[state + AIR_STATE.drop][j] = 0.0
    rows[state + AIR_STATE.lost][j] = rows[state + AIR_STATE.integral][j] = 0.0
    rows[state + AIR_STATE.rate][j] = 0.0
    rows[state + AIR_STATE.line_rate][j] = rows[state + AIR_STATE.space][j] = 0.0
    rows[state + AIR_STATE.ahead][j] = rows[state + AIR_STATE.slope][j] = 0.0


@kernel
def begin_leak(rows: Any, state: int) -> None:
    """Begin to count the pressure that the leaks of a tile lose in a control period."""
    lost = rows[state + AIR_STATE.lost]
    for j in range(LANES):
        lost[j] = 0.0


@kernel
def valve_effects_on(fixed: Any, effects: int) -> int:
    """Return 0 where the plain regulator is sufficient, 1 for the effects of a day, 2 for all."""
    rare = (
        count_on(fixed[effects + AIR.dead_band], 0.0)
        + count_on(fixed[effects + AIR.overlap], 0.0)
        + count_on(fixed[effects + AIR.exhaust_rate], UNCHOKED)
        + count_on(fixed[effects + AIR.slew_bend], 0.0)
        + count_on(fixed[effects + AIR.slew_ratio], 1.0)
        + count_on(fixed[effects + AIR.pilot_lag], 0.0)
        + count_on(fixed[effects + AIR.rate_lag], 0.0)
        + count_on(fixed[effects + AIR.exhaust_taper], 0.0)
        + count_on(fixed[effects + AIR.integral], 0.0)
        + count_on(fixed[effects + AIR.speed_2], 1.0)
        + count_on(fixed[effects + AIR.speed_6], 1.0)
        + count_on(fixed[effects + AIR.speed_20], 1.0)
        + count_on(fixed[effects + AIR.speed_60], 1.0)
        + count_on(fixed[effects + AIR.supply_effect], 0.0)
    )
    daily = (
        count_on(fixed[effects + AIR.exhaust_ratio], 1.0)
        + count_on(fixed[effects + AIR.leak], 0.0)
        + count_on(fixed[effects + AIR.supply_pressure], AMPLE)
    )
    return 2 if rare > 0 else (1 if daily > 0 else 0)


@kernel
def line_effects_on(fixed: Any, effects: int) -> int:
    """Return the number of lanes whose line rings."""
    return count_on(fixed[effects + AIR.ring_share], 0.0) + count_on(  # type: ignore[no-any-return]
        fixed[effects + AIR.ring_flow], 0.0
    )


@kernel
def delay_commands(
    rows: Any, ring: int, set_point: Any, dead: Any, step: Any, period: float, older: Any,
    newer: Any,
    switch: Any,
) -> None:  # fmt: skip
    """Write the two delayed setpoints of a control period and the time between them.

    ``ring`` is the first row of the last setpoints, ``dead`` the dead times [s], ``step`` the
    control periods and ``period`` their duration [s]. ``older`` takes effect first, then, at
    ``switch`` [s], ``newer`` [Pa].
    """
    for j in range(LANES):
        age = dead[j] / period
        whole = min(int(age), DELAY_PERIODS)
        switch[j] = (age - whole) * period
        note(rows, ring, j, step[j], set_point[j])
        newer[j] = noted(rows, ring, j, step[j], whole)
        older[j] = noted(rows, ring, j, step[j], whole + 1)


@kernel
def air_step(
    rows: Any, fixed: Any, state: int, effects: int, pressure: Any, full: Any, lag: Any, slew: Any,
    target: Any, width: Any, own: Any, valve: int, lines: int,
) -> None:  # fmt: skip
    """Advance the pressures of a tile towards their targets, each by its ``width`` [s].

    ``state`` and ``effects`` are the first rows of the air's state (``AIR_STATE``) and effects
    (``AIR``); ``full`` [Pa], ``lag`` [s] and ``slew`` [Pa/s] are rows. A target below zero shuts
    the valve. ``own`` is two rows of scratch; the second receives the pressures before. ``valve``
    is that of :func:`valve_effects_on`; ``lines`` is above 0 where lines ring.
    """
    regulated = rows[state + AIR_STATE.regulated]
    for j in range(LANES):
        before = regulated[j]
        if valve > 1:
            after = regulate_with_effects(
                rows, fixed, j, state, effects, lag[j], slew[j], full[j], target[j], width[j]
            )
        elif valve > 0:
            after = regulate_with_leak(
                rows, fixed, j, state, effects, lag[j], slew[j], full[j], target[j], width[j]
            )
        else:
            after = regulate_with_gain(
                rows, fixed, j, state, effects, lag[j], slew[j], target[j], width[j]
            )
        after = after if width[j] > 0.0 else before
        regulated[j] = after
        own[0][j], own[1][j] = before, pressure[j]
        pressure[j] = after
    if lines > 0:
        for j in range(LANES):
            if width[j] > 0.0:
                pressure[j] = line_step(
                    rows, fixed, j, state + AIR_STATE.line, effects + AIR.ring_share, own[0][j],
                    pressure[j], width[j],
                )  # fmt: skip
            else:
                pressure[j] = own[1][j]
