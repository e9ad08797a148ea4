"""The classical controllers that residual policies correct: made by name, told a nominal plant."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.settings.settings import SettingsError
from baselines.core import catalogue
from pam_envs.parameters import Signals
from pam_envs.wording import near

MOST_NUMBERS = 64
"""Larger arrays stand on a card by their shape alone."""


def make(name: str, plant: Any, signals: Signals, actions: Signals) -> Any:
    """Return a controller by name, told a plant.

    Raises
    ------
    SettingsError
        If there is none of that name.
    """
    if name not in catalogue.CONTROLLERS:
        known = list(catalogue.CONTROLLERS)
        raise SettingsError(f"residual.controller = {name!r} is not known{near(name, known)}")
    return catalogue.make_controller(name, plant=plant, signals=signals, action_signals=actions)


def names_for(env: str) -> list[str]:
    """Return the classical controllers of an environment."""
    return [name for name, entry in catalogue.CONTROLLERS.items() if env in entry.envs]


def parameters(thing: Any, depth: int = 4) -> Any:
    """Return the numbers that a controller holds, as plain values by their names.

    Nominal plants and other objects with a ``digest()`` stand by it, long arrays by their shape.
    """
    if thing is None or isinstance(thing, (bool, int, float, str)):
        return thing
    if isinstance(thing, np.generic):
        return thing.item()
    if isinstance(thing, np.ndarray):
        return thing.tolist() if thing.size <= MOST_NUMBERS else {"shape": list(thing.shape)}
    if callable(getattr(thing, "digest", None)):
        return {"digest": thing.digest()}
    if depth and isinstance(thing, Mapping):
        return {str(key): parameters(value, depth - 1) for key, value in thing.items()}
    if depth and dataclasses.is_dataclass(thing):
        names = [field.name for field in dataclasses.fields(thing)]
        return {name: parameters(getattr(thing, name), depth - 1) for name in names}
    if depth and isinstance(thing, (list, tuple)) and len(thing) <= MOST_NUMBERS:
        return [parameters(value, depth - 1) for value in thing]
    return type(thing).__name__


def mapped(state: Any, change: Callable[[NDArray[Any]], Any]) -> Any:
    """Return a controller's state, a tuple of arrays and of such tuples, each array changed."""
    if isinstance(state, tuple):
        made = [mapped(part, change) for part in state]
        return type(state)(*made) if hasattr(state, "_fields") else tuple(made)
    return None if state is None else change(state)


def restored(template: Any, saved: Any) -> Any:
    """Return a saved state in the form of a template: tuples and arrays."""
    if isinstance(template, tuple):
        made = [restored(t, s) for t, s in zip(template, saved, strict=True)]
        return type(template)(*made) if hasattr(template, "_fields") else tuple(made)
    return None if template is None else saved.numpy().astype(template.dtype)
