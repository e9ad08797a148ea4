"""Catalogue of the policies that come with the project, as controllers for benchmarks.

Each preset is an entry. Its policies, one a training seed, are compared together, since the result
of a single seed is no evidence.
"""

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym

from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import PolicyFileError, read, record_of
from agents.policies.residual import ResidualPolicy, with_controller
from agents.settings import presets as configs
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from baselines.core.catalogue import CONTROLLERS as CLASSICAL
from pam_envs.hysteresis.protocol import kinds
from pam_envs.parameters import Signals
from pam_envs.wording import near

FOLDER = Path(__file__).resolve().parents[1] / "pretrained"
BY_HAND = "by hand"


@dataclass(frozen=True)
class Entry:
    """Policies of one preset."""

    file: str  # name in agents/pretrained, with {seed} for the training seed
    summary: str
    knowledge: str  # "nominal model" for a policy that was trained in simulation of it
    citation: str
    envs: tuple[str, ...]
    kind: str = "learned"
    baseline: str = ""  # controller that a residual corrects
    # settings tried for the preset, with earlier searches and those of a residual's controller;
    # None if not counted
    trials: int | None = None
    tuning: str = BY_HAND  # origin of the settings
    # knobs of the corrected controller found by a search
    found: Mapping[str, float] = field(default_factory=dict, hash=False)

    @property
    def preset(self) -> str:
        """Name of the preset, for example ``KneeWalk-v0.ppo``."""
        return self.file.removesuffix(".s{seed}.onnx")

    @property
    def first(self) -> Path | None:
        """File of the lowest training seed, None without a file."""
        return next(iter(self.files().values()), None)

    @property
    def author(self) -> str:
        """Author in BibTeX form, of the lowest training seed; empty for those of this package."""
        return "" if self.first is None else str(record_of(self.first).get("author", ""))

    @property
    def trained_with(self) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
        """Names of signals and actions of the lowest training seed; None without a file."""
        if self.first is None:
            return None
        card = read(self.first).card
        signals, actions = (
            tuple(s["name"] for s in card[p]) for p in ("signals", "action_signals")
        )
        return signals, actions

    def files(self) -> dict[int, Path]:
        """Return the existing files by training seed."""
        start, _, end = self.file.partition("{seed}")
        seeds = {path: path.name[len(start) : -len(end)] for path in FOLDER.glob(f"{start}*{end}")}
        found = {int(seed): path for path, seed in seeds.items() if seed.isdigit()}
        return dict(sorted(found.items()))


PPO = "Schulman et al., Proximal policy optimization algorithms, arXiv:1707.06347, 2017"
SAC = (
    "Haarnoja et al., Soft actor-critic: off-policy maximum entropy deep reinforcement learning "
    "with a stochastic actor, ICML 2018"
)
TQC = (
    "Kuznetsov et al., Controlling overestimation bias with truncated mixture of continuous "
    "distributional quantile critics, ICML 2020"
)
LSTM = "Hochreiter, Schmidhuber, Long short-term memory, Neural Computation 9 (1997)"
RESIDUAL = "Johannink et al., Residual reinforcement learning for robot control, ICRA 2019"


class Kind(NamedTuple):
    """Prefix of controllers' names, summary and citation of an algorithm and variant."""

    name: str
    summary: str
    citation: str


KINDS: dict[str, Kind] = {
    "ppo": Kind("ppo", "PPO, two layers beside a linear path; no memory", PPO),
    "ppo-history": Kind("history", "PPO with a history of the last control periods", PPO),
    "ppo-randomized": Kind(
        "randomized", "PPO with a history of the last control periods, trained on drawn plants", PPO
    ),
    "ppo-robust": Kind(
        "robust",
        "PPO with a strided history, trained on drawn plants, paces and wearers; its critic saw "
        "the parameters",
        PPO,
    ),
    "ppo-rma": Kind("rma", "student of a PPO teacher that saw the parameters", PPO),
    "recurrent_ppo": Kind("recurrent", "PPO with an LSTM, inputs beside it", f"{PPO}; {LSTM}"),
    "sac": Kind("sac", "SAC, two layers; no memory", SAC),
    "tqc": Kind("tqc", "TQC, two layers; no memory", TQC),
}
"""By algorithm and variant, as in a file name; residuals and a user's presets are separate."""
NAME = re.compile(r"[a-z0-9_]+")  # valid names of controllers
HOW_TO_NAME = "name its file ENV.ALGO-VARIANT.yaml, the variant in small letters, digits and _"
SUFFIXES: dict[str, str] = {
    "MusclePositioning-v0": "",
    "AntagonisticJoint-v0": "_joint",
    "RedundantManipulator-v0": "_manipulator",
    "ElbowOrthosis-v0": "_elbow",
}
"""Suffixes of controllers' names; the others are the environment's name in snake case."""
WHERE: dict[str, str] = {
    "KneeTension-v0": "; trained on the brace that is free to move",
    "KneeWalk-v0": "; trained at 5 s a stride",
    "KneeStairsUp-v0": "; trained at the paper's pace",
    "KneeStairsDown-v0": "; trained at the paper's pace",
}


def offered() -> dict[str, Entry]:
    """Return an entry for every preset; SettingsError for one whose names do not fit."""
    made: dict[str, Entry] = {}
    for (env_id, algo, variant), path in configs.presets().items():
        preset = f"{algo}-{variant}" if variant else algo
        config = configs.read(path)
        if (config.env, config.algo) != (env_id, algo):
            raise SettingsError(
                f"{path.name} is for {config.env} with {config.algo}; {HOW_TO_NAME}"
            )
        name = _prefix(preset) + _suffix(env_id.removeprefix("PAM/"))
        if name in made or not NAME.fullmatch(name):
            raise SettingsError(
                f"the preset {path.stem} would get the controller name {name!r}, which is "
                f"{'already in use' if name in made else 'not a valid name'}; {HOW_TO_NAME}"
            )
        made[name] = _entry(path, preset, config)
    return made


def _prefix(preset: str) -> str:
    if preset == "ppo-residual":
        return "residual"
    return KINDS[preset].name if preset in KINDS else preset.replace("-", "_")


def _suffix(env: str) -> str:
    words = re.findall(r"[A-Z]?[a-z0-9]+", env.partition("-")[0])
    return SUFFIXES.get(env, "".join(f"_{word.lower()}" for word in words))


def _entry(path: Path, preset: str, config: Config) -> Entry:
    """Return the entry of a preset, learned or residual."""
    where = WHERE.get(config.env.removeprefix("PAM/"), "")
    baseline = config.residual.controller
    trials, tuning = budget(config)
    made = Entry(
        file=f"{path.stem}.s{{seed}}.onnx",
        summary="",
        knowledge="nominal model",
        citation="",
        envs=(config.env,),
        trials=trials,
        tuning=tuning,
    )
    if not baseline:
        kind = KINDS.get(preset) or _own(preset, path)
        return replace(made, summary=f"{kind.summary}{where}", citation=kind.citation)
    policy = config.algo.upper().replace("_", " ")
    return replace(
        made,
        summary=f"{baseline} corrected by a {policy} policy, which sees its action{where}",
        knowledge=CLASSICAL[baseline].knowledge,
        citation=f"{KINDS[config.algo].citation}; {RESIDUAL}",
        kind="residual",
        baseline=baseline,
        found=CLASSICAL[baseline].found,
    )


def _own(preset: str, path: Path) -> Kind:
    """Return the kind of a user's preset, described by the first comment of its file."""
    algo, _, variant = preset.partition("-")
    first = path.read_text(encoding="utf-8").partition("\n")[0]
    summary = first.removeprefix("#").strip(" .") if first.startswith("#") else ""
    return Kind(preset, summary or f"{algo}, variant {variant}", KINDS[algo].citation)


def budget(config: Config) -> tuple[int | None, str]:
    """Return the number of settings tried for a preset, and its origin."""
    search, corrected = config.search, config.residual.controller
    if corrected and corrected not in CLASSICAL:
        raise SettingsError(
            f"residual.controller = {corrected!r} is no controller{near(corrected, CLASSICAL)}"
        )
    if search.trials is None:
        return None, BY_HAND
    base = CLASSICAL[corrected].trials if corrected else 0
    parts = [f"search of {search.trials}"]
    parts += [f"{search.earlier} of searches before it"] if search.earlier else []
    parts += [f"{base} of its controller"] if base else []
    return search.trials + search.earlier + base, ", ".join(parts)


def check_files(entries: Mapping[str, Entry]) -> None:
    """Raise if a policy file has no preset, and would be left out of every comparison."""
    known = {entry.preset for entry in entries.values()}
    for path in sorted(FOLDER.glob("*.onnx")):
        named = re.fullmatch(r"(.+)\.s[0-9]+", path.stem)
        if named is None:
            raise PolicyFileError(
                f"{path.name} names no training seed, as {path.stem}.s0.onnx does"
            )
        if named[1] not in known:
            raise PolicyFileError(
                f"{path.name} is of no preset: there is no {named[1]}.yaml in agents/configs; add "
                "that, or take the file out"
            )


@functools.cache
def outdated(name: str) -> bool:
    """Return whether a policy was trained on plants that its environment no longer has."""
    first = CONTROLLERS[name].first
    if first is None:
        return False
    card = read(first).card
    kwargs: dict[str, Any] = dict(card.get("env_kwargs", {}))
    given: list[dict[str, Any]] = (
        [{}] if {"plant", "hysteresis"} & set(kwargs) else [{"hysteresis": h} for h in kinds()]
    )
    now = set()
    for kind in given:
        env: Any = gym.make(card["env"], disable_env_checker=True, **kwargs, **kind)
        now.add(env.unwrapped.plant.digest())
    return not now & set(card["plants"])


OFFERED: dict[str, Entry] = offered()  # all presets' entries, trained or not
check_files(OFFERED)
CONTROLLERS: dict[str, Entry] = {n: entry for n, entry in OFFERED.items() if entry.files()}
"""Entries with files."""


def load_pretrained(
    name: str,
    signals: Signals | None = None,
    action_signals: Signals | None = None,
    training_seed: int | None = None,
) -> OnnxPolicy:
    """Return a policy that comes with the project, by a key of :data:`CONTROLLERS`.

    The signals, if given, must equal those of the training; the default training seed is the lowest
    that exists. A ValueError says that there is no such policy or training seed, that the signals
    differ, or that the card differs from the file name in environment, algorithm, training seed or
    controller.
    """
    if name not in CONTROLLERS:
        raise ValueError(f"no policy named {name!r}{near(name, CONTROLLERS)}")
    files = CONTROLLERS[name].files()
    seed = min(files) if training_seed is None else training_seed
    if seed not in files:
        raise ValueError(f"{name} has no training seed {seed}; there are: {list(files)}")
    policy = OnnxPolicy.load(files[seed], signals, action_signals)
    card, entry = policy.card, CONTROLLERS[name]
    algo = entry.file.split(".")[1].partition("-")[0]
    for what, is_, should in (
        ("env", card["env"], entry.envs[0]),
        ("algo", card["algo"], algo),
        ("seed", card["seed"], seed),
        ("baseline", policy.corrects, entry.baseline),
    ):
        if is_ != should:
            raise PolicyFileError(
                f"the card of {policy.name} has {what} {is_!r}, its file name {should!r}; "
                "name the file after the training"
            )
    return policy


def make_controller(
    name: str,
    plant: Any = None,
    signals: Signals | None = None,
    action_signals: Signals | None = None,
    seed: int = 0,
    training_seed: int | None = None,
) -> OnnxPolicy | ResidualPolicy:
    """Return a policy with the interface of benchmarks.

    ``plant`` is the nominal plant of the controller that a residual corrects. ``seed`` is not used:
    no policy draws random numbers.
    """
    policy = load_pretrained(name, signals, action_signals, training_seed)
    return with_controller(policy, plant)
