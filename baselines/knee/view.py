"""Observation of the knee's controllers: tensions and angles from named signals.

The environments of the brace alone track a tension or a stiffness, those of the gait a tension in
stance and an angle in swing. The names and units of the signals determine which. A reference
stiffness ``s`` becomes the reference tension ``s (L - L_min)`` at the sensed angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array, Reader, Rows, reader
from baselines.core.entry import Spec
from baselines.knee.nominal import KneeNominal
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

NAMES = ("tension", "angle", "set_point", "reference")
GAIT_NAMES = ("stance", "angle_reference")


class KneeView(NamedTuple):
    """One observation of every row in SI, arrays of shape (n_env,).

    Sensed tension and angle, the setpoint of the last period, the reference tension (in swing that
    of the tension controller off-line), the muscle's length above its shortest, rows in stance, and
    the reference angle of the swing. Without a gait all rows are in stance, with the sensed angle.
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

    ``gait``: whether there is stance and swing; ``stiffness``: whether the reference is a
    stiffness.
    """

    nominal: KneeNominal
    reader: Reader
    gait: bool
    stiffness: bool

    def read(self, observation: ArrayLike) -> KneeView:
        """Return the view of an observation of shape (n_obs,) or (n_env, n_obs)."""
        tension, angle, set_point, reference, *phase = self.reader.rows(observation)
        stretch = self.nominal.stretch(angle)
        if self.stiffness:
            reference = reference * stretch
        stance, path = (phase[0] > 0.5, phase[1]) if phase else (np.ones(len(angle), bool), angle)
        return KneeView(tension, angle, set_point, reference, stretch, stance, path)


def make_knee_observer(spec: Spec[KneeOrthosis]) -> KneeObserver:
    """Return the reader of the signals of any environment of the knee."""
    signals = spec.signals
    gait = set(GAIT_NAMES) <= set(signals.names())
    unit = signals["reference"].unit
    if unit not in ("N", "N/m"):
        raise ValueError(f"reference is in {unit}; the knee's controllers track N or N/m")
    names = [*NAMES, *(GAIT_NAMES if gait else ())]
    return KneeObserver(KneeNominal(spec.plant), reader(signals, names), gait, unit == "N/m")
