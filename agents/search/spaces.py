"""What a search may choose: ranges and choices of settings, by algorithm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from agents.settings.presets import Config, from_mapping, put


@dataclass(frozen=True)
class Range:
    """Numbers from ``low`` to ``high``; ``log``: evenly by their logarithm; ``whole`` numbers."""

    low: float
    high: float
    log: bool = False
    whole: bool = False

    def suggest(self, trial: Any, name: str) -> float:
        """Return a value that the search proposes."""
        if self.whole:
            return int(trial.suggest_int(name, int(self.low), int(self.high), log=self.log))
        return float(trial.suggest_float(name, self.low, self.high, log=self.log))

    @property
    def common(self) -> float:
        """Any value, the same for all: what is searched does not matter."""
        return int(self.low) if self.whole else self.low

    def nearest(self, value: Any) -> Any:
        """Return the value, or the end of the range that is nearer."""
        held = min(max(value, self.low), self.high)
        return round(held) if self.whole else held


@dataclass(frozen=True)
class Choice:
    """One of several values; a list is named by its text."""

    values: tuple[Any, ...]

    def suggest(self, trial: Any, name: str) -> Any:
        """Return a value that the search proposes."""
        texts = [str(value) for value in self.values]
        return self.values[texts.index(trial.suggest_categorical(name, texts))]

    @property
    def common(self) -> Any:
        """Any value, the same for all: what is searched does not matter."""
        return self.values[0]

    def nearest(self, value: Any) -> str:
        """Return the text of the value, or of the first one."""
        texts = [str(entry) for entry in self.values]
        return str(value) if str(value) in texts else texts[0]


Space = Mapping[str, Range | Choice]

_RATE = Range(3e-5, 3e-3, log=True)
_HORIZON = Range(10.0, 200.0, log=True)
_WIDTHS = Choice(([32, 32], [64, 64], [128, 128]))
_WIDTH = Choice(([32], [64], [128]))
"""Of the layer behind a memory."""
_PPO: Space = {
    "learning_rate": _RATE,
    "horizon": _HORIZON,
    "gae_lambda": Range(0.8, 0.99),
    "clip_range": Range(0.1, 0.3),
    "n_epochs": Range(2, 8, whole=True),
    "network.log_std_init": Range(-4.5, -0.5),
    "network.gain": Range(5.0, 50.0, log=True),
}
_OFF_POLICY: Space = {
    "learning_rate": _RATE,
    "horizon": _HORIZON,
    "tau": Range(0.002, 0.05, log=True),
    "gradient_steps": Range(4, 16, whole=True),
    "network.hidden": _WIDTHS,
    "network.gain": Range(5.0, 50.0, log=True),
}
SPACES: Mapping[str, Space] = {
    "ppo": {**_PPO, "network.hidden": _WIDTHS},
    "recurrent_ppo": {**_PPO, "network.hidden": _WIDTH, "lstm_size": Choice((16, 32, 64))},
    "sac": _OFF_POLICY,
    "tqc": {**_OFF_POLICY, "top_quantiles_to_drop_per_net": Range(0, 5, whole=True)},
}
"""Names without a dot are of the algorithm's part. ``horizon`` is ``1 / (1 - gamma)``, in control
periods; ``learning_rate`` is the first of the two, and the last stays the share of it that it is
in the preset."""


def space_of(config: Config) -> dict[str, Range | Choice]:
    """Return what a search chooses for a preset."""
    space = dict(SPACES[config.algo])
    if config.residual.controller:
        space["residual.scale"] = Range(0.003, 0.3, log=True)
    if config.history.frames:
        space["history.frames"] = Range(2, 32, log=True, whole=True)
    return space


def as_settings(config: Config, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by dotted name from what a search chose."""
    made: dict[str, Any] = {}
    for name, value in values.items():
        if name == "horizon":
            made[f"{config.algo}.gamma"] = round(1.0 - 1.0 / value, 5)
        elif name == "learning_rate":
            first, last = config.chosen.learning_rate
            share = last / first if first else 1.0
            made[f"{config.algo}.learning_rate"] = [_short(value), _short(share * _short(value))]
        else:
            place = name if "." in name else f"{config.algo}.{name}"
            made[place] = _short(value) if isinstance(value, float) else value
    return made


def from_settings(config: Config) -> dict[str, Any]:
    """Return the preset's own values as a search would choose them, ends of ranges where beyond."""
    plain: dict[str, Any] = config.as_dict()
    own = plain[config.algo]
    made: dict[str, Any] = {}
    for name, range_ in space_of(config).items():
        if name == "horizon":
            value: Any = 1.0 / max(1.0 - own["gamma"], 1e-9)
        elif name == "learning_rate":
            value = own["learning_rate"][0]
        else:
            part, _, entry = name.rpartition(".")
            value = (plain[part] if part else own)[entry]
        made[name] = range_.nearest(value)
    return made


def with_settings(config: Config, settings: Mapping[str, Any]) -> Config:
    """Return the configuration with settings by dotted name."""
    plain = config.as_dict()
    for name, value in settings.items():
        put(plain, name, value)
    return from_mapping(plain)


def _short(value: float) -> float:
    """Return a number to three digits, as a person would write it."""
    return float(f"{value:.3g}")
