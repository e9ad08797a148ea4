"""Segments of a recording: their declared properties and repetitions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pam_envs.data.recording.columns import rows_text
from pam_envs.data.rig_file import Rig
from pam_envs.wording import near

if TYPE_CHECKING:
    from pam_envs.data.recording.recording import Recording

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def check_rig(recording: Recording, rig: Rig) -> list[str]:
    """Return declared properties of segments that contradict the recording, as sentences."""
    named = [label for group in rig.repeats for label in group]
    lost = [label for label in (*named, *rig.valve_closed) if label not in recording.segments]
    if lost:
        return [
            f"the rig names the segment {label!r}, which the recording lacks"
            f"{near(label, recording.segments)}"
            for label in dict.fromkeys(lost)
        ]
    problems = []
    for group in rig.repeats:
        lengths = {label: len(recording.rows_of(label)) for label in group}
        if max(lengths.values()) - min(lengths.values()) >= 3:
            listed = ", ".join(f"{label!r} has {n}" for label, n in lengths.items())
            problems.append(
                f"segments that repeat one another must be equally long: {listed} samples; cut "
                "them alike, or take them out of repeats"
            )
    return problems


def repeat_rows(recording: Recording, rig: Rig) -> list[list[Indices]]:
    """Return the samples of each group's segments, cut to equal length.

    Sample i of a segment was taken under the same command as sample i of the others.
    """
    groups = []
    for group in rig.repeats:
        rows = [recording.rows_of(label) for label in group]
        n = min(len(mine) for mine in rows)
        groups.append([mine[:n] for mine in rows])
    return groups


def returns(segment: Indices, segments: Sequence[str], rows: Indices) -> list[str]:
    """Return the segments that appear in several places, as sentences."""
    first = np.flatnonzero(np.r_[True, np.diff(segment) != 0])
    again = [i for i in first if np.any(segment[:i] == segment[i])]
    labels = list(dict.fromkeys(segments[segment[i]] for i in again))
    return [
        f"segment {label!r} starts again in "
        f"{rows_text(rows[i] for i in again if segments[segment[i]] == label)}; give each stretch "
        f"a label of its own, for example {label + '_2'!r}"
        for label in labels
    ]


def load_changes(
    load: Array, segment: Indices, segments: Sequence[str], rows: Indices
) -> list[str]:
    """Return where the load changes inside a segment, as sentences."""
    changed = (np.diff(load) != 0.0) & (np.diff(segment) == 0)
    if not changed.any():
        return []
    at = np.flatnonzero(changed) + 1
    names = ", ".join(repr(segments[i]) for i in dict.fromkeys(segment[at].tolist()))
    return [
        f"the load changes inside segment {names} at {rows_text(rows[at])}; if load_N is the "
        "reading of a load cell, call the column force_N and give the hanging load as load_N"
    ]
