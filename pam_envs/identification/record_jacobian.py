"""Jacobian of a simulated record by a plant's parameters.

By forward differences, with every perturbed parameter set a lane of one rollout: a minute of
record and twenty parameters take tens of milliseconds.
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

    ``set_points`` (T,) [Pa] are those of a plant at rest at no pressure, one a control period, and
    ``names`` parameters or play weights (:func:`weights`). The outputs, shape (4, T), are those of
    :func:`pam_envs.plants.single_muscle.rollout.simulate_rows`, the derivatives (4, T, n) in SI.
    """
    known = (*R.PARAMETERS, *weights(plant))
    rows = (*range(len(R.PARAMETERS)), *range(R.WEIGHT, R.WEIGHT + plant.elements))
    for name in names:
        if name not in known:
            raise ValueError(f"no parameter named {name!r}; there are: {', '.join(known)}")
    places = [rows[known.index(name)] for name in names]
    steps = _STEP * scales(plant, names)
    columns = np.tile(plant.parameter_rows(), (len(names) + 1, 1))
    columns[np.arange(1, len(names) + 1), places] += steps
    outputs = simulate_rows(plant, columns, set_points)
    derivatives = (outputs[:, :, 1:] - outputs[:, :, :1]) / steps
    return outputs[:, :, 0], derivatives
