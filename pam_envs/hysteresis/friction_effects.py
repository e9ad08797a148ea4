"""Effects on the friction of a muscle: shape of small loops, pressure dependence, first cycles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pam_envs.hysteresis.creep import CreepEffects
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, effect


@dataclass(frozen=True, kw_only=True)
class FrictionEffects:
    """Shape and pressure dependence of the friction."""

    shape: float = assumed(1.0, "1", 0.01, 100.0, "slope of small loops over plays'", neutral=1.0)
    pressure_slope: float = effect("1", -2.0, 20.0, "friction gained up to full pressure, linear")
    pressure_bend: float = effect("1", -20.0, 20.0, "friction gained with pressure squared")


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
