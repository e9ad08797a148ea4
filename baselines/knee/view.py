"""What the controllers of the knee read: named signals, turned into tensions and angles.

The environments of the brace alone track a tension or a stiffness, those of the gait a tension in
stance and an angle in swing. Told apart by the names and units of their signals, they look the
same from here: a stiffness ``s`` is wanted as the tension ``s (L - L_min)`` at the angle sensed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Reader, Rows, reader
from baselines.knee.nominal import KneeNominal
from pam_envs.parameters import Signals

NAMES = ("tension", "angle", "set_point", "reference")
GAIT_NAMES = ("stance", "angle_reference")


class View(NamedTuple):
    """One observation of every row, arrays of shape (n_env,).

    Attributes
    ----------
    tension, angle, set_point : ndarray
        As sensed [N], [rad]; of the last period [Pa].
    wanted : ndarray
        Tension [N] that is asked for; in swing, what the tension's controller is shown off-line.
    stretch : ndarray
        Muscle's length above its shortest [m].
    stance : ndarray of bool
        Where the tension is tracked; everywhere without a gait.
    angle_wanted : ndarray
        Angle [rad] asked for in swing; the angle as sensed without a gait.
    """

    tension: Array
    angle: Array
    set_point: Array
    wanted: Array
    stretch: Array
    stance: Rows
    angle_wanted: Array


@dataclass(frozen=True)
class Eyes:
    """Makes a :class:`View` of observations.

    Attributes
    ----------
    nominal : KneeNominal
    reader : Reader
    gait : bool
        Whether there is stance and swing.
    stiffness : bool
        Whether the reference is a stiffness.
    """

    nominal: KneeNominal
    reader: Reader
    gait: bool
    stiffness: bool

    def look(self, observation: ArrayLike) -> View:
        """Return what an observation of shape (n_obs,) or (n_env, n_obs) shows."""
        tension, angle, set_point, wanted, *more = self.reader.rows(observation)
        stretch = self.nominal.stretch(angle)
        if self.stiffness:
            wanted = wanted * stretch
        stance, path = self._phase(more, angle)
        return View(tension, angle, set_point, wanted, stretch, stance, path)

    def _phase(self, more: list[Array], angle: Array) -> tuple[Rows, Array]:
        if not self.gait:
            return np.ones(len(angle), bool), angle
        return more[0] > 0.5, more[1]

    @cached_property
    def full_pressure(self) -> float:
        """Capacity [Pa] of the nominal muscle."""
        return self.nominal.full_pressure


def make_eyes(nominal: KneeNominal, signals: Signals) -> Eyes:
    """Return what reads the signals of any environment of the knee."""
    there = set(signals.names())
    gait = set(GAIT_NAMES) <= there
    names = [*NAMES, *(GAIT_NAMES if gait else ())]
    unit = signals["reference"].unit
    if unit not in ("N", "N/m"):
        raise ValueError(f"reference is in {unit}; the knee's controllers track N or N/m")
    return Eyes(nominal, reader(signals, names), gait, unit == "N/m")
