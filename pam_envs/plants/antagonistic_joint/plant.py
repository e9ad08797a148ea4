"""One stage of fluidic_muscles: a joint between two antagonistic pneumatic muscles.

    (angle, co-contraction) -> feed-forward -> set-points -> regulators -> pressures
    F = F(p, e) - friction(e)          of each muscle, 0 where it would push
    J phi'' + D phi' = -F_A dL_A/dphi - F_B dL_B/dphi - m g c sin(phi) + disturbance

Without hysteresis, gravity and load the feed-forward makes the angle at rest the commanded one; the
regulators' lag and the damped stiffness of the muscles are then two real poles near 23 rad/s. The
paper's reduced plant, a Preisach operator and two poles, is the make ``dynamics="reduced"``.

Effects (off unless set): of both regulators, static gain, dead time, dead band, spool overlap,
rounded slew limit, slow and choked exhaust, leak, limited and drooping supply, resonance of the
line; of both muscles, creep, first cycles and temperature; stick-slip of the bearing; delay,
drift, ramp, bow and slip of both kinds of sensor. In the reduced plant only pressures and sensors
have them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.protocol import Usage
from pam_envs.kernels.motion import LARGEST_PHASE
from pam_envs.mechanics.antagonistic_lever import AntagonisticLever
from pam_envs.muscle.force_map import FULL_PRESSURE, ForceMap, paper_stretch
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint import statics as pair_statics
from pam_envs.plants.antagonistic_joint.hysteresis import JointHysteresis, joint_hysteresis
from pam_envs.plants.antagonistic_joint.link import Link, NominalPoint
from pam_envs.plants.core.plant import Plant, effects_of, neutral_of
from pam_envs.pneumatics.regulator import JointRegulator
from pam_envs.sensing.orthosis import GaugeSensor
from pam_envs.sensing.sensor import JointEncoder

Dynamics = Literal["muscles", "reduced"]
Array = NDArray[np.float64]

STRETCHED = (
    "assumed",
    "contraction axis of the measured map stretched: the force at 6.5 bar ends at 25 %, which "
    "+-30 degrees take with this lever",
)
REACHED = ("derived", "largest angle that 6.5 bar reach at the nominal co-contraction")
PRESTRESS_RANGE = (20.0, 120.0)
"""Co-contractions [N] that the preset takes: more and the buckling lever leaves no stiffness."""


PARTS: dict[str, type] = {
    "regulator": JointRegulator,
    "hysteresis": JointHysteresis,
    "muscle": ForceMap,
    "lever": AntagonisticLever,
    "link": Link,
    "nominal": NominalPoint,
    "angle": JointEncoder,
    "pressure": GaugeSensor,
}


@dataclass(frozen=True)
class AntagonisticJoint(Plant):
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
    components: ClassVar[tuple[str, ...]] = tuple(PARTS)
    names: ClassVar[tuple[str, ...]] = K.NAMES
    choices: ClassVar[tuple[str, ...]] = ("dynamics",)
    effects: ClassVar[tuple[tuple[str, ...], ...]] = effects_of(PARTS)
    neutral: ClassVar[Mapping[str, float]] = neutral_of(PARTS, K.EFFECTS)
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

    def __post_init__(self) -> None:
        """Check every parameter, and that the motion can be followed."""
        if self.dynamics not in ("muscles", "reduced"):
            raise ValueError(f"dynamics = {self.dynamics!r}; choose one of muscles, reduced")
        self.check_components()
        self._model.check(Usage("a joint", "virgin"))
        pair_statics.check_angles(self, self.link)
        self._check_motion()

    def _check_motion(self) -> None:
        """Refuse a motion that the sub-steps cannot follow (see ``kernels.motion``)."""
        h, link = self.control_period / self.substeps, self.link
        full = float(np.max(pair_statics.stiffness(self, link.stop, *2 * (FULL_PRESSURE,))))
        k = (full + link.stop_stiffness) / link.inertia
        phase = max(k, (0.5 * link.damping / link.inertia) ** 2) * h * h
        if phase > LARGEST_PHASE:
            raise ValueError(
                f"link.inertia = {link.inertia:g} kg m2 with link.damping = {link.damping:g} "
                f"N m s/rad moves too fast for {self.substeps} sub-steps: phase {phase:.1f} "
                f"against at most {LARGEST_PHASE:g}; use more sub-steps or a larger inertia"
            )

    # --- presets --------------------------------------------------------------------------------

    @classmethod
    def paper(cls, hysteresis: str = "maxwell_slip", **changes: float) -> AntagonisticJoint:
        """Return the joint whose muscles end at 25 % contraction, as fluidic_muscles has it.

        Parameters
        ----------
        hysteresis : {"maxwell_slip", "preisach", "none"}
            Which hysteresis; both operators have the same loops.
        **changes : float
            Parameters to replace, with ``__`` for the dot (``hysteresis__width=0.5``).
        """
        plant = cls(
            hysteresis=joint_hysteresis(hysteresis),
            muscle=ForceMap(stretch=paper_stretch()),
            provenance={"muscle.stretch": STRETCHED},
        )
        return plant._changed(changes)

    @classmethod
    def measured(cls, hysteresis: str = "maxwell_slip", **changes: float) -> AntagonisticJoint:
        """Return the joint with muscles as measured; what it reaches is its limit.

        The limit is the angle that full pressure reaches at the nominal co-contraction, against
        the link's weight; other parameters are those of :meth:`paper`.
        """
        plant = cls(hysteresis=joint_hysteresis(hysteresis), provenance={"link.limit": REACHED})
        plant = plant._changed(changes)
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
        return plant._changed(changes)

    def _changed(self, changes: Mapping[str, float]) -> AntagonisticJoint:
        return self.replace({k.replace("__", "."): v for k, v in changes.items()})

    def without_noise(self) -> AntagonisticJoint:
        """Return the plant with sensors that show the truth."""
        sensors = ("angle", "pressure")
        return self.replace(
            {f"{s}.{what}": 0.0 for s in sensors for what in ("noise", "resolution")}
        )

    # --- ranges ---------------------------------------------------------------------------------

    @property
    def angle_range(self) -> tuple[float, float]:
        """Lowest and highest set-point [rad]."""
        return -self.link.limit, self.link.limit

    @property
    def largest_angle(self) -> float:
        """Angle of the mechanical stop [rad]."""
        return self.link.stop

    @property
    def prestress(self) -> float:
        """Usual co-contraction [N]."""
        return self.nominal.prestress

    @property
    def prestress_range(self) -> tuple[float, float]:
        """Lowest and highest co-contraction [N] that is a set-point."""
        return PRESTRESS_RANGE

    # --- statics --------------------------------------------------------------------------------

    def forces_for(
        self, angle: ArrayLike, prestress: ArrayLike, torque: ArrayLike = 0.0
    ) -> tuple[Array, Array]:
        """Return the forces [N] of both muscles whose mean is ``prestress`` [N].

        ``torque`` [N m] is what they exert together, at an angle [rad].
        """
        return pair_statics.forces_for(self, angle, prestress, torque)

    def pressures_for(
        self, angle: ArrayLike, prestress: ArrayLike | None = None, torque: ArrayLike = 0.0
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return both pressures [Pa] for an angle [rad], co-contraction [N] and torque [N m].

        The exact inverse of the static law, without hysteresis. Where a muscle would need more than
        full pressure the co-contraction gives way; the last value says where even without any the
        angle is out of reach.
        """
        stress = self.prestress if prestress is None else prestress
        return pair_statics.pressures_for(self, angle, stress, torque)

    def torque(self, angle: ArrayLike, pressure_a: ArrayLike, pressure_b: ArrayLike) -> Array:
        """Return the torque [N m] at an angle [rad] and pressures [Pa], without hysteresis."""
        return pair_statics.pull(self, angle, pressure_a, pressure_b)

    def stiffness_at(self, angle: ArrayLike, prestress: ArrayLike | None = None) -> Array:
        """Return the stiffness [N m/rad] at rest, pressures held, without hysteresis."""
        pressures = self.pressures_for(angle, prestress)[:2]
        return pair_statics.stiffness(self, angle, *pressures)

    def reachable_angle(
        self, prestress: float | None = None, torque: float = 0.0, payload: float = 0.0
    ) -> float:
        """Return the largest angle [rad] up to the stop that the regulators' range reaches.

        The co-contraction is held, and so are the weights of link and payload.

        Parameters
        ----------
        prestress : float, optional
            Co-contraction [N]; default: the nominal one.
        torque : float
            Against which the muscles hold it beside the weights [N m].
        payload : float
            Mass at the link's end [kg].
        """
        stress = self.prestress if prestress is None else prestress

        def load(angle: float) -> float:
            return torque + float(self.weight_torque(angle, payload))

        return pair_statics.reachable_angle(self, self.link.stop, stress, load)

    def weight_torque(self, angle: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return the torque [N m] that holds link and payload [kg] at an angle [rad]."""
        moment = self.link.mass * self.link.centre + np.asarray(payload) * self.link.length
        return np.asarray(self.link.gravity * moment * np.sin(angle))

    def torque_range(self, angles: ArrayLike, by_pressure: bool = False) -> tuple[Array, Array]:
        """Return the least and the largest torque [N m] at angles [rad].

        Set-points of angles end at their limit, and so does what they exert; pressures do not.
        """
        if self.dynamics == "reduced":
            low, high = (
                self.nominal.stiffness * (end - np.asarray(angles)) for end in self.angle_range
            )
            return low, high
        limit = None if by_pressure else self.link.limit
        return pair_statics.torque_range(self, angles, limit, self.prestress)

    def gravity_shift(self, angles: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return what to add to set-points [rad] so that gravity is borne, shape (..., 1).

        ``angles`` (..., 1) [rad] are those at which link and payload [kg] shall rest.
        """
        phi = np.asarray(angles, float)
        weight = self.weight_torque(phi, np.asarray(payload)[..., None])
        held = np.clip(phi, *self.angle_range)
        return pair_statics.shift_for(self, held, self.prestress, weight, self.link.limit)

    # --- rows, files, identity --------------------------------------------------------------------

    def parameter_rows(self) -> Array:
        """Return the parameters as the column that the kernels read, shape (n_parameters,)."""
        named = [self.value(name) for name in K.NAMES]
        return np.array(named + self._model.numbers())

    def rest_angles(self, commands: ArrayLike, prestress: float | None = None) -> Array:
        """Return where the joint rests [rad] after each of a series of set-points [rad], (T,).

        Quasi-static, hysteresis included, from the straight virgin state, without gravity and load.
        """
        from pam_envs.plants.antagonistic_joint.rollout import rest_angles

        return rest_angles(self, commands, prestress)
