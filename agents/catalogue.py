"""Trained policies that come with the project, as controllers for benchmarks.

A controller may have been trained several times: its file then has ``{seed}`` in its name, and
``training_seed`` says which. A comparison is of all of them, since one lucky seed proves nothing.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents import configs
from agents.configs import Config
from agents.onnx_file import PolicyFileError
from agents.policy import OnnxPolicy
from agents.residual import ResidualPolicy, with_controller
from baselines.catalogue import CONTROLLERS as CLASSICAL
from pam_envs.parameters import Signals
from pam_envs.wording import near

FOLDER = Path(__file__).resolve().parent / "pretrained"


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

    @property
    def author(self) -> str:
        """Who trained it, as BibTeX wants it; empty for the authors of this package.

        The JSON file beside the policy of the lowest training seed says so, under ``author``.
        """
        cards = [path.with_suffix(".json") for path in self.files().values()]
        if not cards or not cards[0].is_file():
            return ""
        return str(json.loads(cards[0].read_text(encoding="utf-8")).get("author", ""))

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
"""By algorithm and variant, as in a preset's file name. Residuals are beside these."""
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


def _offered() -> dict[str, Entry]:
    """Return an entry for every preset of a known kind, and for every residual."""
    made = {}
    for env_id, algo, variant in configs.presets():
        env = env_id.removeprefix("PAM/")
        preset = f"{algo}-{variant}" if variant else algo
        config = configs.preset(env_id, algo, variant)
        if preset.startswith("ppo-residual"):
            made[variant + SUFFIXES[env]] = _residual(env, preset, config)
        elif preset in KINDS:
            made[KINDS[preset].name + SUFFIXES[env]] = _learned(env, preset, config)
    return made


def _learned(env: str, preset: str, config: Config) -> Entry:
    kind = KINDS[preset]
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
    trials, tuning = budget(config)
    return Entry(
        file=f"{env}.{preset}.s{{seed}}.onnx",
        summary=f"{baseline} corrected by a PPO policy, which sees its action{WHERE.get(env, '')}",
        knowledge=CLASSICAL[baseline].knowledge,
        citation=f"{PPO}; {RESIDUAL}",
        envs=(f"PAM/{env}",),
        kind="residual",
        baseline=baseline,
        trials=trials,
        tuning=tuning,
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


OFFERED: dict[str, Entry] = _offered()
"""All policies that the board would take, trained or not."""
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
