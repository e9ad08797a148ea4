"""Where the time of a training goes: stepping plants, and everything else."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator
from typing import Any

from benchmarks.speed.rates import Chunk, Measurement, Missing, median

MOST = 0.05
"""The largest share of a training's time that its environments may take."""


def shares(rounds: int) -> list[Measurement]:
    """Environments' share of the time of each PPO preset."""
    try:
        building, configs, speed = (
            importlib.import_module(f"agents.{name}") for name in ("building", "configs", "speed")
        )
    except ModuleNotFoundError as error:
        raise Missing(f"agents cannot be imported: {error.name} is not installed") from error
    from pam_envs.__main__ import env_ids

    found = []
    for preset in (configs.preset(env, "ppo") for env in env_ids()):
        env = building.make_env(preset)
        chunk = speed.stepper(building.make_model(preset, 0, env))
        name = preset.env.removeprefix("PAM/").rpartition("-")[0]
        found.append(_share(f"{name}, N = {preset.num_envs}", env, chunk, min(rounds, 3)))
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
