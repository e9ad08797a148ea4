"""The classical controllers that residual policies correct: made by name, told a nominal plant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numpy.typing import NDArray

from agents.settings.schema import SettingsError
from baselines.core import catalogue
from pam_envs.parameters import Signals
from pam_envs.wording import near


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
