"""Entry of finished runs into ``agents/pretrained``, as one set of training seeds of a preset."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

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


class Finished(NamedTuple):
    """A run that can be entered: its folder, preset (``KneeWalk-v0.ppo``) and training seed."""

    folder: Path
    preset: str
    seed: int


class Entered(NamedTuple):
    """Result of an entry: name on the leaderboard, the policies, and the files they replace."""

    controller: str
    files: tuple[Path, ...]
    replaced: tuple[Path, ...]


def enter(folders: Sequence[Path], author: str = "") -> Entered:
    """Copy the policies of finished runs to ``agents/pretrained``, in place of earlier ones.

    Everything is checked before anything is written. ``author`` is in BibTeX form, empty for the
    authors of this package. A ValueError names a folder without a sound policy, or says that the
    runs are not training seeds 0 to n - 1 of one preset with its present settings.
    """
    runs = sorted(map(_checked, folders), key=lambda run: run.seed)
    _check_together(runs)
    controller, entry = next(
        pair for pair in catalogue.offered().items() if pair[1].preset == runs[0].preset
    )
    before = [path for place in entry.files().values() for path in _both(place) if path.is_file()]
    written = []
    for run in runs:
        policy, place = run.folder / POLICY, catalogue.FOLDER / entry.file.format(seed=run.seed)
        record = record_of(policy) | ({"author": author} if author else {})
        write_policy(place, policy.read_bytes(), record)
        written.append(place)
    for path in set(before) - {path for place in written for path in _both(place)}:
        path.unlink()
    return Entered(controller, tuple(written), tuple(before))


def _both(policy: Path) -> tuple[Path, Path]:
    return policy, policy.with_suffix(".json")


def _checked(folder: Path) -> Finished:
    """Return a run whose policy loads and whose settings are a preset's."""
    policy = folder / POLICY
    if not policy.is_file():
        raise PolicyFileError(
            f"{folder} holds no {POLICY}; give the folders of finished runs, or finish this one: "
            f"python -m agents train --resume --out {folder}"
        )
    try:
        card = OnnxPolicy.load(policy).card
        config = configs.from_mapping(card.get("config"))
    except (PolicyFileError, SettingsError) as error:
        raise PolicyFileError(f"{folder}: {error}") from error
    if finished(policy) is None:
        raise PolicyFileError(
            f"{folder}: {RECORD} is not the record of {POLICY}; take both from one run"
        )
    seed = card["seed"]
    if not isinstance(seed, int) or seed < 0:
        raise PolicyFileError(
            f"{folder}: its card says training seed {seed!r}, and seeds are 0, 1, 2, ...; train it "
            "by python -m agents train"
        )
    return Finished(folder, _preset(folder, config, str(card.get("command", "")).split()), seed)


def _preset(folder: Path, config: configs.Config, words: list[str]) -> str:
    """Return the name of the preset with a run's settings; ``words`` is its training command."""
    env = config.env.removeprefix("PAM/")
    if "--config" in words:
        raise SettingsError(
            f"{folder} was trained with --config, not with a preset; save the settings as "
            f"agents/configs/{env}.{config.algo}-VARIANT.yaml, VARIANT in small letters, digits "
            "and _, and train with --variant"
        )
    variant = words[words.index("--variant") + 1] if "--variant" in words[:-1] else ""
    kind = f"{config.algo}-{variant}" if variant else config.algo
    known = {path.stem: path for path in configs.presets().values()}
    path = known.get(f"{env}.{kind}")
    if path is None:
        kinds = sorted(stem.rpartition(".")[2] for stem in known if stem.startswith(f"{env}."))
        raise SettingsError(
            f"{folder} was trained with the preset {env}.{kind}, which does not exist; add "
            f"agents/configs/{env}.{kind}.yaml, or train one of {', '.join(kinds)}"
        )
    preset, own = configs.read(path).decisive().as_dict(), config.decisive().as_dict()
    other = [name for name in sorted({*preset, *own}) if preset.get(name) != own.get(name)]
    if other:
        raise SettingsError(
            f"{folder} was trained with other values of {', '.join(other)} than {path.name} has "
            "now; train it anew, or give the preset these settings"
        )
    return path.stem


def _check_together(runs: Sequence[Finished]) -> None:
    """Raise unless runs, sorted by seed, are seeds 0 to n - 1 of one preset."""
    if not runs:
        raise ValueError("no runs are given; name their folders, like runs/PAM-KneeWalk-v0/ppo-*")
    first = runs[0]
    for seed, run in enumerate(runs):
        if run.preset != first.preset:
            raise ValueError(
                f"{run.folder} is of {run.preset} and {first.folder} of {first.preset}; enter the "
                "runs of one preset at a time"
            )
        if run.seed < seed:
            raise ValueError(
                f"{runs[seed - 1].folder} and {run.folder} both are of training seed {run.seed}; "
                "leave one out"
            )
        if run.seed > seed:
            raise ValueError(
                f"training seed {seed} is missing, of {len(runs)} runs up to seed "
                f"{runs[-1].seed}; seeds must be 0, 1, 2, ...: train it, and enter all together"
            )
