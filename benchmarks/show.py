"""Run one episode and draw it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import controllers, metrics, plots, rollout
from benchmarks.cells import make_env


def play(
    env_id: str,
    controller: str,
    kwargs: Mapping[str, Any],
    seed: int,
    video: Path | None = None,
) -> tuple[rollout.Episode, Any]:
    """Run one episode, and film it where a path is given.

    Returns
    -------
    Episode and (n,) array [Pa]
        The recording, and the set-points that were asked for.
    """
    filmed = {"render_mode": "rgb_array"} if video else {}
    env = make_env(env_id, {**kwargs, **filmed})
    entrant = controllers.find(controller)
    made = controllers.make(entrant, env.unwrapped.plant, env)
    film = Film(video, env) if video else None
    try:
        episode = rollout.run(env, made, seed, film)
        signal = env.unwrapped.action_signals[0]
        set_points = signal.decode(np.clip(episode.actions, *_bounds(env)))
    finally:
        env.close()
        if film:
            film.close()
    return episode, set_points


def _bounds(env: Any) -> tuple[Any, Any]:
    return env.action_space.low, env.action_space.high


class Film:
    """Writes a frame of the environment every few steps, at the speed of life."""

    def __init__(self, path: Path, env: Any) -> None:
        import imageio_ffmpeg

        self._open = imageio_ffmpeg.write_frames
        self._path, self._frames, self._step = path, None, 0
        self._every = max(1, round(0.04 / env.unwrapped.control_period))
        self._fps = 1.0 / (self._every * env.unwrapped.control_period)

    def __call__(self, env: Any) -> None:
        """Take the present picture, if it is time for one."""
        if self._step % self._every == 0:
            self._write(env.render())
        self._step += 1

    def _write(self, picture: Any) -> None:
        height, width = (2 * (n // 2) for n in picture.shape[:2])  # the codec wants even sizes
        if self._frames is None:
            frames = self._open(str(self._path), (width, height), fps=self._fps, macro_block_size=2)
            frames.send(None)
            self._frames = frames
        self._frames.send(np.ascontiguousarray(picture[:height, :width]))

    def close(self) -> None:
        """Finish the file."""
        if self._frames is not None:
            self._frames.close()


def summary(episode: rollout.Episode, settle_seconds: float) -> dict[str, float]:
    """Return the episode's scores (those that need no scale of a scenario file)."""
    signals = {**episode.signals, "sensed": episode.signals["sensor/contraction"]}
    return metrics.score(signals, episode.period, settle_seconds, 0.5, {})


def draw(episode: rollout.Episode, set_points: Any, title: str, path: Path) -> None:
    """Write the figure of an episode."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure = plots.episode_figure(episode.signals, set_points, title)
    figure.savefig(path, dpi=150)
