"""Run and drawing of one episode. Matplotlib is imported when a figure is drawn."""

import itertools
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runs import controllers, rollout
from benchmarks.scenarios.scenario_env import make_env
from benchmarks.scoring import metrics


def play(
    env_id: str, controller: str, kwargs: Mapping[str, Any], seed: int, video: Path | None = None
) -> tuple[rollout.Episode, Any]:
    """Return a recorded episode and its setpoints by name, SI; film it if a path is given."""
    entrant = controllers.find(controller)
    if not entrant.runs_in(env_id):
        raise ValueError(f"{controller} is for {', '.join(entrant.envs)}, not for {env_id}")
    filmed = {"render_mode": "rgb_array"} if video else {}
    try:
        env = make_env(env_id, {**kwargs, **filmed})
    except (TypeError, ValueError) as error:  # remove Gymnasium's suffix of the message
        said = str(error).partition(" was raised from the environment creator")[0]
        raise ValueError(f"{env_id}: {said}") from error
    made = controllers.make(entrant, env.unwrapped.plant, env)
    with _film(video, env) as watch:
        episode = rollout.run(env, made, seed, watch)
    space, signals = env.action_space, env.unwrapped.action_signals
    inside = np.clip(episode.actions.reshape(-1, len(signals)), space.low, space.high)
    env.close()
    return episode, {name: signals.decode(inside, name) for name in signals.names()}


@contextmanager
def _film(path: Path | None, env: Any) -> Iterator[rollout.Watch | None]:
    """Yield the function that adds frames to a real-time film; None without a path."""
    if path is None:
        yield None
        return
    import imageio.v2 as imageio

    period, steps = env.unwrapped.control_period, itertools.count()
    every = max(1, round(0.04 / period))
    film: Any = imageio.get_writer(path, fps=1.0 / (every * period), macro_block_size=8)
    with film:

        def watch(env: Any) -> None:
            if next(steps) % every == 0:
                film.append_data(env.render())

        yield watch


def summary(episode: rollout.Episode, content: Mapping[str, Any]) -> dict[str, float]:
    """Return the common scores of an episode; of its second half if it is short."""
    last = float(episode.signals["time"][-1])
    settle = min(float(content["settle_seconds"]), 0.5 * last)
    common = {"settle_seconds": settle, "cost_scales": {}, "metrics": ()}
    return metrics.score(episode.signals, episode.period, {**content, **common})


def score_lines(scores: Mapping[str, float], content: Mapping[str, Any]) -> list[str]:
    """Return a line for each score with its SI unit, also for inapplicable scores."""
    units = metrics.of_track(content)
    lines = []
    for name, value in scores.items():
        unit = "" if units[name] == "1" else f" {units[name]}"
        text = "does not apply" if np.isnan(value) else f"{value:.6g}{unit}"
        lines.append(f"{name:20s} {text}")
    return lines


def episode_figure(
    signals: Mapping[str, Any],
    set_points: Mapping[str, Any],
    title: str,
    shown: tuple[str, float] = ("mm", 1e3),
) -> Any:
    """Return a figure of an episode: tracking, error, setpoints and output over pressure.

    The last is omitted if the pressure of a single muscle is not recorded. ``shown`` is the unit
    of the output and its factor from SI; ``set_points`` are pressures, or angles, by name.
    """
    from matplotlib.figure import Figure

    t, (unit, factor) = signals["time"], shown
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    grid = figure.add_gridspec(3, 2, width_ratios=[2.0, 1.0], height_ratios=[2.0, 1.0, 1.2])
    columns = 0 if "state/pressure" in signals else slice(None)
    track = figure.add_subplot(grid[0, columns])
    error = figure.add_subplot(grid[1, columns], sharex=track)
    inputs = figure.add_subplot(grid[2, columns], sharex=track)
    track.plot(t, factor * signals["reference"], color="0.3", linestyle="--", label="reference")
    track.plot(t, factor * signals["output"], color="#0072b2", label="output")
    track.set_ylabel(f"output [{unit}]")
    track.legend(frameon=False, ncols=2)
    error.plot(t, factor * (signals["output"] - signals["reference"]), color="#d55e00")
    error.axhline(0.0, color="0.7", linewidth=0.6)
    error.set_ylabel(f"error [{unit}]")
    for upper in (track, error):
        upper.tick_params(labelbottom=False)
    _draw_inputs(inputs, signals, set_points)
    if "state/pressure" in signals:
        loop = figure.add_subplot(grid[:, 1])
        loop.plot(1e-5 * signals["state/pressure"], factor * signals["output"], color="#0072b2")
        loop.set_xlabel("pressure [bar]")
        loop.set_ylabel(f"output [{unit}]")
        loop.set_title("hysteresis loop")
    figure.suptitle(title)
    return figure


def _draw_inputs(axes: Any, signals: Mapping[str, Any], set_points: Mapping[str, Any]) -> None:
    """Draw setpoints, and of a single muscle its pressure."""
    angles = all(name.startswith("angle") for name in set_points)
    unit, factor = ("deg", np.rad2deg(1.0)) if angles else ("bar", 1e-5)
    single = {"color": "0.6"} if len(set_points) == 1 else {}
    for name, asked in set_points.items():
        label = "setpoint" if single else name.replace("_set_point", "")
        axes.plot(signals["time"], factor * asked, linewidth=0.8, label=label, **single)
    if "state/pressure" in signals:
        pressure = 1e-5 * signals["state/pressure"]
        axes.plot(signals["time"], pressure, color="#009e73", linewidth=1.5, label="pressure")
    axes.set_ylabel(f"{'angle' if angles else 'pressure'} [{unit}]")
    axes.set_xlabel("time [s]")
    axes.legend(frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
