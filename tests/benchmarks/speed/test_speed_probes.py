"""Probes of training (time within the plants, below all wrappers) and of planning."""

from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import VectorEnv

from benchmarks.speed import controllers as speed_controllers
from benchmarks.speed import learning as speed_learning
from benchmarks.speed import probes, rates
from benchmarks.speed.groups import measure


@pytest.mark.parametrize(
    ("rest", "share", "verdict"), [(38.0, 0.05, "pass"), (18.0, 0.1, "MISSED")]
)
def test_environment_share_refers_to_the_whole_rollout(monkeypatch, rest, share, verdict):
    now = [0.0]
    monkeypatch.setattr(speed_learning, "time", SimpleNamespace(process_time=lambda: now[0]))

    class Batch:
        def step(self, actions: None) -> None:
            now[0] += 1.0

    batches = (Batch(), Batch())
    env = SimpleNamespace(venv=SimpleNamespace(batches=batches))

    def chunk() -> int:
        for batch in batches:
            batch.step(None)
        now[0] += rest
        return 2

    found = speed_learning._share("KneeWalk, N = 2", env, chunk, 3)
    assert found.value == pytest.approx(share)
    assert found.verdict == verdict
    assert "KneeWalk" in found.name


def test_time_of_an_action_is_compared_with_the_control_period(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(speed_controllers, "time", SimpleNamespace(process_time=lambda: now[0]))

    class Slow:
        """A controller that takes 2 ms for an action, and 30 ms for the hundredth."""

        def predict(self, observation, state, start, deterministic):
            count = 0 if start else state + 1
            now[0] += 0.03 if count == 99 else 0.002
            return np.zeros(1, np.float32), count

    def design(*_):
        now[0] += 1.5
        return Slow()

    monkeypatch.setattr(speed_controllers, "make_controller", design)
    env = gym.make("PAM/MusclePositioning-v0").unwrapped
    found = speed_controllers.timed("slow", env, 3)
    assert found.value == pytest.approx(1e6 * (199 * 0.002 + 0.03) / 200)
    assert found.floor == pytest.approx(1e4)
    assert found.verdict == "pass"
    assert "design 1.5 s" in found.note
    monkeypatch.setattr(speed_controllers, "make_controller", lambda *_: 1 / 0)
    assert speed_controllers.timed("broken", env, 3).verdict == "not measured"


@pytest.mark.parametrize("variant", ["", "residual"])
def test_all_batches_of_a_preset_are_found(variant):
    building = pytest.importorskip(
        "agents.training.building", reason="the extra 'agents' is not there"
    )
    from agents.settings.presets import preset

    config = preset("PAM/KneeTension-v0", "ppo", variant)
    env = building.make_env(config)
    found = list(speed_learning.batches_of(env))
    env.close()
    assert len(found) == len(config.kinds()) > 1
    assert all(isinstance(batch, VectorEnv) for batch in found)
    assert sum(batch.num_envs for batch in found) == config.num_envs


@pytest.mark.parametrize(("rate", "verdict"), [(1999.0, "MISSED"), (2001.0, "pass"), (3e4, "aim")])
def test_planning_has_a_required_rate(monkeypatch, rate, verdict):
    def timed(subjects, rounds):
        assert subjects["poses"]() == 3 * 2 * 41 * probes.REPEATS
        return {"poses": [rate] * rounds}

    monkeypatch.setattr(probes, "interleaved", timed)
    (found,) = measure(["planning"], rounds=3)
    assert (found.value, found.verdict) == (rate, verdict)
    assert "MISSED" not in rates.table([found]) or rate < 2000.0
