"""Common properties of the presets."""

import math

import gymnasium as gym
import pytest

from agents.settings import presets as configs
from baselines.core.catalogue import CONTROLLERS

PRESETS = sorted(configs.presets())
RESIDUAL = [names for names in PRESETS if names[2].startswith("residual")]
ROBUST = [names for names in PRESETS if names[1:] == ("ppo", "robust")]
GAIT = ("PAM/KneeWalk", "PAM/KneeStairs")
EVERY = [("ppo", ""), ("ppo", "residual")]


@pytest.mark.parametrize("names", PRESETS, ids="-".join)
def test_presets_train_on_both_hysteresis_models(names):
    assert configs.preset(*names).plants.hysteresis == ("maxwell_slip", "preisach")


@pytest.mark.parametrize("names", PRESETS, ids="-".join)
def test_budget_is_counted_or_by_hand(names):
    search = configs.preset(*names).search
    assert search.note.startswith("by hand") if search.trials is None else search.trials > 0


@pytest.mark.parametrize("names", PRESETS, ids="-".join)
def test_every_kind_of_row_is_evaluated(names):
    config = configs.preset(*names)
    assert config.evaluation.interval > 0
    assert config.evaluation.episodes >= 4 * len(config.kinds())


@pytest.mark.parametrize("names", [n for n in PRESETS if n[1:] in EVERY], ids="-".join)
def test_environment_of_every_kind_of_row_exists(names):
    config = configs.preset(*names)
    for kind in config.kinds():
        gym.make(config.env, **kind).close()
        gym.make(config.env, **{**kind, **config.evaluation.env_kwargs}).close()


@pytest.mark.parametrize("names", ROBUST, ids="-".join)
def test_robust_presets_have_drawn_everyday_and_a_quarter_of_nominal_plants(names):
    config = configs.preset(*names)
    drawn = [kind.get("randomize", False) for kind in config.kinds()]
    assert drawn.count(False) >= len(drawn) / 4
    assert {True, "everyday"} <= set(drawn)
    assert config.cost.quadratic > 0.0 or config.cost.relative
    assert config.cost.action_rate > 0.0
    assert config.privileged.critic
    for kind in config.kinds()[: len(config.mix)]:
        made = gym.make_vec(config.env, 1, vectorization_mode="vector_entry_point", **kind)
        assert bool(made.unwrapped.ranges) == bool(kind.get("randomize"))


@pytest.mark.parametrize("names", ROBUST, ids="-".join)
def test_robust_residuals_correct_a_feedback_controller(names):
    config = configs.preset(*names)
    if not names[0].startswith(GAIT):
        assert CONTROLLERS[config.residual.controller].feedback
        assert config.residual.scale * math.exp(config.network.log_std_init) <= 0.02


@pytest.mark.parametrize("names", RESIDUAL, ids="-".join)
def test_residual_presets_limit_exploration(names):
    config = configs.preset(*names)
    assert config.ppo.warm_up > 0
    assert config.ppo.target_kl is not None
    assert 2 * config.ppo.batch_size >= config.ppo.n_steps * config.num_envs
    assert config.residual.scale * math.exp(config.network.log_std_init) <= 0.02
