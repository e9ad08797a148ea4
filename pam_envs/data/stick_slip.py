"""Record of an antagonistic pair of muscles with both valves shut: 28 s at 250 Hz.

A motor pulls the joint back and forth. The joint sticks and steps, and the trapped air of one
muscle is compressed while that of the other expands (``PROVENANCE.md``).
"""

from __future__ import annotations

import dataclasses
from importlib import resources
from pathlib import Path

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import ATMOSPHERE

FILE, RIG = "antagonistic_stick_slip.csv.gz", "antagonistic_stick_slip_rig.yaml"
FOLDER = Path(__file__).parent
KPA, MM = 1e3, 1e-3
MUSCLE_LENGTH = 0.2
"""Length of the muscles [m], as the record's own script states."""


@dataclasses.dataclass(frozen=True)
class StickSlipRecord:
    """Signals of the record, shape (n,) each, in SI.

    Attributes
    ----------
    time : ndarray
        Time of each sample [s].
    force : ndarray
        Force of the motor on the tendon [N].
    displacement, velocity : ndarray
        Of the tendon [m, m/s].
    pressures : ndarray, shape (2, n)
        Gauge pressures of both muscles [Pa].
    """

    time: Array
    force: Array
    displacement: Array
    velocity: Array
    pressures: Array

    def trapped_slopes(self) -> Array:
        """Return the change of the log of both absolute pressures with the displacement [1/m].

        Slopes of straight lines by least squares, shape (2,).
        """
        return log_slopes(self.displacement, self.pressures)


def log_slopes(displacement: Array, pressures: Array) -> Array:
    """Return slopes [1/m] of the log of absolute pressures, gauge [Pa] (m, n), by displacement."""
    x = displacement - displacement.mean()
    return np.asarray(np.log(pressures + ATMOSPHERE) @ x / (x @ x))


def recording_and_rig(folder: Path = FOLDER) -> tuple[Path, Path]:
    """Return the files of the record and of its rig, whose ``channels`` are those of a joint."""
    return folder / FILE, folder / RIG


def load_stick_slip() -> StickSlipRecord:
    """Read the shipped record."""
    with resources.as_file(resources.files(__package__) / FILE) as path:
        table = np.genfromtxt(path, delimiter=",", names=True)
    return StickSlipRecord(
        time=table["time_s"],
        force=table["force_N"],
        displacement=MM * table["displacement_mm"],
        velocity=MM * table["velocity_mm_s"],
        pressures=KPA * np.array([table["pressure_1_kPa"], table["pressure_2_kPa"]]),
    )
