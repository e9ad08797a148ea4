"""Row numbers by name: each quantity of a kernel is declared once, with its name and its row."""

from collections import namedtuple
from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def indices(keys: Iterable[str], first: int = 0) -> Any:
    """Return a named tuple of consecutive numbers; ``a/b`` becomes the field ``a_b``."""
    fields = [key.replace("/", "_") for key in keys]
    make: Any = namedtuple  # its fields are not literals
    return make("Indices", fields)(*range(first, first + len(fields)))


def computed(prefix: str, *names: str) -> dict[str, None]:
    """Return entries of ``info`` that a kernel computes, all of one group."""
    return {f"{prefix}/{name}": None for name in names}


def copied(prefix: str, rows: Any, *names: str) -> dict[str, int]:
    """Return entries of ``info`` that copy the state's row of their name in upper case."""
    return {f"{prefix}/{name}": getattr(rows, name.upper()) for name in names}


class Report:
    """Entries of ``info`` and signals, and the work rows into which kernels write them.

    Parameters
    ----------
    entries : mapping of str to int or None
        Keys in order, without ``time``, ``reference`` and ``output``, which come first, and
        ``saturated``, which comes last. Row of the state that the entry copies; None if a kernel
        computes it.
    scratch : int
        Work rows of the plant, which come before the report.
    observed : sequence of int or None
        Likewise of the signals of the observation, without references.
    """

    def __init__(
        self, entries: Mapping[str, int | None], scratch: int, observed: Sequence[int | None] = ()
    ) -> None:
        self.keys = ("time", "reference", "output", *entries, "saturated")
        self.scratch = scratch
        self.rows = indices(self.keys, scratch)  # rows.reward_tracking
        self.ended = scratch + len(self.keys)  # flag of a broken limit
        self.signals = self.ended + 1
        self.end = self.signals + len(observed)
        sources = (*entries.values(), None, None, *observed)
        self.copied = tuple(
            (to, row) for to, row in enumerate(sources, scratch + 3) if row is not None
        )
