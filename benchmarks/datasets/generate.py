"""Data sets of an environment: its behaviours, trained where necessary, and their recording."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
from rich.console import Console

from agents.policies.policy import OnnxPolicy
from agents.policies.residual import with_controller
from agents.settings import presets
from baselines.core.catalogue import make_controller
from benchmarks.datasets import behaviours, recording
from benchmarks.datasets.behaviours import CLASSICAL, KINDS, Behaviour, InUnits
from pam_envs.wording import near
from sweeps.progress import Start

MEDIUM = 0.1
"""Share of the training's steps after which the policy of the medium data acts."""


@dataclass(frozen=True)
class Order:
    """Data sets to generate for an environment."""

    env: str
    kinds: Sequence[str]
    steps: int  # of each data set, at least
    noise: float  # of controllers and policies, in units of half the action's range
    controller: str = ""  # of the classical data, by default CLASSICAL's
    policies: Mapping[str, Path] = field(default_factory=dict)  # by kind; others are trained
    training_steps: int | None = None  # of the expert, by default the preset's
    episode_seconds: float | None = None  # [s], by default the environment's
    runs: Path = Path("runs/datasets")

    def __post_init__(self) -> None:
        """Check kinds and numbers."""
        for kind in self.kinds:
            if kind not in KINDS:
                raise ValueError(f"no kind of data named {kind!r}{near(kind, KINDS)}")
        if self.steps < 1:
            raise ValueError(f"steps = {self.steps} is below 1; give the number of control periods")
        if not 0.0 <= self.noise <= 1.0:
            raise ValueError(f"noise = {self.noise:g} must be from 0 to 1 (half the range)")

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the environment: those of its preset, with drawn plants and SI units."""
        made = dict(presets.preset(self.env, "ppo").env_kwargs)
        if self.episode_seconds is not None:
            made["episode_seconds"] = self.episode_seconds
        return {**made, "randomize": True, "normalize": False}


def generate(order: Order, out: Path, start: Start) -> Iterator[Path]:
    """Record the data sets of an order below ``out``; yield their folders."""
    for kind in order.kinds:
        job = recording.Job(order.env, kind, order.arguments, order.steps, order.noise)
        yield recording.record(job, behaviour(order, kind), out, start)


def behaviour(order: Order, kind: str) -> Behaviour:
    """Return the behaviour of a kind of data; a missing policy is trained."""
    env: Any = gym.make(order.env, **{**order.arguments, "normalize": True}).unwrapped
    if kind == "random":
        return Behaviour("uniform", behaviours.uniform)
    if kind == "excitation":
        return Behaviour("steps, ramps, multisine", behaviours.excitation(env.control_period))
    if kind == "classical":
        name = order.controller or CLASSICAL[order.env]
        made: Any = make_controller(name, env.plant, env.signals, env.action_signals)
    else:
        given = order.policies.get(kind)
        policy = OnnxPolicy.load(trained(order, kind) if given is None else given)
        policy.check(env.signals, env.action_signals)
        name = f"{policy.card['algo']} {policy.digest()}"
        made = with_controller(policy, env.plant)
    acting = InUnits(made, env.signals, env.action_signals)
    return Behaviour(name, behaviours.noise(order.noise), acting)


def trained(order: Order, kind: str) -> Path:
    """Return the policy of a training by the preset; an interrupted training continues.

    The expert is trained on drawn plants by the whole preset, the medium policy by a share of its
    steps.
    """
    from agents.training import train as training
    from agents.training.record import Run

    preset = presets.preset(order.env, "ppo")
    steps = order.training_steps or preset.steps
    if kind == "medium":
        steps = max(round(MEDIUM * steps), 1)
    config = presets.changed(preset, [f"steps={steps}", "plants.randomize=true"])
    folder = (order.runs / f"{Path(order.env).name}-{kind}-{steps}").resolve()
    run = Run(config, 0, folder)
    folder.mkdir(parents=True, exist_ok=True)
    with training.alone(folder):
        return training.train_to_the_end(run, Console(stderr=True))
