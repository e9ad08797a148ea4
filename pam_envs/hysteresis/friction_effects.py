"""Creep of a muscle and effects on its friction: loops, pressure dependence, first cycles.

Creep: four Kelvin-Voigt elements that follow a quantity with time constants of their own. The creep
of ``x`` is ``sum_k c_k y_k`` with ``T_k y_k' = x - y_k``. Applied to the effective pressure the
force creeps, applied to the length the position does.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from pam_envs.kernels.arithmetic import count_on, decay
from pam_envs.kernels.build import kernel
from pam_envs.kernels.yielding import yielded_with_tail
from pam_envs.parameters import assumed, effect

ELEMENTS = 4
"""Kelvin-Voigt elements."""


@dataclass(frozen=True, kw_only=True)
class CreepEffects:
    """Creep of the effective pressure, off unless a recording shows it."""

    creep_1: float = effect("1", -0.5, 2.0, "first Kelvin-Voigt compliance")
    creep_2: float = effect("1", -0.5, 2.0, "second Kelvin-Voigt compliance")
    creep_3: float = effect("1", -0.5, 2.0, "third Kelvin-Voigt compliance")
    creep_4: float = effect("1", -0.5, 2.0, "fourth Kelvin-Voigt compliance")
    creep_time_1: float = assumed(0.4, "s", 0.02, 1e4, "its time constant")
    creep_time_2: float = assumed(2.5, "s", 0.02, 1e4, "its time constant")
    creep_time_3: float = assumed(15.0, "s", 0.02, 1e4, "its time constant")
    creep_time_4: float = assumed(90.0, "s", 0.02, 1e4, "its time constant")


@kernel
def creep_left(
    fixed: Any, compliance: int, time: int, first: int, last: int, width: Any, left: Any
) -> None:
    """Write the shares of the elements' gaps that are left after ``width`` seconds, by element.

    ``compliance`` and ``time`` are the first rows of compliances and time constants [s].
    """
    for k in range(ELEMENTS):
        if count_on(fixed[compliance + k], 0.0) > 0:
            for j in range(first, last):
                left[k][j] = decay(width[j] / fixed[time + k][j])


@kernel
def creep_step(
    rows: Any, fixed: Any, state: int, compliance: int, first: int, last: int, value: Any,
    left: Any, total: Any,
) -> None:  # fmt: skip
    """Add the creep of lanes ``first`` to ``last`` to the row ``total``.

    ``state`` and ``compliance`` are the first rows of the elements' state and compliances,
    ``value`` is the quantity that they follow, ``left`` is that of :func:`creep_left`. Elements
    without compliance in the whole tile stay behind.
    """
    for k in range(ELEMENTS):
        if count_on(fixed[compliance + k], 0.0) == 0:
            continue
        lag = rows[state + k]
        for j in range(first, last):
            follows = value[j] - (value[j] - lag[j]) * left[k][j]
            lag[j] = follows if left[k][j] < 1.0 else lag[j]
            total[j] = total[j] + fixed[compliance + k][j] * lag[j]


@kernel
def begin_creep(rows: Any, fixed: Any, j: int, state: int, compliance: int, value: float) -> float:
    """Settle the elements of one lane at a value; return their creep."""
    total = 0.0
    for k in range(ELEMENTS):
        rows[state + k][j] = value
        total = total + fixed[compliance + k][j]
    return total * value


@kernel
def creeps_on(fixed: Any, compliance: int) -> int:
    """Return the number of lanes and elements of a tile that creep."""
    on = 0
    for k in range(ELEMENTS):
        on = on + count_on(fixed[compliance + k], 0.0)
    return on


@dataclass(frozen=True, kw_only=True)
class FrictionEffects:
    """Shape and pressure dependence of the friction."""

    shape: float = assumed(1.0, "1", 0.01, 100.0, "slope of small loops over plays'", neutral=1.0)
    pressure_slope: float = effect("1", -2.0, 20.0, "friction gained up to full pressure, linear")
    pressure_bend: float = effect("1", -20.0, 20.0, "friction gained with pressure squared")


@dataclass(frozen=True, kw_only=True)
class YieldEffects:
    """Friction of the pressure that yields smoothly (:mod:`pam_envs.kernels.yielding`)."""

    yield_width: float = effect("Pa", 0.0, 2e5, "effective pressure lost at full yield")
    yield_break: float = assumed(2e4, "Pa", 1e2, 1e6, "pressure over which it yields")
    yield_ratio: float = assumed(
        0.5, "1", 0.0, 1.0, "0: springs back after a reversal, 1: friction of Dahl"
    )
    yield_tail: float = effect("1", -1.0, 1.0, "approach to full yield: -1 abrupt, 1 slow")


@kernel
def yield_step(
    rows: Any, fixed: Any, state: int, width: int, first: int, last: int, pressure: Any
) -> None:
    """Move the yielding friction of lanes ``first`` to ``last`` to a pressure [Pa].

    ``state`` is the row of its share of full yield; the next row is the pressure before. ``width``
    is the first row of :class:`YieldEffects`.
    """
    share, before = rows[state], rows[state + 1]
    for j in range(first, last):
        moved = (pressure[j] - before[j]) / fixed[width + 1][j]
        share[j], _ = yielded_with_tail(share[j], moved, fixed[width + 2][j], fixed[width + 3][j])
        before[j] = pressure[j]


@dataclass(frozen=True, kw_only=True)
class StartEffects:
    """Friction at the start of a rollout or replay, which nothing has moved before by default."""

    start: float = effect(
        "1", -1.0, 1.0, "friction at the start over its largest; below 0: after relaxation"
    )


@dataclass(frozen=True, kw_only=True)
class FirstCycles:
    """Loss of force in the first cycles."""

    first_loss: float = effect("1", -0.9, 0.9, "effective pressure missing at first")
    first_travel: float = assumed(2e6, "Pa", 1e4, 1e9, "pressure travel of the transition")


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """Pressure below which the muscle exerts no force."""

    threshold: float = effect("Pa", 0.0, 3e5, "pressure before the tube meets the braid")


@dataclass(frozen=True, kw_only=True)
class DriveEffects(FirstCycles, CreepEffects):
    """Creep and first cycles of the effective pressure of a muscle."""

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        (*(f"creep_{k}" for k in (1, 2, 3, 4)), *(f"creep_time_{k}" for k in (1, 2, 3, 4))),
        ("first_loss", "first_travel"),
    )


@kernel
def newness(travel: float, span: float) -> float:
    """Return the share of the first state that is left after a travel, 1 to 0."""
    return decay(min(40.0, travel / span))


@kernel
def friction_with_effects(
    friction: float, most: float, share_of_full: float, shape: float, slope: float, bend: float
) -> float:
    """Return the friction [Pa] of the plays, at most ``most``, with :class:`FrictionEffects`.

    ``share_of_full`` is the pressure over full pressure.
    """
    share = min(1.0, abs(friction) / max(most, 1.0))
    friction = friction * shape / (1.0 + (shape - 1.0) * share)
    grown = (slope + bend * share_of_full) * share_of_full
    return friction * max(0.02, 1.0 + grown)
