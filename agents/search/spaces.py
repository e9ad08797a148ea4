"""Search spaces of the settings, by algorithm, as Optuna's distributions."""

from collections.abc import Mapping
from typing import Any

from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

from agents.settings.presets import Config, from_mapping, put
from pam_envs import yaml_file

Distribution = FloatDistribution | IntDistribution | CategoricalDistribution
Space = Mapping[str, Distribution]


def _choice(*values: Any) -> CategoricalDistribution:
    """Return a choice among values, which Optuna stores as text."""
    return CategoricalDistribution([str(value) for value in values])


_RATE = FloatDistribution(3e-5, 3e-3, log=True)
_HORIZON = FloatDistribution(10.0, 200.0, log=True)
_GAIN = FloatDistribution(5.0, 50.0, log=True)
_WIDTHS = _choice([32, 32], [64, 64], [128, 128])
_PPO: Space = {
    "learning_rate": _RATE,
    "horizon": _HORIZON,
    "gae_lambda": FloatDistribution(0.8, 0.99),
    "clip_range": FloatDistribution(0.1, 0.3),
    "n_epochs": IntDistribution(2, 8),
    "network.log_std_init": FloatDistribution(-4.5, -0.5),
    "network.gain": _GAIN,
}
_OFF_POLICY: Space = {
    "learning_rate": _RATE,
    "horizon": _HORIZON,
    "tau": FloatDistribution(0.002, 0.05, log=True),
    "gradient_steps": IntDistribution(4, 16),
    "network.hidden": _WIDTHS,
    "network.gain": _GAIN,
}
SPACES: Mapping[str, Space] = {
    "ppo": {**_PPO, "network.hidden": _WIDTHS},
    "recurrent_ppo": {
        **_PPO,
        "network.hidden": _choice([32], [64], [128]),
        "lstm_size": _choice(16, 32, 64),
    },
    "sac": _OFF_POLICY,
    "tqc": {**_OFF_POLICY, "top_quantiles_to_drop_per_net": IntDistribution(0, 5)},
}
"""Names without a dot are of the algorithm's part. ``horizon`` is ``1 / (1 - gamma)``, in control
periods; ``learning_rate`` is the first of the two, whose ratio is the preset's."""


def space_of(config: Config) -> dict[str, Distribution]:
    """Return the search space of a preset."""
    space = dict(SPACES[config.algo])
    if config.residual.controller:
        space["residual.scale"] = FloatDistribution(0.003, 0.3, log=True)
    if config.history.frames:
        space["history.frames"] = IntDistribution(2, 32, log=True)
    return space


def suggest(trial: Any, config: Config) -> dict[str, Any]:
    """Return a trial's values in the search space of a preset."""
    return {name: _suggest(trial, name, own) for name, own in space_of(config).items()}


def _suggest(trial: Any, name: str, own: Distribution) -> Any:
    if isinstance(own, CategoricalDistribution):
        return trial.suggest_categorical(name, own.choices)
    kind = trial.suggest_float if isinstance(own, FloatDistribution) else trial.suggest_int
    return kind(name, own.low, own.high, log=own.log)


def common(config: Config) -> dict[str, Any]:
    """Return one point of a search space, the same for all presets with that space."""
    return {
        name: own.choices[0] if isinstance(own, CategoricalDistribution) else own.low
        for name, own in space_of(config).items()
    }


def as_settings(config: Config, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by dotted name from a point of the search space."""
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
            made[place] = yaml_file.parse(value, place) if isinstance(value, str) else _short(value)
    return made


def from_settings(config: Config) -> dict[str, Any]:
    """Return the nearest point of the search space to a preset's settings."""
    plain: dict[str, Any] = config.as_dict()
    own = plain[config.algo]
    made: dict[str, Any] = {}
    for name, distribution in space_of(config).items():
        if name == "horizon":
            value: Any = 1.0 / max(1.0 - own["gamma"], 1e-9)
        elif name == "learning_rate":
            value = own["learning_rate"][0]
        else:
            part, _, entry = name.rpartition(".")
            value = (plain[part] if part else own)[entry]
        made[name] = _nearest(distribution, value)
    return made


def _nearest(own: Distribution, value: Any) -> Any:
    if isinstance(own, CategoricalDistribution):
        return str(value) if str(value) in own.choices else own.choices[0]
    held = min(max(value, own.low), own.high)
    return round(held) if isinstance(own, IntDistribution) else held


def with_settings(config: Config, settings: Mapping[str, Any]) -> Config:
    """Return the configuration with settings by dotted name."""
    plain = config.as_dict()
    for name, value in settings.items():
        put(plain, name, value)
    return from_mapping(plain)


def _short(value: Any) -> Any:
    """Return a float rounded to three digits, and other numbers unchanged."""
    return float(f"{value:.3g}") if isinstance(value, float) else value
