"""Comparison of a family's controller in an environment."""

import numpy as np
import pytest

from pam_envs.checkout import catalogue
from pam_envs.diagnosis.closed_loop import in_environment
from pam_envs.diagnosis.closed_loop.in_environment import EPISODES, compare
from pam_envs.diagnosis.families.kinds import KINDS, kind_named
from pam_envs.diagnosis.plant_protocol import Loop
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.diagnosis.conftest import needs_kernels

KNEE = kind_named("knee_orthosis").loop
LATE = KneeOrthosis.no_load().changed({"regulator.dead_time": 0.06})


def test_loops_are_of_controllers_that_know_the_plant_and_run_in_the_environment():
    loops = [loop for name in KINDS if (loop := kind_named(name).loop) is not None]
    assert len(loops) == 4
    for loop in loops:
        entry = catalogue().CONTROLLERS[loop.controller]
        assert loop.env in entry.envs
        assert entry.knowledge == "nominal model"


@needs_kernels
def test_controller_of_the_right_plant_has_the_smaller_error_on_the_true_plant():
    found, reason = compare(KNEE, KneeOrthosis.no_load(), LATE, oracle=LATE)
    assert reason == ""
    assert len(found["references"]) == EPISODES
    assert found["after"]["value"] == found["oracle"]["value"] < 0.7 * found["before"]["value"]
    assert found["recovered"] == 1.0
    assert "the rig in PAM/KneeTension-v0" in found["text"]
    assert found["better_percent"]["interval"][0] > 20.0


@needs_kernels
def test_equal_plants_are_no_different():
    found, _ = compare(KNEE, LATE, LATE)
    assert found["better_percent"]["value"] == 0.0
    assert "no significant difference" in found["text"]


class Wild:
    """Controller that is switched to an extreme in some episodes."""

    def __init__(self, wild):
        self.wild = np.array(wild)

    def predict(self, observations, state, start, deterministic):
        return np.where(self.wild[:, None], 1.0, -1.0) * np.ones((len(observations), 2)), state


@needs_kernels
@pytest.mark.parametrize("wild", [2, 7])
def test_episodes_that_a_limit_ends_are_left_out(wild):
    kind = kind_named("elbow_orthosis")
    plant, ended = kind.preset(), np.arange(EPISODES) < wild

    class Elbow:
        """Environment that a limit ends under a large action."""

        control_period, signals, action_signals = 0.01, None, None

        def reset(self, seed):
            self.count = 0
            return np.zeros(1), {}

        def step(self, action):
            self.count += 1
            info = {"output": np.sin(self.count), "reference": 0.0}
            return np.zeros(1), 0.0, action[0] > 0.0 and self.count == 5, self.count == 900, info

    found, reason = with_environments(Elbow, lambda *_: Wild(ended), kind.loop, plant)
    if wild == 2:
        assert [row["name"] for row in found["references"]] == [f"episode {k}" for k in range(2, 8)]
        assert "ended 2 of 8 episodes, which are left out" in found["text"]
    else:
        assert found is None
        assert reason == "a limit of PAM/ElbowOrthosis-v0 ended 7 of 8 episodes"


def with_environments(made, design, loop, plant):
    """Return a comparison in environments of a class."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(in_environment, "environments", lambda *_: [made() for _ in range(EPISODES)])
        return compare(loop, plant, plant, design)


def test_plant_that_the_environment_does_not_take_is_a_reason():
    wrong = Loop("PAM/ElbowOrthosis-v0", "elbow_allocation", "N m", 1.0)
    found, reason = compare(wrong, LATE, LATE)
    assert found is None
    assert reason.startswith("PAM/ElbowOrthosis-v0 does not take this plant: ")


def test_missing_package_of_the_controllers_is_a_reason(monkeypatch):
    def missing():
        raise ModuleNotFoundError("No module named 'control'", name="control")

    monkeypatch.setattr(in_environment, "catalogue", missing)
    assert compare(KNEE, LATE, LATE) == (
        None,
        "the controllers need control: pip install 'pam-envs[baselines]'",
    )
