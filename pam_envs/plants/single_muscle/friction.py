"""Friction driven by length as a hysteresis from pressure to effective pressure, at one load.

At rest under a constant load the friction elements act like a pressure that is missing: the
effective pressure is the one at which the law without friction has the same contraction. So that
controllers, figures and linear models that invert a hysteresis of the pressure serve both drives.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.hysteresis.protocol import HysteresisModel, Rows, RowsState
from pam_envs.hysteresis.slip import SlipModel, flat_rows, slip_lag, slip_to
from pam_envs.kernels.build import entry, kernel
from pam_envs.muscle.effective_area import (
    CLOSE,
    LEAST_GAIN,
    NEWTON_STEPS,
    EffectiveAreaMuscle,
    law_and_slope,
)
from pam_envs.muscle.effects import MAP, map_force, map_slopes

if TYPE_CHECKING:
    from pam_envs.plants.single_muscle.plant import SingleMuscle


LOWEST, HIGHEST = -0.3, 0.6
"""Strains between which a rest is looked for."""
MOST_STEPS = 80
"""Of the search for a rest; Newton's steps converge in about six."""
REPEATS, SETTLED = 12, 1e-8
"""Fixed-point steps for the limit's dependence on pressure, each gains about two digits, and the
change [Pa] after which they end."""
NO_ELEMENTS = (np.zeros(0), np.zeros((0, 2)), 0.0, 1.0)
"""Elements of a muscle without friction, as :attr:`SlipModel.arrays` gives them."""


@kernel
def law_of(drive: float, strain: float, stiffer: float, law: Any) -> tuple[float, float]:
    """Return the force [N] of the law without its map, and minus its derivative by strain [N].

    ``law`` has the parameters of :func:`law_numbers`; ``stiffer`` is a factor on its passive force.
    """
    return law_and_slope(
        drive, drive, strain, stiffer, law[0, 0], law[1, 0], law[2, 0], law[3, 0], law[4, 0],
        law[5, 0], law[6, 0], law[7, 0], law[8, 0],
    )  # fmt: skip


@kernel
def area_of(strain: float, law: Any) -> float:
    """Return the effective area [m2] at a strain."""
    return law[0, 0] * (1.0 - law[1, 0] * strain - law[6, 0] * strain * strain)  # type: ignore[no-any-return]


@kernel
def drive_of(pull: float, strain: float, law: Any) -> float:
    """Return the effective pressure [Pa] that gives a force [N] at a strain.

    The same as :meth:`EffectiveAreaMuscle.drive`.
    """
    area, missing = area_of(strain, law), pull - law_of(0.0, strain, 1.0, law)[0]
    drive = missing / area
    for _ in range(NEWTON_STEPS):
        excess = area * drive + map_force(law, 0, 9, drive, strain) - missing
        gain = map_slopes(law, 0, 9, drive, strain)[1]
        step = excess / max(area + gain, LEAST_GAIN * area)
        drive = drive - step
        if abs(step) < CLOSE:
            break
    return drive


@kernel
def strain_of_rest(
    drive: float, pull: float, stiffer: float, law: Any, friction: float, limit: float,
    thresholds: Any, curves: Any, low: float, per: float, sliders: Any,
) -> float:  # fmt: skip
    """Return the strain at which the force falls to ``pull`` [N], with friction on the way there.

    Newton's method, and bisection where a step leaves the bracket or is not half of the last.
    """
    below, above, e, last = LOWEST, HIGHEST, 0.05, 1.0
    for _ in range(MOST_STEPS):
        force, slope = law_of(drive, e, stiffer, law)
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


@kernel
def limit_of(pressure: float, free: float, grows: float) -> float:
    """Return the factor on the slip forces at a pressure [Pa]; ``free`` is that at none."""
    return max(0.0, free + grows * pressure)


@entry
def felt_rows(
    pressure: Array, pull: float, law: Array, friction: float, free: float, grows: float,
    thresholds: Array, curves: Array, low: float, per: float, before: Array, drive: Array,
    after: Array,
) -> None:  # fmt: skip
    """Write effective pressures [Pa] at pressures [Pa], and the sliders after ``before``."""
    for r in range(len(pressure)):
        limit = limit_of(pressure[r], free, grows)
        strain = strain_of_rest(
            pressure[r], pull, 1.0, law, friction, limit, thresholds, curves, low, per, before[r]
        )
        drive[r] = drive_of(pull, strain, law)
        slip_to(strain, limit, thresholds, before[r], after[r])


@entry
def slide_rows(
    pressure: Array, pull: float, law: Array, friction: float, free: float, grows: float,
    thresholds: Array, curves: Array, low: float, per: float, sliders: Array,
) -> None:  # fmt: skip
    """Move the sliders, (rows, n), through pressures [Pa], shape (n_steps, rows)."""
    for r in range(len(sliders)):
        for k in range(len(pressure)):
            p, limit = pressure[k, r], limit_of(pressure[k, r], free, grows)
            strain = strain_of_rest(
                p, pull, 1.0, law, friction, limit, thresholds, curves, low, per, sliders[r]
            )
            slip_to(strain, limit, thresholds, sliders[r], sliders[r])


@kernel
def pressure_needed(
    drive: float, strain: float, law: Any, friction: float, free: float, grows: float,
    thresholds: Any, curves: Any, low: float, per: float, sliders: Any,
) -> tuple[float, float]:  # fmt: skip
    """Return the pressure [Pa] that gives an effective one at a strain, and the limit there.

    ``free`` and ``grows`` are those of :func:`limit_of`.
    """
    area, p, limit = area_of(strain, law), drive, 1.0
    for _ in range(REPEATS):
        was, limit = p, limit_of(p, free, grows)
        lag, _ = slip_lag(strain, limit, thresholds, curves, low, per, sliders)
        p = drive + friction * lag / area
        if abs(p - was) < SETTLED:
            break
    return p, limit


@entry
def needed_rows(
    drive: Array, pull: float, law: Array, friction: float, free: float, grows: float,
    thresholds: Array, curves: Array, low: float, per: float, before: Array, pressure: Array,
    after: Array,
) -> None:  # fmt: skip
    """Write the pressures [Pa] that give effective ones, and the sliders after ``before``."""
    for r in range(len(drive)):
        strain = strain_of_rest(
            drive[r], pull, 1.0, law, 0.0, 1.0, thresholds[:0], curves, low, per, before[r]
        )
        pressure[r], limit = pressure_needed(
            drive[r], strain, law, friction, free, grows, thresholds, curves, low, per, before[r]
        )
        slip_to(strain, limit, thresholds, before[r], after[r])


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
    n = len(elements[0])
    held = np.asarray(sliders, float)
    shape, (w, f, s, most), before = flat_rows((drive, pull, stiffer, limit), held, n)
    strain = np.empty(len(w))
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

    @cached_property
    def _numbers(self) -> tuple[float, Array, float, float, float, Array, Array, float, float]:
        """Arguments of the loops over rows between the inputs and the sliders."""
        held, law = self.plant.hysteresis, law_numbers(self.plant.muscle)
        free = 1.0 + held.limit_per_load * self.load
        slips = (held.friction, free, held.limit_per_pressure)
        return (self.load * GRAVITY, law, *slips, *self._model.arrays)

    def _by_row(self, solve: Any, x: ArrayLike, state: ArrayLike) -> tuple[Array, Array]:
        """Return the outputs of a loop over rows, and the states after it."""
        shape, (given,), before = flat_rows((x,), state, self._model.elements)
        found, after = np.empty_like(given), np.empty_like(before)
        solve(given, *self._numbers, before, found, after)
        return found.reshape(shape), after.reshape(*shape, self._model.elements)

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> Array:
        """Return the sliders at the strain of rest without pressure, free of force."""
        rest = strains_of_rest(self.plant.muscle, 0.0, self.load * GRAVITY)
        return np.full((*batch_shape, self._model.elements), float(rest))

    def step(self, x: ArrayLike, state: Any) -> tuple[Array, Array]:
        """Return the effective pressures at pressures, shape (...), and the state after."""
        return self._by_row(felt_rows, x, state)

    def inverse_step(self, y: ArrayLike, state: Any) -> tuple[Array, Array]:
        """Return the pressures that give effective pressures, and the state after."""
        return self._by_row(needed_rows, y, state)

    def along(self, x: ArrayLike, state: ArrayLike) -> Array:
        """Return the state, (n_rows, n), after pressures in turn, shape (n_steps, n_rows)."""
        after = np.array(state, float, order="C")
        slide_rows(np.array(x, float, order="C"), *self._numbers, after)
        return after

    def rows(self) -> FrictionRows:
        """Return the friction over rows of environments."""
        return FrictionRows(self)


class FrictionRows(Rows):
    """Friction over rows of environments."""

    operator: LoadedFriction

    def along(self, x: Array, state: RowsState) -> RowsState:
        """Return the states after inputs in turn, in one loop."""
        return (self.operator.along(x, state[0]),)
