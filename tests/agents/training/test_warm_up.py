"""Critic warm-up: the policy is frozen, and its learning rate rises from 0 afterwards."""

from typing import Any

import pytest
import torch
from short_runs import tiny
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from agents.policies.networks import CRITIC
from agents.settings import presets as configs
from agents.settings.schema import SettingsError
from agents.training.building import learning_rate, make_env, make_model, warm_up_steps
from agents.training.callbacks import WarmUp

ROLLOUT = 128
KINDS: dict[str, tuple[str, dict[str, Any]]] = {
    "plain": ("ppo", {"network": {"hidden": [16]}}),
    "structured": ("ppo", {"network": {"hidden": [16], "linear": True}}),
    "recurrent": ("recurrent_ppo", {"network": {"hidden": [16]}}),
    "critic without memory": ("recurrent_ppo", {"network": {"hidden": [16], "linear": True}}),
}


class Watch(BaseCallback):
    """Keeps the weights, the batch and the passes at the start of every rollout."""

    def __init__(self) -> None:
        super().__init__()
        self.weights: list[dict[str, torch.Tensor]] = []
        self.sizes: list[tuple[int, int]] = []

    def _on_rollout_start(self) -> None:
        state = self.model.policy.state_dict()
        self.weights.append({name: tensor.detach().clone() for name, tensor in state.items()})
        model: Any = self.model
        self.sizes.append((model.batch_size, model.n_epochs))

    def _on_step(self) -> bool:
        return True


def config_of(name: str, warm_up: int, **changes: Any) -> configs.Config:
    algo, own = KINDS[name]
    part = {"warm_up": warm_up}
    if name == "critic without memory":
        part["critic_lstm"] = False
    return tiny(algo, **{**own, algo: part, **changes})


@pytest.mark.parametrize("name", KINDS)
def test_critic_alone_learns_in_the_warm_up(name):
    config = config_of(name, 2, steps=5 * ROLLOUT)
    model = make_model(config, 0, make_env(config))
    model.set_logger(Logger(None, []))
    watch = Watch()
    model.learn(config.steps, callback=[WarmUp(config), watch])
    critic = {n for n in watch.weights[0] if n.startswith(CRITIC)}
    actor = {n for n, p in model.policy.named_parameters()} - critic
    assert {"action_net.weight", "log_std"} <= actor

    def moved(names: set[str], first: int, second: int) -> list[bool]:
        a, b = watch.weights[first], watch.weights[second]
        return [not torch.equal(a[name], b[name]) for name in sorted(names)]

    assert not any(moved(actor, 0, 2))
    assert any(moved(critic, 0, 1)) and any(moved(critic, 1, 2))
    assert any(moved(actor, 2, 3)) and any(moved(critic, 2, 3))
    usual = (config.chosen.batch_size, config.chosen.n_epochs)
    assert watch.sizes[2:] == [usual] * 3
    assert all(size < usual[0] and passes > usual[1] for size, passes in watch.sizes[:2])
    assert all(parameter.requires_grad for parameter in model.policy.parameters())


def test_rate_rises_from_zero_after_the_warm_up():
    config = config_of("plain", 4, steps=100 * ROLLOUT)
    usual = learning_rate(config_of("plain", 0, steps=100 * ROLLOUT))
    rate = learning_rate(config)
    left = [1.0 - done / 100 for done in range(101)]
    shares = [rate(share) / usual(share) for share in left]
    assert shares[:5] == [1.0] * 5  # the critic's
    assert shares[5:9] == pytest.approx([0.25, 0.5, 0.75, 1.0])
    assert shares[9:] == [1.0] * 92


def test_rate_is_not_negative_beyond_the_end():
    rate = learning_rate(config_of("plain", 0, steps=100 * ROLLOUT))
    assert rate(-0.5) == 0.0 < rate(0.5)


def test_warm_up_to_the_end_is_refused():
    with pytest.raises(SettingsError, match="warm_up = 8 rollouts are 1024 steps of 1024"):
        learning_rate(config_of("plain", 8))


def test_off_policy_algorithms_have_no_warm_up():
    assert warm_up_steps(tiny("sac")) == 0
    with pytest.raises(SettingsError, match=r"unknown setting 'sac\.warm_up'"):
        tiny("sac", sac={"warm_up": 2})
