"""Where the time of a training goes: stepping plants, and everything else."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator
from typing import Any

from benchmarks.speed import Chunk, Measurement, Missing, median

MOST = 0.05
"""The largest share of a training's time that its environments may take."""


def shares(rounds: int) -> list[Measurement]:
    """Environments' share of the time of each PPO preset."""
    try:
        building = importlib.import_module("agents.building")
        configs = importlib.import_module("agents.configs")
    except ModuleNotFoundError as error:
        raise Missing(f"agents cannot be imported: {error.name} is not installed") from error
    from pam_envs.__main__ import env_ids

    return [_share(building, configs.preset(env, "ppo"), min(rounds, 3)) for env in env_ids()]


def _share(building: Any, preset: Any, rounds: int) -> Measurement:
    """Measure one preset: rollouts and updates together, after one to warm up."""
    env = building.make_env(preset)
    spent = [_timed(batch) for batch in batches_of(env)]
    chunk = _rollout(building.make_model(preset, 0, env))
    chunk()
    found = []
    for _ in range(rounds):
        inside, began = sum(clock() for clock in spent), time.process_time()
        chunk()
        whole = time.process_time() - began
        found.append((sum(clock() for clock in spent) - inside) / whole)
    env.close()
    name = preset.env.removeprefix("PAM/").rpartition("-")[0]
    title = f"environment's share of PPO's time, {name}, N = {preset.num_envs}"
    return Measurement("learning", title, median(found), "", MOST, better="less")


def batches_of(env: Any) -> Iterator[Any]:
    """Yield the batches of plants below all that training wraps around them."""
    if hasattr(env, "venv"):
        yield from batches_of(env.venv)
    else:
        yield from getattr(env, "batches", (env,))


def _timed(batch: Any) -> Callable[[], float]:
    """Make a batch count the CPU seconds of its steps, and return what reads the count."""
    plain, total = batch.step_wait, [0.0]

    def step_wait() -> Any:
        began = time.process_time()
        try:
            return plain()
        finally:
            total[0] += time.process_time() - began

    batch.step_wait = step_wait
    return lambda: total[0]


def _rollout(model: Any) -> Chunk:
    size = model.n_steps * model.n_envs

    def chunk() -> int:
        model.learn(size, reset_num_timesteps=False)
        return int(size)

    return chunk
