"""The measurement of speed runs and reports what it says."""

from __future__ import annotations

import torch

from agents.training.speed import measure


def test_a_measurement_is_complete_and_leaves_torch_as_it_was() -> None:
    before = torch.get_num_threads()
    made = measure(seconds=0.06)
    assert set(made) == {"ppo_batched", "ppo_default_pendulum", "ratio", "num_envs", "rounds"}
    assert all(value > 0 for value in made.values())
    assert torch.get_num_threads() == before
