"""Trained policies that come with the project, as controllers for benchmarks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.policy import OnnxPolicy
from agents.settings import nearest
from pam_envs.parameters import Signals

FOLDER = Path(__file__).resolve().parent / "pretrained"


@dataclass(frozen=True)
class Entry:
    """A policy as the board names it.

    Attributes
    ----------
    file : str
        In ``agents/pretrained``; its training is recorded in the JSON file beside it.
    summary, citation : str
    knowledge : str
        What a controller is told: "nominal model" for one that was trained in simulation of it.
    envs : tuple of str
        Ids that it runs in.
    kind : str
        "learned".
    """

    file: str
    summary: str
    knowledge: str
    citation: str
    envs: tuple[str, ...]
    kind: str = "learned"


_CITATION = "Schulman et al., Proximal policy optimization algorithms, arXiv:1707.06347, 2017"


def _ppo(env: str, where: str = "") -> Entry:
    """Return the entry of the preset's PPO run in an environment."""
    return Entry(
        file=f"{env}.ppo.onnx",
        summary=f"PPO, two layers of 64 beside a linear path; no memory, 0.2 s of preview{where}",
        knowledge="nominal model",
        citation=_CITATION,
        envs=(f"PAM/{env}",),
    )


CONTROLLERS: dict[str, Entry] = {
    "ppo": _ppo("MusclePositioning-v0"),
    "ppo_knee_tension": _ppo("KneeTension-v0", "; trained on the brace that is free to move"),
    "ppo_knee_stiffness": _ppo("KneeStiffness-v0"),
    "ppo_knee_walk": _ppo("KneeWalk-v0", "; trained at 5 s a stride"),
    "ppo_knee_stairs_up": _ppo("KneeStairsUp-v0", "; trained at the paper's pace"),
    "ppo_knee_stairs_down": _ppo("KneeStairsDown-v0", "; trained at the paper's pace"),
}
PRETRAINED: dict[str, str] = {name: str(FOLDER / entry.file) for name, entry in CONTROLLERS.items()}


def load_pretrained(
    name: str, signals: Signals | None = None, action_signals: Signals | None = None
) -> OnnxPolicy:
    """Return a policy that comes with the project.

    Parameters
    ----------
    name : str
        A key of :data:`PRETRAINED`.
    signals, action_signals : Signals, optional
        The environment's; given, they must be those of the training.

    Raises
    ------
    ValueError
        If there is no such policy, or the signals differ.
    """
    if name not in PRETRAINED:
        raise ValueError(f"no policy named {name!r}{nearest(name, list(PRETRAINED))}")
    return OnnxPolicy.load(PRETRAINED[name], signals, action_signals)


def make_controller(
    name: str,
    plant: Any = None,
    signals: Signals | None = None,
    action_signals: Signals | None = None,
    seed: int = 0,
) -> OnnxPolicy:
    """Return a policy as benchmarks ask for controllers; ``plant`` and ``seed`` are not used."""
    return load_pretrained(name, signals, action_signals)
