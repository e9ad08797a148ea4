"""Calibration of the EMG-proxy effort: what assistance could save, and what chance costs."""

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np

from baselines.core.catalogue import make_controller
from benchmarks.board.format import table
from benchmarks.runs import rows
from benchmarks.runs.rollout import Episode, run
from benchmarks.scoring.groups.knee import effort_ratio
from pam_envs.envs.knee.gait import PACES
from pam_envs.muscle.emg import emg_proxy

GAITS = ("KneeWalk", "KneeStairsUp", "KneeStairsDown")
COLUMNS = (
    "gait",
    "none",
    "perfect",
    "perfect, true demand",
    "vented",
    "random",
    "x scatter",
)
SECONDS = 20.0
SETTLED = 2.0  # begin [s] of the episode that is not counted
VENTED, RANDOM = "zero", "random"


def perfect(episode: Episode, reference: str) -> float:
    """Return the effort with a desired assistance [N m] delivered exactly in stance."""
    signals, skipped = episode.signals, round(SETTLED / episode.period)
    helped = signals[reference] * (signals["state/stance"] > 0.5)
    proxy = emg_proxy(signals["state/demand"], helped, episode.period)
    return effort_ratio(*(part[skipped:] for part in vars(proxy).values()))


def measured(episode: Episode) -> float:
    """Return the effort of an episode as it ran."""
    names = ("extensors", "extensors_free", "flexors", "flexors_free")
    skipped = round(SETTLED / episode.period)
    return effort_ratio(*(episode.signals[f"effort/{name}"][skipped:] for name in names))


def episodes(name: str, pace: str, wearer: str, controller: str, seeds: int) -> Iterator[Episode]:
    """Yield episodes of a gait with a controller, one a seed."""
    env = gym.make(f"PAM/{name}-v0", pace=pace, wearer=wearer, episode_seconds=SECONDS).unwrapped
    for seed in range(seeds):
        made = make_controller(controller, env.plant, env.signals, env.action_signals, seed)  # type: ignore[attr-defined]
        yield run(env, made, seed)


def efforts(seeds: int, wearer: str = "prescribed") -> str:
    """Return a table of mean and standard deviation of the effort over seeds, for every gait.

    *None* is an orthosis that does nothing, 1 by definition. *Perfect* is the share of Eq. (1), or
    of the true demand, delivered exactly in stance; *vented* and *random* are episodes. The last
    column is none less perfect over the scatter of perfect.
    """
    lines = []
    for name in GAITS:
        for pace in PACES:
            vented = list(episodes(name, pace, wearer, VENTED, seeds))
            chance = [measured(e) for e in episodes(name, pace, wearer, RANDOM, seeds)]
            ideal = [perfect(e, "state/torque_reference") for e in vented]
            oracle = [perfect(e, "state/torque_ideal") for e in vented]
            groups = (ideal, oracle, [measured(e) for e in vented], chance)
            gain = (1.0 - np.mean(ideal)) / np.std(ideal, ddof=1)
            cells = (f"{np.mean(g):.3f} ± {np.std(g, ddof=1):.3f}" for g in groups)
            lines.append([f"{name}, {pace} pace", "1", *cells, f"{gain:.1f}"])
    return "\n".join(table(COLUMNS, lines))


TRACKS = ("knee_walk_nominal", "knee_stairs_up_nominal", "knee_stairs_down_nominal")


def pareto_figure() -> Any:
    """Return RMS error against effort of the gaits' nominal tracks, the dominant rows joined."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    figure = Figure(figsize=(10.5, 4.0), layout="constrained")
    for ax, track in zip(figure.subplots(1, 3), TRACKS, strict=True):
        found = [row for row in rows.load_all() if row["row"].startswith(f"{track}--")]
        points = [
            tuple(
                float(np.mean(rows.scores_of(rows.episodes_of(row), metric)))
                for metric in ("rms_error", "emg_effort")
            )
            for row in found
        ]
        best: list[tuple[float, ...]] = []
        names: list[str] = []
        stacked = 0  # height of a number above those of points beside it [points]
        for (error, effort), row in sorted(zip(points, found, strict=True), key=lambda p: p[0]):
            front, above = not best or effort < best[-1][1], 5
            if front:
                stacked += 9 if best and error < 1.3 * best[-1][0] else -stacked
                above += stacked
                best.append((error, effort))
            ax.plot(error, effort, "o", color="C0" if front else "0.6", markersize=5)
            name, label = row["controller"]["name"].removeprefix("knee_"), ""
            if front:
                label = str(len(best))
                names.append(f"{label}  {name}")
            elif row["controller"]["name"] in (VENTED, RANDOM):
                label = name
            ax.annotate(
                label, (error, effort), fontsize=7, xytext=(4, above), textcoords="offset points"
            )
        ax.text(0.03, 0.97, "\n".join(names), fontsize=7, va="top", transform=ax.transAxes)
        ax.plot(*zip(*best, strict=True), color="C0", linewidth=0.8)
        ax.axhline(1.0, color="0.3", linewidth=0.8, linestyle=":")
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.margins(x=0.2, y=0.25)
        low, high = ax.get_ylim()
        ax.set_ylim(low, high + 0.05 * len(names) * (high - low))  # room for the names
        ax.set_title(track.removeprefix("knee_").removesuffix("_nominal").replace("_", " "))
        ax.set_xlabel("RMS tracking error [N]")
        ax.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("EMG effort (1: without the orthosis)")
    return figure
