"""Names of a policy network's inputs, in order."""

from __future__ import annotations

from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from pam_envs.parameters import Signals
from pam_envs.wording import near


def names(config: Config, signals: Signals, actions: Signals) -> tuple[str, ...]:
    """Return the signals, a residual's controller's action, and the history."""
    seen = present(config, signals, actions)
    frames = config.history.frames
    return (*seen, *(f"{n}@{k + 1}" for k in range(frames) for n in config.history.signals))


def present(config: Config, signals: Signals, actions: Signals) -> tuple[str, ...]:
    """Return the present inputs, without the history."""
    corrected = actions if config.residual.controller else ()
    return (*signals.names(), *(f"controller_{action.name}" for action in corrected))


def index(known: tuple[str, ...], name: str, where: str) -> int:
    """Return an input's index, or raise naming the nearest."""
    name = name.strip()
    if name not in known:
        raise SettingsError(f"{where}: no signal named {name!r}{near(name, known)}")
    return known.index(name)


def kept(config: Config, signals: Signals, actions: Signals) -> tuple[int, ...]:
    """Return the indices of the inputs in the history."""
    known = present(config, signals, actions)
    return tuple(index(known, name, "history.signals") for name in config.history.signals)
