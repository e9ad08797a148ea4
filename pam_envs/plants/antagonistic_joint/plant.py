"""One stage of fluidic_muscles: a joint between two antagonistic pneumatic muscles.

    (angle, co-contraction) -> feedforward -> setpoints -> regulators -> pressures
    F = F(p, e) - friction(e)          of each muscle, 0 where it would push
    J phi'' + D phi' = -F_A dL_A/dphi - F_B dL_B/dphi - m g c sin(phi) + disturbance

Without hysteresis, gravity and load the feedforward makes the angle at rest the commanded one; the
regulators' lag and the damped stiffness of the muscles are then two real poles near 23 rad/s,
behind the regulators' dead time and below their rate limit, which the paper does not have. The
paper's reduced plant, a Preisach operator and two poles, is the variant ``dynamics="reduced"``.

Effects (off unless set, ``AntagonisticJoint.effects``): of both regulators and muscles, of the
bearing and of the sensors; in the reduced plant only pressures and sensors have them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.mechanics.antagonistic_lever import AntagonisticLever
from pam_envs.muscle.force_map import FULL_PRESSURE, ForceMap, paper_stretch
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.hysteresis import JointHysteresis, joint_hysteresis
from pam_envs.plants.antagonistic_joint.link import Link, NominalPoint
from pam_envs.plants.antagonistic_joint.statics import PairPlant
from pam_envs.pneumatics.regulator import JointRegulator
from pam_envs.sensing.sensor import GaugeSensor, JointEncoder

Dynamics = Literal["muscles", "reduced"]

STRETCHED = (
    "assumed",
    "contraction axis of the measured map stretched: the force at 6.5 bar ends at 25 %, which "
    "+-30 degrees take with this lever",
)
REACHED = ("derived", "largest angle that 6.5 bar reach at the nominal co-contraction")


@dataclass(frozen=True)
class AntagonisticJoint(PairPlant, rows=K):
    """The plant; another one is :meth:`replace` of it.

    Attributes
    ----------
    dynamics : {"muscles", "reduced"}
        First principles, or the paper's reduced plant.
    regulator, hysteresis, muscle, lever, link, nominal
        The components; both muscles and both regulators are alike but for ``muscle.imbalance``.
    angle, pressure
        The sensors.
    """

    family: ClassVar[str] = "antagonistic_joint"
    makes: ClassVar[Mapping[str, tuple[str, ...]]] = {"dynamics": ("muscles", "reduced")}
    stages: ClassVar[int] = 1

    dynamics: Dynamics = "muscles"
    regulator: JointRegulator = field(default_factory=JointRegulator)
    hysteresis: JointHysteresis = field(default_factory=JointHysteresis)
    muscle: ForceMap = field(default_factory=ForceMap)
    lever: AntagonisticLever = field(default_factory=AntagonisticLever)
    link: Link = field(default_factory=Link)
    nominal: NominalPoint = field(default_factory=NominalPoint)
    angle: JointEncoder = field(default_factory=JointEncoder)
    pressure: GaugeSensor = field(default_factory=GaugeSensor)

    @property
    def dead_time(self) -> float:
        """Dead time [s] from a setpoint to the pressure."""
        return 0.0 if self.dynamics == "reduced" else self.regulator.dead_time

    @property
    def flowless(self) -> str:
        """Reason why this variant has no flow through a regulator's orifices, and the remedy."""
        return (
            "dynamics = 'reduced' moves by its commands, without air; take dynamics = 'muscles' or "
            "air = 'regulator'"
            if self.dynamics == "reduced"
            else ""
        )

    def _check(self) -> None:
        """Refuse angles out of reach, and a motion that the sub-steps cannot follow."""
        super()._check()
        if self.dynamics == "reduced" and self.hysteresis.drive == "length":
            raise ValueError(
                "dynamics = 'reduced' has the hysteresis of the paper, from command to angle: give "
                "hysteresis_drive='pressure'"
            )
        link = self.link
        full = float(np.max(self.stiffness(link.stop, FULL_PRESSURE, FULL_PRESSURE)))
        turns = np.linspace(-link.stop, link.stop, 45)
        air = self.air_stiffness(*self.volumes(turns))
        self.check_phase(
            (full + 2.0 * air + link.stop_stiffness) / link.inertia,
            link.damping / link.inertia,
            f"link.inertia = {link.inertia:g} kg m2 with link.damping = {link.damping:g} N m s/rad",
        )

    # --- presets --------------------------------------------------------------------------------

    @classmethod
    def paper(cls, hysteresis: str = "maxwell_slip_length", **changes: float) -> AntagonisticJoint:
        """Return the joint whose muscles end at 25 % contraction, as fluidic_muscles has it.

        Parameters
        ----------
        hysteresis : {"maxwell_slip_length", "preisach_length", "none"}
            Kind of the hysteresis: driven by length as here, or ``"maxwell_slip"`` and
            ``"preisach"``, driven by pressure. All have the same loops at one pressure.
        **changes : float
            Parameters to replace, with ``__`` for the dot (``hysteresis__width=0.5``).
        """
        plant = cls(
            hysteresis=joint_hysteresis(hysteresis),
            muscle=ForceMap(stretch=paper_stretch()),
            provenance={"muscle.stretch": STRETCHED},
        )
        return plant.changed(changes)

    @classmethod
    def measured(
        cls, hysteresis: str = "maxwell_slip_length", **changes: float
    ) -> AntagonisticJoint:
        """Return the joint with muscles as measured, limited to the angle that it reaches.

        The limit is the angle that full pressure reaches at the nominal co-contraction, against
        the link's weight; other parameters are those of :meth:`paper`.
        """
        plant = cls(hysteresis=joint_hysteresis(hysteresis), provenance={"link.limit": REACHED})
        plant = plant.changed(changes)
        if "link__limit" in changes:
            return plant
        return plant.replace({"link.limit": plant.reachable_angle()})

    @classmethod
    def reduced(cls, hysteresis: str = "maxwell_slip", **changes: float) -> AntagonisticJoint:
        """Return the paper's reduced plant: a hysteresis, then two real poles."""
        plant = cls.paper("none")
        plant = dataclasses.replace(
            plant, hysteresis=joint_hysteresis(hysteresis, True), dynamics="reduced"
        )
        return plant.changed(changes)

    # --- statics --------------------------------------------------------------------------------

    def reachable_angle(
        self, prestress: float | None = None, torque: float = 0.0, payload: float = 0.0
    ) -> float:
        """Return the largest angle [rad] up to the stop that the regulators' range reaches.

        The co-contraction [N] (default: the nominal one) is held against the weights of link and
        payload [kg] and a torque [N m].
        """
        return self._reach(
            prestress, lambda angle: torque + float(self.weight_torque(angle, payload))
        )

    def weight_torque(self, angle: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return the torque [N m] that holds link and payload [kg] at an angle [rad]."""
        moment = self.link.mass * self.link.centre + np.asarray(payload) * self.link.length
        return np.asarray(self.link.gravity * moment * np.sin(angle))

    def torque_range(self, angles: ArrayLike, by_pressure: bool = False) -> tuple[Array, Array]:
        """Return the least and the largest torque [N m] at angles [rad].

        The limit of angle setpoints also limits the torque; pressure setpoints have no such limit.
        """
        if self.dynamics != "reduced":
            return super().torque_range(angles, by_pressure)
        low, high = (
            self.nominal.stiffness * (end - np.asarray(angles)) for end in self.angle_range
        )
        return low, high

    def gravity_shift(self, angles: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return the addition to setpoints [rad] that compensates gravity, shape (..., 1)."""
        return super().gravity_shift(angles, np.asarray(payload)[..., None])

    # --- rows, files, identity --------------------------------------------------------------------

    def rest_angles(self, commands: ArrayLike, prestress: float | None = None) -> Array:
        """Return the angles at rest [rad] after each of a series of setpoints [rad], (T,).

        Quasi-static, hysteresis included, from the straight virgin state, without gravity and load.
        """
        from pam_envs.plants.antagonistic_joint.rollout import simulate_joint

        series = np.concatenate([[0.0], np.asarray(commands, float)])
        floating = self.replace({"link.gravity": 0.0})
        return simulate_joint(floating, series, prestress=prestress, quasi_static=True)["angle"][1:]
