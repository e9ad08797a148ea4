"""The redundant manipulator of fluidic_muscles: a chain of joints between antagonistic muscles.

    M(q) q'' + bias(q, q') = sum over a joint's muscles of -F dL/dq - D q' + disturbance

Six stages with axes x-y-x-y-x-y unless another chain is given; each has the muscles, the
hysteresis, the regulators and the feedforward of a single joint
(:mod:`pam_envs.plants.antagonistic_joint.plant`). Gravity, inertia and the payload at the tip
couple the joints. The arm hangs.

Masses and damping are not published. Links of 0.1 kg are about as heavy as the muscles of a stage
bear where the paper's paths bend the arm most, and lighter than two muscles with their fittings,
which have no mass in this model.
Each joint has, beside the viscosity of its muscles, the damping that gives it a ratio of one half
with the rest of the straight arm held rigid. Both have a common factor (``arm.mass_factor``,
``arm.damping_factor``) that can be drawn.

Effects (off unless set, ``RedundantManipulator.effects``), the same for all joints: of the
regulators, the muscles and the sensors. The bearings have viscous friction only.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.mechanics.antagonistic_lever import AntagonisticLever
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.muscle.force_map import ForceMap, paper_stretch
from pam_envs.plants.antagonistic_joint.hysteresis import JointHysteresis, joint_hysteresis
from pam_envs.plants.antagonistic_joint.link import (
    ArmFactors,
    Link,
    NominalPoint,
    Stage,
    StagePoint,
)
from pam_envs.plants.antagonistic_joint.plant import (
    REACHED,
    STRETCHED,
    AntagonisticJoint,
)
from pam_envs.plants.antagonistic_joint.statics import PairPlant
from pam_envs.plants.redundant_manipulator import rows as M
from pam_envs.pneumatics.regulator import JointRegulator
from pam_envs.sensing.sensor import GaugeSensor, JointEncoder

LINK = SerialChain.uniform()
"""The chain unless another one is given."""
DAMPING_RATIO = 0.5
MOST_DAMPING = 100.0
LINKS = ("lengths", "masses", "centres", "across", "along")


@dataclass(frozen=True)
class RedundantManipulator(PairPlant, rows=M):
    """The plant; another one is :meth:`replace` of it, or ``dataclasses.replace`` for the chain.

    Attributes
    ----------
    axes, lengths, masses, centres, across, along, gravity
        The chain, as in :class:`~pam_envs.mechanics.serial_chain.chain.SerialChain`, for an
        ``arm.mass_factor`` of 1.
    joint_damping : tuple of float
        Of each joint [N m s/rad], beside ``link.damping`` and the muscles' viscosity, for an
        ``arm.damping_factor`` of 1.
    arm
        Factors of all masses and of all damping.
    regulator, hysteresis, muscle, lever, link, nominal
        The components of every stage.
    angle, pressure
        The sensors of every stage.
    """

    family: ClassVar[str] = "redundant_manipulator"
    choices: ClassVar[tuple[str, ...]] = ("axes", *LINKS, "gravity", "joint_damping")
    dynamics: ClassVar[str] = "muscles"

    axes: str = "".join(LINK.axes)
    lengths: tuple[float, ...] = LINK.lengths
    masses: tuple[float, ...] = LINK.masses
    centres: tuple[float, ...] = LINK.centres
    across: tuple[float, ...] = LINK.across
    along: tuple[float, ...] = LINK.along
    gravity: tuple[float, ...] = LINK.gravity
    joint_damping: tuple[float, ...] = (0.0,) * LINK.stages
    arm: ArmFactors = field(default_factory=ArmFactors)
    regulator: JointRegulator = field(default_factory=JointRegulator)
    hysteresis: JointHysteresis = field(default_factory=JointHysteresis)
    muscle: ForceMap = field(default_factory=ForceMap)
    lever: AntagonisticLever = field(default_factory=AntagonisticLever)
    link: Stage = field(default_factory=Stage)
    nominal: StagePoint = field(default_factory=StagePoint)
    angle: JointEncoder = field(default_factory=JointEncoder)
    pressure: GaugeSensor = field(default_factory=GaugeSensor)

    def __post_init__(self) -> None:
        """Check every parameter and the chain."""
        for name in (*LINKS, "gravity", "joint_damping"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name)))
        if len(self.gravity) != 3:
            raise ValueError(f"gravity = {self.gravity!r}; give three numbers [m/s2]")
        super().__post_init__()

    def _check(self) -> None:
        """Refuse angles out of reach, too many joints, and other than one damping per joint."""
        super()._check()
        if self.chain.stages > M.MOST_STAGES:
            raise ValueError(
                f"axes = {self.axes!r}: {self.chain.stages} joints; at most {M.MOST_STAGES} are "
                "simulated"
            )
        damping = self.joint_damping
        if len(damping) != self.stages or not all(0.0 <= d <= MOST_DAMPING for d in damping):
            raise ValueError(
                f"joint_damping = {damping!r}; give {self.stages} numbers from 0 to "
                f"{MOST_DAMPING:g} N m s/rad, one a joint"
            )

    # --- presets --------------------------------------------------------------------------------

    @classmethod
    def paper(
        cls, hysteresis: str = "maxwell_slip_length", chain: SerialChain = LINK, **changes: float
    ) -> RedundantManipulator:
        """Return the arm whose muscles end at 25 % contraction, so that joints take +-30 degrees.

        Parameters
        ----------
        hysteresis : {"maxwell_slip_length", "preisach_length", "none"}
            Kind of the hysteresis: driven by length as here, or ``"maxwell_slip"`` and
            ``"preisach"``, driven by pressure. All have the same loops at one pressure.
        chain : SerialChain
            Joints and links.
        **changes : float
            Parameters to replace, with ``__`` for the dot (``hysteresis__width=0.5``).
        """
        muscle, provenance = ForceMap(stretch=paper_stretch()), {"muscle.stretch": STRETCHED}
        return cls._of(chain, hysteresis, muscle, provenance, changes)

    @classmethod
    def measured(
        cls, hysteresis: str = "maxwell_slip_length", chain: SerialChain = LINK, **changes: float
    ) -> RedundantManipulator:
        """Return the arm with muscles as measured, its joints limited to the angle that they reach.

        The limit is the largest angle that every joint alone reaches at the nominal co-contraction
        within the regulators' range, against the weight of the straight arm beyond it. A bent arm
        may have to bear more; the torques of a path are checked when an environment is made.
        """
        plant = cls._of(chain, hysteresis, ForceMap(), {"link.limit": REACHED}, changes)
        if "link__limit" in changes:
            return plant
        return plant.replace({"link.limit": plant.reachable_angle()})

    @classmethod
    def _of(
        cls, chain: SerialChain, hysteresis: str, muscle: ForceMap,
        provenance: Mapping[str, tuple[str, str]], changes: Mapping[str, float],
    ) -> RedundantManipulator:  # fmt: skip
        plant = cls(
            **{name: getattr(chain, name) for name in (*LINKS, "gravity")},
            axes="".join(chain.axes),
            joint_damping=(0.0,) * chain.stages,
            hysteresis=joint_hysteresis(hysteresis),
            muscle=muscle,
            provenance=provenance,
        ).changed(changes)
        return dataclasses.replace(plant, joint_damping=plant.even_damping())

    def even_damping(self) -> tuple[float, ...]:
        """Return the damping for a ratio of one half at each joint, the straight arm rigid."""
        pressures = self.pressures_for(0.0)[:2]
        rate = self.lever.rate(0.0)
        viscous = self.muscle.viscosity * float(np.sum(np.array(pressures) * rate**2))
        own = viscous / self.muscle.rest_length + self.link.damping
        inertia = np.diag(self.chain.mass_matrix(np.zeros(self.stages), 0.0))
        stiffness = float(self.stiffness_at(0.0)) + np.maximum(0.0, self._weights_alone(0.0)[1])
        total = 2.0 * DAMPING_RATIO * np.sqrt(stiffness * inertia)
        return tuple(float(round(d, 3)) for d in np.maximum(0.0, total - own))

    # --- chain and ranges -----------------------------------------------------------------------

    @cached_property
    def chain(self) -> SerialChain:
        """Joints and links with the mass factor applied."""
        return self.nominal_chain.heavier(self.arm.mass_factor)

    @cached_property
    def nominal_chain(self) -> SerialChain:
        """Joints and links for a mass factor of 1."""
        x, y, z = self.gravity
        parts = {name: getattr(self, name) for name in LINKS}
        return SerialChain(tuple(self.axes), **parts, gravity=(x, y, z))

    @property
    def stages(self) -> int:
        """Number of joints."""
        return len(self.axes)

    # --- statics --------------------------------------------------------------------------------

    def reachable_angle(self, prestress: float | None = None, payload: float = 0.0) -> float:
        """Return the largest angle [rad] that each joint of a straight arm reaches alone.

        At a co-contraction [N] (default: the nominal one), with a payload [kg] at the tip.
        """
        straight, across = self._weights_alone(payload)
        found = self.link.stop
        for even, odd in zip(straight, across, strict=True):

            def weight(angle: float, even: float = even, odd: float = odd) -> float:
                return max(0.0, even * math.cos(angle) + odd * math.sin(angle))

            found = min(found, self._reach(prestress, weight))
        return found

    def _weights_alone(self, payload: float) -> tuple[Array, Array]:
        """Return weight torques [N m], arm straight, with each joint at 0 or 90 degrees alone."""
        straight = self.chain.gravity_torque(np.zeros(self.stages), payload)
        bent = 0.5 * math.pi * np.eye(self.stages)
        across = [self.chain.gravity_torque(q, payload)[k] for k, q in enumerate(bent)]
        return straight, np.array(across)

    def weight_torque(self, angles: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return the torques [N m] that hold arm and payload [kg] at angles (..., n) [rad]."""
        return self.chain.gravity_torque(angles, payload)

    def stage(self) -> AntagonisticJoint:
        """Return one stage on its own, with its own link."""
        chain = self.chain
        link = Link(
            **{f.name: getattr(self.link, f.name) for f in dataclasses.fields(self.link)},
            length=chain.lengths[-1],
            mass=chain.masses[-1],
            centre=chain.centres[-1],
            gyration=math.sqrt(chain.across[-1] / chain.masses[-1] + chain.centres[-1] ** 2),
        )
        same = {name: getattr(self, name) for name in self.components if name != "arm"}
        same |= {"link": link, "nominal": NominalPoint(prestress=self.prestress)}
        return AntagonisticJoint(**same)

    def rest_angles(self, commands: ArrayLike, prestress: float | None = None) -> Array:
        """Return the angles at rest [rad] of one stage after each of some setpoints [rad], (T,).

        Quasi-static, hysteresis included, from the straight virgin state, without gravity and load.
        """
        return self.stage().rest_angles(commands, prestress)

    # --- rows, files, identity --------------------------------------------------------------------

    def table_values(self) -> list[float]:
        """Return the numbers of the hysteresis operator, the joints' damping and the chain."""
        damping = [*self.joint_damping, *[0.0] * (M.MOST_STAGES - self.stages)]
        return [*self._model.numbers(), *damping, *self.nominal_chain.rows()]


def _numbers(name: str, values: Sequence[float]) -> tuple[float, ...]:
    try:
        return tuple(float(v) for v in values)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} = {values!r}; give a list of numbers") from error
