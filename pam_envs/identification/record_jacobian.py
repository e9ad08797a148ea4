"""Jacobian of a simulated record by a plant's parameters.

By forward differences, with every perturbed parameter set a lane of one rollout: a minute of
record and twenty parameters take tens of milliseconds, where automatic differentiation of the same
simulation takes many times longer. The fits of the diagnosis
(:mod:`pam_envs.diagnosis.fit.least_squares`) work the same way.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.parameters import declarations
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate_rows

Array = NDArray[np.float64]

_NOT_FREE = ("regulator.max_pressure", "muscle.diameter", "muscle.braid_angle", "mass.load")
FREE = tuple(
    name
    for name in R.PARAMETERS
    if name not in _NOT_FREE and not name.startswith(("position.", "pressure."))
)
"""Parameters that a record of the motion depends on."""
_STEP = 1e-4
"""Perturbation, as a part of a parameter's scale: far above rounding, far below curvature."""


def weights(plant: SingleMuscle) -> tuple[str, ...]:
    """Return the names of a plant's play weights, for :func:`jacobian`."""
    return tuple(f"hysteresis.weight[{k}]" for k in range(plant.elements))


def _place(plant: SingleMuscle, name: str) -> int:
    """Return the row of a parameter in the column that the kernels read."""
    if name in R.PARAMETERS:
        return R.PARAMETERS.index(name)
    if name in weights(plant):
        return R.WEIGHT + weights(plant).index(name)
    known = ", ".join((*R.PARAMETERS, *weights(plant)))
    raise ValueError(f"no parameter named {name!r}; there are: {known}")


def scales(plant: SingleMuscle, names: Sequence[str]) -> Array:
    """Return the size of a meaningful change of each parameter."""
    sizes = []
    for name in names:
        if name in weights(plant):
            sizes.append(0.1)
            continue
        component, _, field = name.partition(".")
        declared = declarations(getattr(plant, component))[field]
        value = abs(plant.value(name))
        sizes.append(value if value > 0.0 else 0.01 * (declared.high - declared.low))
    return np.array(sizes)


def jacobian(
    plant: SingleMuscle, set_points: ArrayLike, names: Sequence[str] = FREE
) -> tuple[Array, Array]:
    """Return the outputs of a plant over a record and their derivatives by parameters.

    Parameters
    ----------
    plant : SingleMuscle
        Starts at rest at no pressure.
    set_points : array_like, shape (T,)
        Set-points [Pa], one a control period.
    names : sequence of str
        Parameters, play weights (:func:`weights`) among them.

    Returns
    -------
    outputs : array, shape (4, T)
        As :func:`pam_envs.plants.single_muscle.rollout.simulate_rows`.
    derivatives : array, shape (4, T, n)
        In SI units of output per SI unit of parameter.
    """
    places = [_place(plant, name) for name in names]
    steps = _STEP * scales(plant, names)
    columns = np.tile(plant.parameter_rows(), (len(names) + 1, 1))
    columns[np.arange(1, len(names) + 1), places] += steps
    outputs = simulate_rows(plant, columns, set_points)
    derivatives = (outputs[:, :, 1:] - outputs[:, :, :1]) / steps
    return outputs[:, :, 0], derivatives
