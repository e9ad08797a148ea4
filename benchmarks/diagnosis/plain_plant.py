"""Plants other than the muscle for the diagnosis, defined by tables of parameters and causes."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.least_squares import Free

Parameters = Mapping[str, tuple[float, float, float, float]]
"""Neutral value, bounds and meaningful change of every parameter [SI]."""


class PlainPlant:
    """Parameters of a plant for :class:`pam_envs.diagnosis.fit.least_squares.PlantFamily`.

    ``base_names`` are always fitted; those of ``weighed`` are known to one meaningful change, those
    of ``logarithmic`` are fitted on a logarithmic scale.
    """

    parameters: ClassVar[Parameters]
    base_names: ClassVar[tuple[str, ...]]
    logarithmic: ClassVar[tuple[str, ...]] = ()
    weighed: ClassVar[tuple[str, ...]] = ()

    @property
    def values(self) -> dict[str, float]:
        """Parameters before a fit."""
        return {name: row[0] for name, row in self.parameters.items()}

    @property
    def column(self) -> NDArray[np.float64]:
        """Parameters before a fit, shape (p,)."""
        return np.array(list(self.values.values()))

    def free(self, name: str, **changes: Any) -> Free:
        """Return the fit settings of a parameter."""
        _, low, high, scale = self.parameters[name]
        made: dict[str, Any] = {"low": low, "high": high, "scale": scale}
        made |= {"start": self.values[name], "log": name in self.logarithmic}
        made["prior"] = 1.0 if name in self.weighed else np.inf
        return Free(name, list(self.parameters).index(name), **{**made, **changes})

    def base(self) -> tuple[Free, ...]:
        """Return the base parameters."""
        return tuple(map(self.free, self.base_names))


def plain_causes(table: Mapping[str, tuple[str, *tuple[Any, ...]]]) -> tuple[Cause, ...]:
    """Return causes by name: title and forms, each with its parameter and starting values [SI]."""
    return tuple(
        Cause(
            name,
            title,
            tuple(Form(form, (Term(key, tuple(starts)),)) for form, key, *starts in forms),
        )
        for name, (title, *forms) in table.items()
    )
