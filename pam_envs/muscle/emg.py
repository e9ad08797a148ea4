"""EMG proxy of the knee's extensors and flexors.

The extensors bear what the orthosis does not, ``u = max(0, tau - tau_a) / tau_max`` above a floor
of co-contraction; where the orthosis extends more than needed, the flexors work against it:

    extensors  max(0, tau - tau_a)          flexors  max(0, tau_a - tau)

Excitation becomes activation by a first-order lag, faster on the way up.

There are three readings of the demand ``tau``. *Uncalibrated*: the full balance about the knee.
Both *calibrated* ones start from the paper's own estimate ``tau_w``, Eq. (1), with one constant an
activity, fitted to its three published reductions: *A* takes the true demand to be ``lambda
tau_w``; *B* takes the EMG to be a power ``n`` of the torque. They count from the muscles' resting
level, so that one constant is enough.
"""

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from pam_envs import yaml_file
from pam_envs.arrays import Array
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import entry, kernel
from pam_envs.parameters import assumed

Reading = Literal["uncalibrated", "A", "B"]
READINGS: tuple[Reading, ...] = ("uncalibrated", "A", "B")
CONSTANTS = Path(__file__).resolve().parent.parent / "data" / "emg_calibration.yaml"


@dataclass(frozen=True)
class MuscleActivation:
    """Activation of muscles that bear a torque."""

    largest_torque: float = assumed(200.0, "N m", 20.0, 600.0, "largest knee extension of an adult")
    floor: float = assumed(0.03, "1", 0.0, 0.3, "co-contraction, 0.02 to 0.05", neutral=0.0)
    rise_time: float = assumed(0.0125, "s", 0.001, 0.2, "activation dynamics, 10 to 15 ms")
    fall_time: float = assumed(0.05, "s", 0.001, 0.5, "activation dynamics, 40 to 60 ms")


@kernel
def excitation(torque: float, largest: float, floor: float) -> float:
    """Return the excitation, 0 to 1, of muscles that bear a torque [N m] (below 0: none)."""
    return max(0.0, min(1.0, floor + max(0.0, torque) / largest))


@kernel
def activation(before: float, excited: float, risen: float, fallen: float) -> float:
    """Return the activation after a period; ``risen, fallen`` are the remaining shares of a gap."""
    left = risen if excited > before else fallen
    return excited + (before - excited) * left


@kernel
def left_of_gap(period: float, time: float) -> float:
    """Return the remaining share of a gap after a period of a first-order lag."""
    return decay(min(20.0, period / time))


@entry
def _activations(excited: Any, risen: float, fallen: float, out: Any) -> None:
    """Run the activation over a record, from rest at its first value."""
    level = excited[0]
    for t in range(len(excited)):
        level = activation(level, excited[t], risen, fallen)
        out[t] = level


def activation_of(torque: ArrayLike, period: float, muscle: MuscleActivation) -> Array:
    """Return the activation, shape (T,), of muscles that bear torques [N m], shape (T,)."""
    borne = np.maximum(0.0, np.asarray(torque, float))
    excited = np.clip(muscle.floor + borne / muscle.largest_torque, 0.0, 1.0)
    out = np.empty_like(excited)
    risen, fallen = (left_of_gap(period, t) for t in (muscle.rise_time, muscle.fall_time))
    _activations(excited, risen, fallen, out)
    return out


@functools.cache
def calibration(activity: str, reading: Reading) -> float:
    """Return the fitted constant of a calibrated reading; raise ValueError if there is none."""
    known = yaml_file.read(CONSTANTS, "constants")["readings"]
    if reading not in known or activity not in known[reading]:
        raise ValueError(
            f"reading = {reading!r}, activity = {activity!r}; there are constants for the readings "
            f"{', '.join(known)} and the activities {', '.join(known['A'])}"
        )
    return float(known[reading][activity])


@dataclass(frozen=True)
class EmgProxy:
    """Activations with and without the orthosis, shape (T,) each.

    The paper's electrodes compare ``extensors`` with ``extensors_free``.
    """

    extensors: Array
    extensors_free: Array
    flexors: Array
    flexors_free: Array

    @property
    def change(self) -> float:
        """Change of the extensors' RMS, -0.2 for a reduction by 20 %."""
        return rms(self.extensors) / rms(self.extensors_free) - 1.0


def rms(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def emg_proxy(
    demand: ArrayLike,
    assistance: ArrayLike,
    period: float,
    muscle: MuscleActivation | None = None,
    reading: Reading = "uncalibrated",
    constant: float = 1.0,
) -> EmgProxy:
    """Return the EMG proxy of a record.

    Parameters
    ----------
    demand : array_like, shape (T,)
        Knee torque [N m], extension positive: the full balance for the uncalibrated reading, the
        estimate of Eq. (1) for ``"A"`` and ``"B"``.
    assistance : array_like, shape (T,)
        Torque of the orthosis as delivered [N m].
    period : float
        Sampling period [s].
    muscle : MuscleActivation, optional
        Calibrated readings leave its floor out.
    reading : {"uncalibrated", "A", "B"}
        See the module.
    constant : float
        ``lambda`` of reading A, ``n`` of reading B.
    """
    muscle = MuscleActivation() if muscle is None else muscle
    muscle = muscle if reading == "uncalibrated" else replace(muscle, floor=0.0)
    needed, helped = np.asarray(demand, float), np.asarray(assistance, float)
    if reading == "A":
        needed = constant * needed
    power = constant if reading == "B" else 1.0

    def active(torque: Array) -> Array:
        share = np.maximum(0.0, torque) / muscle.largest_torque
        return activation_of(share**power * muscle.largest_torque, period, muscle)

    rest = needed - helped
    return EmgProxy(active(rest), active(needed), active(-rest), active(-needed))
