"""Trained policies that come with the project, as controllers for benchmarks.

A controller may have been trained several times: its file then has ``{seed}`` in its name, and
``training_seed`` says which. A comparison is of all of them, since one lucky seed proves nothing.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import PolicyFileError, read, record_of
from agents.policies.residual import ResidualPolicy, with_controller
from agents.settings import presets as configs
from agents.settings.presets import Config
from agents.settings.schema import SettingsError
from baselines.core.catalogue import CONTROLLERS as CLASSICAL
from pam_envs.parameters import Signals
from pam_envs.wording import near

FOLDER = Path(__file__).resolve().parents[1] / "pretrained"


BY_HAND = "by hand"


@dataclass(frozen=True)
class Entry:
    """A policy as the board names it.

    Attributes
    ----------
    file : str
        In ``agents/pretrained``, perhaps with ``{seed}``; its training is recorded in the JSON
        file beside it.
    summary, citation : str
    knowledge : str
        What a controller is told: "nominal model" for one that was trained in simulation of it.
    envs : tuple of str
        Ids that it runs in.
    kind : {"learned", "residual"}
    baseline : str
        Name of the controller that a residual corrects.
    trials : int or None
        Settings that were tried to choose the preset's, those of earlier searches and of a
        residual's controller with them; None where nobody counted.
    tuning : str
        How that number came about.
    found : mapping
        What a search found for the knobs of that controller.
    """

    file: str
    summary: str
    knowledge: str
    citation: str
    envs: tuple[str, ...]
    kind: str = "learned"
    baseline: str = ""
    trials: int | None = None
    tuning: str = BY_HAND
    found: Mapping[str, float] = field(default_factory=dict, hash=False)

    @property
    def author(self) -> str:
        """Who trained it, as BibTeX wants it; empty for the authors of this package.

        The JSON file beside the policy of the lowest training seed says so, under ``author``.
        """
        first = next(iter(self.files().values()), None)
        return "" if first is None else str(record_of(first).get("author", ""))

    @property
    def trained_with(self) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
        """Names of signals and actions, by the lowest training seed; None without a file."""
        first = next(iter(self.files().values()), None)
        if first is None:
            return None
        card = read(first).card
        signals, actions = (
            tuple(s["name"] for s in card[p]) for p in ("signals", "action_signals")
        )
        return signals, actions

    def files(self) -> dict[int, Path]:
        """Return the files that are there by training seed."""
        start, mark, end = self.file.partition("{seed}")
        if not mark:
            return {0: FOLDER / self.file}
        found = {
            int(path.name[len(start) : len(path.name) - len(end)]): path
            for path in FOLDER.glob(f"{start}*{end}")
            if path.name[len(start) : len(path.name) - len(end)].isdigit()
        }
        single = FOLDER / (start.removesuffix(".s") + end)
        if 0 not in found and single.is_file():
            found[0] = single
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
MODEL = "nominal model"


@dataclass(frozen=True)
class Kind:
    """A kind of training of which an environment may have a preset.

    Attributes
    ----------
    name : str
        What names of controllers begin with.
    summary, citation : str
    """

    name: str
    summary: str
    citation: str


KINDS: dict[str, Kind] = {
    "ppo": Kind("ppo", "PPO, two layers beside a linear path; no memory", PPO),
    "ppo-history": Kind("history", "PPO that sees the last control periods", PPO),
    "ppo-randomized": Kind(
        "randomized", "PPO that sees the last control periods, trained on drawn plants", PPO
    ),
    "recurrent_ppo": Kind(
        "recurrent", "PPO with a long short-term memory, inputs beside it", f"{PPO}; {LSTM}"
    ),
    "sac": Kind("sac", "SAC, two layers; no memory", SAC),
    "tqc": Kind("tqc", "TQC, two layers; no memory", TQC),
}
"""By algorithm and variant, as in a preset's file name. Residuals are beside these, and presets
of one's own."""
NAME = re.compile(r"[a-z0-9_]+")
"""What a row of the board may be named after."""
HOW_TO_NAME = "name its file ENV.ALGO-VARIANT.yaml, the variant in small letters, digits and _"
SUFFIXES: dict[str, str] = {
    "MusclePositioning-v0": "",
    "KneeTension-v0": "_knee_tension",
    "KneeStiffness-v0": "_knee_stiffness",
    "KneeWalk-v0": "_knee_walk",
    "KneeStairsUp-v0": "_knee_stairs_up",
    "KneeStairsDown-v0": "_knee_stairs_down",
    "AntagonisticJoint-v0": "_joint",
    "RedundantManipulator-v0": "_manipulator",
    "ElbowOrthosis-v0": "_elbow",
}
"""What names of controllers end with, by environment."""
WHERE: dict[str, str] = {
    "KneeTension-v0": "; trained on the brace that is free to move",
    "KneeWalk-v0": "; trained at 5 s a stride",
    "KneeStairsUp-v0": "; trained at the paper's pace",
    "KneeStairsDown-v0": "; trained at the paper's pace",
}


def offered() -> dict[str, Entry]:
    """Return an entry for every preset.

    Raises
    ------
    ValueError
        If a preset is of another environment or algorithm than its file's name says, or that
        gives no name or the one of another.
    """
    made: dict[str, Entry] = {}
    for (env_id, algo, variant), path in configs.presets().items():
        env = env_id.removeprefix("PAM/")
        preset = f"{algo}-{variant}" if variant else algo
        config = configs.read(path)
        if (config.env, config.algo) != (env_id, algo):
            raise SettingsError(
                f"{path.name} is for {config.env} with {config.algo}; {HOW_TO_NAME}"
            )
        name = _name(preset) + _suffix(env)
        if name in made or not NAME.fullmatch(name):
            raise SettingsError(
                f"the preset {env}.{preset} would be the controller {name!r}, "
                f"{'as another is' if name in made else 'which is no name'}; {HOW_TO_NAME}"
            )
        if config.residual.controller:
            made[name] = _residual(env, preset, config)
        else:
            made[name] = _learned(env, preset, KINDS.get(preset) or _own(preset, path), config)
    return made


def _name(preset: str) -> str:
    """Return what names of a preset's controllers begin with."""
    if preset == "ppo-residual":
        return "residual"
    return KINDS[preset].name if preset in KINDS else preset.replace("-", "_")


def _suffix(env: str) -> str:
    """Return what names end with: as listed, or made from the id of an unlisted environment."""
    words = re.findall(r"[A-Z]?[a-z0-9]+", env.partition("-")[0])
    return SUFFIXES.get(env, "".join(f"_{word.lower()}" for word in words))


def _own(preset: str, path: Path) -> Kind:
    """Return the kind of a preset of one's own; its file's first comment says what it is."""
    algo, _, variant = preset.partition("-")
    first = path.read_text(encoding="utf-8").partition("\n")[0]
    said = first.removeprefix("#").strip(" .") if first.startswith("#") else ""
    return Kind(preset, said or f"{algo}, variant {variant}", KINDS[algo].citation)


def _learned(env: str, preset: str, kind: Kind, config: Config) -> Entry:
    trials, tuning = budget(config)
    return Entry(
        file=f"{env}.{preset}.s{{seed}}.onnx",
        summary=f"{kind.summary}{WHERE.get(env, '')}",
        knowledge=MODEL,
        citation=kind.citation,
        envs=(f"PAM/{env}",),
        trials=trials,
        tuning=tuning,
    )


def _residual(env: str, preset: str, config: Config) -> Entry:
    baseline = config.residual.controller
    if baseline not in CLASSICAL:
        raise SettingsError(
            f"{env}.{preset}.yaml: residual.controller = {baseline!r} is no controller"
            f"{near(baseline, CLASSICAL)}"
        )
    trials, tuning = budget(config)
    algo = preset.partition("-")[0]
    policy, where = algo.upper().replace("_", " "), WHERE.get(env, "")
    return Entry(
        file=f"{env}.{preset}.s{{seed}}.onnx",
        summary=f"{baseline} corrected by a {policy} policy, which sees its action{where}",
        knowledge=CLASSICAL[baseline].knowledge,
        citation=f"{KINDS[algo].citation}; {RESIDUAL}",
        envs=(f"PAM/{env}",),
        kind="residual",
        baseline=baseline,
        trials=trials,
        tuning=tuning,
        found=CLASSICAL[baseline].found,
    )


def budget(config: Config) -> tuple[int | None, str]:
    """Return how many settings were tried to choose a preset's, and where."""
    search, corrected = config.search, config.residual.controller
    if search.trials is None:
        return None, BY_HAND
    base = CLASSICAL[corrected].trials if corrected else 0
    said = [f"search of {search.trials}"]
    said += [f"{search.earlier} of searches before it"] if search.earlier else []
    said += [f"{base} of its controller"] if base else []
    return search.trials + search.earlier + base, ", ".join(said)


def check_files(entries: Mapping[str, Entry]) -> None:
    """Raise if a policy file is of no preset, and would be left out of every comparison.

    Raises
    ------
    PolicyFileError
        Naming the file.
    """
    known = {preset_of(entry) for entry in entries.values()}
    for path in sorted(FOLDER.glob("*.onnx")):
        preset = re.sub(r"\.s[0-9]+$", "", path.stem)
        if preset not in known:
            raise PolicyFileError(
                f"{path.name} is of no preset: there is no {preset}.yaml in agents/configs; add "
                "that, or take the file out"
            )


def preset_of(entry: Entry) -> str:
    """Return the name of an entry's preset, like ``KneeWalk-v0.ppo``."""
    return entry.file.removesuffix(".s{seed}.onnx")


OFFERED: dict[str, Entry] = offered()
"""All policies that the board would take, trained or not."""
check_files(OFFERED)
CONTROLLERS: dict[str, Entry] = {n: entry for n, entry in OFFERED.items() if entry.files()}
"""Those of which files are there."""
PRETRAINED: dict[str, str] = {
    name: str(next(iter(entry.files().values()))) for name, entry in CONTROLLERS.items()
}
"""The file of the lowest training seed of each."""


def load_pretrained(
    name: str,
    signals: Signals | None = None,
    action_signals: Signals | None = None,
    training_seed: int | None = None,
) -> OnnxPolicy:
    """Return a policy that comes with the project.

    Parameters
    ----------
    name : str
        A key of :data:`CONTROLLERS`.
    signals, action_signals : Signals, optional
        The environment's; given, they must be those of the training.
    training_seed : int, optional
        Which of its trainings; default: the lowest that is there.

    Raises
    ------
    ValueError
        If there is no such policy or training, the signals differ, or the file is of another
        environment, algorithm or training seed than its name says.
    """
    if name not in CONTROLLERS:
        raise ValueError(f"no policy named {name!r}{near(name, CONTROLLERS)}")
    files = CONTROLLERS[name].files()
    seed = min(files) if training_seed is None else training_seed
    if seed not in files:
        raise ValueError(f"{name} has no training seed {seed}; there are: {list(files)}")
    policy = OnnxPolicy.load(files[seed], signals, action_signals)
    _check_name(policy, CONTROLLERS[name], seed)
    return policy


def _check_name(policy: OnnxPolicy, entry: Entry, seed: int) -> None:
    """Raise unless a policy is the one that its file's name says."""
    card = policy.card
    said = (card["env"], card["algo"], card["seed"], policy.corrects)
    algo = entry.file.split(".")[1].partition("-")[0]
    wanted = (entry.envs[0], algo, seed, entry.baseline)
    for what, is_, should in zip(("env", "algo", "seed", "baseline"), said, wanted, strict=True):
        if is_ != should:
            raise PolicyFileError(
                f"{policy.name} is by its card of {what} {is_!r}, and should be of {should!r}; "
                "name files as they were trained"
            )


def make_controller(
    name: str,
    plant: Any = None,
    signals: Signals | None = None,
    action_signals: Signals | None = None,
    seed: int = 0,
    training_seed: int | None = None,
) -> OnnxPolicy | ResidualPolicy:
    """Return a policy as benchmarks ask for controllers.

    ``plant`` is what the controller that a residual corrects is told; other policies are told
    nothing. ``seed`` is not used: no policy draws.
    """
    policy = load_pretrained(name, signals, action_signals, training_seed)
    return with_controller(policy, plant)
