"""Calibration figures of the EMG-proxy effort, and the tracks of a normal day."""

import numpy as np
import pytest

from agents.policies import catalogue
from benchmarks.effort import GAITS, RANDOM, VENTED, episodes, measured, perfect
from benchmarks.runs.controllers import find
from benchmarks.runs.runner import fits
from benchmarks.scenarios.scenario import available


@pytest.mark.parametrize("name", GAITS)
@pytest.mark.parametrize("pace", ["slow", "normal"])
def test_effort_sees_perfect_assistance_beyond_the_scatter_of_seeds(name, pace):
    vented = list(episodes(name, pace, "prescribed", VENTED, 4))
    of_estimate, of_demand = (
        [perfect(e, f"state/{key}") for e in vented] for key in ("torque_reference", "torque_ideal")
    )
    assert 1.0 - np.mean(of_estimate) > 5.0 * np.std(of_estimate, ddof=1)
    assert 0.84 < np.mean(of_demand) < 0.89
    chance = np.mean([measured(e) for e in episodes(name, pace, "prescribed", RANDOM, 4)])
    assert chance > np.mean(of_estimate) or (name, pace) == ("KneeStairsDown", "normal")


def test_every_environment_has_a_track_of_a_normal_day():
    tracks = available().values()
    drawn = {t.env for t in tracks if t.content["kwargs"].get("randomize") == "everyday"}
    assert drawn == {t.env for t in tracks} and len(drawn) == 9


def test_policy_of_plants_that_are_no_more_fits_no_track(monkeypatch):
    track = available()["knee_walk_nominal"]
    assert catalogue.outdated("ppo_knee_walk") and not fits(find("ppo_knee_walk"), track)
    monkeypatch.setattr(catalogue, "outdated", lambda name: False)
    assert fits(find("ppo_knee_walk"), track)
