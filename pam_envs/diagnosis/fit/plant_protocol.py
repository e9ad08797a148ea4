"""Interface of a plant that can be diagnosed: parameter columns, simulation, free parameters."""

from __future__ import annotations

from typing import Any, Protocol

from pam_envs.diagnosis.arrays import Array
from pam_envs.diagnosis.fit.least_squares import Free


class PlantFamily(Protocol):
    """A plant with fixed inputs and free parameters; the engine needs nothing else of it.

    A plant whose parameters depend on one another also gives a function that completes columns in
    place (:attr:`pam_envs.diagnosis.fit.least_squares.Problem.tie`).
    """

    @property
    def column(self) -> Array:
        """Parameters of the plain plant, shape (p,)."""
        ...

    def simulate(self, columns: Array) -> Array:
        """Return sensor readings for parameter columns (n, p), shape (channels, T, n)."""
        ...

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter: place, bounds, scale, start."""
        ...
