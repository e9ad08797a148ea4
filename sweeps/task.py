"""Tasks and their outcomes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol


class Task(Protocol):
    """A unit of work."""

    @property
    def key(self) -> str:
        """Digest of all inputs of the result."""
        ...


Act = Callable[[Any], Any]
"""Executes a task in a worker: a function of a module that workers can import."""


@dataclass(frozen=True)
class Done:
    """Outcome of a task.

    Attributes
    ----------
    key : str
    value : object
        Return value of the function.
    error : str, optional
        Reason for a missing value.
    lost : bool
        Whether the reason is that its workers died.
    """

    key: str
    value: Any = None
    error: str | None = None
    lost: bool = False
