"""Speed of training, and the environments' share of its time."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from typing import Any

from benchmarks.speed.rates import Chunk, Measurement, interleaved, median, ratio

ENV = "PAM/MusclePositioning-v0"
MOST = 0.05  # the largest share of a training's time that its environments may take


def learning(rounds: int) -> list[Measurement]:
    """PPO at 256 environments compared with the default on one Pendulum."""
    from agents.settings.presets import preset
    from agents.training import building

    config = dataclasses.replace(preset(ENV, "ppo"), num_envs=256)
    chunk = rollouts_of(building.make_model(config, 0, building.make_env(config)))
    import torch
    from stable_baselines3 import PPO

    torch.set_num_threads(1)
    peer = PPO("MlpPolicy", "Pendulum-v1", seed=0, device="cpu")

    def default() -> int:
        peer.learn(2048, reset_num_timesteps=False)
        return 2048

    rates = interleaved({"ours": chunk, "peer": default}, min(rounds, 3))
    ours, peers = rates["ours"], rates["peer"]
    gain = "PPO N = 256 / default on one Pendulum"
    return [
        Measurement("learning", "PPO, N = 256, frames per CPU second", median(ours), "1/s"),
        Measurement("learning", "PPO default, one Pendulum, the same", median(peers), "1/s"),
        Measurement("learning", gain, ratio(ours, peers), "x", 25.0, 60.0),
    ]


def rollouts_of(model: Any) -> Chunk:
    """Return a function that trains for one rollout and returns its steps, after a first one."""
    size = model.n_steps * model.n_envs

    def once() -> int:
        model.learn(size, reset_num_timesteps=model.num_timesteps == 0)
        return int(size)

    once()
    return once


def shares(rounds: int) -> list[Measurement]:
    """Environments' share of the training time of each PPO preset."""
    from agents.settings.presets import preset
    from agents.training import building
    from pam_envs.__main__ import env_ids

    found = []
    for config in (preset(env_id, "ppo") for env_id in env_ids()):
        env = building.make_env(config)
        chunk = rollouts_of(building.make_model(config, 0, env))
        name = config.env.removeprefix("PAM/").rpartition("-")[0]
        found.append(_share(f"{name}, N = {config.num_envs}", env, chunk, min(rounds, 3)))
        env.close()
    return found


def _share(name: str, env: Any, chunk: Chunk, rounds: int) -> Measurement:
    """Measure one preset: a chunk is rollouts and updates together."""
    spent = [_timed(batch) for batch in batches_of(env)]
    found = []
    for _ in range(rounds):
        inside, began = sum(clock() for clock in spent), time.process_time()
        chunk()
        whole = time.process_time() - began
        found.append((sum(clock() for clock in spent) - inside) / whole)
    title = f"environment's share of PPO's time, {name}"
    return Measurement("learning", title, median(found), "", MOST, better="less")


def batches_of(env: Any) -> Iterator[Any]:
    """Yield the batches of plants inside the training wrappers."""
    if hasattr(env, "venv"):
        yield from batches_of(env.venv)
    else:
        yield from env.batches


def _timed(batch: Any) -> Callable[[], float]:
    """Make a batch sum the CPU seconds of its steps; return a function that reads the sum."""
    plain, total = batch.step, [0.0]

    def step(actions: Any) -> Any:
        began = time.process_time()
        try:
            return plain(actions)
        finally:
            total[0] += time.process_time() - began

    batch.step = step
    return lambda: total[0]
