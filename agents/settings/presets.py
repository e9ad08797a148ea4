"""Training presets, one YAML file per environment and algorithm, with a checked schema.

A file is named ``ENV.ALGO.yaml`` or ``ENV.ALGO-VARIANT.yaml``. With ``extends: ENV.ALGO`` it holds
only the differences from another preset, without that preset's search, and without its algorithm's
settings if the algorithm differs.
"""

import dataclasses
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym

import pam_envs  # noqa: F401  (registers the environments)
from agents.settings import parts
from agents.settings.parts import (
    Adaptation,
    Cost,
    Evaluation,
    History,
    Network,
    Normalize,
    Plants,
    Privileged,
    Residual,
    Search,
    Widening,
)
from agents.settings.schema import SettingsError, build, choice, number
from pam_envs import yaml_file
from pam_envs.wording import near

FOLDER = Path(__file__).resolve().parents[1] / "configs"
ALGORITHMS: tuple[str, ...] = ("ppo", "sac", "tqc", "recurrent_ppo")
ON_POLICY = ("ppo", "recurrent_ppo")
MODEL = "model"
"""Entry of ``mix`` with arguments of the controller's nominal plant."""
OPTIONAL = (
    *("share", "mix", "per_reference", "cost", "history", "residual", "plants", "widening"),
    *("privileged", "adaptation", "evaluation", "search"),
)
"""Parts that the plain form omits where they equal their defaults."""
LATER = (
    *(("history", "stride"), ("cost", "relative")),
    *(("cost", "settle_seconds"), ("residual", "gauge")),
)
"""The same of settings within parts: files from before have none of them."""
NAME = re.compile(r"[A-Za-z0-9]+-v[0-9]+\.[a-z_]+(-[a-z_]+)?")
ENV = re.compile(r"PAM/[A-Za-z0-9]+-v[0-9]+")
"""Valid ids. For ``module:id`` Gymnasium would import the module, which runs its code."""


@dataclass(frozen=True)
class Config:
    """Settings of a training.

    ``steps`` and ``checkpoint_steps`` count control periods of all rows of the batched environment
    together. ``share`` has arguments of the environment that differ among the rows, each a list:
    the rows are divided evenly among all combinations, the kinds of rows. ``mix`` is a list of sets
    of arguments, each of which is combined with all of these; in an entry, ``model`` has arguments
    of the nominal plant from which a residual's controller is built, as in a scenario file.
    ``per_reference`` has further arguments by the kind's reference, for example reward weights that
    balance references with small and with large errors. The parts are described in
    :mod:`agents.settings.parts`; of those of the algorithms only that of ``algo`` is used.
    ``schema`` is the version of this schema.
    """

    env: str
    algo: str = choice("ppo", *ALGORITHMS)
    steps: int = number(1_000_000, 1, 10**12)
    num_envs: int = number(256, 1, 1_000_000)
    checkpoint_steps: int = number(500_000, 1, 10**12)
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    share: dict[str, Any] = field(default_factory=dict)
    mix: tuple[dict[str, Any], ...] = ()
    per_reference: dict[str, Any] = field(default_factory=dict)
    network: Network = field(default_factory=Network)
    normalize: Normalize = field(default_factory=Normalize)
    cost: Cost = field(default_factory=Cost)
    history: History = field(default_factory=History)
    residual: Residual = field(default_factory=Residual)
    plants: Plants = field(default_factory=Plants)
    widening: Widening = field(default_factory=Widening)
    privileged: Privileged = field(default_factory=Privileged)
    adaptation: Adaptation = field(default_factory=Adaptation)
    evaluation: Evaluation = field(default_factory=Evaluation)
    search: Search = field(default_factory=Search)
    ppo: parts.PPO = field(default_factory=parts.PPO)
    sac: parts.SAC = field(default_factory=parts.SAC)
    tqc: parts.TQC = field(default_factory=parts.TQC)
    recurrent_ppo: parts.RecurrentPPO = field(default_factory=parts.RecurrentPPO)
    schema: int = number(1, 1, 1)

    def __post_init__(self) -> None:
        """Refuse unknown environments and contradictory settings."""
        check_env(self.env)
        self._check_rollout()
        network = self.network
        if network.hold and not network.linear:
            raise SettingsError("network.hold needs network.linear: true")
        if self.algo not in ON_POLICY and network.linear:
            raise SettingsError(f"network.linear is for ppo; leave it out for {self.algo}")
        if self.residual.controller and network.hold:
            raise SettingsError(
                "network.hold is not for a residual, which starts from its controller; leave it out"
            )
        if bool(self.history.frames) != bool(self.history.signals):
            raise SettingsError("history needs both frames and signals, or neither")
        self._check_privileged()
        self._check_kinds()

    def _check_privileged(self) -> None:
        """Refuse settings that a privileged critic, a teacher or widening ranges do not fit."""
        if not self.sees_parameters:
            return
        name = "privileged.critic" if self.privileged.critic else "adaptation.steps"
        if self.adaptation.steps and (self.algo != "ppo" or not self.history.frames):
            raise SettingsError("adaptation.steps needs algo: ppo and a history for the student")
        if self.algo not in ON_POLICY or not self.network.linear:
            raise SettingsError(f"{name} needs ppo or recurrent_ppo with network.linear: true")
        if self.algo == "recurrent_ppo" and self.recurrent_ppo.critic_lstm:
            raise SettingsError(f"{name} needs recurrent_ppo.critic_lstm: false")
        if self.normalize.observation:
            raise SettingsError(f"{name} needs normalize.observation: false")

    @property
    def sees_parameters(self) -> bool:
        """Whether the critic, or a teacher, sees the plants' parameters in training."""
        return self.privileged.critic or self.adaptation.steps > 0

    def _check_kinds(self) -> None:
        given = {"randomize", "hysteresis"} & {*self.env_kwargs, *self.share}
        mixed = {name for entry in self.mix for name in entry}
        if self.plants != Plants() and given:
            raise SettingsError(
                f"env_kwargs or share and plants both set {', '.join(sorted(given))}; keep plants"
            )
        if "hysteresis" in mixed or ("randomize" in mixed and self.plants.randomize):
            raise SettingsError(
                "mix sets hysteresis, or randomize beside plants.randomize: true; leave hysteresis "
                "to plants, and plants.randomize false"
            )
        for entry in self.mix:
            if not isinstance(entry.get(MODEL, {}), Mapping):
                raise SettingsError(f"mix: model = {entry[MODEL]!r} must be a mapping")
        for name, values in self.share.items():
            if not isinstance(values, list) or not values:
                raise SettingsError(f"share.{name} = {values!r} must be a list of values")
        unknown = set(self.per_reference) - set(self.share.get("reference", ()))
        if unknown:
            raise SettingsError(
                f"per_reference names {', '.join(sorted(unknown))}, which share.reference lacks"
            )
        kinds = len(self.kinds())
        if self.num_envs % kinds:
            raise SettingsError(
                f"num_envs = {self.num_envs} is no multiple of the {kinds} kinds that share, mix "
                "and plants.hysteresis make; choose one"
            )

    def kinds(self) -> tuple[dict[str, Any], ...]:
        """Return the environment's arguments of each kind of rows."""
        return tuple({k: v for k, v in kind.items() if k != MODEL} for kind in self._rows())

    def models(self) -> tuple[dict[str, Any], ...]:
        """Return the controller's arguments of each kind of rows, {} for the rows' nominal plant.

        They are complete: those of the environment with the changes of ``model``.
        """
        kinds = zip(self.kinds(), self._rows(), strict=True)
        return tuple({**kind, **row[MODEL]} if row.get(MODEL) else {} for kind, row in kinds)

    def _rows(self) -> tuple[dict[str, Any], ...]:
        laws = {"hysteresis": list(self.plants.hysteresis)} if self.plants.hysteresis else {}
        shared = {**laws, **self.share}
        base = {**self.env_kwargs, **({"randomize": True} if self.plants.randomize else {})}
        kinds = [
            {**base, **dict(zip(shared, values, strict=True)), **entry}
            for values in itertools.product(*shared.values())
            for entry in self.mix or ({},)
        ]
        own = self.per_reference
        return tuple({**kind, **own.get(str(kind.get("reference")), {})} for kind in kinds)

    def _check_rollout(self) -> None:
        if self.algo not in ON_POLICY:
            return
        rollout = self.chosen.n_steps * self.num_envs
        if rollout % min(self.chosen.batch_size, rollout):
            raise SettingsError(
                f"{self.algo}.batch_size = {self.chosen.batch_size} does not divide the {rollout} "
                f"samples of a rollout ({self.algo}.n_steps * num_envs); choose a divisor"
            )

    @property
    def chosen(self) -> Any:
        """Settings of the algorithm in use."""
        return getattr(self, self.algo)

    def decisive(self) -> "Config":
        """Return the settings that affect the exported policy, the others at their defaults."""
        usual: Any = Config.checkpoint_steps
        return dataclasses.replace(self, search=Search(), checkpoint_steps=usual)

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, without other algorithms' parts and optional default parts."""
        default = Config(self.env)
        plain, usual = (_plain(dataclasses.asdict(config)) for config in (self, default))
        for part, name in LATER:
            if plain[part][name] == usual[part][name]:
                del plain[part][name]
        omitted = [a for a in ALGORITHMS if a != self.algo]
        omitted += [name for name in OPTIONAL if getattr(self, name) == getattr(default, name)]
        return {name: value for name, value in plain.items() if name not in omitted}


def check_env(name: str) -> None:
    """Raise unless ``name`` is an environment of this package; the message names the nearest."""
    if not (ENV.fullmatch(name) and name in gym.registry):
        known = [env for env in gym.registry if ENV.fullmatch(env)]
        raise SettingsError(f"env = {name!r} is no environment here{near(name, known)}")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value


def presets() -> dict[tuple[str, str, str], Path]:
    """Return the presets' files by environment id, algorithm and variant ("" for none)."""
    found = {}
    for path in sorted(FOLDER.glob("*.yaml")):
        name, _, kind = path.stem.rpartition(".")
        algo, _, variant = kind.partition("-")
        found[f"PAM/{name}", algo, variant] = path
    return found


def preset_path(env: str, algo: str, variant: str = "") -> Path:
    """Return the file of a preset; see :func:`preset`."""
    found = presets()
    if algo not in ALGORITHMS:
        raise SettingsError(f"algo = {algo!r} is not known{near(algo, ALGORITHMS)}")
    if (env, algo, variant) not in found:
        ids = {e: None for e, _, _ in found}
        kinds = sorted(f"{a}-{v}" if v else a for e, a, v in found if e == env)
        what = f"{algo}-{variant}" if variant else algo
        hint = near(what, kinds) if env in ids else near(env, ids)
        raise SettingsError(
            f"no {what} preset for {env!r}{hint}; for your own settings use --config FILE"
        )
    return found[env, algo, variant]


def preset(env: str, algo: str, variant: str = "") -> Config:
    """Return the preset of an environment, algorithm and variant; an error names the nearest."""
    return read(preset_path(env, algo, variant))


def read(path: str | Path) -> Config:
    """Return the configuration in a YAML file; a SettingsError names what is wrong in it."""
    path = Path(path)
    given = _mapping(path)
    with yaml_file.naming(path.name):
        return from_mapping(given)


def _mapping(path: Path) -> Any:
    try:
        return yaml_file.read(path, "settings")
    except ValueError as error:
        raise SettingsError(str(error)) from error


def from_text(text: str) -> Config:
    """Return the configuration of a YAML text; see :func:`read`."""
    return from_mapping(yaml_file.parse(text, "the settings"))


def from_mapping(given: Any) -> Config:
    """Return the configuration of a mapping; see :func:`read`."""
    if isinstance(given, Mapping) and "extends" in given:
        given = _extended(given)
    made: Config = build(Config, given)
    return made


def _extended(given: Mapping[str, Any], above: tuple[str, ...] = ()) -> Any:
    """Return a mapping merged into the preset that it extends; ``above`` is the chain so far."""
    name = given["extends"]
    under = _mapping(_extendable(name, above))
    own = {key: value for key, value in given.items() if key != "extends"}
    if "extends" in under:
        under = _extended(under, (*above, name))
    foreign = ["search"]
    if own.get("algo", under.get("algo")) != under.get("algo"):
        foreign += ALGORITHMS
    under = {key: value for key, value in under.items() if key not in foreign}
    return _merged(under, own)


def _extendable(name: Any, above: tuple[str, ...]) -> Path:
    """Return the file of a preset to extend."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise SettingsError(f"extends = {name!r} must name a preset, for example KneeWalk-v0.ppo")
    if name in above:
        circle = " -> ".join((*above[above.index(name) :], name))
        raise SettingsError(f"extends = {name!r} is circular ({circle}); remove one")
    path = FOLDER / f"{name}.yaml"
    if not path.is_file():
        names = [p.stem for p in presets().values()]
        raise SettingsError(f"extends = {name!r} is no preset{near(name, names)}")
    return path


def _merged(under: Any, over: Any) -> Any:
    if not (isinstance(under, Mapping) and isinstance(over, Mapping)):
        return over
    return {**under, **{k: _merged(under.get(k), v) for k, v in over.items()}}


def changed(config: Config, assignments: Sequence[str]) -> Config:
    """Return the configuration with assignments like ``"ppo.gamma=0.95"`` applied."""
    plain = config.as_dict()
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals:
            raise SettingsError(f"{assignment!r} must read name=value, for example ppo.gamma=0.95")
        put(plain, name, yaml_file.parse(text, name))
    return from_mapping(plain)


def put(plain: dict[str, Any], name: str, value: Any) -> None:
    """Set an entry of nested mappings by its dotted name."""
    at: Any = plain
    *above, last = name.strip().split(".")
    for part in above:
        at = at.setdefault(part, {}) if isinstance(at, dict) else None
        if not isinstance(at, Mapping):
            raise SettingsError(f"{name!r} names no setting")
    at[last] = value
