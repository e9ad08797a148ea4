"""Log of a single muscle on a rig, in the format of recordings that a diagnosis reads."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TextIO

from pam_envs.constants import BAR, MM

COMMAND = ("pressure_set_point", "pressure_command_bar", BAR)
READINGS = (("pressure", "pressure_bar", BAR), ("contraction", "contraction_mm", MM))


class RecordingLog:
    """CSV file with one row per control period, and one segment per episode.

    Each row is written to the disk at once. The clock restarts with every episode, because the
    environment vents and settles the muscle before it (docs/recording.md).

    Parameters
    ----------
    path : str or Path
        File, which must not exist yet.
    load : float
        Pull of the hanging load on the muscle [N].
    """

    def __init__(self, path: str | Path, load: float) -> None:
        self.path, self.load = Path(path), load
        self._file: TextIO | None = None
        self._writer: Any = None

    def add(
        self, segment: str, time: float, setpoints: Mapping[str, float], values: Mapping[str, float]
    ) -> None:
        """Write the readings at ``time`` [s] and the setpoints in force until the next row."""
        readings = [(name, column, unit) for name, column, unit in READINGS if name in values]
        if self._file is None:
            name, column, _ = COMMAND
            if name not in setpoints or not readings:
                raise ValueError(
                    f"a recording needs the setpoint {name} and readings of pressure or "
                    f"contraction; there are {', '.join([*setpoints, *values])}"
                )
            self._file = self.path.open("x", encoding="utf-8", newline="")
            self._writer = csv.writer(self._file)
            self._writer.writerow(
                ["time_s", "segment", column, *(r[1] for r in readings), "load_N"]
            )
        row = [f"{values[name] / unit:.6g}" for name, _, unit in readings]
        command = f"{setpoints[COMMAND[0]] / COMMAND[2]:.6g}"
        self._writer.writerow([f"{time:.6f}", segment, command, *row, f"{self.load:.6g}"])
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None
