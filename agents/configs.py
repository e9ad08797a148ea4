"""Training presets, one YAML file per environment and algorithm, with a checked schema."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import yaml

from agents.settings import SettingsError, build, choice, nearest, number

FOLDER = Path(__file__).resolve().parent / "configs"
Algo = Literal["ppo", "sac"]
ALGORITHMS: tuple[str, ...] = ("ppo", "sac")


@dataclass(frozen=True)
class Network:
    """The policy's network.

    Attributes
    ----------
    hidden : tuple of int
        Width of each hidden layer, of the policy and of the critic alike.
    activation : {"tanh", "relu", "elu"}
    log_std_init : float
        PPO: logarithm of the first standard deviation of the action, in its range [-1, 1].
    differences : tuple of str
        ``"a - b"`` with names of signals: fixed extra inputs ``gain * (a - b)``. A millimetre is a
        thirtieth of the range, so that errors are small numbers among the plain signals.
    gain : float
        That factor.
    linear : bool
        PPO: a linear path from the inputs to the action beside the layers, as in structured
        control nets (Srouji, Zhang, Salakhutdinov, ICML 2018).
    hold : tuple of str
        PPO with ``linear``: a signal for each action. The untrained policy returns its value, so
        that learning starts from "keep the last set-point".
    """

    hidden: tuple[int, ...] = number((64, 64), 1, 4096)
    activation: str = choice("tanh", "tanh", "relu", "elu")
    log_std_init: float = number(0.0, -10.0, 3.0)
    differences: tuple[str, ...] = ()
    gain: float = number(10.0, 0.0, 1e4)
    linear: bool = False
    hold: tuple[str, ...] = ()


@dataclass(frozen=True)
class Normalize:
    """Running normalisation during training; the exported policy contains it."""

    observation: bool = False
    reward: bool = True
    clip_observation: float = number(10.0, 0.1, 1e6)
    clip_reward: float = number(10.0, 0.1, 1e6)


@dataclass(frozen=True)
class PPO:
    """Proximal policy optimisation (Schulman et al. 2017), names as in stable-baselines3.

    ``learning_rate`` runs linearly from the first value to the second over the training.
    """

    n_steps: int = number(32, 2, 100_000)
    batch_size: int = number(2048, 2, 1_000_000)
    n_epochs: int = number(4, 1, 100)
    learning_rate: tuple[float, float] = number((3e-4, 3e-4), 0.0, 1.0)
    gamma: float = number(0.97, 0.0, 1.0)
    gae_lambda: float = number(0.95, 0.0, 1.0)
    clip_range: float = number(0.2, 1e-3, 10.0)
    ent_coef: float = number(0.0, 0.0, 10.0)
    vf_coef: float = number(0.5, 0.0, 100.0)
    max_grad_norm: float = number(0.5, 1e-3, 1e3)
    target_kl: float | None = number(None, 1e-6, 10.0)


@dataclass(frozen=True)
class SAC:
    """Soft actor-critic (Haarnoja et al. 2018), names as in stable-baselines3."""

    buffer_size: int = number(200_000, 100, 100_000_000)
    learning_starts: int = number(5_000, 0, 100_000_000)
    batch_size: int = number(256, 1, 1_000_000)
    learning_rate: tuple[float, float] = number((1e-3, 1e-3), 0.0, 1.0)
    gamma: float = number(0.97, 0.0, 1.0)
    tau: float = number(0.005, 0.0, 1.0)
    train_freq: int = number(1, 1, 100_000)
    gradient_steps: int = number(8, 1, 100_000)
    ent_coef: float | Literal["auto"] = number("auto", 0.0, 100.0)


@dataclass(frozen=True)
class Config:
    """A training run: what is learnt, where, and how.

    Attributes
    ----------
    env : str
        Environment id.
    algo : {"ppo", "sac"}
    steps : int
        Control periods of all rows together.
    num_envs : int
        Rows of the batched environment.
    checkpoint_steps : int
        Control periods between checkpoints.
    env_kwargs : dict
        Arguments of the environment.
    network, normalize, ppo, sac
        The parts; ``ppo`` or ``sac`` is used according to ``algo``.
    schema : int
        Version of this schema.
    """

    env: str
    algo: str = choice("ppo", *ALGORITHMS)
    steps: int = number(1_000_000, 1, 10**12)
    num_envs: int = number(256, 1, 2**20)
    checkpoint_steps: int = number(500_000, 1, 10**12)
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    network: Network = field(default_factory=Network)
    normalize: Normalize = field(default_factory=Normalize)
    ppo: PPO = field(default_factory=PPO)
    sac: SAC = field(default_factory=SAC)
    schema: int = number(1, 1, 1)

    def __post_init__(self) -> None:
        """Refuse combinations that cannot train."""
        rollout = self.ppo.n_steps * self.num_envs
        if self.algo == "ppo" and rollout % min(self.ppo.batch_size, rollout):
            raise SettingsError(
                f"ppo.batch_size = {self.ppo.batch_size} does not divide the {rollout} samples of "
                f"a rollout (ppo.n_steps * num_envs); choose a divisor"
            )
        if self.network.hold and not self.network.linear:
            raise SettingsError("network.hold needs network.linear: true")
        if self.algo == "sac" and self.network.linear:
            raise SettingsError("network.linear is for ppo; leave it out for sac")

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, without the other algorithm's part."""
        plain = _plain(dataclasses.asdict(self))
        for other in ALGORITHMS:
            if other != self.algo:
                del plain[other]
        made: dict[str, Any] = plain
        return made


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value


def presets() -> dict[tuple[str, str], Path]:
    """Return the presets' files by environment id and algorithm."""
    found = {}
    for path in sorted(FOLDER.glob("*.yaml")):
        name, _, algo = path.stem.rpartition(".")
        found[f"PAM/{name}", algo] = path
    return found


def preset(env: str, algo: str) -> Config:
    """Return the preset of an environment and algorithm.

    Raises
    ------
    SettingsError
        If there is none, naming the nearest.
    """
    found = presets()
    if algo not in ALGORITHMS:
        raise SettingsError(f"algo = {algo!r} is not known{nearest(algo, list(ALGORITHMS))}")
    if (env, algo) not in found:
        ids = [e for e, a in found if a == algo]
        raise SettingsError(
            f"no {algo} preset for {env!r}{nearest(env, ids)} A file of your own: --config FILE"
        )
    return read(found[env, algo])


def read(path: str | Path) -> Config:
    """Return the configuration in a YAML file, or on the card beside a policy.

    Raises
    ------
    SettingsError
        If the file is no YAML mapping or a setting is unknown or out of bounds.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        given = json.loads(text) if path.suffix == ".json" else yaml.safe_load(text)
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise SettingsError(f"{path.name} cannot be read as YAML: {error}") from error
    if isinstance(given, Mapping) and "action_signals" in given:
        given = given.get("config")
    try:
        return from_mapping(given)
    except SettingsError as error:
        raise SettingsError(f"{path.name}: {error}") from error


def from_mapping(given: Any) -> Config:
    """Return the configuration that a mapping describes; see :func:`read`."""
    made: Config = build(Config, given)
    return made


def changed(config: Config, assignments: Sequence[str]) -> Config:
    """Return the configuration with ``"ppo.gamma=0.95"`` and the like applied.

    Raises
    ------
    SettingsError
        If an assignment has no ``=`` or names no setting.
    """
    plain = config.as_dict()
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise SettingsError(f"{assignment!r} must read name=value, for example ppo.gamma=0.95")
        at: Any = plain
        *above, last = name.strip().split(".")
        for part in above:
            at = at.setdefault(part, {}) if isinstance(at, dict) else None
            if not isinstance(at, Mapping):
                raise SettingsError(f"{name!r} names no setting")
        at[last] = yaml.safe_load(text)
    return from_mapping(plain)
