"""Hysteresis of the single muscle: friction driven by length, or of its effective pressure."""

from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.friction_effects import (
    CreepEffects,
    FirstCycles,
    FrictionEffects,
    StartEffects,
    Threshold,
    YieldEffects,
)
from pam_envs.hysteresis.protocol import HysteresisModel, operator_of
from pam_envs.parameters import declarations, effect, identified
from pam_envs.plants.core.plant import OperatorComponent

Kind: TypeAlias = str
"""A value of ``hysteresis=``, one of :func:`pam_envs.hysteresis.protocol.kinds`."""
_FIT = "least squares on positioning2021, Tables 3-5"


@dataclass(frozen=True)
class Hysteresis(
    StartEffects,
    Threshold,
    FirstCycles,
    CreepEffects,
    YieldEffects,
    FrictionEffects,
    OperatorComponent,
):
    """Friction of braid and tube, driven by length or by pressure.

    *Length* (an operator of :mod:`pam_envs.hysteresis.slip`): the force of friction elements in
    parallel with the muscle, which their strain drives from that under the load at no pressure,

        F = F(p, e) - friction lag(e),    limit = 1 + limit_per_pressure p + limit_per_load load

    with stiffnesses that are constant and slip forces that the ``limit`` scales: passive whatever
    pressure and length do.

    *Pressure*: the pressure, stretched to a scale on which friction is uniform, passes an operator
    with hysteresis; the operator's hysteretic part is scaled by ``1 + width_per_load * load``, like
    friction of strands and friction that yields; the result is stretched back. ``operator`` has
    slope 1 and starts virgin, or is None.
    """

    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("shape",),
        ("pressure_slope",),
        ("pressure_bend",),
        ("yield_width", "yield_break", "yield_ratio", "yield_tail"),
        ("first_width", "first_loss", "first_stiffness", "first_travel"),
        ("threshold",),
        ("start",),
        ("friction", "limit_per_pressure", "limit_per_load"),
    )

    stretch: float = identified(
        0.0,
        "1",
        -0.8,
        0.8,
        f"pressure-dependent friction; {_FIT}",
        neutral=0.0,
    )
    width_per_load: float = identified(
        0.0,
        "1/kg",
        -0.2,
        0.2,
        f"load-dependent loop width; {_FIT}",
        neutral=0.0,
    )
    friction: float = identified(
        0.0, "N", 0.0, 1e5, f"stiffness of all elements over strain; {_FIT}", neutral=0.0
    )
    limit_per_pressure: float = identified(
        0.0, "1/Pa", -1e-6, 1e-4, f"slip force over that at no pressure; {_FIT}", neutral=0.0
    )
    limit_per_load: float = identified(
        0.0, "1/kg", -0.2, 1.0, f"slip force over that without load; {_FIT}", neutral=0.0
    )
    # effects of the first cycles that only this hysteresis has
    first_width: float = effect("1", -1.0, 10.0, "extra loop width of the first travel")
    first_stiffness: float = effect("N", 0.0, 1e6, "passive force over strain of the first travel")

    pressure_only: ClassVar[dict[str, str]] = {
        "stretch": "limit_per_pressure",
        "width_per_load": "limit_per_load",
        "shape": "elements with other thresholds",
        "pressure_slope": "limit_per_pressure",
        "pressure_bend": "limit_per_pressure",
        "first_width": "first_loss",
    }
    """Parameters that friction driven by length does not have, with what it has in their place."""

    def check_drive(self) -> None:
        """Raise if a parameter is set that acts on friction driven by pressure alone."""
        if self.operator is None or self.drive == "pressure":
            return
        for name, instead in self.pressure_only.items():
            value, neutral = getattr(self, name), declarations(self)[name].neutral
            if value != neutral:
                raise ValueError(
                    f"hysteresis.{name} = {value:g} acts on friction driven by pressure, and this "
                    f"muscle's is driven by length: leave it at {neutral:g} (there: {instead}), or "
                    "take hysteresis_drive='pressure'"
                )

    def stretched(self, pressure: ArrayLike, full: float) -> NDArray[np.float64]:
        """Return ``pressure`` [Pa] on the scale on which the friction is uniform."""
        p = np.asarray(pressure, float)
        if self.stretch == 0.0:
            return p
        return np.asarray(p * (1.0 + self.stretch * (1.0 - p / full)))

    def unstretched(self, value: ArrayLike, full: float) -> NDArray[np.float64]:
        """Return the pressure [Pa] whose stretched value is ``value``."""
        z, s = np.asarray(value, float), 1.0 + self.stretch
        if self.stretch == 0.0:
            return z
        root = np.sqrt(np.maximum(0.0, s * s - 4.0 * self.stretch * z / full))
        return np.asarray(2.0 * z / (s + root))

    def limit(self, pressure: ArrayLike, load: ArrayLike) -> NDArray[np.float64]:
        """Return the factor on the slip forces at a pressure [Pa] and a load [kg]."""
        grown = self.limit_per_pressure * np.asarray(pressure, float)
        return np.asarray(np.maximum(0.0, 1.0 + grown + self.limit_per_load * np.asarray(load)))

    def at_load(self, load: float) -> HysteresisModel | None:
        """Return the operator at a load [kg], with its hysteretic part scaled."""
        if self.operator is None:
            return None
        width = max(0.0, min(1.2, 1.0 + self.width_per_load * load))
        return self.operator.scaled(width, slope=1.0)


@dataclass(frozen=True)
class HysteresisInverse:
    """The pressure that gives a desired effective pressure, given the history so far."""

    hysteresis: Hysteresis
    operator: HysteresisModel | None
    full: float

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Any:
        """Return the state after a rest at no pressure."""
        return operator_of(self.operator).initial_state(batch_shape)

    def pressure(self, drive: ArrayLike, state: Any) -> tuple[NDArray[np.float64], Any]:
        """Return the pressure [Pa] for an effective pressure [Pa], and the state it leaves.

        The pressure is held between 0 and ``full``, and the state is that of the held pressure.
        """
        if self.operator is None:
            return np.clip(np.asarray(drive, float), 0.0, self.full), state
        x, _ = self.operator.inverse_step(self.hysteresis.stretched(drive, self.full), state)
        x = np.clip(x, 0.0, self.full)
        _, after = self.operator.step(x, state)
        return self.hysteresis.unstretched(x, self.full), after

    def drive(self, pressure: ArrayLike, state: Any) -> tuple[NDArray[np.float64], Any]:
        """Return the effective pressure [Pa] at a pressure [Pa], and the state it leaves."""
        if self.operator is None:
            return np.asarray(pressure, float), state
        x = self.hysteresis.stretched(np.clip(pressure, 0.0, self.full), self.full)
        value, after = self.operator.step(x, state)
        return self.hysteresis.unstretched(value, self.full), after
