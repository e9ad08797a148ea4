"""Controllers with knobs from a search: reader of ``tuned.yaml``.

The search (``python -m benchmarks tune``) uses the same sampler and the same tuning seeds as the
search over a learned controller's settings; the number of trials is in each entry. Its result is
for one environment, on its nominal plant or on plants drawn in each episode, and is a separate
entry beside the controller as published.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from baselines.core.entry import SUFFIXES, Bounds, Entry, Knobs, Plants, check_knobs
from pam_envs import yaml_file

FILE = Path(__file__).with_name("tuned.yaml")
SCHEMA = 1
_OF_PLANTS: Mapping[Plants, str] = {"nominal": "", "drawn": " of drawn plants"}
EDGE = 0.05
"""Distance from an end of the search, over its logarithmic range, that counts as on the bound."""


@dataclass(frozen=True)
class Tuned:
    """Result of a search over the knobs of a published controller in an environment.

    Attributes
    ----------
    bounds : mapping
        Lowest and highest factor of each knob in the search.
    trials, seed : int
        Number of settings tried, and seed of the search.
    before, after : float
        Objective with all knobs at 1 and with these [SI]; lower is better.
    command : str
        Command that repeats the search, in the search space of the present catalogue.
    plants : {"nominal", "drawn"}
        Plants of the search's episodes; not written if nominal.
    """

    controller: str
    env: str
    knobs: Knobs
    bounds: Bounds
    trials: int
    seed: int
    before: float
    after: float
    command: str
    plants: Plants = "nominal"

    @property
    def name(self) -> str:
        """Name in the catalogue."""
        return tuned_name(self.controller, self.env, self.plants)

    @property
    def on_bounds(self) -> tuple[str, ...]:
        """Knobs whose optimum is on a bound of the search, so that a better one may be beyond."""
        return tuple(
            name
            for name, value in self.knobs.items()
            for low, high in (self.bounds[name],)
            if not EDGE < math.log(value / low) / math.log(high / low) < 1.0 - EDGE
        )


def tuned_name(controller: str, env: str, plants: Plants = "nominal") -> str:
    """Return the name in the catalogue of a controller tuned in an environment, on some plants."""
    kind = "" if plants == "nominal" else plants
    return "_".join(word for word in (controller, "tuned", kind, SUFFIXES.get(env, "")) if word)


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
        bounds = {knob: tuple(ends) for knob, ends in record.get("bounds", {}).items()}
        made = Tuned(**{**record, "bounds": bounds})
    except TypeError as error:
        raise ValueError(
            f"{FILE.name}: {name}: {error}; search again, or remove the entry"
        ) from error
    if lacking := [knob for knob in made.knobs if knob not in made.bounds]:
        raise ValueError(
            f"{FILE.name}: {name} has no bounds of {', '.join(lacking)}; search again, or remove "
            "the entry"
        )
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
            tuning=f"Optuna TPE, {made.trials} trials on tuning seeds{_OF_PLANTS[made.plants]}",
            trials=made.trials,
            knobs={},
            found=made.knobs,
        )
    return entries
