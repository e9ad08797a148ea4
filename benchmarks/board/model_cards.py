"""Model cards: a page of each trained policy, beside its files in ``agents/pretrained``.

A card covers all training seeds of a preset. It is written from the cards inside the policy files,
the training records beside them and the rows of the leaderboard.
"""

import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from agents.policies import catalogue
from agents.policies.policy_file import read, record_of
from agents.settings import presets
from benchmarks.board import accessors as views
from benchmarks.board.format import duration, millions, number, table
from benchmarks.board.leaderboard import load
from benchmarks.board.words import score_words, short_env
from benchmarks.runs import rows
from benchmarks.runs.rows import Row
from benchmarks.scenarios import scenario as scenarios
from pam_envs.files import write_text

CARDS = catalogue.FOLDER
BOARD = "../../benchmarks/leaderboard"
LINK = re.compile(r"\]\(([^)#]+)\)")
LISTED = 3
"""Signals of one range that are listed one by one."""
OUTDATED = (
    "trained on earlier parameters of its plants; therefore without scores on the leaderboard "
    "until it is trained anew"
)


def texts(results: Path = rows.RESULTS) -> dict[Path, str]:
    """Return the model cards by their paths, with the scores of a folder of rows."""
    held = [row for row in load(results) if views.name_of(row) in catalogue.CONTROLLERS]
    found = {}
    for name, entry in catalogue.CONTROLLERS.items():
        own = [row for row in held if views.name_of(row) == name]
        found[CARDS / f"{entry.preset}.md"] = card_text(name, entry, own)
    return found


def write(results: Path = rows.RESULTS) -> list[Path]:
    """Write the model cards, and remove those of policies that are no longer there."""
    made = texts(results)
    for path in set(CARDS.glob("*.md")) - set(made):
        path.unlink()
    for path, text in made.items():
        write_text(path, text)
    return list(made)


def card_text(name: str, entry: catalogue.Entry, own: Sequence[Row]) -> str:
    """Return the model card of a policy; ``own`` are its rows."""
    files = entry.files()
    cards = {seed: read(path).card for seed, path in files.items()}
    first, path = next(iter(cards.values())), next(iter(files.values()))
    env = short_env(entry.envs[0])
    lines = [
        f"# `{name}` in {env}",
        "",
        "Written by `python -m benchmarks cards`; do not edit.",
        "",
        f"{entry.summary}.",
        "",
        *table(["", ""], _facts(name, entry, first, own), words=True),
        "",
        "## Files",
        "",
        *_files(files, cards, _unit(entry.envs[0])),
        "",
        "## Inputs and outputs",
        "",
        *_signals(entry, first),
        "",
        "## Scores",
        "",
        *_scores(name, env, own),
        "",
        "## Limits",
        "",
        *_limits(entry, first),
        "",
        "## Use",
        "",
        "```sh",
        f"python -m pam_envs.agents show {_shown(path)}      # complete card in JSON",
        f"python -m pam_envs.agents watch {_shown(path)}     # film",
        f"python -m pam_envs.agents evaluate {_shown(path)}  # scores",
        "```",
    ]
    return "\n".join(lines) + "\n"


def _facts(
    name: str, entry: catalogue.Entry, card: Mapping[str, Any], own: Sequence[Row]
) -> list[list[str]]:
    """Return purpose, training, state, author and licence of a policy."""
    config = presets.from_mapping(card["config"])
    command = str(card["command"]).removeprefix("python -m agents ")
    return [
        ["environment", f"`{entry.envs[0]}`"],
        ["algorithm", f"{config.algo.upper()} ({entry.citation})"],
        ["trained on", f"simulated plants only, {len(card['plants'])} of them"],
        ["training episodes", _episodes(config)],
        ["steps", f"{millions(card['steps'])} control periods for each training seed"],
        ["settings", entry.tuning],
        ["command", f"`python -m pam_envs.agents {command}`"],
        ["state", "current" if own or not catalogue.outdated(name) else OUTDATED],
        ["author", entry.author or "the authors of this package"],
        ["licence", "MIT, as the package"],
    ]


def _episodes(config: presets.Config) -> str:
    """Return the environment's arguments in training, each set once."""
    found = dict.fromkeys(_arguments(kind) for kind in config.kinds())
    return "; ".join(filter(None, found)) or "default arguments"


def _arguments(kwargs: Mapping[str, Any]) -> str:
    return ", ".join(f"`{name}={value!r}`" for name, value in kwargs.items())


def _unit(env: str) -> str:
    """Return the SI unit of the tracked output of an environment."""
    track = next(track for track in scenarios.available().values() if track.env == env)
    return str(track.content.get("unit", "m"))


def _files(
    files: Mapping[int, Path], cards: Mapping[int, Mapping[str, Any]], unit: str
) -> list[str]:
    """Return a table of the files: digest, error on tuning episodes, training time."""
    heading = ["file", "SHA-256 begins", f"error on tuning episodes [{unit}]", "training time"]
    lines = []
    for seed, path in files.items():
        record = record_of(path)
        lines.append(
            [
                f"[{path.name}]({path.name})",
                f"`{record['sha256'][:16]}`",
                number(cards[seed]["chosen"]["value"]),
                duration(record["training"]["seconds"]),
            ]
        )
    return table(heading, lines, words=True)


def _signals(entry: catalogue.Entry, card: Mapping[str, Any]) -> list[str]:
    """Return a table of the signals, of one range together, and how they are scaled."""
    lines = [
        *(["input", *line] for line in _grouped(card["signals"])),
        *(["output", *line] for line in _grouped(card["action_signals"])),
    ]
    more = ""
    if entry.baseline:
        more = f" The policy also reads the action of `{entry.baseline}`, and corrects it."
    return [
        *table(["", "signal", "unit", "range in [-1, 1]", "ahead"], lines, words=True),
        "",
        f"All values are float32, scaled from their range to [-1, 1].{more}",
    ]


def _grouped(signals: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """Return names, unit, range and time ahead of signals; neighbours of one range together."""
    lines = []
    for (unit, low, high), group in itertools.groupby(
        signals, lambda signal: (signal["unit"], signal["low"], signal["high"])
    ):
        held = list(group)
        names = [f"`{signal['name']}`" for signal in held]
        if len(names) > LISTED:
            names = [f"{names[0]} to {names[-1]} ({len(names)})"]
        ahead = max(signal["ahead"] for signal in held)
        lines.append(
            [
                ", ".join(names),
                unit,
                f"{low:.6g} to {high:.6g}",
                f"up to {ahead:.3g} s" if ahead else "",
            ]
        )
    return lines


def _scores(name: str, env: str, own: Sequence[Row]) -> list[str]:
    """Return a table of the rows of a policy on the leaderboard."""
    if not own:
        return [f"No row of `{name}` is on the [leaderboard]({BOARD}/{env}.md)."]
    lines = []
    for row in own:
        failed, total = views.failures_of(row)
        lines.append(
            [
                f"`{row['row']}`",
                score_words(row, views.published_split(row)),
                f"{failed} of {total}",
                views.published_split(row),
            ]
        )
    return [
        f"RMS error with 95 % interval, as on the [leaderboard]({BOARD}/{env}.md); "
        "`python -m benchmarks verify ROW` computes a row again.",
        "",
        *table(["row", "score", "failed episodes", "episodes"], lines, words=True),
    ]


def _limits(entry: catalogue.Entry, card: Mapping[str, Any]) -> list[str]:
    """Return what a policy must not be used for, and where it is not reliable."""
    seeds = len(entry.files())
    few = ""
    if seeds < views.LISTED_SEEDS:
        few = f" {seeds} training seed: not ranked, which needs {views.LISTED_SEEDS}."
    return [
        "- No policy has been tested on hardware, and none guarantees limits of pressure, force or "
        "motion: not for a rig, and not for a device on a person.",
        "- Reliable only on plants, references and signals like those of the training.",
        f"- Scores are simulation results.{few}",
    ]


def _shown(path: Path) -> str:
    return f"agents/pretrained/{path.name}"
