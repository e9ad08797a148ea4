"""Film of the best controllers of a track side by side, in the same episode.

As published, classical, learned, and the oracle (:mod:`benchmarks.bounds.oracle`), each with its
name and its error so far.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.board import accessors as views
from benchmarks.board.format import number
from benchmarks.board.summary import SIDES, Best
from benchmarks.bounds import run as bounding
from benchmarks.runs import controllers, rollout
from benchmarks.scenarios.scenario import Scenario, ScenarioSet
from benchmarks.scenarios.scenario_env import make_env, model_of
from benchmarks.scoring.metrics import headline_of, shown
from pam_envs.arrays import Array

Frame = NDArray[np.uint8]
BAR = 48
"""Height of the caption of a picture [pixels]."""
FRAMES = 25.0
"""Frames per second."""


@dataclass(frozen=True)
class Replay:
    """Controller that repeats recorded actions, shape (steps, n_act)."""

    actions: Array

    def predict(
        self, observation: Any, state: Any = None, start: Any = True, deterministic: bool = True
    ) -> tuple[Any, int]:
        """Return the next recorded action."""
        place = 0 if state is None else int(state)
        return self.actions[place].astype(np.float32), place + 1


def write(
    path: Path, track: ScenarioSet, best: Best, scenario: Scenario, seed: int, oracle: bool = True
) -> Path:
    """Write the film of one episode; the suffix of the path (.mp4, .gif) is its format.

    Parameters
    ----------
    path : Path
        File to write.
    track, scenario : ScenarioSet, Scenario
        Episode.
    best : Best
        The best controllers of the track; those that it lacks are left out.
    seed : int
        Seed of the episode.
    oracle : bool
        Whether to run the oracle, which takes a minute or more.
    """
    import imageio.v2 as imageio

    pictures = [played(track, scenario, seed, *one) for one in sides(track, best, scenario)]
    if oracle:
        stored = bounding.read().get(track.name)
        how = (stored.horizon, stored.start) if stored else (bounding.HORIZON, "")
        (episode,) = bounding.play(track, scenario, (seed,), *how)
        pictures.append(played(track, scenario, seed, SIDES[3], "", Replay(episode.actions)))
    path.parent.mkdir(parents=True, exist_ok=True)
    writer: Any = imageio.get_writer(path, fps=FRAMES, macro_block_size=8)
    with writer:
        for k in range(max(map(len, pictures))):
            writer.append_data(tiled([frames[min(k, len(frames) - 1)] for frames in pictures]))
    return path


def sides(track: ScenarioSet, best: Best, scenario: Scenario) -> Iterator[tuple[str, str, Any]]:
    """Yield side, name and controller of each row, or of a row for two sides once."""
    seen: dict[str, str] = {}
    for side, row in zip(SIDES, (best.paper, best.classical, best.learned), strict=False):
        if row is not None:
            name = views.name_of(row)
            seen[name] = f"{seen[name]}, {side}" if name in seen else side
    env = make_env(track.env, scenario.kwargs)
    for name, side in seen.items():
        entrant = controllers.find(name)
        model = model_of(track.env, scenario, env)
        seed = entrant.training_seeds[0]
        made = controllers.make(entrant, model, env, training_seed=seed)
        yield side, name if seed is None else f"{name}, training seed {seed}", made
    env.close()


def played(
    track: ScenarioSet, scenario: Scenario, seed: int, side: str, name: str, controller: Any
) -> list[Frame]:
    """Return the captioned frames of an episode."""
    env = make_env(track.env, {**scenario.kwargs, "render_mode": "rgb_array"})
    every, steps = max(1, round(1.0 / FRAMES / env.unwrapped.control_period)), count()
    pictures: list[Frame] = []

    def watch(env: Any) -> None:
        if next(steps) % every == 0:
            pictures.append(env.render())

    signals = rollout.run(env, controller, seed, watch).signals
    env.close()
    errors = running_error(signals, track.content)
    places = [min(max(k * every - 1, 0), len(errors) - 1) for k in range(len(pictures))]
    return [
        captioned(picture, side, f"{name}  {errors[k]}".strip())
        for picture, k in zip(pictures, places, strict=True)
    ]


def running_error(signals: Mapping[str, Array], content: Mapping[str, Any]) -> list[str]:
    """Return the RMS error up to each step in words, scored as in the track.

    Empty before the first scored step, and where the headline is not the error of the output.
    """
    scored = signals["time"] > content["settle_seconds"]
    for name in content.get("gate") or ():
        scored = scored & (signals[name] > 0.5)
    if headline_of(content) != "rms_error":
        return [""] * len(scored)
    unit, factor = shown(content)
    squares = np.cumsum(np.where(scored, (signals["output"] - signals["reference"]) ** 2, 0.0))
    counts = np.cumsum(scored)
    means = factor * np.sqrt(squares / np.maximum(counts, 1))
    return [
        f"RMS so far {number(float(mean))} {unit}" if n else ""
        for mean, n in zip(means, counts, strict=True)
    ]


def captioned(picture: Frame, title: str, text: str) -> Frame:
    """Return a picture under a bar with a title and a line of text."""
    from PIL import Image, ImageDraw, ImageFont

    height, width = picture.shape[:2]
    made = Image.new("RGB", (width, height + BAR), "white")
    made.paste(Image.fromarray(picture), (0, BAR))
    draw = ImageDraw.Draw(made)
    draw.text((8, 4), title, fill="black", font=ImageFont.load_default(18))
    draw.text((8, 26), text, fill="#444444", font=ImageFont.load_default(15))
    return np.asarray(made)


def tiled(pictures: Sequence[Frame]) -> Frame:
    """Return pictures of one size in two columns, or one below two pictures."""
    columns = min(2, len(pictures))
    blank = np.full_like(pictures[0], 255)
    filled = [*pictures, *[blank] * (-len(pictures) % columns)]
    rows = [np.hstack(filled[k : k + columns]) for k in range(0, len(filled), columns)]
    return np.vstack(rows)
