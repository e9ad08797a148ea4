"""References of a rig: samples of a CSV file, or holds at random levels."""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pam_envs.arrays import Array
from pam_envs.wording import near, shown

COLUMNS = ("time_s", "reference_mm")
LONGEST = 3600.0
"""Longest episode [s]."""
LEAST = 2
"""Smallest number of samples of a file."""
SHARES = (0.1, 0.9)
"""Default range of levels over the reach."""
OUTSIDE = 0.1
"""Distance from the reach that a reference may have, over the reach."""
STREAM = 450
"""Second word of the seed of levels."""


@dataclass(frozen=True)
class Holds:
    """Random levels, each held for the same time; every run draws its own.

    Attributes
    ----------
    number : int
        Number of holds.
    seconds : float
        Duration of a hold [s].
    span : tuple of float, optional
        Lowest and highest level [m]; None: ``SHARES`` of the reach.
    """

    number: int = 60
    seconds: float = 4.0
    span: tuple[float, float] | None = None

    def check(self) -> None:
        """Raise ValueError unless number, duration and levels are admissible."""
        if not 1 <= self.number <= 10_000 or not 0.1 <= self.seconds <= 600.0:
            raise ValueError(
                f"holds = {self.number} must be from 1 to 10000, and hold_seconds = "
                f"{self.seconds:g} from 0.1 to 600 s"
            )
        if self.number * self.seconds > LONGEST:
            raise ValueError(
                f"{self.number} holds of {self.seconds:g} s take {self.number * self.seconds:g} s; "
                f"at most {LONGEST:g} s can be simulated: give fewer --holds"
            )
        if self.span is not None and not self.span[0] < self.span[1]:
            low, high = (1e3 * level for level in self.span)
            raise ValueError(
                f"range_mm = {low:g} {high:g} must have the lower level first, and another one"
            )

    def samples(self, reach: tuple[float, float], seed: int, period: float) -> Array:
        """Return the reference [m] of a run, for a reach [m] and control period [s], (n,)."""
        low, high = self.span or tuple(reach[0] + share * (reach[1] - reach[0]) for share in SHARES)
        levels = np.random.default_rng((seed, STREAM)).uniform(low, high, self.number)
        return np.repeat(levels, round(self.seconds / period))


def read(path: Path, period: float) -> Array:
    """Return the reference [m] of a CSV file at the control period [s], shape (n,).

    The columns are ``time_s`` and ``reference_mm``. Each sample holds until the next one.

    Raises
    ------
    ValueError
        If a column is missing, a cell is no number, time does not increase, or the file is too
        short or too long.
    """
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        header = [name.strip() for name in rows.fieldnames or ()]
        rows.fieldnames = header
        for name in COLUMNS:
            if name not in header:
                raise ValueError(
                    f"{path} has no column {name!r}{near(name, header)}; a reference needs "
                    f"{' and '.join(COLUMNS)}"
                )
        try:
            table = np.array([[float(row[name]) for name in COLUMNS] for row in rows])
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"{path}: {shown(str(error))}; every line needs {' and '.join(COLUMNS)}"
            ) from error
    if len(table) < LEAST or not np.isfinite(table).all():
        raise ValueError(
            f"{path} has {len(table)} samples; at least {LEAST} finite ones are needed"
        )
    time, level = table[:, 0] - table[0, 0], 1e-3 * table[:, 1]
    steps = np.diff(time)
    if not (steps > 0.0).all():
        line = int(np.argmin(steps > 0.0)) + 1
        raise ValueError(
            f"{path}: time_s does not increase after {table[line - 1, 0]:g} s; sort it"
        )
    end = time[-1] + steps[-1]
    if end > LONGEST:
        raise ValueError(
            f"{path} lasts {end:g} s; at most {LONGEST:g} s can be simulated: is time_s in seconds?"
        )
    every = np.arange(max(1, round(end / period))) * period
    index = np.searchsorted(time, every + 1e-9, side="right") - 1
    return np.asarray(level[index])


def check_reach(samples: Array, reach: tuple[float, float], where: str) -> None:
    """Raise ValueError if a reference [m] is far outside the reach [m] of the plant."""
    margin = OUTSIDE * (reach[1] - reach[0])
    low, high = float(samples.min()), float(samples.max())
    if low < reach[0] - margin or high > reach[1] + margin:
        raise ValueError(
            f"the reference spans {1e3 * low:.3g} to {1e3 * high:.3g} mm, and the plant reaches "
            f"{1e3 * reach[0]:.3g} to {1e3 * reach[1]:.3g} mm at {where}; give another --range-mm "
            "or reference, or the plant of that rig"
        )
