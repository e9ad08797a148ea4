"""Effects of a normal day: every environment draws them, within declared bounds."""

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.kernels.build import COMPILED
from pam_envs.parameters import declarations
from pam_envs.plants import ElbowOrthosis, KneeOrthosis, RedundantManipulator, SingleMuscle
from pam_envs.plants.core.everyday import EVERYDAY, everyday
from tests.envs.cases import IDS

PLANTS = (SingleMuscle.mas10, KneeOrthosis.no_load, RedundantManipulator.paper, ElbowOrthosis.paper)


@pytest.mark.parametrize("make", PLANTS)
def test_ranges_switch_on_creep_leak_droop_dead_time_rate_and_drift(make) -> None:
    plant, ranges = make(), everyday(make())
    assert set(EVERYDAY) <= set(ranges)
    assert any(name.endswith(".drift") for name in ranges)
    for name, (low, high) in ranges.items():
        part, _, entry = name.partition(".")
        declared = declarations(getattr(plant, part))[entry]
        assert declared.low <= low < high <= declared.high, name
    assert plant.replace({name: high for name, (_, high) in ranges.items()}).extended


@pytest.mark.skipif(COMPILED, reason="machine code for each case takes minutes")
@pytest.mark.parametrize("name", IDS)
def test_episodes_differ_from_the_plain_plant_and_from_each_other(name: str) -> None:
    seen = []
    for randomize, seed in ((False, 1), ("everyday", 1), ("everyday", 2)):
        env = gym.make(name, randomize=randomize)
        env.reset(seed=seed)
        action = np.full(env.action_space.shape, 0.3, np.float32)
        observations = [env.step(action)[0] for _ in range(20)]
        assert np.isfinite(observations).all()
        seen.append(np.array(observations))
    assert np.abs(seen[1] - seen[0]).max() > 1e-3
    assert np.abs(seen[2] - seen[1]).max() > 1e-3


def test_a_misspelt_preset_is_refused() -> None:
    with pytest.raises(ValueError, match="'everyday' or a mapping"):
        gym.make("PAM/MusclePositioning-v0", randomize="normal")
