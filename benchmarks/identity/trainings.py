"""Trainings of a learned row: the first n seeds of one training, none copied or left out.

Several seeds show the scatter of a training. A copied policy, a seed dropped because of its score,
or a lucky seed of other settings would hide part of that scatter.
"""

import itertools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.identity import artefacts
from benchmarks.identity.hashing import digest
from benchmarks.runs.controllers import Entrant

SETTINGS = ("algo", "env", "env_kwargs", "plant", "plants", "signals", "action_signals", "steps")
"""Entries of a card that all seeds of one training share."""
LEFT_OUT = ("search", "checkpoint_steps")
"""Entries of a configuration without effect on the training."""


def of(entrant: Entrant) -> list[dict[str, Any]] | None:
    """Return the training of each policy file from the record beside it, ``None`` without one."""
    if not entrant.files:
        return None
    found = []
    for seed, path in entrant.files:
        card = _card_beside(path)
        known = {key: card[key] for key in ("command", "steps") if key in card}
        found.append({"training_seed": seed, **known, **(card.get("training") or {})})
    return found


def _card_beside(policy: Path) -> dict[str, Any]:
    card = artefacts.located(policy).with_suffix(".json")
    return dict(json.loads(card.read_text(encoding="utf-8"))) if card.is_file() else {}


def card_record(controller: Any) -> dict[str, Any]:
    """Return seed and settings of the training of a policy, from the card inside its file."""
    card = getattr(controller, "card", None)
    said = dict(card) if isinstance(card, Mapping) else {}
    config = dict(said.get("config") or {})
    settings = {name: said.get(name) for name in SETTINGS}
    settings["config"] = {name: v for name, v in config.items() if name not in LEFT_OUT}
    corrected = dict(said.get("baseline") or {})  # recorded actions differ by rounding
    settings["baseline"] = [corrected.get(name) for name in ("name", "scale")]
    return {"seed": said.get("seed"), "settings": digest(settings)[:16]}


def check_files(entrant: Entrant) -> None:
    """Raise ValueError unless the files belong to seeds 0, 1, 2, ... and all differ."""
    seeds = [seed for seed, _ in entrant.files]
    if seeds != list(range(len(seeds))):
        raise ValueError(
            f"{entrant.name}: training seeds {', '.join(map(str, seeds))}, and they must be 0 to "
            f"{len(seeds) - 1}: the first ones, none left out; train those that are missing"
        )
    first: dict[str, int] = {}
    for seed, path in entrant.files:
        other = first.setdefault(artefacts.file_record(path, seed)["sha256"], seed)
        if other != seed:
            raise ValueError(f"{entrant.name}: {_copies(other, seed)}")
        card = _card_beside(path)
        for record in (card, card.get("training") or {}):
            _check_seed(entrant, seed, record.get("seed", seed))


def check_cells(entrant: Entrant, cells: Sequence[Mapping[str, Any]]) -> None:
    """Raise ValueError unless a row's cells belong to different seeds of one training."""
    check_files(entrant)
    if not entrant.files:
        return
    settings = {}
    runs: dict[int, list[str]] = {}
    for cell in cells:
        seed = cell["training_seed"]
        _check_seed(entrant, seed, cell["card"]["seed"])
        settings[seed] = cell["card"]["settings"]
        done = [episode["trajectory"] for episode in cell["episodes"] if episode["steps"]]
        runs.setdefault(seed, []).extend(done)
    odd = [seed for seed, found in settings.items() if found != settings[0]]
    if odd:
        raise ValueError(
            f"{entrant.name}: training seed {odd[0]} was trained with other settings than seed 0; "
            "train all of a row's seeds by one command"
        )
    for first, second in itertools.combinations(runs, 2):
        if runs[first] and runs[first] == runs[second]:
            raise ValueError(f"{entrant.name}: {_copies(first, second)}")


def _copies(first: int, second: int) -> str:
    return (
        f"training seeds {first} and {second} are one policy; a copy is no training of its own: "
        "train it, or take it out"
    )


def _check_seed(entrant: Entrant, seed: int, said: Any) -> None:
    if said != seed:
        raise ValueError(
            f"{entrant.name}: the file of training seed {seed} has seed {said} on its card; name "
            "files as they were trained"
        )
