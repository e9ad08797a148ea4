"""Row numbers by name: each quantity of a kernel is declared once, with its name and its row."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterable, Mapping
from typing import Any

PREFIXES = ("reward", "cost", "margin", "effort", "state", "sensor")
"""Groups of the entries of ``info``, besides ``time``, ``reference``, ``output``, ``saturated``."""


def indices(keys: Iterable[str], first: int = 0) -> Any:
    """Return a named tuple of consecutive numbers, one for each key.

    Parameters
    ----------
    keys : iterable of str
        ``reward/tracking`` becomes the field ``reward_tracking``.
    first : int
        Number of the first key.
    """
    fields = [key.replace("/", "_") for key in keys]
    make: Any = namedtuple  # its fields are not literals
    return make("Indices", fields)(*range(first, first + len(fields)))


def computed(prefix: str, *names: str) -> dict[str, None]:
    """Return entries of ``info`` that a kernel computes, all of one group."""
    return {f"{prefix}/{name}": None for name in names}


class Report:
    """Entries of ``info`` and the work rows into which kernels write them.

    Parameters
    ----------
    entries : mapping of str to int or None
        Keys in order, without ``time``, ``reference`` and ``output``, which come first, and
        ``saturated``, which comes last. Row of the state that the entry copies; None if a kernel
        computes it.
    scratch : int
        Work rows of the plant, which come before the report.

    Attributes
    ----------
    keys : tuple of str
        All keys in order.
    rows : named tuple of int
        Work row of each key: ``rows.reward_tracking``.
    copied : tuple of (int, int)
        Work row and state row of each entry that is a copy; see :func:`copy_rows
        <pam_envs.envs.core.step.copy_rows>`.
    ended, signals : int
        Work row of the flag of a broken limit, and the first one of the observation.
    """

    def __init__(self, entries: Mapping[str, int | None], scratch: int) -> None:
        self.keys = ("time", "reference", "output", *entries, "saturated")
        self.scratch = scratch
        self.rows = indices(self.keys, scratch)
        numbered = enumerate(entries.values(), scratch + 3)
        self.copied = tuple((to, row) for to, row in numbered if row is not None)
        self.ended = scratch + len(self.keys)
        self.signals = self.ended + 1
