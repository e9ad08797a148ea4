"""Classical controllers that residual policies correct, by name."""

from __future__ import annotations

from typing import Any

from agents.settings.schema import SettingsError
from baselines.core import catalogue
from pam_envs.parameters import Signals
from pam_envs.wording import near


def make(name: str, plant: Any, signals: Signals, actions: Signals) -> Any:
    """Return a controller by name, built from a nominal plant.

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
