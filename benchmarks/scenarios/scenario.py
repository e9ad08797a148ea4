"""Scenario files: episodes of an environment and the rules of their scores.

A file names an environment, a grid of keyword arguments, the number of seeds, the settling window
and the worst-case values. The digest is that of the content and not of the layout: a changed number
changes it, a changed comment does not.

Every scenario has public seeds of its own, derived from its name: a common seed would give all
scenarios of a grid the same reference and noise, and thus correlated errors. A scenario of the same
name in another track has the same seeds, for paired comparison of tracks.
"""

import hashlib
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.identity.hashing import digest, plain
from benchmarks.scoring.metrics import GROUPS, headline_of, of_track
from pam_envs import yaml_file
from pam_envs.wording import shown

FOLDER = Path(__file__).parent
_REQUIRED = {
    *("schema", "name", "version", "title", "env", "seeds", "settle_seconds", "hold_seconds"),
    *("sensed", "rests", "cost_scales", "worst_case"),
}
_OPTIONAL = {
    *("kwargs", "grid", "per_reference", "model", "metrics", "gate", "half_range", "headline"),
    *("unit", "shown", *(key for group in GROUPS.values() for key in group.needs)),
}
MOST_SEEDS = MOST_SCENARIOS = 1000
PUBLIC_SEEDS = 899_999
"""Public seeds are from 1 to this number; those of tuning and training are above."""
_UNITS = {"load": "kg", "mismatch": "N", "pace": "s", "payload": "kg"}
"""Of the axes of a grid, for the scenarios' names."""


@dataclass(frozen=True)
class Scenario:
    """One setting of an environment, run once per seed.

    ``model`` has the keyword arguments that differ for the environment whose plant is the
    controller's nominal model; it is empty where the model is of the plant's own kind. Where the
    reference rests a steady-state error is scored.
    """

    name: str
    kwargs: Mapping[str, Any]
    model: Mapping[str, Any]
    rests: bool


def public_seeds(name: str, number: int) -> tuple[int, ...]:
    """Return the public seeds of a scenario: a function of its name, all different."""
    return tuple(dict.fromkeys(itertools.islice(_drawn(name), 2 * number)))[:number]


def _drawn(name: str) -> Iterator[int]:
    for k in itertools.count():
        drawn = hashlib.sha256(f"public|{name}|{k}".encode()).digest()[:8]
        yield 1 + int.from_bytes(drawn, "big") % PUBLIC_SEEDS


@dataclass(frozen=True)
class ScenarioSet:
    """The content of a scenario file as plain data, stored with every row."""

    content: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Check the keys and the values that determine the scores."""
        given, asked = set(self.content), tuple(self.content.get("metrics") or ())
        unknown, missing = given - _REQUIRED - _OPTIONAL, _REQUIRED - given
        self._refuse_if(
            unknown | missing,
            f"unknown keys {shown(sorted(unknown))}, missing keys {sorted(missing)}",
        )
        other = sorted(set(asked) - set(GROUPS))
        self._refuse_if(other, f"no metrics {shown(other)}; choose from {', '.join(GROUPS)}")
        for name in asked:
            lacking = sorted(set(GROUPS[name].needs) - given)
            self._refuse_if(lacking, f"the metrics {name} need {', '.join(lacking)}")
        headline, expected = headline_of(self.content), of_track(self.content)
        known = ", ".join(expected)
        self._refuse_if(
            headline not in expected, f"no headline {shown(headline)}; choose from {known}"
        )
        self._refuse_if(
            set(self.content["worst_case"]) != set(expected),
            f"worst_case needs a value for each of {known}",
        )
        size = math.prod(map(len, (self.content.get("grid") or {}).values()))
        self._refuse_if(
            not 1 <= size <= MOST_SCENARIOS,
            f"the grid has {size} scenarios; give 1 to {MOST_SCENARIOS}",
        )
        number = self.content["seeds"]
        self._refuse_if(
            type(number) is not int or not 1 <= number <= MOST_SEEDS,
            f"seeds must be their number, from 1 to {MOST_SEEDS}, got {shown(number)}",
        )

    def _refuse_if(self, wrong: object, why: str) -> None:
        if wrong:
            raise ValueError(f"{self.content.get('name', 'the scenario file')}: {why}")

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
        """Return all scenarios of the grid, ordered by the names of its axes.

        The order of the file is not used: a record stores its content with sorted keys, and must
        give the same scenarios in the same order.
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
    """Return the scenarios of a file; raise ValueError where one of its entries is wrong."""
    content = yaml_file.read(path, "scenario file")
    if not isinstance(content, dict) or content.get("schema") != 1:
        raise ValueError(f"{path}: not a scenario file of schema 1")
    with yaml_file.naming(str(path)):
        made = ScenarioSet(plain(content))
    if made.name != path.stem:
        raise ValueError(f"{path}: holds {made.name!r}; name file and content alike")
    return made


_ADDED: dict[str, ScenarioSet] = {}
"""Third-party scenario files by name."""


def add(path: Path) -> ScenarioSet:
    """Load a file from outside the folder; this process then knows it by its name."""
    made = load(path)
    _ADDED[made.name] = made
    return made


def names() -> tuple[str, ...]:
    """Return the names of all scenario files, those of the checkout and those that were added."""
    return tuple(sorted({path.stem for path in FOLDER.glob("*.yaml")} | set(_ADDED)))


def available() -> dict[str, ScenarioSet]:
    """Return all scenario files by name."""
    return {name: _ADDED.get(name) or load(FOLDER / f"{name}.yaml") for name in names()}
