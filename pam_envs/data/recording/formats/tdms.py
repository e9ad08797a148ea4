"""Channels of TDMS files of LabVIEW: ``group/channel``."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.data.recording.formats.signals import (
    ChannelError,
    Signal,
    check_count,
    column,
    failures_named,
    missing_package,
    unknown,
)
from pam_envs.wording import shown

KIND = "TDMS"
UNIT_KEYS = ("unit_string", "NI_UnitDescription", "unit", "Unit")
STEP = "wf_increment"


@contextmanager
def open_tdms(path: Path) -> Iterator["TdmsLog"]:
    """Open a file for its channels."""
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise missing_package(str(path), KIND, "npTDMS") from error
    # TdmsFile.open(path) would leave the file open where it fails.
    with failures_named(str(path), KIND), path.open("rb") as raw, TdmsFile.open(raw) as file:
        yield TdmsLog(file)


class TdmsLog:
    """Channels of an open TDMS file."""

    def __init__(self, file: Any) -> None:
        self.channels = {
            f"{group.name}/{channel.name}": channel
            for group in file.groups()
            for channel in group.channels()
        }

    def names(self) -> Iterable[str]:
        """Return the names of groups and channels."""
        return self.channels

    def read(self, name: str) -> Signal:
        """Return the scaled readings of a channel; a waveform has its own clock."""
        channel = self.channels.get(name.strip("/").replace("'", ""))
        if channel is None:
            raise unknown(name, self.channels)
        check_count(name, len(channel))
        values = channel[:]
        if values.dtype.kind == "O":
            values = values.astype(str)
        of = channel.properties
        unit = next((str(of[key]) for key in UNIT_KEYS if of.get(key)), "")
        return Signal(column(name, values, None, "one channel"), unit, clock_of(channel, name))


def clock_of(channel: Any, name: str) -> Any:
    """Return the clock of a waveform [s], None without one."""
    step = channel.properties.get(STEP)
    if step is None:
        return None
    if not (isinstance(step, (int, float)) and 0.0 < step < np.inf):
        raise ChannelError(f"channel {shown(name)} has the period {STEP} = {shown(step)}")
    return np.asarray(channel.time_track(), np.float64)
