"""Trained policies that come with the project, as controllers for benchmarks.

A controller may have been trained several times: its file then has ``{seed}`` in its name, and
``training_seed`` says which. A comparison is of all of them, since one lucky seed proves nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.policy import OnnxPolicy
from agents.residual import ResidualPolicy, with_controller
from agents.settings import nearest
from pam_envs.parameters import Signals

FOLDER = Path(__file__).resolve().parent / "pretrained"


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
    """

    file: str
    summary: str
    knowledge: str
    citation: str
    envs: tuple[str, ...]
    kind: str = "learned"
    baseline: str = ""

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
    """A kind of training of which every environment may have a preset.

    Attributes
    ----------
    preset : str
        Algorithm and variant as in the preset's file name.
    summary, citation : str
    """

    preset: str
    summary: str
    citation: str


KINDS: dict[str, Kind] = {
    "ppo": Kind("ppo", "PPO, two layers beside a linear path; no memory", PPO),
    "history": Kind("ppo-history", "PPO that sees the last control periods", PPO),
    "randomized": Kind(
        "ppo-randomized", "PPO that sees the last control periods, trained on drawn plants", PPO
    ),
    "recurrent": Kind(
        "recurrent_ppo", "PPO with a long short-term memory, inputs beside it", f"{PPO}; {LSTM}"
    ),
    "sac": Kind("sac", "SAC, two layers; no memory", SAC),
    "tqc": Kind("tqc", "TQC, two layers; no memory", TQC),
}
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
CORRECTED: dict[str, str] = {
    "MusclePositioning-v0": "inverse",
    "KneeTension-v0": "knee_inverse_ahead_ltr",
    "KneeStiffness-v0": "knee_inverse_ahead",
    "KneeWalk-v0": "knee_inverse_ahead_ltr",
    "KneeStairsUp-v0": "knee_inverse_ahead_ltr",
    "KneeStairsDown-v0": "knee_inverse_ahead_ltr",
    "AntagonisticJoint-v0": "joint_mfc_mu_ahead",
    "RedundantManipulator-v0": "joint_pid_smooth_ahead",
    "ElbowOrthosis-v0": "elbow_allocation_early",
}
"""Controllers that residuals correct. On the tuning seeds (``python -m agents classical``) they
have the least error, or move the set-point less than others within a tenth of it."""


def _learned(env: str, kind: Kind) -> Entry:
    return Entry(
        file=f"{env}.{kind.preset}.s{{seed}}.onnx",
        summary=f"{kind.summary}{WHERE.get(env, '')}",
        knowledge=MODEL,
        citation=kind.citation,
        envs=(f"PAM/{env}",),
    )


def _residual(env: str, baseline: str) -> Entry:
    return Entry(
        file=f"{env}.ppo-residual.s{{seed}}.onnx",
        summary=f"{baseline} corrected by a PPO policy, which sees its action{WHERE.get(env, '')}",
        knowledge=MODEL,
        citation=f"{PPO}; {RESIDUAL}",
        envs=(f"PAM/{env}",),
        kind="residual",
        baseline=baseline,
    )


OFFERED: dict[str, Entry] = {
    **{
        f"{name}{suffix}": _learned(env, kind)
        for env, suffix in SUFFIXES.items()
        for name, kind in KINDS.items()
    },
    **{f"residual{SUFFIXES[env]}": _residual(env, baseline) for env, baseline in CORRECTED.items()},
}
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
        If there is no such policy or training, or the signals differ.
    """
    if name not in CONTROLLERS:
        raise ValueError(f"no policy named {name!r}{nearest(name, list(CONTROLLERS))}")
    files = CONTROLLERS[name].files()
    seed = min(files) if training_seed is None else training_seed
    if seed not in files:
        raise ValueError(f"{name} has no training seed {seed}; there are: {list(files)}")
    return OnnxPolicy.load(files[seed], signals, action_signals)


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
