"""Tiny settings, and training with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from agents import configs, train

ID = "PAM/MusclePositioning-v0"
SHORT = {"episode_seconds": 0.3, "reference": "mixed", "load": None}


def tiny(algo: str = "ppo", **changes: Any) -> configs.Config:
    """Return settings that train in about a second, with many automatic resets."""
    plain = configs.preset(ID, algo).as_dict()
    plain |= {"num_envs": 8, "steps": 1024, "checkpoint_steps": 256, "env_kwargs": SHORT}
    if algo == "ppo":
        plain["ppo"] |= {"n_steps": 16, "batch_size": 64}
    else:
        plain["sac"] |= {"learning_starts": 128, "gradient_steps": 2, "buffer_size": 600}
    return configs.from_mapping({**plain, **changes})


def trained(folder: Path, config: configs.Config, seed: int = 3) -> Any:
    """Train and return the model; the folder holds checkpoint and policy."""
    run = train.Run(config, seed, folder)
    model = train.start(run)
    train.train(run, model, Console(quiet=True))
    return model
