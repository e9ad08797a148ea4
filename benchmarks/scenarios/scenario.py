"""Scenario files: episodes of an environment and the rules of their scores.

A file names an environment, a grid of keyword arguments, the number of seeds, the settling window
and the worst-case values. What is digested is the content and not the layout, so that a comment
changes nothing and a number changes everything.

Every scenario has public seeds of its own, derived from its name: one seed would give all scenarios
of a grid the same reference and noise, and their errors would rise and fall together. A scenario
of the same name in another track has the same seeds, so that tracks are compared in pairs.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from benchmarks.identity.hashing import digest, plain
from benchmarks.scoring.metrics import GROUPS, headline_of, of_track

FOLDER = Path(__file__).parent
_KEYS = {
    "schema",
    "name",
    "version",
    "title",
    "env",
    "seeds",
    "settle_seconds",
    "hold_seconds",
    "sensed",
    "rests",
    "cost_scales",
    "worst_case",
    "kwargs",
    "grid",
    "per_reference",
    "model",
    "metrics",
    "gate",
    "half_range",
    "headline",
    "tool_length",
    "activity",
    "unit",
    "shown",
}
_OPTIONAL = {
    "kwargs",
    "grid",
    "per_reference",
    "model",
    "metrics",
    "gate",
    "half_range",
    "headline",
    "tool_length",
    "activity",
    "unit",
    "shown",
}
MOST_SEEDS = 1000
PUBLIC_SEEDS = 899_999
"""Public seeds are from 1 to this number; those of tuning and training are above."""
_UNITS = {"load": "kg", "mismatch": "N", "pace": "s", "payload": "kg"}
"""Of the axes of a grid, for the scenarios' names."""


@dataclass(frozen=True)
class Scenario:
    """One setting of an environment, run once per seed.

    Attributes
    ----------
    name : str
        Unique in its file.
    kwargs : mapping
        Keyword arguments of ``gymnasium.make``.
    model : mapping
        Keyword arguments that differ for the environment whose plant is the controller's nominal
        model; empty where the model is of the plant's own kind.
    rests : bool
        Whether the reference rests, so that a steady-state error is scored.
    """

    name: str
    kwargs: Mapping[str, Any]
    model: Mapping[str, Any]
    rests: bool


def public_seeds(name: str, number: int) -> tuple[int, ...]:
    """Return the public seeds of a scenario: a function of its name, all different."""
    different = dict.fromkeys(itertools.islice(_drawn(name), 2 * number))
    return tuple(different)[:number]


def _drawn(name: str) -> Iterator[int]:
    for k in itertools.count():
        drawn = hashlib.sha256(f"public|{name}|{k}".encode()).digest()[:8]
        yield 1 + int.from_bytes(drawn, "big") % PUBLIC_SEEDS


@dataclass(frozen=True)
class ScenarioSet:
    """The content of a scenario file.

    Attributes
    ----------
    content : mapping
        The file as plain data, kept with every row.
    """

    content: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Check the keys and the values that the scores rest on."""
        given, name = set(self.content), self.content.get("name", "the scenario file")
        if given - _KEYS or _KEYS - given - _OPTIONAL:
            raise ValueError(
                f"{name}: unknown keys {sorted(given - _KEYS)}, "
                f"missing keys {sorted(_KEYS - given - _OPTIONAL)}"
            )
        unknown = set(self.content.get("metrics") or ()) - set(GROUPS)
        if unknown:
            raise ValueError(
                f"{name}: no metrics {sorted(unknown)}; choose from {', '.join(GROUPS)}"
            )
        expected = of_track(self.content)
        headline = headline_of(self.content)
        if headline not in expected:
            raise ValueError(f"{name}: no headline {headline!r}; choose from {', '.join(expected)}")
        if "chain" in (self.content.get("metrics") or ()) and "tool_length" not in given:
            raise ValueError(f"{name}: the metrics of a chain need tool_length [m]")
        if set(self.content["worst_case"]) != set(expected):
            raise ValueError(f"{name}: worst_case needs a value for each of {', '.join(expected)}")
        number = self.content["seeds"]
        if type(number) is not int or not 1 <= number <= MOST_SEEDS:
            raise ValueError(
                f"{name}: seeds must be their number, from 1 to {MOST_SEEDS}, got {number!r}"
            )

    @property
    def name(self) -> str:
        """Name of the track, as in the row's file name."""
        return str(self.content["name"])

    @property
    def env(self) -> str:
        """Id of the environment."""
        return str(self.content["env"])

    @property
    def seeds(self) -> dict[str, tuple[int, ...]]:
        """Public seeds of each scenario."""
        names = [scenario.name for scenario in self.scenarios()]
        return {name: public_seeds(name, self.content["seeds"]) for name in names}

    @property
    def digest(self) -> str:
        """SHA-256 of the content; the title is description."""
        return digest(identifying(self.content))

    def __hash__(self) -> int:
        """Return a hash of the content, so that results can be cached by track."""
        return hash(self.digest)

    def scenarios(self) -> tuple[Scenario, ...]:
        """Return the grid, written out by the names of its axes.

        Not in the order of the file: a record keeps its content with sorted keys, and has to give
        the same scenarios in the same order.
        """
        grid = dict(sorted((self.content.get("grid") or {}).items()))
        return tuple(
            self._scenario(dict(zip(grid, values, strict=True)))
            for values in itertools.product(*grid.values())
        )

    def _scenario(self, point: Mapping[str, Any]) -> Scenario:
        kwargs = {**(self.content.get("kwargs") or {}), **point}
        reference = kwargs.get("reference")
        kwargs |= (self.content.get("per_reference") or {}).get(reference, {})
        return Scenario(
            name="_".join(_word(axis, value) for axis, value in point.items()) or "only",
            kwargs=kwargs,
            model=dict(self.content.get("model") or {}),
            rests=reference in self.content["rests"],
        )


def _word(axis: str, value: Any) -> str:
    if isinstance(value, (int, float)):
        return f"{value:g}{_UNITS.get(axis, '')}"
    return Path(value).stem if axis == "plant" else str(value)


def identifying(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a scenario file without its title, which is description."""
    return {key: value for key, value in content.items() if key != "title"}


def load(path: Path) -> ScenarioSet:
    """Return the scenarios of a file.

    Raises
    ------
    ValueError
        If the file is not a mapping, or a key is unknown or missing.
    """
    content = yaml.safe_load(path.read_text())
    if not isinstance(content, dict) or content.get("schema") != 1:
        raise ValueError(f"{path}: not a scenario file of schema 1")
    made = ScenarioSet(plain(content))
    if made.name != path.stem:
        raise ValueError(f"{path}: holds {made.name!r}; name file and content alike")
    return made


_ADDED: dict[str, ScenarioSet] = {}
"""Scenario files from elsewhere, by name."""


def add(path: Path) -> ScenarioSet:
    """Load a file from outside the folder; this process then knows it by its name."""
    made = load(path)
    _ADDED[made.name] = made
    return made


def names(folder: Path | None = None) -> tuple[str, ...]:
    """Return the names of the scenario files of a folder, by default of the checkout."""
    found = {path.stem for path in (folder or FOLDER).glob("*.yaml")}
    return tuple(sorted(found | (set() if folder else set(_ADDED))))


def available(folder: Path | None = None) -> dict[str, ScenarioSet]:
    """Return all scenario files by name."""
    added = {} if folder else _ADDED
    return {
        name: added[name] if name in added else load((folder or FOLDER) / f"{name}.yaml")
        for name in names(folder)
    }
