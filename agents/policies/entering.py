"""Finished runs become policies that come with the project, which the board then takes.

A set of runs is entered as a whole: training seeds 0 to n - 1 of one preset. It takes the place of
what was there of that preset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from agents.policies import catalogue
from agents.policies.policy import OnnxPolicy
from agents.policies.policy_file import (
    POLICY,
    RECORD,
    PolicyFileError,
    finished,
    record_of,
    write_policy,
)
from agents.settings import presets as configs
from agents.settings.schema import SettingsError


@dataclass(frozen=True)
class Finished:
    """A run that may be entered.

    Attributes
    ----------
    folder : Path
    preset : str
        Like ``KneeWalk-v0.ppo``.
    seed : int
        Of the training.
    """

    folder: Path
    preset: str
    seed: int


@dataclass(frozen=True)
class Entered:
    """What was written.

    Attributes
    ----------
    controller : str
        The policies' name on the board.
    files : tuple of Path
        The policies.
    replaced : tuple of Path
        Files of the same preset that were there before: overwritten, or taken out.
    """

    controller: str
    files: tuple[Path, ...]
    replaced: tuple[Path, ...]


def enter(folders: Sequence[Path], author: str = "") -> Entered:
    """Copy the policies of finished runs to ``agents/pretrained``.

    Everything is checked before anything is written. Each file is written whole or not at all, a
    record before its policy.

    Parameters
    ----------
    folders : sequence of Path
        Of the runs, in any order.
    author : str
        Who trained them, as BibTeX wants it; empty for the authors of this package.

    Raises
    ------
    ValueError
        If a folder holds no sound policy, or the runs are not the first training seeds of one
        preset as it is now.
    """
    runs = sorted(map(_checked, folders), key=lambda run: run.seed)
    _check_together(runs)
    controller, entry = _entry(runs[0])
    before = _files(entry)
    written = []
    for run in runs:
        place = catalogue.FOLDER / entry.file.format(seed=run.seed)
        policy = run.folder / POLICY
        record = record_of(policy) | ({"author": author} if author else {})
        write_policy(place, policy.read_bytes(), record)
        written.append(place)
    for path in set(before) - {path for place in written for path in _both(place)}:
        path.unlink()
    return Entered(controller, tuple(written), tuple(before))


def _checked(folder: Path) -> Finished:
    """Return a run whose policy loads, and is of a preset."""
    if not (folder / POLICY).is_file():
        raise PolicyFileError(
            f"{folder} holds no {POLICY}; give the folders of finished runs, or finish this one: "
            f"python -m agents train --resume --out {folder}"
        )
    try:
        card = OnnxPolicy.load(folder / POLICY).card
        config = configs.from_mapping(card.get("config"))
    except (PolicyFileError, SettingsError) as error:
        raise PolicyFileError(f"{folder}: {error}") from error
    if finished(folder / POLICY) is None:
        raise PolicyFileError(
            f"{folder}: {RECORD} is not the record of {POLICY}; take both from one run"
        )
    seed = card["seed"]
    if not isinstance(seed, int) or seed < 0:
        raise PolicyFileError(
            f"{folder}: its card says training seed {seed!r}, and seeds are 0, 1, 2, ...; train it "
            "by python -m agents train"
        )
    words = str(card.get("command", "")).split()
    return Finished(folder, _preset(folder, config, words), seed)


def _preset(folder: Path, config: configs.Config, words: list[str]) -> str:
    """Return the preset of which a run's settings are, those that decide nothing left aside.

    Parameters
    ----------
    folder : Path
    config : Config
    words : list of str
        Of the command that trained it, which names the variant.
    """
    env = config.env.removeprefix("PAM/")
    if "--config" in words:
        raise SettingsError(
            f"{folder} was trained with settings of no preset; save them as agents/configs/"
            f"{env}.{config.algo}-VARIANT.yaml, VARIANT in small letters, digits and _, and train "
            "by --variant"
        )
    variant = words[words.index("--variant") + 1] if "--variant" in words[:-1] else ""
    kind = f"{config.algo}-{variant}" if variant else config.algo
    path = configs.presets().get((config.env, config.algo, variant))
    if path is None:
        known = sorted(p.stem.rpartition(".")[2] for p in configs.presets().values() if _of(p, env))
        raise SettingsError(
            f"{folder} is of the preset {env}.{kind}, and {env} has {', '.join(known)}; add "
            f"agents/configs/{env}.{kind}.yaml, or train one of those"
        )
    other = _differing(configs.read(path), config)
    if other:
        raise SettingsError(
            f"{folder} was trained with {', '.join(other)} other than {path.name} has now; train "
            "it anew, or give the preset these settings"
        )
    return path.stem


def _of(path: Path, env: str) -> bool:
    return path.stem.rpartition(".")[0] == env


def _differing(preset: configs.Config, config: configs.Config) -> list[str]:
    """Return the names of the decisive settings in which a run differs from its preset."""
    wanted, given = preset.decisive().as_dict(), config.decisive().as_dict()
    names = sorted({*wanted, *given})
    return [name for name in names if wanted.get(name) != given.get(name)]


def _check_together(runs: Sequence[Finished]) -> None:
    """Raise unless runs, in the order of their seeds, are seeds 0 to n - 1 of one preset."""
    if not runs:
        raise ValueError("no runs are given; name their folders, like runs/PAM-KneeWalk-v0/ppo-*")
    first = runs[0]
    for run, wanted in zip(runs, range(len(runs)), strict=True):
        if run.preset != first.preset:
            raise ValueError(
                f"{run.folder} is of {run.preset} and {first.folder} of {first.preset}; enter the "
                "runs of one preset at a time"
            )
        if run.seed < wanted:
            twin = next(other for other in runs if other.seed == run.seed)
            raise ValueError(
                f"{twin.folder} and {run.folder} both are of training seed {run.seed}; leave one "
                "out"
            )
        if run.seed > wanted:
            raise ValueError(
                f"training seed {wanted} is missing, of {len(runs)} runs up to seed "
                f"{runs[-1].seed}; seeds must be 0, 1, 2, ...: train it, and enter all together"
            )


def _entry(run: Finished) -> tuple[str, catalogue.Entry]:
    """Return the controller that a run is a training of, and its name."""
    offered = catalogue.offered()
    return next(
        (name, entry) for name, entry in offered.items() if catalogue.preset_of(entry) == run.preset
    )


def _files(entry: catalogue.Entry) -> list[Path]:
    """Return the files of an entry that are there, also one without a training seed in its name."""
    single = catalogue.FOLDER / f"{catalogue.preset_of(entry)}.onnx"
    found = [path for place in (*entry.files().values(), single) for path in _both(place)]
    return [path for path in dict.fromkeys(found) if path.is_file()]


def _both(policy: Path) -> tuple[Path, Path]:
    """Return the places of a policy and of its record."""
    return policy, policy.with_suffix(".json")
