"""Film of an episode under a controller, written as a whole or not at all."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.rendering.renderer import write_film

Policy = Callable[[Any], Any]
"""Action of an observation."""


def check(video: Path, fps: int) -> None:
    """Raise ValueError unless a film can be written with this suffix and rate."""
    if video.suffix not in (".mp4", ".gif"):
        raise ValueError(f"--video {video} must end in .mp4 or .gif")
    if not 1 <= fps <= 100:
        raise ValueError(f"--fps {fps} must be from 1 to 100")


def write(
    env: Any, policy: Policy, video: Path, seconds: float, seed: int = 0, fps: int = 25
) -> None:
    """Write the film of an episode.

    Parameters
    ----------
    env : Env
        Environment with ``render_mode="rgb_array"``.
    policy : callable
        From an observation to an action.
    video : Path
        Output file, .mp4 or .gif.
    seconds : float
        Length of the episode [s].
    seed : int
        Seed of the episode.
    fps : int
        Frames per second.
    """
    check(video, fps)
    with whole_file(video) as path:
        write_film(path, _pictures(env, policy, seconds, seed, fps), fps)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Provide a temporary file beside ``path``, which replaces it on success."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _pictures(
    env: Any, policy: Policy, seconds: float, seed: int, fps: int
) -> Iterator[NDArray[np.uint8]]:
    """Run an episode and yield its pictures."""
    from rich.progress import track

    observation, _ = env.reset(seed=seed)
    yield env.render()
    period, shown = env.unwrapped.control_period, 1
    for step in track(range(1, round(seconds / period) + 1), description="filming"):
        observation, _, terminated, truncated, _ = env.step(policy(observation))
        if step * period * fps > shown - 1e-6:
            shown += 1
            yield env.render()
        if terminated or truncated:
            return
