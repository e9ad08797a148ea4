"""Controllers with knobs from a search: reader of ``tuned.yaml``.

The search (``python -m benchmarks tune``) uses the same number of trials and the same tuning seeds
as the search over a learned controller's settings. Its result is for one environment, and is a
separate entry beside the controller as published.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from baselines.core.entry import SUFFIXES, Entry, Knobs, check_knobs
from pam_envs import yaml_file

FILE = Path(__file__).with_name("tuned.yaml")
SCHEMA = 1


@dataclass(frozen=True)
class Tuned:
    """Result of a search over the knobs of a published controller in an environment.

    Attributes
    ----------
    trials, seed : int
        Number of settings tried, and seed of the search.
    before, after : float
        Objective with all knobs at 1 and with these [SI]; lower is better.
    command : str
        Command that repeats the search.
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
    """Return the name in the catalogue of a controller tuned in an environment."""
    return "_".join(word for word in (controller, "tuned", SUFFIXES.get(env, "")) if word)


def read(file: Path = FILE) -> dict[str, Tuned]:
    """Return the results of searches by their names in the catalogue."""
    content = yaml_file.read(file, "tuned values")
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        raise ValueError(
            f"{file.name} is not of schema {SCHEMA}; restore the file of the last commit, and add "
            "to it with `python -m benchmarks tune`"
        )
    return {name: _read(name, record) for name, record in (content.get("tuned") or {}).items()}


def _read(name: str, record: Mapping[str, Any]) -> Tuned:
    try:
        made = Tuned(**record)
    except TypeError as error:
        raise ValueError(
            f"{FILE.name}: {name}: {error}; search again, or remove the entry"
        ) from error
    if made.name != name:
        raise ValueError(
            f"{FILE.name}: {name} belongs to {made.controller} in {made.env}; name it {made.name}"
        )
    return made


def entries(plain: Mapping[str, Entry], found: Mapping[str, Tuned]) -> dict[str, Entry]:
    """Return the catalogue entries of tuned controllers; ``plain`` holds the untuned ones."""
    entries: dict[str, Entry] = {}
    for name, made in found.items():
        base = plain.get(made.controller)
        if base is None or made.env not in base.envs:
            raise ValueError(
                f"{name}: no controller {made.controller!r} in {made.env}; remove it from"
                f" {FILE.name}"
            )
        check_knobs(made.controller, base.knobs, made.knobs)
        entries[name] = replace(
            base,
            summary=f"{made.controller} with {', '.join(made.knobs)} as found by a search",
            envs=(made.env,),
            tuning=f"Optuna TPE, {made.trials} trials on tuning seeds",
            trials=made.trials,
            knobs={},
            found=made.knobs,
        )
    return entries
