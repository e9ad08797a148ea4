"""Fit of the static force law to a table of forces over pressure and contraction."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from scipy.optimize import least_squares

from pam_envs.arrays import Array
from pam_envs.data.force_table import ForceTable
from pam_envs.muscle.effective_area import EffectiveAreaMuscle
from pam_envs.parameters import declarations

FITTED = ("area", "area_taper", "braid_force", "braid_strain", "stiffness", "hardening")
STRAINS = (0.006, 0.015, 0.03, 0.06, 0.12)
"""Starting values of the strain over which the force of the braid rises."""
SAME = 1e-4
"""Relative difference of two sums of squares that counts as none."""


@dataclasses.dataclass(frozen=True)
class LawFit:
    """Static law fitted to a table.

    Attributes
    ----------
    values : mapping of str to float
        Parameters of the muscle [SI].
    rms, worst : float
        RMS and largest error of the force [N].
    at_bound : tuple of str
        Parameters at one of their bounds.
    """

    values: Mapping[str, float]
    rms: float
    worst: float
    at_bound: tuple[str, ...]


def fit_law(table: ForceTable, muscle: EffectiveAreaMuscle) -> LawFit:
    """Fit the static law by least squares from several starts; the force of a slack muscle is 0.

    ``muscle`` gives the rest length and a law of the right size.
    """
    strain = table.contraction / muscle.rest_length
    declared = declarations(muscle)
    size = muscle.area * float(table.pressure.max())
    scale = np.array([muscle.area, 1.0, 0.2 * size, 0.02, size, 10.0 * size])
    low, high = (np.array([getattr(declared[n], end) for n in FITTED]) for end in ("low", "high"))

    def errors(z: Array) -> Array:
        law = dataclasses.replace(
            muscle,
            **dict(zip(FITTED, np.clip(z * scale, low, high).tolist(), strict=True)),
            area_curve=0.0,
        )
        return np.asarray(np.maximum(0.0, law.tension(table.pressure, strain)) - table.force)

    own = np.array([getattr(muscle, name) for name in FITTED])
    found = []
    for start in STRAINS:
        own[FITTED.index("braid_strain")] = start
        begin = np.clip(own, low + 1e-3 * scale, high - 1e-3 * scale)
        found.append(
            least_squares(errors, begin / scale, bounds=(low / scale, high / scale), x_scale=1.0)
        )
    least = min(float(fit.cost) for fit in found)
    # with few lengths several laws fit alike: the first of them, on every processor
    best = next(fit for fit in found if fit.cost <= (1.0 + SAME) * least)
    values = np.clip(best.x * scale, low, high)
    values = np.where(best.active_mask < 0, low, np.where(best.active_mask > 0, high, values))
    at_bound = tuple(n for n, active in zip(FITTED, best.active_mask, strict=True) if active)
    left = errors(best.x)
    return LawFit(
        dict(zip(FITTED, values.tolist(), strict=True)),
        float(np.sqrt(np.mean(left**2))),
        float(np.max(np.abs(left))),
        at_bound,
    )
