"""Identification of the antagonistic joint's presets.

:func:`fit_force_map` fits the static law of :mod:`pam_envs.muscle.force_map` on the measured map,
:func:`fit_angle_plays` the reduced plant's hysteresis on loops of the plant with muscles. The
numbers in the code are theirs, rounded.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from importlib import resources

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares, nnls

from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.muscle.force_map import ForceMap
from pam_envs.plants.antagonistic_joint.hysteresis import ANGLE_THRESHOLDS
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

Array = NDArray[np.float64]

MAP_LENGTH = 0.25
"""Length [m] of the muscle that was measured, at rest."""
FITTED = ("area", "taper", "threshold", "braid_force", "braid_strain", "stiffness")
AMPLITUDES = (25.0, 20.0, 15.0, 10.0, 7.0, 5.0, 3.0)
"""Of the loops on which the reduced hysteresis is identified [degrees]."""


@dataclass(frozen=True)
class MeasuredMap:
    """Static forces of a DMSP-10-250 [Pa, 1, N], shape (n,); 0 N where the muscle is slack."""

    pressure: Array
    contraction: Array
    force: Array

    def residuals(self, law: ForceMap) -> Array:
        """Return the errors of a law [N]; its pull where the muscle is slack."""
        value = law.law(self.pressure, self.contraction)
        return np.where(self.force > 0.0, value - self.force, np.maximum(0.0, value))


def measured_map() -> MeasuredMap:
    """Return the measured map."""
    source = resources.files("pam_envs.data") / "dmsp10_force_map.csv"
    columns = np.genfromtxt(str(source), delimiter=",", names=True)
    contraction = 1.0 - columns["length_m"] / MAP_LENGTH
    return MeasuredMap(columns["pressure_pa"], contraction, columns["force_n"])


def fit_force_map(data: MeasuredMap, start: ForceMap | None = None) -> ForceMap:
    """Return the law that fits a map in the sense of least squares."""
    first = ForceMap() if start is None else start
    scale = np.array([getattr(first, name) for name in FITTED])

    def law(x: Array) -> ForceMap:
        values = dict(zip(FITTED, (x * scale).tolist(), strict=True))
        return dataclasses.replace(first, **values)

    def errors(x: Array) -> Array:
        return data.residuals(law(x))

    found = least_squares(errors, np.ones(len(FITTED)), xtol=1e-12)
    return law(found.x)


def loop_commands(seed: int = 0, turns: int = 40) -> Array:
    """Return setpoints [rad]: loops of falling amplitude, then random turns, shape (T,)."""
    phase = np.linspace(0.0, 4.0 * np.pi, 121)[1:]
    parts = [np.radians(a) * np.sin(phase) for a in AMPLITUDES]
    at = 0.0
    for turn in np.radians(np.random.default_rng(seed).uniform(-25.0, 25.0, turns)):
        parts.append(np.linspace(at, turn, 13)[1:])
        at = turn
    return np.concatenate(parts)


def fit_angle_plays(
    plant: AntagonisticJoint, thresholds: ArrayLike = ANGLE_THRESHOLDS
) -> tuple[PlayOperator, float]:
    """Return plays of total slope 1 that rest where a plant with muscles does, and the error left.

    The operator maps setpoints [rad] to angles at rest [rad], with thresholds (n,) [rad]; the
    error is the RMS over :func:`loop_commands` [rad].
    """
    commands = loop_commands()
    behind = commands - plant.rest_angles(commands)
    given = tuple(float(t) for t in np.asarray(thresholds, float))
    stops = [commands - PlayOperator((t,), (1.0,), 0.0).simulate(commands)[0] for t in given]
    weights, norm = nnls(np.column_stack(stops), behind)
    operator = PlayOperator(given, tuple(weights.tolist()), 1.0 - float(weights.sum()))
    return operator, float(norm / np.sqrt(len(commands)))
