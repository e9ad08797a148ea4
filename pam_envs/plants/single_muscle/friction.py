"""Friction driven by length as a hysteresis from pressure to effective pressure, at one load.

At rest under a constant load the friction elements act like a pressure that is missing: the
effective pressure is the one at which the law without friction has the same contraction. So that
controllers, figures and linear models that invert a hysteresis of the pressure serve both drives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.protocol import HysteresisModel
from pam_envs.hysteresis.slip import SlipModel, slip_lag
from pam_envs.kernels.build import entry, kernel
from pam_envs.muscle.effective_area import EffectiveAreaMuscle, law_and_slope
from pam_envs.muscle.effects import MAP, map_force, map_slopes

if TYPE_CHECKING:
    from pam_envs.plants.single_muscle.plant import SingleMuscle


LOWEST, HIGHEST = -0.3, 0.6
"""Strains between which a rest is looked for."""
MOST_STEPS = 80
"""Of the search for a rest; Newton's steps converge in about six."""
REPEATS, CLOSE = 12, 1e-8
"""Fixed-point steps for the limit's dependence on pressure, each gains about two digits, and the
change [Pa] after which they end."""
NO_ELEMENTS = (np.zeros(0), np.zeros((0, 2)), 0.0, 1.0)
"""Elements of a muscle without friction, as :attr:`SlipModel.arrays` gives them."""


@kernel
def strain_of_rest(
    drive: float, pull: float, stiffer: float, law: Any, friction: float, limit: float,
    thresholds: Any, curves: Any, low: float, per: float, sliders: Any,
) -> float:  # fmt: skip
    """Return the strain at which the force falls to ``pull`` [N], with friction on the way there.

    ``law`` has the parameters of :func:`law_numbers`; ``stiffer`` is a factor on its passive force.
    Newton's method, and bisection where a step leaves the bracket or is not half of the last.
    """
    below, above, e, last = LOWEST, HIGHEST, 0.05, 1.0
    for _ in range(MOST_STEPS):
        force, slope = law_and_slope(
            drive, drive, e, stiffer, law[0, 0], law[1, 0], law[2, 0], law[3, 0], law[4, 0],
            law[5, 0], law[6, 0], law[7, 0], law[8, 0],
        )  # fmt: skip
        steeper, _ = map_slopes(law, 0, 9, drive, e)
        force, slope = force + map_force(law, 0, 9, drive, e), slope + steeper
        lag, stick = slip_lag(e, limit, thresholds, curves, low, per, sliders)
        excess = force - friction * lag - pull
        if excess > 0.0:
            below = e
        else:
            above = e
        steep = slope + friction * stick
        moved = e + excess / steep if steep > 0.0 else LOWEST
        if not below < moved < above or abs(moved - e) > 0.5 * last:
            moved = 0.5 * (below + above)
        last = abs(moved - e)
        e = moved
        if last < 1e-15:
            break
    return e


@entry
def rest_rows(
    drive: Array, pull: Array, stiffer: Array, law: Array, friction: float, limit: Array,
    thresholds: Array, curves: Array, low: float, per: float, sliders: Array, strain: Array,
) -> None:  # fmt: skip
    """Write the strains of rest of rows (:func:`strain_of_rest`)."""
    for r in range(len(drive)):
        strain[r] = strain_of_rest(
            drive[r], pull[r], stiffer[r], law, friction, limit[r], thresholds, curves, low, per,
            sliders[r],
        )  # fmt: skip


def law_numbers(law: EffectiveAreaMuscle) -> Array:
    """Return the parameters of the static law as :func:`strain_of_rest` reads them, a column."""
    return np.array(
        [
            *(law.area, law.area_taper, law.braid_force, law.braid_strain, law.stiffness),
            *(law.hardening, law.area_curve, law.softening, law.stiffening),
            *(getattr(law, name) for name in MAP._fields),
        ]
    )[:, None]


def strains_of_rest(
    law: EffectiveAreaMuscle,
    drive: ArrayLike,
    pull: ArrayLike,
    stiffer: ArrayLike = 1.0,
    friction: float = 0.0,
    limit: ArrayLike = 1.0,
    elements: tuple[Array, Array, float, float] = NO_ELEMENTS,
    sliders: ArrayLike = (),
) -> Array:
    """Return the strains at rest under effective pressures [Pa] and pulls [N], shape (...).

    Parameters
    ----------
    law : EffectiveAreaMuscle
        Static law.
    drive, pull, stiffer, limit : array_like, shape (...)
        Effective pressure [Pa]; force that the muscle carries [N]; factor on the passive force;
        factor on the thresholds.
    friction : float
        Stiffness of all elements over strain [N].
    elements : tuple
        :attr:`SlipModel.arrays`.
    sliders : array_like, shape (..., n)
        Positions of the sliders before [strain].
    """
    held, given = (
        np.asarray(sliders, float),
        [np.asarray(v, float) for v in (drive, pull, stiffer, limit)],
    )
    shape = np.broadcast_shapes(*(v.shape for v in given), held.shape[:-1])
    size, n = math.prod(shape), len(elements[0])
    w, f, s, most = (np.array(np.broadcast_to(v, shape)).reshape(size) for v in given)
    before = np.ascontiguousarray(np.broadcast_to(held, (*shape, n))).reshape(size, n)
    strain = np.empty(size)
    rest_rows(w, f, s, law_numbers(law), friction, most, *elements, before, strain)
    return strain.reshape(shape)


@dataclass(frozen=True)
class LoadedFriction(HysteresisModel):
    """Friction of a muscle at rest under a load [kg]: pressures in, effective pressures out [Pa].

    The state holds the sliders' strains, shape (..., n).
    """

    plant: SingleMuscle
    load: float

    @cached_property
    def _model(self) -> SlipModel:
        model = self.plant.hysteresis.operator
        assert isinstance(model, SlipModel)
        return model

    def _friction(self, strain: Array, pressure: Array, state: ArrayLike) -> tuple[Array, Array]:
        """Return the friction [N] and the state after motion straight to a strain."""
        held = self.plant.hysteresis
        lag, after = self._model.lag(strain, state, held.limit(pressure, self.load))
        return held.friction * lag, after

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Array:
        """Return the sliders at the strain of rest without pressure, free of force."""
        rest = strains_of_rest(self.plant.muscle, 0.0, self.load * GRAVITY)
        return np.full((*batch_shape, self._model.elements), float(rest))

    def step(self, x: ArrayLike, state: Any) -> tuple[Array, Array]:
        """Return the effective pressures at pressures, shape (...), and the state after."""
        p, held, weight = np.asarray(x, float), self.plant.hysteresis, self.load * GRAVITY
        strain = strains_of_rest(
            self.plant.muscle, p, weight, friction=held.friction, limit=held.limit(p, self.load),
            elements=self._model.arrays, sliders=state,
        )  # fmt: skip
        return self.plant.muscle.drive(weight, strain), self._friction(strain, p, state)[1]

    def inverse_step(self, y: ArrayLike, state: Any) -> tuple[Array, Array]:
        """Return the pressures that give effective pressures, and the state after."""
        drive, muscle = np.asarray(y, float), self.plant.muscle
        shape = np.broadcast_shapes(drive.shape, np.shape(state)[:-1])
        strain = np.broadcast_to(strains_of_rest(muscle, drive, self.load * GRAVITY), shape)
        area = muscle.area_at(strain)
        pressure, after = np.broadcast_to(drive, shape), np.asarray(state, float)
        for _ in range(REPEATS):
            friction, after = self._friction(strain, pressure, state)
            was, pressure = pressure, drive + friction / area
            if np.all(abs(pressure - was) < CLOSE):
                break
        return np.asarray(pressure), after
