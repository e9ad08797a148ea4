"""Which kinds of experiment are left out for the reported errors."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pam_envs.data.recording import Recording
from pam_envs.diagnosis.fitting import Problem
from pam_envs.diagnosis.search import Blocks, Candidate

SHARE = (0.15, 0.4)
"""Part of a record that is held out."""


@dataclass(frozen=True)
class HeldOut:
    """Base and model fitted without some samples, and those samples.

    Attributes
    ----------
    rows : ndarray of bool, shape (T,)
        What neither of the two fits has seen.
    problem : Problem
        With the others as training samples.
    base, model : Candidate
        Fitted to them.
    by : {"kinds", "blocks"}
        How the samples were chosen.
    """

    rows: NDArray[np.bool_]
    problem: Problem
    base: Candidate
    model: Candidate
    by: str


def kind_of(label: str) -> str:
    """Return the kind of experiment that a label names: ``random_b`` is of the kind random."""
    return re.sub(r"[\s_.-]+(?:[A-Za-z]|\d+)$|(?<=[A-Za-z])\d+$", "", label) or label


def choose(recording: Recording, blocks: Blocks) -> NDArray[np.bool_]:
    """Return the samples of the kinds that are held out, shape (T,).

    Whole kinds of experiment, so that a model is judged on another kind of motion than it was
    fitted to; those that hold much but not most of the record. Where a recording has fewer than
    three kinds the interleaved blocks are held out.
    """
    kinds = [kind_of(label) for label in recording.segments]
    of = np.array([sorted(set(kinds)).index(k) for k in kinds])[recording.segment]
    names = sorted(set(kinds))
    moving = np.bincount(of, np.abs(np.gradient(recording.command)), minlength=len(names)) > 0
    counts = np.bincount(of, minlength=len(names)) / len(of)
    candidates = [k for k in np.argsort(-counts, kind="stable") if moving[k]]
    rows = np.zeros(len(of), bool)
    if len(candidates) < 3:
        return np.asarray(~blocks.train)
    for k in candidates[1::2]:  # every second one by length: the longest kind stays
        if rows.mean() + counts[k] <= SHARE[1]:
            rows |= of == k
    return rows if rows.mean() >= SHARE[0] else np.asarray(~blocks.train)
