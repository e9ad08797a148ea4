"""Fitting a plant to a record in time: simulation error, never one-step error.

The Jacobian is by differences, with every perturbed parameter set a lane of one rollout: a minute
of record and twenty parameters take tens of milliseconds, where automatic differentiation of the
same simulation takes many times longer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from pam_envs.parameters import declarations
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import OUTPUTS, simulate_rows

Array = NDArray[np.float64]

_NOT_FREE = ("regulator.max_pressure", "muscle.diameter", "muscle.braid_angle", "mass.load")
FREE = tuple(
    name
    for name in R.PARAMETERS
    if name not in _NOT_FREE and not name.startswith(("position.", "pressure."))
)
"""Parameters that a record of motion can tell something about."""
_STEP = 1e-4
"""Perturbation, as a part of a parameter's scale: far above rounding, far below curvature."""


@dataclass(frozen=True)
class Fit:
    """A plant fitted to a record.

    Attributes
    ----------
    plant : SingleMuscle
        With the fitted parameters, all else as it was.
    parameters : dict
        Fitted values by name, in SI.
    standard_errors : dict
        Of the fitted values, from the Jacobian and the residual; infinite for what the record
        does not fix.
    rms : float
        Root mean square residual, in the units of the scaled outputs.
    rank : int
        Independent combinations of the parameters that the record fixes.
    """

    plant: SingleMuscle
    parameters: dict[str, float]
    standard_errors: dict[str, float]
    rms: float
    rank: int


def weights(plant: SingleMuscle) -> tuple[str, ...]:
    """Return the names of a plant's play weights, for :func:`jacobian`."""
    return tuple(f"hysteresis.weight[{k}]" for k in range(plant.elements))


def _place(plant: SingleMuscle, name: str) -> int:
    """Return where a parameter stands in the column that the kernels read."""
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
    """Return what a plant does in a record, and its derivative by parameters.

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


def fit_record(
    plant: SingleMuscle,
    set_points: ArrayLike,
    measured: Mapping[str, ArrayLike],
    names: Sequence[str] = FREE,
    noise: Mapping[str, float] | None = None,
) -> Fit:
    """Fit parameters of a plant to a record, by simulation from rest.

    Parameters
    ----------
    plant : SingleMuscle
        Where to begin, with the load that hung in the record.
    set_points : array_like, shape (T,)
        Set-points [Pa], one a control period.
    measured : mapping
        "contraction" [m] or "pressure" [Pa] or both, shape (T,), at the end of each period.
    names : sequence of str
        Parameters to fit; the others stay.
    noise : mapping, optional
        Standard deviation of each measured output; the plant's sensors by default.

    Returns
    -------
    Fit
        The plant, and how sure the record is of each parameter.

    Raises
    ------
    ValueError
        For an unknown output or parameter, or a length that does not match.
    """
    commands = np.asarray(set_points, float)
    floor = {"contraction": plant.position.noise or 1e-5, "pressure": plant.pressure.noise or 100.0}
    floor.update(noise or {})
    targets = {}
    for name, values in measured.items():
        if name not in floor:
            raise ValueError(f"measured {name!r} is not known; give 'contraction' or 'pressure'")
        targets[name] = np.asarray(values, float)
        if targets[name].shape != commands.shape:
            raise ValueError(
                f"measured {name!r} has shape {targets[name].shape}, the set-points "
                f"{commands.shape}; give one sample for each control period"
            )
    sizes = scales(plant, names)
    bounds = [declarations(getattr(plant, n.partition(".")[0]))[n.partition(".")[2]] for n in names]

    def at(theta: Array) -> SingleMuscle:
        return plant.replace(dict(zip(names, (theta * sizes).tolist(), strict=True)))

    def both(theta: Array) -> tuple[Array, Array]:
        outputs, derivatives = jacobian(at(theta), commands, names)
        pick = [OUTPUTS.index(n) for n in targets]
        weight = np.array([1.0 / floor[n] for n in targets])
        missed = outputs[pick] - np.array(list(targets.values()))
        columns = derivatives[pick] * sizes
        return (missed * weight[:, None]).ravel(), (columns * weight[:, None, None]).reshape(
            missed.size, -1
        )

    remembered: dict[bytes, tuple[Array, Array]] = {}

    def evaluated(theta: Array) -> tuple[Array, Array]:
        key = theta.tobytes()
        if key not in remembered:
            remembered.clear()
            remembered[key] = both(theta)
        return remembered[key]

    def misses(theta: Array) -> Array:
        return evaluated(theta)[0]

    def slopes(theta: Array) -> Array:
        return evaluated(theta)[1]

    found = least_squares(
        misses,
        np.array([plant.value(n) for n in names]) / sizes,
        jac=slopes,
        bounds=(
            np.array([b.low for b in bounds]) / sizes,
            np.array([b.high for b in bounds]) / sizes,
        ),
        method="trf",
        max_nfev=100,
    )
    return _summary(at(found.x), names, sizes, found)


def _summary(plant: SingleMuscle, names: Sequence[str], sizes: Array, found: Any) -> Fit:
    rms = float(np.sqrt(np.mean(found.fun**2)))
    _, singular, directions = np.linalg.svd(found.jac, full_matrices=False)
    sure = singular > 1e-5 * max(singular[0], 1e-300)
    spread = directions[sure] / singular[sure, None]
    lost = np.sum(directions[~sure] ** 2, axis=0) > 1e-6
    errors = np.where(lost, np.inf, rms * np.sqrt(np.sum(spread**2, axis=0)) * sizes)
    values = (found.x * sizes).tolist()
    return Fit(
        plant,
        dict(zip(names, values, strict=True)),
        dict(zip(names, errors.tolist(), strict=True)),
        rms,
        int(sure.sum()),
    )
