"""Observation of the knee's controllers: named signals as tensions and angles.

The environments of the brace alone track a tension or a stiffness, those of the gait a tension in
stance and an angle in swing. The names and units of the signals determine which. A reference
stiffness ``s`` becomes the reference tension ``s (L - L_min)`` at the sensed angle.
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


class KneeView(NamedTuple):
    """One observation of every row, arrays of shape (n_env,).

    Attributes
    ----------
    tension, angle, set_point : ndarray
        Sensed [N], [rad]; of the last period [Pa].
    reference : ndarray
        Reference tension [N]; in swing that of the tension controller off-line.
    stretch : ndarray
        Muscle's length above its shortest [m].
    stance : ndarray of bool
        Rows that track the tension; all without a gait.
    angle_reference : ndarray
        Reference angle [rad] in swing; the sensed angle without a gait.
    """

    tension: Array
    angle: Array
    set_point: Array
    reference: Array
    stretch: Array
    stance: Rows
    angle_reference: Array


@dataclass(frozen=True)
class KneeObserver:
    """Reader of observations as a :class:`KneeView`.

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

    def read(self, observation: ArrayLike) -> KneeView:
        """Return the view of an observation of shape (n_obs,) or (n_env, n_obs)."""
        tension, angle, set_point, reference, *more = self.reader.rows(observation)
        stretch = self.nominal.stretch(angle)
        if self.stiffness:
            reference = reference * stretch
        stance, path = self._phase(more, angle)
        return KneeView(tension, angle, set_point, reference, stretch, stance, path)

    def _phase(self, more: list[Array], angle: Array) -> tuple[Rows, Array]:
        if not self.gait:
            return np.ones(len(angle), bool), angle
        return more[0] > 0.5, more[1]

    @cached_property
    def full_pressure(self) -> float:
        """Capacity [Pa] of the nominal muscle."""
        return self.nominal.full_pressure


def make_knee_observer(nominal: KneeNominal, signals: Signals) -> KneeObserver:
    """Return the reader of the signals of any environment of the knee."""
    there = set(signals.names())
    gait = set(GAIT_NAMES) <= there
    names = [*NAMES, *(GAIT_NAMES if gait else ())]
    unit = signals["reference"].unit
    if unit not in ("N", "N/m"):
        raise ValueError(f"reference is in {unit}; the knee's controllers track N or N/m")
    return KneeObserver(nominal, reader(signals, names), gait, unit == "N/m")
