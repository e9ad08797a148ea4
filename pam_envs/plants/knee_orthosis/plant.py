"""A power-assist knee orthosis with a McKibben muscle: yeh2010.

    setpoint -> regulator -> pressure P -> hysteresis -> stiffness s -> T = s (L - L_min)
    L = 2 L_b sin(theta / 2) - L_a
    tau_a = T L_b cos(theta / 2) - kappa (theta_0 - theta)              extension positive

It is mounted in one of three ways. In the *rig* the muscle is held at its nominal length. With
*no load* the brace is on its own, ``tau_a`` is 0 at rest and ``theta`` follows the pressure. On
the *leg* it opens with the knee, ``theta = mount angle + knee flexion``; the wearer walks or takes
stairs on a path that he holds with a stiffness of his own, and the knee bears the full balance of
ground force, weight and acceleration, of which the paper's Eq. (1) sees the vertical force alone.

Effects (off unless set, ``KneeOrthosis.effects``): of the regulator (the measured dynamics replace
them), of the muscle before its hysteresis, its viscosity and a correction of its law, of the
bearing of the brace alone, and of all sensors.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import Usage, operator_of
from pam_envs.hysteresis.slip import SlipModel
from pam_envs.mechanics.knee_lever import KneeLever
from pam_envs.mechanics.leg import Leg
from pam_envs.muscle.emg import MuscleActivation
from pam_envs.muscle.gas_spring import GasSpring
from pam_envs.parameters import assumed, published
from pam_envs.plants.core.passivity import ImposedMuscles
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.knee_orthosis import rows as K
from pam_envs.plants.knee_orthosis.hysteresis import LENGTHS, KneeHysteresis, knee_hysteresis
from pam_envs.pneumatics.measured_dynamics import OrthosisRegulator, mode_rows
from pam_envs.references.gait import ACTIVITIES, PAPER_STRIDE, SIGNALS, gait_table
from pam_envs.sensing.sensor import (
    AngleSensor,
    CopSensor,
    GaugeSensor,
    GroundSensor,
    HeelSensor,
    TensionSensor,
)
from pam_envs.sensing.shoe import Shoe

Mounting = Literal["rig", "no_load", "leg"]
Dynamics = Literal["lag", "measured"]
Activity = Literal["walk", "stairs_up", "stairs_down"]

MAKES: dict[str, tuple[str, ...]] = {
    "mounting": ("rig", "no_load", "leg"),
    "dynamics": ("lag", "measured"),
    "activity": ACTIVITIES,
}
STAIRS_MOUNT_ANGLE = 1.4835
"""85 degrees [rad]: 92 degrees of flexion then stay below the toggle at 180 degrees."""


@dataclass(frozen=True)
class Fixture:
    """Fixture that holds the muscle at its length."""

    length: float = published(0.22, "m", 0.05, 1.0, "nominal length, yeh2010, section 4.1")


_VARIED = "hausdorff2007: 1 to 3 % of healthy adults' stride times; 2 to 4 % at a slow walk"


@dataclass(frozen=True)
class Stride:
    """The wearer's pace, and how strides differ."""

    time: float = published(
        PAPER_STRIDE,
        "s",
        0.8,
        20.0,
        "5 s a stride, yeh2010, section 5.2; 1.224 s is the natural pace of the measured stride",
    )
    variability: float = assumed(
        0.0, "1", 0.0, 0.1, f"standard deviation of durations over their mean; {_VARIED}"
    )
    load_variability: float = assumed(
        0.0, "1", 0.0, 0.1, f"standard deviation of the strides' ground forces; {_VARIED}"
    )


@dataclass(frozen=True)
class KneeOrthosis(Plant, rows=K):
    """The plant; another one is :meth:`replace` of it.

    Attributes
    ----------
    mounting : {"rig", "no_load", "leg"}
        See the module.
    dynamics : {"lag", "measured"}
        Between setpoint and pressure: the regulator's dead time, rate limit and lag, of which the
        lag alone makes the inverse track as published, or the published frequency response
        ``G_T / G_T(0)``, for which the feedback was designed. The paper's figures for the two
        exclude each other.
    activity : {"walk", "stairs_up", "stairs_down"}
        Activity of the leg.
    regulator, hysteresis, muscle, lever, fixture, leg, stride, shoe, activation
        The components.
    tension, angle, pressure, heel, ground, cop, ankle
        The sensors.
    """

    family: ClassVar[str] = "knee_orthosis"
    makes: ClassVar[Mapping[str, tuple[str, ...]]] = MAKES

    mounting: Mounting = "no_load"
    dynamics: Dynamics = "lag"
    activity: Activity = "walk"
    regulator: OrthosisRegulator = field(default_factory=OrthosisRegulator)
    hysteresis: KneeHysteresis = field(default_factory=lambda: knee_hysteresis("maxwell_slip"))
    muscle: GasSpring = field(default_factory=GasSpring)
    lever: KneeLever = field(default_factory=KneeLever)
    fixture: Fixture = field(default_factory=Fixture)
    leg: Leg = field(default_factory=Leg)
    stride: Stride = field(default_factory=Stride)
    shoe: Shoe = field(default_factory=Shoe)
    activation: MuscleActivation = field(default_factory=MuscleActivation)
    tension: TensionSensor = field(default_factory=TensionSensor)
    angle: AngleSensor = field(default_factory=AngleSensor)
    pressure: GaugeSensor = field(default_factory=GaugeSensor)
    heel: HeelSensor = field(default_factory=HeelSensor)
    ground: GroundSensor = field(default_factory=GroundSensor)
    cop: CopSensor = field(default_factory=CopSensor)
    ankle: AngleSensor = field(default_factory=AngleSensor)

    @property
    def dead_time(self) -> float:
        """Dead time [s] from a setpoint to the pressure."""
        return 0.0 if self.dynamics == "measured" else self.regulator.dead_time

    def _usage(self) -> Usage:
        return Usage("the orthosis", "low", self.regulator.max_pressure, unit_slope=False)

    @property
    def flowless(self) -> str:
        """Reason why this variant has no flow through a regulator's orifices, and the remedy."""
        return (
            "dynamics = 'measured' is the response of regulator and muscle together; take "
            "dynamics = 'lag' or air = 'regulator'"
            if self.dynamics == "measured"
            else ""
        )

    def _check(self) -> None:
        """Refuse too fast a motion, and a strap with which the wire opens past its toggle."""
        lever, leg, hold = self.lever, self.leg, 0.0
        inertia, damping = lever.inertia, lever.damping
        viscous = self.muscle.largest_damping(self.regulator.max_pressure)
        damping += viscous * lever.arm**2
        if self.mounting == "leg":
            inertia += leg.inertia
            damping += leg.hold_damping + leg.stance_damping + leg.damping
            hold = leg.hold_stiffness + 2.0 * leg.stance_stiffness + leg.stiffness
        pull = self.muscle.gain * self.muscle.stiffness_ratio * self.regulator.max_pressure
        air = 0.0
        if self.mounting != "rig":
            lengths = self.lever.length(np.linspace(0.0, np.pi, 45))
            stretch = np.maximum(0.0, lengths - self.muscle.shortest_length)
            gives = self.muscle.stiffness_ratio * stretch * lever.arm
            air = self.air_stiffness(self.muscle.volume_at(lengths), gives)
        self.check_phase(
            (lever.stiffness + hold + pull * lever.arm**2 + air) / inertia,
            damping / inertia,
            f"lever.inertia = {lever.inertia:g} kg m2 with lever.damping = {lever.damping:g} "
            f"N m s/rad and lever.stiffness = {lever.stiffness:g} N m/rad",
        )
        if self.mounting != "leg":
            return
        widest = self.lever.mount_angle + float(self.gait_table()[:, 0].max())
        if widest >= np.pi:
            raise ValueError(
                f"lever.mount_angle = {self.lever.mount_angle:g} rad: the knee of activity "
                f"{self.activity!r} opens the wire to {widest:.3f} rad, past its toggle at pi; "
                f"strap it on at less than {self.lever.mount_angle - widest + np.pi:.3f} rad"
            )

    # --- presets --------------------------------------------------------------------------------

    @classmethod
    def rig(
        cls, hysteresis: str = "maxwell_slip", dynamics: Dynamics = "lag", **changes: float
    ) -> KneeOrthosis:
        """Return the muscle held at its nominal length: 158 N at 2 bar, 79 N/bar.

        Parameters
        ----------
        hysteresis : {"maxwell_slip", "preisach", "none"}
            Hysteresis model; both operators have the same loops.
        dynamics : {"lag", "measured"}
            See the class.
        **changes : float
            Parameters to replace, with ``__`` for the dot (``hysteresis__width=0.5``).
        """
        return cls._preset(hysteresis, changes, mounting="rig", dynamics=dynamics)

    @classmethod
    def no_load(
        cls, hysteresis: str = "maxwell_slip", dynamics: Dynamics = "lag", **changes: float
    ) -> KneeOrthosis:
        """Return the brace alone; the parameters are those of :meth:`rig`."""
        return cls._preset(hysteresis, changes, mounting="no_load", dynamics=dynamics)

    @classmethod
    def on_leg(
        cls,
        activity: Activity = "walk",
        stride: float = PAPER_STRIDE,
        hysteresis: str = "maxwell_slip",
        dynamics: Dynamics = "lag",
        **changes: float,
    ) -> KneeOrthosis:
        """Return the brace on a leg.

        Parameters
        ----------
        activity : {"walk", "stairs_up", "stairs_down"}
            Activity of the leg.
        stride : float
            Duration of a stride [s]; 5 s in the paper, 1.224 s at natural pace.
        hysteresis, dynamics, **changes
            See :meth:`rig`.
        """
        changes = {"stride__time": stride} | changes
        if activity in ACTIVITIES[1:]:
            changes = {"lever__mount_angle": STAIRS_MOUNT_ANGLE} | changes
        made = {"mounting": "leg", "dynamics": dynamics, "activity": activity}
        return cls._preset(hysteresis, changes, **made)

    @classmethod
    def _preset(cls, hysteresis: str, changes: Mapping[str, float], **makes: Any) -> KneeOrthosis:
        plant = cls(hysteresis=knee_hysteresis(hysteresis)).changed(changes)
        return dataclasses.replace(plant, **makes)

    # --- statics ----------------------------------------------------------------------------------

    def tension_for(self, angle: ArrayLike, torque: ArrayLike = 0.0) -> NDArray[np.float64]:
        """Return the tension ``T_d`` [N] for an assistive torque [N m] at an angle [rad].

        ``T_d = [kappa (theta_0 - theta) + tau_a] / (L_b cos(theta / 2))``, not held above 0.
        """
        return self.lever.tension(torque, angle)

    def stiffness_for(self, tension: ArrayLike, angle: ArrayLike) -> NDArray[np.float64]:
        """Return the stiffness ``T / dL`` [N/m] of a tension [N] at an angle [rad]."""
        return self.muscle.stiffness(tension, self.lever.length(angle))

    def pull(
        self, stiffness: ArrayLike, pressure: ArrayLike, length: ArrayLike
    ) -> NDArray[np.float64]:
        """Return the tension [N], not held above 0, with the correction of the law.

        At a stiffness [N/m], a pressure [Pa] and a length [m] of the muscle.
        """
        tension = self.muscle.tension(stiffness, length)
        if not self.muscle.corrects:
            return tension
        strain = 1.0 - np.asarray(length) / self.lever.full_length
        return tension + self.muscle.correction(pressure, strain)

    def angle_at(
        self, stiffness: ArrayLike, pressure: ArrayLike | None = None
    ) -> NDArray[np.float64]:
        """Return the angle [rad] at which the brace rests without load at a stiffness [N/m].

        With the correction of the law if the pressure [Pa] is given.
        """
        s = np.asarray(stiffness, float)
        low, high = np.zeros_like(s), np.full_like(s, np.pi)
        for _ in range(60):
            middle = 0.5 * (low + high)
            length = self.lever.length(middle)
            if pressure is None:
                tension = self.muscle.tension(s, length)
            else:
                tension = np.maximum(0.0, self.pull(s, pressure, length))
            opens = self.lever.torque(tension, middle) < 0.0
            low, high = np.where(opens, middle, low), np.where(opens, high, middle)
        return 0.5 * (low + high)

    def imposed_muscles(self, cycles: int) -> ImposedMuscles:
        """Return the muscle under an imposed pressure and length [m], never slack."""
        held, muscle = self.hysteresis, self.muscle
        operator, model = held.scaled, held.model
        state = operator_of(operator).initial_state((cycles,))
        if isinstance(model, SlipModel):
            state = model.initial_state((cycles,))
        middle = float(np.mean(LENGTHS))

        def force(p: Array, length: Array, state: Any) -> tuple[Array, Any]:
            if isinstance(model, SlipModel):
                lag, after = model.lag(length - middle, state, held.limit(p[0]))
                return law(p, length) - held.friction * lag, after
            if operator is None:
                return law(p, length), state
            felt, after = operator.step(p[0], state)
            return -muscle.tension(muscle.gain * felt, length), after

        def law(p: Array, length: Array) -> Array:
            return -muscle.tension(muscle.gain * muscle.stiffness_ratio * p[0], length)

        return ImposedMuscles(force, law, state)

    # --- rows, files, identity --------------------------------------------------------------------

    def table_values(self) -> list[float]:
        """Return the modes of the measured dynamics and the numbers of the hysteresis operator."""
        return mode_rows() + self._model.numbers()

    def gait_table(self) -> NDArray[np.float64]:
        """Return the stride's curves as the kernels read them, shape (points, signals)."""
        if self.mounting != "leg":
            return np.zeros((4, len(SIGNALS)))
        return gait_table(self.activity)
