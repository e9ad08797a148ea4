"""Effects of temperature, load, viscosity, creep, friction in length and a finer static map."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from pam_envs.constants import ROOM_TEMPERATURE
from pam_envs.kernels.arithmetic import count_on
from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.yielding import deflected_with_tail
from pam_envs.parameters import assumed, declarations, effect, named_rows, parameter_rows


@dataclass(frozen=True, kw_only=True)
class TemperatureEffects:
    """Temperature of a muscle; the law is that of 293.15 K."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (("temperature", "temperature_gain"),)

    temperature: float = assumed(ROOM_TEMPERATURE, "K", 230.0, 400.0, "of the muscle")
    temperature_gain: float = effect("1/K", -0.05, 0.05, "effective pressure gained per kelvin")


@kernel
def temperature_factor(kelvin: float, gain: float) -> float:
    """Return the effective pressure at a temperature [K] over that at room temperature."""
    return 1.0 + gain * (kelvin - ROOM_TEMPERATURE)


@dataclass(frozen=True, kw_only=True)
class LoadEffects:
    """Dependence of the static law on the load."""

    load_curve: float = effect("Pa/N2", -200.0, 200.0, "pressure shift over load squared")
    load_stiffening: float = effect("1/N", -0.015, 0.05, "stiffness gained per newton of load")
    load_stiffening_2: float = effect("1/N2", -2e-4, 1e-3, "the same by load squared")
    load_stiffening_root: float = effect("1/N^0.5", -0.1, 0.5, "the same by the root of the load")


@kernel
def stiffening(weight: float, linear: float, square: float, root: float) -> float:
    """Return the factor on the passive force under a weight [N]."""
    return 1.0 + (linear + square * weight) * weight + root * math.sqrt(max(0.0, weight))


@dataclass(frozen=True, kw_only=True)
class ViscosityEffects:
    """Damping in addition to that of the load: at low speed, and growing with pressure.

    The damping of a muscle grows with its pressure, and is smaller in relaxation (reynolds2003).
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("viscosity", "viscosity_speed"),
        ("viscosity_per_pressure", "viscosity_relaxing"),
    )

    viscosity: float = effect("N s/m", 0.0, 1e5, "damping at small speed beside the load's")
    viscosity_speed: float = assumed(0.02, "m/s", 1e-4, 10.0, "speed that lowers it by 1 / sqrt(2)")
    viscosity_per_pressure: float = effect(
        "N s/(m Pa)", 0.0, 1.0, "damping over effective pressure, beside the load's"
    )
    viscosity_relaxing: float = assumed(
        1.0, "1", 0.0, 2.0, "viscosity_per_pressure in relaxation over contraction", neutral=1.0
    )

    def largest_damping(self, pressure: float) -> float:
        """Return the damping [N s/m] of slow motion at an effective pressure [Pa]."""
        grown = self.viscosity_per_pressure * max(1.0, self.viscosity_relaxing)
        return self.viscosity + grown * pressure


VISCOSITY = parameter_rows(ViscosityEffects)
"""Rows of a muscle's viscosity, from its first."""


@kernel
def viscous_damping(
    viscosity: float, pace: float, per_pressure: float, relaxing: float, speed: float, drive: float
) -> float:
    """Return the damping [N s/m] at a speed of contraction [m/s] and an effective pressure [Pa]."""
    grown = per_pressure * max(0.0, drive) * (relaxing if speed < 0.0 else 1.0)
    return viscosity / math.sqrt(1.0 + abs(speed) / pace) + grown


@kernel
def taut_damping(fixed: Any, j: int, first: int, speed: float, drive: float, force: float) -> float:
    """Return the damping [N s/m] of a muscle, at most that which takes all its force.

    ``force`` [N] is that without viscosity; a slack muscle has no damping. ``first`` is the first
    row of :class:`ViscosityEffects`.
    """
    damping = viscous_damping(
        fixed[first + VISCOSITY.viscosity][j],
        fixed[first + VISCOSITY.viscosity_speed][j],
        fixed[first + VISCOSITY.viscosity_per_pressure][j],
        fixed[first + VISCOSITY.viscosity_relaxing][j],
        speed,
        drive,
    )
    if damping * speed > force:
        damping = force / speed
    return damping if force > 0.0 else 0.0


@dataclass(frozen=True, kw_only=True)
class LengthCreepEffects:
    """Creep of the length with the time constants of the hysteresis."""

    creep_1: float = effect("1", -0.5, 2.0, "length that follows at creep_time_1")
    creep_2: float = effect("1", -0.5, 2.0, "length that follows at creep_time_2")
    creep_3: float = effect("1", -0.5, 2.0, "length that follows at creep_time_3")
    creep_4: float = effect("1", -0.5, 2.0, "length that follows at creep_time_4")


BREAKS = (0.1, 0.3, 0.6, 1.0)
"""Strains at which strands break away, over that of the last one."""
STRANDS = len(BREAKS)


@dataclass(frozen=True, kw_only=True)
class StrandEffects:
    """Friction of the braid's strands: four Maxwell-slip elements in parallel with the muscle."""

    strand_1: float = effect("N", 0.0, 5e4, "friction of the first strands to break away")
    strand_2: float = effect("N", 0.0, 5e4, "friction of the second strands to break away")
    strand_3: float = effect("N", 0.0, 5e4, "friction of the third strands to break away")
    strand_4: float = effect("N", 0.0, 5e4, "friction of the last strands to break away")
    strand_break: float = assumed(0.02, "1", 0.001, 0.3, "strain at which the last strand slips")
    strand_per_pressure: float = assumed(
        0.0, "1/Pa", -2e-3, 0.1, "slip force gained over that at no pressure", neutral=0.0
    )


@kernel
def slip_limit(fixed: Any, j: int, grows: int, drive: float) -> float:
    """Return the factor on the slip force of strands at an effective pressure [Pa]."""
    return max(0.0, 1.0 + fixed[grows][j] * drive)


@kernel
def strand_forces(
    rows: Any, fixed: Any, state: int, force: int, break_away: int, strain: Any, drive: Any,
    friction: Any, sticking: Any,
) -> None:  # fmt: skip
    """Add the strands' force [N] and its slope by strain [N] at strains of a tile.

    ``state``, ``force`` and ``break_away`` are the first rows of the slip positions and forces, and
    the row of the strain at which the last strand breaks away; the next row is its growth with the
    effective pressure ``drive`` [Pa].
    """
    for i in range(STRANDS):
        slip, part = rows[state + i], BREAKS[i]
        for j in range(LANES):
            stiff = fixed[force + i][j] / (part * fixed[break_away][j])
            span = part * fixed[break_away][j] * slip_limit(fixed, j, break_away + 1, drive[j])
            gap = max(-span, min(span, strain[j] - slip[j]))
            friction[j] = friction[j] + stiff * gap
            sticking[j] = sticking[j] + (stiff if abs(strain[j] - slip[j]) < span else 0.0)


@kernel
def slip_strands(
    rows: Any, fixed: Any, state: int, break_away: int, strain: Any, drive: Any
) -> None:
    """Move the strands' slip positions with the strains of a tile."""
    for i in range(STRANDS):
        slip, part = rows[state + i], BREAKS[i]
        for j in range(LANES):
            span = part * fixed[break_away][j] * slip_limit(fixed, j, break_away + 1, drive[j])
            slip[j] = max(strain[j] - span, min(strain[j] + span, slip[j]))


@kernel
def strands_on(fixed: Any, force: int) -> int:
    """Return the number of lanes and strands of a tile with friction."""
    on = 0
    for i in range(STRANDS):
        on = on + count_on(fixed[force + i], 0.0)
    return on


@dataclass(frozen=True, kw_only=True)
class LengthYieldEffects:
    """Friction of the length that yields smoothly: one spring in parallel with the muscle.

    Its friction grows with the effective pressure. With ``yield_share = 0`` its stiffness is
    constant, so that it creates no energy whatever length and pressure do
    (:mod:`pam_envs.kernels.yielding`). With a share above 0 it is not passive: pressure raises the
    force of an element that does not move.
    """

    yield_force: float = effect("N", 0.0, 5e4, "friction at full yield, at no pressure")
    yield_per_pressure: float = assumed(
        0.0, "N/Pa", -0.1, 0.1, "friction gained with effective pressure", neutral=0.0
    )
    yield_break: float = assumed(0.01, "1", 0.001, 0.3, "strain over which it yields, likewise")
    yield_share: float = assumed(
        0.0,
        "1",
        0.0,
        1.0,
        "growth of the stiffness with pressure over that of the friction",
        neutral=0.0,
    )
    yield_ratio: float = assumed(
        0.5, "1", 0.0, 1.0, "0: springs back after a reversal, 1: friction of Dahl"
    )


@dataclass(frozen=True, kw_only=True)
class LengthYieldTailEffects(LengthYieldEffects):
    """The same with a tail: how the friction approaches its largest value."""

    yield_tail: float = effect(
        "1", -1.0, 1.0, "approach of the yielding friction to its limit: -1 abrupt, 1 slow"
    )


LEAST_STIFFER = 1e-9
"""Stiffness over that without pressure, below which the element has no friction."""


@kernel
def yield_spring(fixed: Any, j: int, first: int, drive: float) -> tuple[float, float]:
    """Return the stiffness by strain [N], and the largest deflection at an effective pressure.

    ``first`` is the first row of :class:`LengthYieldEffects`.
    """
    force, span = fixed[first][j], fixed[first + 2][j]
    grown = max(0.0, force + fixed[first + 1][j] * drive) / force if force > 0.0 else 0.0
    stiffer = 1.0 + fixed[first + 3][j] * (grown - 1.0)
    limit = grown / stiffer if stiffer > LEAST_STIFFER else 1.0
    return stiffer * (force / span), limit * span


@kernel
def yield_forces(
    rows: Any, fixed: Any, state: int, first: int, moved: Any, drive: Any, friction: Any,
    sticking: Any,
) -> None:  # fmt: skip
    """Add the yielding friction [N] and its slope by strain [N] after motions of a tile.

    ``state`` is the row of the deflections, ``first`` the first row of
    :class:`LengthYieldTailEffects`, ``moved`` the strains gained since.
    """
    deflection = rows[state]
    for j in range(LANES):
        stiff, limit = yield_spring(fixed, j, first, drive[j])
        after, slope = deflected_with_tail(
            deflection[j], moved[j], limit, fixed[first + 4][j], fixed[first + 5][j]
        )
        friction[j] = friction[j] + stiff * after
        sticking[j] = sticking[j] + stiff * slope


@kernel
def yield_deflections(
    rows: Any, fixed: Any, state: int, first: int, moved: Any, drive: Any
) -> None:
    """Move the deflections of a tile by the strains gained."""
    deflection = rows[state]
    for j in range(LANES):
        _, limit = yield_spring(fixed, j, first, drive[j])
        deflection[j], _ = deflected_with_tail(
            deflection[j], moved[j], limit, fixed[first + 4][j], fixed[first + 5][j]
        )


MAP_TERMS = (
    (0, 5), (1, 3), (1, 4), (2, 0), (2, 1), (2, 2), (2, 3), (3, 0), (3, 1), (3, 2), (4, 0), (4, 1),
    (5, 0),
)  # fmt: skip
"""Orders in pressure and in strain of the terms of a finer static map: those of total order five
that the law of the muscle does not have."""
_TERM = "N", -5e4, 5e4


@dataclass(frozen=True, kw_only=True)
class StaticMapEffects:
    """Correction of the static law by products of Chebyshev polynomials of pressure and strain.

    The force of a term is ``map_ij T_i(2 w / map_pressure - 1) T_j(2 e / map_strain - 1)`` at an
    effective pressure ``w`` and a strain ``e``; outside the range of the map it stays constant.
    """

    map_05: float = effect(*_TERM, "T_0(pressure) T_5(strain)")
    map_13: float = effect(*_TERM, "T_1(pressure) T_3(strain)")
    map_14: float = effect(*_TERM, "T_1(pressure) T_4(strain)")
    map_20: float = effect(*_TERM, "T_2(pressure) T_0(strain)")
    map_21: float = effect(*_TERM, "T_2(pressure) T_1(strain)")
    map_22: float = effect(*_TERM, "T_2(pressure) T_2(strain)")
    map_23: float = effect(*_TERM, "T_2(pressure) T_3(strain)")
    map_30: float = effect(*_TERM, "T_3(pressure) T_0(strain)")
    map_31: float = effect(*_TERM, "T_3(pressure) T_1(strain)")
    map_32: float = effect(*_TERM, "T_3(pressure) T_2(strain)")
    map_40: float = effect(*_TERM, "T_4(pressure) T_0(strain)")
    map_41: float = effect(*_TERM, "T_4(pressure) T_1(strain)")
    map_50: float = effect(*_TERM, "T_5(pressure) T_0(strain)")
    map_pressure: float = assumed(6e5, "Pa", 100.0, 3e6, "upper end of the map")
    map_strain: float = assumed(0.2, "1", 0.02, 0.6, "upper end of the map")


MAP = named_rows(*declarations(StaticMapEffects))
"""Rows of a finer static map, from its first."""


@kernel
def map_coordinate(x: float, end: float) -> tuple[float, float]:
    """Return a pressure or strain in the range -1 to 1 of the map, and its derivative by ``x``.

    Beyond the range it stays at its end.
    """
    scale = 2.0 / end
    t = x * scale - 1.0
    inside = max(-1.0, min(1.0, t))
    return inside, scale if inside == t else 0.0


@kernel
def strain_polynomials(
    sizes: Any, j: int, first: int, s: float
) -> tuple[float, float, float, float, float, float]:
    """Return the factors [N] of ``T_0`` to ``T_5`` of the pressure, at a strain's coordinate."""
    s2 = s * s
    c2, c3 = 2.0 * s2 - 1.0, (4.0 * s2 - 3.0) * s
    c4, c5 = 8.0 * (s2 * s2 - s2) + 1.0, (16.0 * s2 * s2 - 20.0 * s2 + 5.0) * s
    return (
        sizes[first + MAP.map_05][j] * c5,
        sizes[first + MAP.map_13][j] * c3 + sizes[first + MAP.map_14][j] * c4,
        sizes[first + MAP.map_20][j] + sizes[first + MAP.map_21][j] * s
        + sizes[first + MAP.map_22][j] * c2 + sizes[first + MAP.map_23][j] * c3,
        sizes[first + MAP.map_30][j] + sizes[first + MAP.map_31][j] * s
        + sizes[first + MAP.map_32][j] * c2,
        sizes[first + MAP.map_40][j] + sizes[first + MAP.map_41][j] * s,
        sizes[first + MAP.map_50][j],
    )  # fmt: skip


@kernel
def map_force(sizes: Any, j: int, first: int, drive: float, strain: float) -> float:
    """Return the force [N] of a finer static map at an effective pressure [Pa] and a strain.

    ``sizes`` holds the parameters of :class:`StaticMapEffects` in rows from ``first``, one lane a
    column.
    """
    t, _ = map_coordinate(drive, sizes[first + MAP.map_pressure][j])
    s, _ = map_coordinate(strain, sizes[first + MAP.map_strain][j])
    f0, f1, f2, f3, f4, f5 = strain_polynomials(sizes, j, first, s)
    t2 = t * t
    force = f0 + f1 * t + f2 * (2.0 * t2 - 1.0) + f3 * (4.0 * t2 - 3.0) * t
    return force + f4 * (8.0 * (t2 * t2 - t2) + 1.0) + f5 * (16.0 * t2 * t2 - 20.0 * t2 + 5.0) * t


@kernel
def map_slopes(sizes: Any, j: int, first: int, drive: float, strain: float) -> tuple[float, float]:
    """Return minus the derivative of :func:`map_force` by strain [N], and that by pressure [m2]."""
    t, per_pressure = map_coordinate(drive, sizes[first + MAP.map_pressure][j])
    s, per_strain = map_coordinate(strain, sizes[first + MAP.map_strain][j])
    _, f1, f2, f3, f4, f5 = strain_polynomials(sizes, j, first, s)
    t2, s2 = t * t, s * s
    d3, d4, d5 = 12.0 * s2 - 3.0, (32.0 * s2 - 16.0) * s, 80.0 * s2 * s2 - 60.0 * s2 + 5.0
    g1 = sizes[first + MAP.map_13][j] * d3 + sizes[first + MAP.map_14][j] * d4
    g2 = sizes[first + MAP.map_21][j] + sizes[first + MAP.map_22][j] * 4.0 * s
    g2 = g2 + sizes[first + MAP.map_23][j] * d3
    g3 = sizes[first + MAP.map_31][j] + sizes[first + MAP.map_32][j] * 4.0 * s
    slope = sizes[first + MAP.map_05][j] * d5 + g1 * t + g2 * (2.0 * t2 - 1.0)
    slope = slope + g3 * (4.0 * t2 - 3.0) * t
    slope = slope + sizes[first + MAP.map_41][j] * (8.0 * (t2 * t2 - t2) + 1.0)
    gain = f1 + 4.0 * f2 * t + f3 * (12.0 * t2 - 3.0) + f4 * (32.0 * t2 - 16.0) * t
    gain = gain + f5 * (80.0 * t2 * t2 - 60.0 * t2 + 5.0)
    return -slope * per_strain, gain * per_pressure


@kernel
def map_on(fixed: Any, first: int) -> int:
    """Return the number of lanes and terms of a tile with a finer static map."""
    on = 0
    for k in range(len(MAP_TERMS)):
        on = on + count_on(fixed[first + k], 0.0)
    return on
