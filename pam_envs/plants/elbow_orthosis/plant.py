"""An elbow orthosis with two antagonistic bundles of pneumatic muscles: chakarov2018.

    setpoints or pulses -> pressures -> P = X [(L_n - C) (C_max - C) - friction],  X = k0 + k1 p
    Q = r (P_b - P_a),    S = -dQ/dq = -r^2 (k_a + k_b)              flexion positive
    (J_o + J_w) q'' = Q - weights + wearer

Bundle b (seven muscles) flexes the elbow and bundle a (three) straightens it. Torque and stiffness
are linear in the two pressures, so that a command of both is met exactly within the parallelogram
of the four corners at which each bundle is empty or full. The stiffness is minus the paper's
``K_q``, which is negative.

Effects (off unless set, ``ElbowOrthosis.effects``): of the regulators (on/off valves have none), of
both bundles, of each of their muscles, of the bearing and of the sensors.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.constants import ATMOSPHERE
from pam_envs.hysteresis.protocol import Usage
from pam_envs.hysteresis.slip import SlipModel
from pam_envs.mechanics.forearm import OrthosisLink, Wearer
from pam_envs.mechanics.pulley import Pulley
from pam_envs.muscle.quadratic_bundle import BundleMuscle, QuadraticBundle
from pam_envs.plants.core.passivity import ImposedMuscles
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.elbow_orthosis import rows as K
from pam_envs.plants.elbow_orthosis.hysteresis import (
    REFERENCE_PRESSURE,
    ElbowHysteresis,
    elbow_hysteresis,
)
from pam_envs.pneumatics.on_off_pair import OnOffValve
from pam_envs.pneumatics.regulator import BundleRegulator
from pam_envs.sensing.sensor import AngleSensor, GaugeSensor

Valves = Literal["proportional", "on_off"]

MAKES: tuple[Valves, ...] = ("proportional", "on_off")
STOP_GIVES = 0.15
"""Depth [rad] of the mechanical stops."""
SEVEN = ("published", "mus_b = 7: chakarov2018, section 3")


@dataclass(frozen=True)
class ElbowOrthosis(Plant, rows=K):
    """The plant; another one is :meth:`replace` of it.

    Attributes
    ----------
    valves : {"proportional", "on_off"}
        A regulator at each bundle that takes setpoints, or the paper's pair of a fill and an
        exhaust valve, which takes pulses.
    bundle_a, bundle_b, muscle, regulator, valve, hysteresis, pulley, link, wearer
        The components; ``muscle`` holds effects that the muscles of both bundles have. Of regulator
        and valve the one that is not in use has no effect.
    angle, pressure
        The sensors; both pressure gauges are alike.
    """

    family: ClassVar[str] = "elbow_orthosis"
    makes: ClassVar[Mapping[str, tuple[str, ...]]] = {"valves": MAKES}

    valves: Valves = "proportional"
    bundle_a: QuadraticBundle = field(default_factory=QuadraticBundle)
    bundle_b: QuadraticBundle = field(default_factory=lambda: QuadraticBundle(muscles=7.0))
    muscle: BundleMuscle = field(default_factory=BundleMuscle)
    regulator: BundleRegulator = field(default_factory=BundleRegulator)
    valve: OnOffValve = field(default_factory=OnOffValve)
    hysteresis: ElbowHysteresis = field(default_factory=lambda: elbow_hysteresis("maxwell_slip"))
    pulley: Pulley = field(default_factory=Pulley)
    link: OrthosisLink = field(default_factory=OrthosisLink)
    wearer: Wearer = field(default_factory=Wearer)
    angle: AngleSensor = field(default_factory=AngleSensor)
    pressure: GaugeSensor = field(default_factory=GaugeSensor)

    @property
    def dead_time(self) -> float:
        """Dead time [s] from a setpoint to the pressure."""
        return 0.0 if self.valves == "on_off" else self.regulator.dead_time

    @property
    def air(self) -> str:
        """Air supply: ``"regulator"``, or ``"flow"``, always so with on/off valves."""
        return "flow" if self.valves == "on_off" else super().air

    @property
    def flowless(self) -> str:
        """Reason why this variant has no flow through a regulator's orifices, and the remedy."""
        own = "valves = 'on_off' have a flow of their own; leave regulator.flow at 0"
        return own if self.valves == "on_off" else ""

    @property
    def inert(self) -> frozenset[str]:
        """Parameters of the regulator that have no effect: all, with on/off valves."""
        own = (name for name in self.names if name.startswith("regulator."))
        return frozenset(own) if self.valves == "on_off" else super().inert

    def with_air(self, air: str) -> Self:
        """Return the plant with an air supply; that of on/off valves is ``"flow"``."""
        if self.valves != "on_off":
            return super().with_air(air)
        if air != "flow":
            raise ValueError(
                f"air = {air!r}: valves = 'on_off' let air flow; choose 'flow', or take "
                "valves = 'proportional'"
            )
        return self

    def _usage(self) -> Usage:
        return Usage("an elbow", "virgin", reach=0.55 * self.pulley.stroke)

    def _check(self) -> None:
        """Refuse parts of muscles, a stroke beyond the bundles' force, and too fast a motion."""
        for name in ("bundle_a", "bundle_b"):
            muscles = getattr(self, name).muscles
            if muscles != int(muscles):
                raise ValueError(f"{name}.muscles = {muscles:g} must be a whole number, 1 or more")
        if self.pulley.lowest >= self.pulley.highest:
            raise ValueError(
                f"pulley.lowest = {self.pulley.lowest:g} rad is not below pulley.highest = "
                f"{self.pulley.highest:g} rad; swap them"
            )
        shortest = min(self.bundle_a.reach, self.bundle_b.reach)
        if self.pulley.stroke >= shortest:
            raise ValueError(
                f"pulley.radius = {self.pulley.radius:g} m: the stroke of {self.pulley.stroke:.4f} "
                f"m contracts the bundles beyond {shortest:.4f} m, where their force ends; use a "
                "smaller radius or longer muscles"
            )
        inertia = self.link.inertia + self.wearer.inertia
        damping = self.link.damping + self.wearer.damping
        muscles = self.bundle_a.muscles + self.bundle_b.muscles
        viscous = muscles * self.muscle.largest_damping(self.full_pressure)
        damping += viscous * self.pulley.radius**2
        ends = np.array(self.angle_range)
        full = float(np.max(self.stiffness(ends, self.full_pressure, self.full_pressure)))
        k = full + self._air_stiffness() + self.wearer.stiffness + self.pulley.stop_stiffness
        self.check_phase(
            k / inertia,
            damping / inertia,
            f"link.inertia = {self.link.inertia:g} kg m2 with wearer.inertia = "
            f"{self.wearer.inertia:g} kg m2, wearer.damping = {self.wearer.damping:g} N m s/rad",
        )

    def _air_stiffness(self) -> float:
        """Return the largest stiffness [N m/rad] that the enclosed air adds."""
        total = 0.0
        for bundle in (self.bundle_a, self.bundle_b):
            area = bundle.pressure_factor * float(bundle.shape(0.0))
            air = self.full_pressure + ATMOSPHERE
            total += area * area * air / bundle.nominal_volume * self.pulley.radius**2
        return total * (self.regulator.polytropic if self.regulator.flow else 1.0)

    # --- presets --------------------------------------------------------------------------------

    @classmethod
    def paper(
        cls,
        hysteresis: str = "maxwell_slip_length",
        valves: Valves = "proportional",
        **changes: float,
    ) -> ElbowOrthosis:
        """Return the orthosis with three and seven muscles on a pulley of 31.5 mm.

        Parameters
        ----------
        hysteresis : {"maxwell_slip_length", "preisach_length", "none"}
            Kind of the hysteresis: driven by length as here, or ``"maxwell_slip"`` and
            ``"preisach"``, driven by pressure. All have the same widest loop at one pressure.
        valves : {"proportional", "on_off"}
            See the class.
        **changes : float
            Parameters to replace, with ``__`` for the dot (``bundle_a__muscles=4``).
        """
        plant = cls(hysteresis=elbow_hysteresis(hysteresis), provenance={"bundle_b.muscles": SEVEN})
        return dataclasses.replace(plant.changed(changes), valves=valves)

    # --- ranges ---------------------------------------------------------------------------------

    @property
    def angle_range(self) -> tuple[float, float]:
        """Lowest and highest flexion [rad]."""
        return self.pulley.lowest, self.pulley.highest

    @property
    def hard_limits(self) -> tuple[float, float]:
        """Flexion [rad] up to which the mechanical stops give way on either side."""
        return self.pulley.lowest - STOP_GIVES, self.pulley.highest + STOP_GIVES

    @property
    def full_pressure(self) -> float:
        """Highest pressure [Pa]: of the regulators, or of the valves' supply."""
        pulsed = self.valves == "on_off"
        return self.valve.supply_pressure if pulsed else self.regulator.max_pressure

    @property
    def cycle(self) -> float:
        """Cycle of the on/off valves [s]."""
        return 1.0 / self.valve.frequency

    # --- statics, without hysteresis ------------------------------------------------------------

    def geometry(self, angle: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return the shapes [m2] of bundles a and b and their slopes [m] at an angle [rad]."""
        c_a, c_b = self.pulley.contractions(angle)
        a, b = self.bundle_a, self.bundle_b
        return a.shape(c_a), b.shape(c_b), a.slope(c_a), b.slope(c_b)

    def coefficients(self, pressure_a: ArrayLike, pressure_b: ArrayLike) -> tuple[Array, Array]:
        """Return ``X = k0 + k1 p`` [N/m2] of both bundles at their pressures [Pa]."""
        return self.bundle_a.factor(pressure_a), self.bundle_b.factor(pressure_b)

    def pressures_of(self, factor_a: ArrayLike, factor_b: ArrayLike) -> tuple[Array, Array]:
        """Return the pressures [Pa] of both factors ``X`` [N/m2]."""
        return self.bundle_a.pressure(factor_a), self.bundle_b.pressure(factor_b)

    def forces(
        self, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike
    ) -> tuple[Array, Array]:
        """Return both forces [N] with the correction of the law, 0 where a bundle is slack."""
        c_a, c_b = self.pulley.contractions(angle)
        force_a = self._force(self.bundle_a, pressure_a, c_a)
        return force_a, self._force(self.bundle_b, pressure_b, c_b)

    def _force(self, bundle: QuadraticBundle, pressure: ArrayLike, contraction: Array) -> Array:
        law = bundle.law(pressure, contraction)
        if self.muscle.corrects:
            more = self.muscle.correction(pressure, contraction / bundle.nominal_length)
            law = law + bundle.gain * bundle.muscles * more
        return np.maximum(0.0, law)

    def torque(self, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
        """Return the torque ``Q`` [N m] at an angle [rad] and pressures [Pa], Eq. (23)."""
        return self.pulley.torque(*self.forces(angle, pressure_a, pressure_b))

    def stiffness(self, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
        """Return the stiffness ``S = -K_q`` [N m/rad] at held pressures [Pa], Eq. (22).

        It includes the correction of the force law.
        """
        c_a, c_b = self.pulley.contractions(angle)
        k_a = self._growth(self.bundle_a, pressure_a, c_a)
        return np.asarray(
            -(self.pulley.radius**2) * (k_a + self._growth(self.bundle_b, pressure_b, c_b))
        )

    def _growth(self, bundle: QuadraticBundle, pressure: ArrayLike, contraction: Array) -> Array:
        """Return the derivative [N/m] of a bundle's force by its contraction."""
        slope = bundle.stiffness(pressure, contraction) * (bundle.shape(contraction) > 0.0)
        if self.muscle.corrects:
            more = self.muscle.correction_growth(pressure, contraction / bundle.nominal_length)
            slope = slope + bundle.gain * bundle.muscles / bundle.nominal_length * more
            slope = slope * (self._force(bundle, pressure, contraction) > 0.0)
        return np.asarray(slope)

    def determinant(self, angle: ArrayLike) -> Array:
        """Return the determinant [m6] of the map from both factors to torque and ``K_q``."""
        shape_a, shape_b, slope_a, slope_b = self.geometry(angle)
        return np.asarray(-(self.pulley.radius**3) * (shape_a * slope_b + shape_b * slope_a))

    def allocate(
        self, angle: ArrayLike, torque: ArrayLike, stiffness: ArrayLike
    ) -> tuple[Array, Array]:
        """Return the pressures [Pa] of a torque [N m] and a stiffness [N m/rad]: exact.

        They are not clipped; ``mechanics.allocation`` gives the best ones within their range.
        """
        shape_a, shape_b, slope_a, slope_b = self.geometry(angle)
        pull = np.asarray(torque, float) / self.pulley.radius
        hold = -np.asarray(stiffness, float) / self.pulley.radius**2
        per = 1.0 / (shape_a * slope_b + shape_b * slope_a)
        factor_a = (shape_b * hold - slope_b * pull) * per
        factor_b = (shape_a * hold + slope_a * pull) * per
        return self.pressures_of(factor_a, factor_b)

    def corners(self, angle: ArrayLike) -> tuple[Array, Array]:
        """Return torques [N m] and stiffnesses [N m/rad] of the four corners, shape (..., 4).

        Bundles a and b empty and empty, full and empty, full and full, empty and full.
        """
        q = np.asarray(angle, float)[..., None]
        p_a, p_b = self.full_pressure * np.array([[0.0, 1, 1, 0], [0.0, 0, 1, 1]])
        return self.torque(q, p_a, p_b), self.stiffness(q, p_a, p_b)

    def weight_torque(self, angle: ArrayLike) -> Array:
        """Return the flexing torque [N m] that supports the orthosis at an angle [rad]."""
        moment = self.link.mass * self.link.centre * self.link.gravity
        return np.asarray(moment * np.sin(angle))

    def friction(self, lag: ArrayLike, pressure: Any = None) -> tuple[Array, Array]:
        """Return the share of friction [m2] in the shapes of bundles a and b.

        ``lag`` [m] is the travel (``pulley.travel(angle)``) less the output of
        ``hysteresis.operator``: with hysteresis a force is ``X (shape - friction)``. With the
        ``pressure`` [Pa] of both bundles, shape (2, ...), so are the lags; friction driven by
        length needs them.
        """
        part = 0.5 * self.hysteresis.loop * np.asarray(lag, float) / self.hysteresis.largest_lag
        a, b = self.bundle_a, self.bundle_b
        if self.hysteresis.drive == "length":
            part = part / self.friction_limits(pressure)
        part_a, part_b = (part, part) if pressure is None else part
        return -part_a * a.shape(0.0), part_b * b.shape(0.0)

    def friction_limits(self, pressure: Any) -> Array:
        """Return the slip forces over those at ``REFERENCE_PRESSURE``, shape (2, ...)."""
        now = self.coefficients(*np.asarray(pressure, float))
        there = self.coefficients(*np.full((2, 1), REFERENCE_PRESSURE))
        return np.array([x / y for x, y in zip(now, there, strict=True)])

    def slide(self, angle: ArrayLike, pressure: ArrayLike, state: Any) -> tuple[Any, Any]:
        """Return the shares of :meth:`friction` after motion to angles [rad], and the state.

        ``pressure`` [Pa] has the shape (2, ...). The state of friction driven by length is one of
        both bundles, a tuple; that of others the operator's own. Start from
        ``hysteresis.initial(n)``.
        """
        travel, model = self.pulley.travel(angle), self.hysteresis.model
        if isinstance(model, SlipModel):
            limits = self.friction_limits(pressure)
            moved = [model.lag(travel, s, limit) for s, limit in zip(state, limits, strict=True)]
            lags = np.array([lag for lag, _ in moved])
            return self.friction(lags, pressure), tuple(after for _, after in moved)
        follows, after = model.rows().forward(np.asarray(travel), state)
        return self.friction(travel - follows), after

    def imposed_muscles(self, cycles: int) -> ImposedMuscles:
        """Return both bundles under imposed pressures (2, n) [Pa] and an angle [rad], taut."""

        def force_of(p: Array, angle: Array, losses: tuple[Any, Any]) -> Array:
            shape_a, shape_b, _, _ = self.geometry(angle)
            x_a, x_b = self.coefficients(*p)
            return self.pulley.torque(x_a * (shape_a - losses[0]), x_b * (shape_b - losses[1]))

        def force(p: Array, angle: Array, state: Any) -> tuple[Array, Any]:
            losses, after = self.slide(angle, p, state)
            return force_of(p, angle, losses), after

        return ImposedMuscles(
            force, lambda p, angle: force_of(p, angle, (0.0, 0.0)), self.hysteresis.initial(cycles)
        )

    # --- rows, files, identity --------------------------------------------------------------------

    def table_values(self) -> list[float]:
        """Return the numbers of the hysteresis operator and its largest lag."""
        return [*self._model.numbers(), self.hysteresis.largest_lag]
