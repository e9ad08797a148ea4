"""Scenarios of the tracks: public seeds of their own, and the same scenarios from a record."""

import hashlib
import json
from collections import Counter

import pytest

from benchmarks.board import summary
from benchmarks.scenarios import kinds
from benchmarks.scenarios import scenario as scenarios
from benchmarks.scenarios.scenario import ScenarioSet, available, public_seeds
from tests.benchmarks.conftest import CONTENT

TRACKS = sorted(available())


def test_seeds_are_a_function_of_the_scenario_name():
    first = int.from_bytes(hashlib.sha256(b"public|steps|0").digest()[:8], "big")
    assert public_seeds("steps", 3)[0] == 1 + first % 899_999
    assert public_seeds("steps", 3) == public_seeds("steps", 5)[:3]
    many = [seed for k in range(500) for seed in public_seeds(f"{k}", 5)]
    assert min(many) >= 1
    assert max(many) < 900_000


def test_repeated_seeds_are_skipped(monkeypatch):
    monkeypatch.setattr(scenarios, "_drawn", lambda name: iter([4, 4, 7, 4, 1, 2]))
    assert public_seeds("steps", 3) == (4, 7, 1)


@pytest.mark.parametrize("name", TRACKS)
def test_no_two_scenarios_of_a_track_share_a_seed(name):
    track = available()[name]
    drawn = [seed for seeds in track.seeds.values() for seed in seeds]
    assert len(set(drawn)) == len(drawn) == len(track.scenarios()) * track.content["seeds"]


def test_scenario_has_the_same_seeds_in_all_tracks_of_an_environment():
    tracks = available()
    nominal, drawn = (tracks[f"positioning_{name}"].seeds for name in ("nominal", "randomised"))
    shared = set(nominal) & set(drawn)
    assert len(shared) > 3
    assert all(nominal[name] == drawn[name][: len(nominal[name])] for name in shared)


def test_every_environment_has_one_track_of_each_kind_of_the_summary():
    found = {}
    for name, track in available().items():
        for kind in summary.KINDS:
            found.setdefault(track.env, Counter())[kind] += kinds.is_of(name, kind)
    assert len(found) == 9
    assert {tuple(counts.values()) for counts in found.values()} == {(1,) * len(summary.KINDS)}


def test_counterpart_is_the_track_of_another_kind_with_the_same_environment():
    tracks = available()
    for name, track in tracks.items():
        other = kinds.counterpart(name, kinds.NOMINAL, kinds.DRAWN)
        assert (other is not None) == kinds.is_of(name, kinds.NOMINAL)
        assert other is None or tracks[other].env == track.env
    assert kinds.counterpart("nominal", kinds.NOMINAL, kinds.DRAWN) is None


@pytest.mark.parametrize("seeds", [0, 1001, [101, 102], 2.0, True, "5"])
def test_file_gives_the_number_of_seeds(seeds):
    with pytest.raises(ValueError, match="seeds must be their number, from 1 to 1000"):
        ScenarioSet({**CONTENT, "seeds": seeds})


@pytest.mark.parametrize("name", TRACKS)
def test_record_gives_the_scenarios_of_its_file(name):
    made = available()[name]
    content = json.loads(json.dumps(made.content, sort_keys=True))
    again = ScenarioSet(content)
    assert again.digest == made.digest
    assert again.scenarios() == made.scenarios()
    assert len({s.name for s in made.scenarios()}) == len(made.scenarios()) > 1
