"""PPO of rsl-rl on a batch on the GPU: neither observations nor actions leave it.

pip install "pam-envs[cuda]" rsl-rl-lib
python ppo.py PAM/MusclePositioning-v0 --device cuda --num-envs 4096 --iterations 100
"""

import argparse
import time
from typing import Any

import gymnasium as gym
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

import pam_envs  # noqa: F401  registers the environments


class DeviceVecEnv(VecEnv):
    """A batch on a device, as rsl-rl takes it."""

    def __init__(self, env_id: str, num_envs: int, device: str, **arguments: Any) -> None:
        self.envs: Any = gym.make_vec(env_id, num_envs, device=device, info=False, **arguments)
        self.num_envs, self.num_actions = self.envs.action_space.shape
        self.max_episode_length = self.envs.setup.episode_steps
        self.cfg = {"env": env_id, **arguments}
        self.observations, _ = self.envs.reset(seed=0)
        self.device = self.observations.device
        self.episode_length_buf = torch.zeros(num_envs, dtype=torch.long, device=self.device)

    def get_observations(self) -> TensorDict:
        """Return the present observations."""
        return TensorDict({"policy": self.observations}, batch_size=[self.num_envs])

    def step(self, actions: torch.Tensor) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict]:
        """Step all environments; episodes that reach their length end by time-out."""
        self.observations, reward, terminated, truncated, _ = self.envs.step(actions)
        over = terminated | truncated
        self.episode_length_buf = (self.episode_length_buf + 1) * ~over
        return self.get_observations(), reward.float(), over, {"time_outs": truncated & ~terminated}


def settings(steps: int = 32) -> dict[str, Any]:
    """Return the settings of PPO: two hidden layers of 64, ``steps`` periods a rollout."""
    network = {"class_name": "MLPModel", "hidden_dims": [64, 64], "activation": "tanh"}
    spread = {"class_name": "GaussianDistribution", "init_std": 0.6}
    return {
        "class_name": "OnPolicyRunner",
        "num_steps_per_env": steps,
        "save_interval": 100,
        "check_for_nan": False,
        "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "actor": {**network, "distribution_cfg": spread},
        "critic": dict(network),
        "algorithm": {"class_name": "PPO", "learning_rate": 1e-3, "entropy_coef": 0.0},
    }


def main() -> None:
    """Train, and print the environment steps per second of rollouts and updates together."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("env")
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--num-envs", type=int, default=4096)
    parser.add_argument("--iterations", type=int, default=100)
    given = parser.parse_args()
    try:
        env = DeviceVecEnv(given.env, given.num_envs, given.device)
    except (gym.error.DependencyNotInstalled, RuntimeError) as error:
        parser.exit(1, f"{error}\n")
    runner = OnPolicyRunner(env, settings(), log_dir=None, device=str(env.device))
    began = time.perf_counter()
    runner.learn(given.iterations)
    env.envs.device.synchronise()
    steps = given.iterations * given.num_envs * runner.cfg["num_steps_per_env"]
    print(f"{steps / (time.perf_counter() - began):,.0f} environment steps per second")


if __name__ == "__main__":
    main()
