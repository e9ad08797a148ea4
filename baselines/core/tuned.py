"""Controllers of papers with numbers that a search found: ``tuned.yaml``, read and checked.

The search (``python -m benchmarks tune``) has as many trials as that of a learned controller's
settings, and looks at the same tuning seeds. What it finds belongs to one environment, and is an
entry of the catalogue of its own beside the controller as published, which stays as it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from baselines.core.entry import Entry
from baselines.core.knobs import Knobs, check_knobs

FILE = Path(__file__).with_name("tuned.yaml")
SCHEMA = 1
PLACES: Mapping[str, str] = {
    "PAM/KneeTension-v0": "tension",
    "PAM/KneeStiffness-v0": "stiffness",
    "PAM/KneeWalk-v0": "walk",
    "PAM/KneeStairsUp-v0": "stairs_up",
    "PAM/KneeStairsDown-v0": "stairs_down",
    "PAM/AntagonisticJoint-v0": "joint",
    "PAM/RedundantManipulator-v0": "arm",
}
"""Word for an environment in the names of controllers that run in several."""


@dataclass(frozen=True)
class Tuned:
    """What a search found for a controller in an environment.

    Attributes
    ----------
    controller : str
        Name of the controller as published.
    env : str
        Id of the environment.
    knobs : mapping of float
        Factors; see :mod:`baselines.core.knobs`.
    trials, seed : int
        Settings that were tried, and seed of the search.
    before, after : float
        Its objective with all knobs at 1 and with these, SI; less is better.
    command : str
        What searches again.
    """

    controller: str
    env: str
    knobs: Knobs
    trials: int
    seed: int
    before: float
    after: float
    command: str

    @property
    def name(self) -> str:
        """Name in the catalogue."""
        return tuned_name(self.controller, self.env)


def tuned_name(controller: str, env: str) -> str:
    """Return the name of a controller as it was tuned in an environment."""
    return "_".join(word for word in (controller, "tuned", PLACES.get(env, "")) if word)


def read(file: Path = FILE) -> dict[str, Tuned]:
    """Return what searches found, by names in the catalogue.

    Raises
    ------
    ValueError
        If the file is not laid out as a search writes it.
    """
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise ValueError(
            f"{file.name} is not of schema {SCHEMA}; take the one of the last commit, and add to "
            "it with `python -m benchmarks tune`"
        )
    return {name: _read(name, said) for name, said in (content.get("tuned") or {}).items()}


def _read(name: str, said: Mapping[str, Any]) -> Tuned:
    try:
        made = Tuned(**said)
    except TypeError as error:
        raise ValueError(
            f"{FILE.name}: {name}: {error}; search again, or take the entry out"
        ) from error
    if made.name != name:
        raise ValueError(
            f"{FILE.name}: {name} is of {made.controller} in {made.env}; name it {made.name}"
        )
    return made


def entries(plain: Mapping[str, Entry], found: Mapping[str, Tuned]) -> dict[str, Entry]:
    """Return the catalogue's entries of what searches found.

    Parameters
    ----------
    plain : mapping of Entry
        The controllers as published.
    found : mapping of Tuned

    Raises
    ------
    ValueError
        If there is no such controller in that environment, or a knob is out of its bounds.
    """
    return {name: _as_entry(name, plain, made) for name, made in found.items()}


def _as_entry(name: str, plain: Mapping[str, Entry], made: Tuned) -> Entry:
    base = plain.get(made.controller)
    if base is None or made.env not in base.envs:
        raise ValueError(
            f"{name}: no controller {made.controller!r} in {made.env}; take it out of {FILE.name}"
        )
    check_knobs(made.controller, base.knobs, made.knobs)
    return replace(
        base,
        summary=f"{made.controller} with {', '.join(made.knobs)} as found by a search",
        envs=(made.env,),
        tuning=f"Optuna TPE, {made.trials} trials on tuning seeds",
        trials=made.trials,
        knobs={},
        found=made.knobs,
    )
