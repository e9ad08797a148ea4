"""Public seeds: every scenario has its own, so that intervals have their coverage."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet, available, public_seeds
from benchmarks.scoring import statistics
from tests.benchmarks.conftest import CONTENT

TRACKS = sorted(available())


def test_seeds_are_a_function_of_the_scenario_name() -> None:
    first = int.from_bytes(hashlib.sha256(b"public|steps|0").digest()[:8], "big")
    assert public_seeds("steps", 3)[0] == 1 + first % 899_999
    assert public_seeds("steps", 3) == public_seeds("steps", 5)[:3]
    many = [seed for k in range(500) for seed in public_seeds(f"{k}", 5)]
    assert min(many) >= 1
    assert max(many) < 900_000


def test_repeated_seeds_are_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scenarios, "_drawn", lambda name: iter([4, 4, 7, 4, 1, 2]))
    assert public_seeds("steps", 3) == (4, 7, 1)


@pytest.mark.parametrize("name", TRACKS)
def test_no_two_scenarios_of_a_track_share_a_seed(name: str) -> None:
    track = available()[name]
    drawn = [seed for seeds in track.seeds.values() for seed in seeds]
    assert len(set(drawn)) == len(drawn) == len(track.scenarios()) * track.content["seeds"]


def test_scenario_has_the_same_seeds_in_all_tracks_of_an_environment() -> None:
    tracks = available()
    nominal, drawn = (tracks[f"positioning_{name}"].seeds for name in ("nominal", "randomised"))
    shared = set(nominal) & set(drawn)
    assert len(shared) > 3
    assert all(nominal[name] == drawn[name][: len(nominal[name])] for name in shared)


@pytest.mark.parametrize("seeds", [0, 1001, [101, 102], 2.0, True, "5"])
def test_file_gives_the_number_of_seeds(seeds: object) -> None:
    with pytest.raises(ValueError, match="seeds must be their number, from 1 to 1000"):
        ScenarioSet({**CONTENT, "seeds": seeds})


def covered(seeds: dict[str, tuple[int, ...]], trials: int = 150) -> float:
    """Return how often an interval of 95 % holds the mean of errors that their seeds move.

    Half of the variance is what a seed draws (reference and noise), half the scenario's own.
    """
    strata = [name for name, own in seeds.items() for _ in own]
    numbers = [seed for own in seeds.values() for seed in own]
    _, place = np.unique(numbers, return_inverse=True)
    random, held = np.random.default_rng(5), 0
    for _ in range(trials):
        common = random.normal(size=place.max() + 1)[place]
        values = 10.0 + common + random.normal(size=len(place))
        found = statistics.of_table(values[None], strata, resamples=500)
        held += found.low <= 10.0 <= found.high
    return held / trials


def test_intervals_have_their_coverage() -> None:
    track = available()["positioning_nominal"]
    assert covered(track.seeds) > 0.88
    shared = dict.fromkeys(track.seeds, tuple(range(101, 106)))
    assert covered(shared) < 0.5  # what one list of seeds for all scenarios would do
