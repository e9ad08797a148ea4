"""An episode: what is a failure of the controller, and what an error of ours."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import rollout
from benchmarks.making import make_env

SHORT = {"episode_seconds": 0.2}


class Gives:
    """A controller that gives one thing, or raises it."""

    def __init__(self, thing):
        self.thing = thing

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        if isinstance(self.thing, Exception):
            raise self.thing
        return self.thing, None


@pytest.fixture
def env():
    made = make_env("PAM/MusclePositioning-v0", SHORT)
    yield made
    made.close()


def test_an_episode_that_ends_by_its_time_is_no_failure(env):
    episode = rollout.run(env, Gives(np.zeros(1, np.float32)), 1)
    assert (episode.failed, len(episode.actions)) == (False, 20)


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (np.array([np.nan]), "ValueError"),
        (np.zeros(2), "ValueError"),
        ("full", "ValueError"),
        (None, ""),
        ({"pressure": 1.0}, ""),
        (TypeError("not so"), "TypeError: not so"),
        (RuntimeError("line\n  two at 0x7f001122aabb"), "RuntimeError: line two at 0x..."),
    ],
)
def test_a_controller_that_fails_is_recorded_with_its_words(env, thing, words):
    episode = rollout.run(env, Gives(thing), 1)
    assert episode.failed
    assert episode.failure.startswith(words)
    assert len(episode.actions) == 0


def test_a_long_message_is_cut(env):
    episode = rollout.run(env, Gives(RuntimeError("x" * 10_000)), 1)
    assert len(episode.failure) == rollout.LONGEST
    assert episode.failure.endswith("...")


@pytest.mark.parametrize("error", [ValueError("ours"), KeyError("ours"), TypeError("ours")])
def test_an_error_of_the_environment_is_raised(env, error, monkeypatch):
    def broken(action):
        raise error

    monkeypatch.setattr(env.unwrapped, "step", broken)
    with pytest.raises(type(error), match="ours"):
        rollout.run(env, Gives(np.zeros(1, np.float32)), 1)
