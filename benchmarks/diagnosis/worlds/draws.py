"""Cases of the study over worlds.

Every world has the same numbers of cases. Seeds depend on offset, world and kind alone, so that a
part of the study has the cases of the whole. Offset 0 is frozen: development uses another offset.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import combinations, islice

import numpy as np

from benchmarks.diagnosis.cases import LACKING, LARGE, Case, check_each, first_seed, sizes_in
from benchmarks.diagnosis.sources import WORLDS
from tests.diagnosis.hidden import EFFECTS
from tests.diagnosis.worlds import OUTSIDE

EACH = {
    **{"single": 4, "clean": 50, "pair": 10, "triple": 10},
    **{"unknown": 6, "clock": 5, "untestable": 8},
}
"""Number of cases of a kind in each world; of single effects, for each effect."""
LATE = (-2.0, -1.0, 0.5, 1.0, 2.0)
"""Rows by which readings are late."""
WORLD_SEEDS, KIND_SEEDS = 5_000, 500  # numbers of seeds of a world, and of a kind in it
SPACED = 15
"""Worlds with that many seeds each; the seeds of later ones follow without gaps."""

Draw = Callable[[int, int, np.random.Generator], Iterator[Case]]


def cases(offset: int = 0, each: Mapping[str, int] | None = None) -> list[Case]:
    """Return the cases; with ``each`` only the first so many of its kinds in each world.

    Raises
    ------
    ValueError
        If a kind does not exist, or has fewer cases.
    """
    check_each(each, EACH)
    made: list[Case] = []
    for i, world in enumerate(WORLDS):
        for k, kind in enumerate(EACH):
            place = WORLD_SEEDS * min(i, SPACED) + KIND_SEEDS * len(EACH) * max(i - SPACED, 0)
            start = first_seed("worlds", offset) + place + KIND_SEEDS * k
            drawn = DRAWS[kind](i, EACH[kind], np.random.default_rng(start))
            numbered = [replace(c, world=world, seed=start + n) for n, c in enumerate(drawn)]
            made += _first(numbered, each.get(kind, 0)) if each else numbered
    return made


def _first(drawn: list[Case], each: int) -> Iterator[Case]:
    """Yield the first cases of a kind; of single effects, those of every effect."""
    if drawn[0].kind != "single":
        yield from drawn[:each]
        return
    for name in EFFECTS:
        yield from islice((case for case in drawn if case.names == (name,)), each)


def _single(world: int, n: int, rng: np.random.Generator) -> Iterator[Case]:
    for name in EFFECTS:
        for size in sizes_in(*LARGE, n, rng):
            yield Case("single", 0, (name,), (float(size),))


def _together(kind: str, number: int) -> Draw:
    """Return the draw of several effects at once."""
    sets = list(combinations(EFFECTS, number))

    def drawn(world: int, n: int, rng: np.random.Generator) -> Iterator[Case]:
        sizes = np.array([sizes_in(*LARGE, n, rng) for _ in range(number)]).T
        for k, row in zip(rng.choice(len(sets), n, replace=False), sizes.tolist(), strict=True):
            yield Case(kind, 0, sets[k], tuple(row))

    return drawn


def _in_turn(kind: str, names: tuple[str, ...]) -> Draw:
    """Return the draw of single effects, taken in turn over the worlds."""

    def drawn(world: int, n: int, rng: np.random.Generator) -> Iterator[Case]:
        for k, size in enumerate(sizes_in(*LARGE, n, rng)):
            yield Case(kind, 0, (names[(world * n + k) % len(names)],), (float(size),))

    return drawn


def _clean(world: int, n: int, rng: np.random.Generator) -> Iterator[Case]:
    yield from [Case("clean", 0)] * n


def _clock(world: int, n: int, rng: np.random.Generator) -> Iterator[Case]:
    for k in range(n):
        yield Case("clock", 0, late=LATE[k % len(LATE)])


DRAWS: dict[str, Draw] = {
    "single": _single,
    "clean": _clean,
    "pair": _together("pair", 2),
    "triple": _together("triple", 3),
    "unknown": _in_turn("unknown", OUTSIDE),
    "clock": _clock,
    "untestable": _in_turn("untestable", tuple(LACKING)),
}
