"""PPO of rsl-rl on a batch on a device, on the processor in place of a GPU."""

import importlib.util
import sys
from pathlib import Path
from typing import Any

import pytest

from pam_envs.kernels.build import COMPILED

EXAMPLE = Path(__file__).parents[3] / "docs/examples/gpu/ppo.py"
ID = "PAM/MusclePositioning-v0"
pytestmark = pytest.mark.skipif(not COMPILED, reason="batches on a device are compiled")


@pytest.fixture(scope="module")
def example() -> Any:
    """Return the module of the example."""
    pytest.importorskip("rsl_rl", reason="rsl-rl is not installed: pip install rsl-rl-lib")
    spec = importlib.util.spec_from_file_location("device_ppo", EXAMPLE)
    assert spec is not None and spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_episodes_that_reach_their_length_end_by_time_out(example: Any) -> None:
    import torch

    env = example.DeviceVecEnv(ID, 3, "host", episode_seconds=0.1)
    first = env.get_observations()["policy"].clone()
    for k in range(env.max_episode_length):
        observations, _, over, extras = env.step(torch.zeros(3, 1))
        assert bool(over.all()) == bool(over.any()) == (k == env.max_episode_length - 1)
    assert torch.equal(over, extras["time_outs"])
    assert not env.episode_length_buf.any()
    assert not torch.equal(observations["policy"], first)  # of the next episode


def test_ppo_updates_the_policy_on_the_device(example: Any) -> None:
    env = example.DeviceVecEnv(ID, 8, "host", episode_seconds=0.1)
    runner = example.OnPolicyRunner(env, example.settings(steps=12), log_dir=None, device="cpu")
    before = [p.detach().clone() for p in runner.alg.get_policy().parameters()]
    runner.learn(2)
    moved = zip(before, runner.alg.get_policy().parameters(), strict=True)
    assert all(not bool((old == new).all()) for old, new in moved)


def test_without_a_gpu_the_example_ends_with_a_sentence(
    example: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "cuda.core", None)
    monkeypatch.setattr(sys, "argv", ["ppo.py", ID])
    with pytest.raises(SystemExit) as ended:
        example.main()
    assert ended.value.code == 1
    assert "pip install 'pam-envs[cuda]'" in capsys.readouterr().err
