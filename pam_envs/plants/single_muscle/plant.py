"""A muscle that lifts a load: Festo MAS-10-N-100 of positioning2021.

    setpoint -> regulator -> pressure -> static law and friction -> hanging mass

The length drives the friction; in the papers' form a hysteresis of the pressure, before the static
law, takes its place.
The measured quantity is the contraction from the rest length under the load that hangs at the
start, as in the paper's tables. Effects (off unless set) of all components; the parameters with a
neutral value in ``SingleMuscle.neutral`` switch them on.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.protocol import HysteresisModel, Usage, model_of, operator_of, preset
from pam_envs.hysteresis.slip import SlipModel
from pam_envs.mechanics.hanging_mass import HangingMass
from pam_envs.muscle.effective_area import EffectiveAreaMuscle
from pam_envs.plants.core.passivity import ImposedMuscles
from pam_envs.plants.core.plant import Plant
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.friction import LoadedFriction, strains_of_rest
from pam_envs.plants.single_muscle.hysteresis import Hysteresis, HysteresisInverse
from pam_envs.pneumatics.regulator import Regulator
from pam_envs.sensing.sensor import PositionSensor, PressureSensor

CREEP = (
    *(f"{part}.creep_{k}" for part in ("hysteresis", "muscle") for k in (1, 2, 3, 4)),
    *(f"hysteresis.creep_time_{k}" for k in (1, 2, 3, 4)),
)
"""Creep of pressure and length has the same time constants."""

LEVELS = 49
"""Levels of a map that resembles the identified hysteresis."""
FOLDER = Path(__file__).resolve().parents[2] / "data"


@dataclass(frozen=True)
class SingleMuscle(Plant, rows=R):
    """The plant; an extended one is ``dataclasses.replace`` of it.

    Attributes
    ----------
    regulator, hysteresis, muscle, mass, position, pressure
        Its components, in the order of the signal.
    """

    family: ClassVar[str] = "single_muscle"
    shared_effects: ClassVar[tuple[tuple[str, ...], ...]] = (CREEP,)

    regulator: Regulator = field(default_factory=Regulator)
    hysteresis: Hysteresis = field(default_factory=Hysteresis)
    muscle: EffectiveAreaMuscle = field(default_factory=EffectiveAreaMuscle)
    mass: HangingMass = field(default_factory=HangingMass)
    position: PositionSensor = field(default_factory=PositionSensor)
    pressure: PressureSensor = field(default_factory=PressureSensor)

    def _usage(self) -> Usage:
        return Usage("a muscle", "virgin", self.regulator.max_pressure)

    def _check(self) -> None:
        """Refuse settings without effect, and a motion that the sub-steps cannot follow."""
        self.hysteresis.check_drive()
        m, law = self.mass, self.muscle
        strains = np.linspace(-0.02, 0.2, 45)
        slope = (
            law.area * law.area_taper * self.regulator.max_pressure
            + law.braid_force / law.braid_strain * np.exp(-strains / law.braid_strain)
            + law.stiffness
            + 3.0 * law.hardening * strains**2
        )
        k = float(slope.max()) / law.rest_length
        k += self.air_stiffness(law.volume_at(strains), law.area_at(strains))
        self.check_phase(
            k / m.moving_mass,
            m.damping / m.moving_mass,
            f"moving_mass = {m.moving_mass:g} kg with damping = {m.damping:g} N s/m and a "
            f"stiffness of {k:.0f} N/m",
        )

    @classmethod
    def mas10(cls, hysteresis: str = "maxwell_slip_length", **changes: float) -> SingleMuscle:
        """Return the muscle identified on the measured tables, with that hysteresis.

        Parameters
        ----------
        hysteresis : {"maxwell_slip_length", "preisach_length", "none"}
            Kind of the hysteresis: driven by length as here, and so passive, or
            ``"maxwell_slip"`` and ``"preisach"``, driven by pressure. Each was identified on the
            same data.
        **changes : float
            Parameters to replace, with ``__`` for the dot (``mass__load=4.55``).
        """
        kind = model_of(hysteresis).kind
        if (FOLDER / f"mas10_{kind}.yaml").exists():
            plant = cls.from_yaml(FOLDER / f"mas10_{kind}.yaml")
        else:
            plant = cls.from_yaml(FOLDER / f"mas10_{PlayOperator.kind}.yaml")
            full = plant.regulator.max_pressure
            made = preset(kind, plant._model, -full, full, LEVELS, "virgin")
            plant = plant.replace({"hysteresis.operator": made})
        return plant.changed(changes)

    # --- the static law and its inverse -----------------------------------------------------

    def contraction_at(self, drive: ArrayLike, load: ArrayLike) -> NDArray[np.float64]:
        """Return the contraction [m] at rest under an effective pressure [Pa] and a load [kg].

        Counted from the rest length under that load, as it is measured.
        """
        drive, load = np.broadcast_arrays(np.asarray(drive, float), np.asarray(load, float))
        return np.asarray(self._absolute(drive, load) - self._absolute(np.zeros_like(drive), load))

    def _absolute(self, drive: NDArray[Any], load: NDArray[Any]) -> NDArray[np.float64]:
        weight, stiffer, shift = self._carried(load)
        strain = strains_of_rest(self.muscle, drive - shift, weight, stiffer)
        return strain * self.muscle.rest_length

    def _carried(self, load: NDArray[Any]) -> tuple[Any, Any, Any]:
        """Return the weight [N], the factor on the stiffness and the pressure shift [Pa]."""
        weight = (load + self.mass.load_error * (load > 0.0)) * GRAVITY
        law = self.muscle
        stiffer = (
            1.0
            + (law.load_stiffening + law.load_stiffening_2 * weight) * weight
            + law.load_stiffening_root * np.sqrt(np.maximum(weight, 0.0))
        )
        return weight, stiffer, self.muscle.load_curve * weight * weight

    def drive_for(self, contraction: ArrayLike, load: ArrayLike) -> NDArray[np.float64]:
        """Return the effective pressure [Pa] that holds a contraction [m] under a load [kg].

        The exact inverse of :meth:`contraction_at`; not held within the regulator's range.
        """
        contraction, load = np.broadcast_arrays(
            np.asarray(contraction, float), np.asarray(load, float)
        )
        strain = (contraction + self._absolute(np.zeros(load.shape), load)) / (
            self.muscle.rest_length
        )
        weight, stiffer, shift = self._carried(load)
        pull = weight + (stiffer - 1.0) * self.muscle.passive(strain)
        return self.muscle.drive(pull, strain) + shift

    def operator_at(self, load: float) -> HysteresisModel | None:
        """Return the hysteresis at a load [kg], from (stretched) pressure to effective pressure.

        ``None`` without hysteresis. Friction driven by length is seen at rest
        (:class:`~pam_envs.plants.single_muscle.friction.LoadedFriction`).
        """
        if self.hysteresis.drive == "length":
            return LoadedFriction(self, load)
        return self.hysteresis.at_load(load)

    def hysteresis_inverse(self, load: float) -> HysteresisInverse:
        """Return the exact inverse of the hysteresis at a load [kg]."""
        full = self.regulator.max_pressure
        return HysteresisInverse(self.hysteresis, self.operator_at(load), full)

    def imposed_muscles(self, cycles: int) -> ImposedMuscles:
        """Return the muscle under an imposed pressure and contraction [m], with the plant's load.

        Friction driven by length begins free of force at contraction 0.
        """
        held, length, full = self.hysteresis, self.muscle.rest_length, self.regulator.max_pressure
        model, load = held.model, self.mass.load
        operator = model if isinstance(model, SlipModel) else operator_of(held.at_load(load))

        def force(p: NDArray[Any], x: NDArray[Any], state: Any) -> tuple[NDArray[Any], Any]:
            if isinstance(operator, SlipModel):
                lag, after = operator.lag(x / length, state, held.limit(p[0], load))
                return self.muscle.tension(p[0], x / length) - held.friction * lag, after
            felt, after = operator.step(held.stretched(p[0], full), state)
            return self.muscle.tension(held.unstretched(felt, full), x / length), after

        def law(p: NDArray[Any], x: NDArray[Any]) -> NDArray[Any]:
            return self.muscle.tension(p[0], x / length)

        return ImposedMuscles(force, law, operator.initial_state((cycles,)))

    # --- rows, files, identity ----------------------------------------------------------------

    def table_values(self) -> list[float]:
        """Return the numbers of the hysteresis operator."""
        return self._model.numbers(self.regulator.max_pressure)
