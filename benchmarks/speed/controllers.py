"""Computing time of controllers: one action for one observation, and the design."""

import time
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from baselines.core.catalogue import PUBLISHED, make_controller
from benchmarks.speed.rates import Measurement

STEPS = 200
"""Observations of the episode that are answered in each round."""
GROUP = "controllers"


def controllers(rounds: int) -> list[Measurement]:
    """Time of an action of every controller of the catalogue, compared with its control period."""
    envs: dict[str, Any] = {}
    results = []
    for name, entry in PUBLISHED.items():
        env_id = entry.envs[0]
        if env_id not in envs:
            envs[env_id] = gymnasium.make(env_id, disable_env_checker=True).unwrapped
        results.append(timed(name, envs[env_id], rounds))
    return results


def timed(name: str, env: Any, rounds: int) -> Measurement:
    """Return the median CPU time of an action [us]; the floor is the control period.

    The median is over the rounds, each of which answers the observations of one episode under the
    controller itself. The note has the 99th percentile of single actions and the CPU time of the
    design.
    """
    begin = time.process_time()
    try:
        controller = make_controller(name, env.plant, env.signals, env.action_signals)
    except Exception as error:  # a missing extra must not prevent the other figures
        note = f"no design: {type(error).__name__}: {error}"
        return Measurement(GROUP, name, None, "us", better="less", note=note)
    design = time.process_time() - begin
    observations = _episode(controller, env)
    _answers(controller, observations)  # compiles
    single = np.array([_answers(controller, observations) for _ in range(rounds)])
    micro, period = 1e6 * single, 1e6 * env.control_period
    return Measurement(
        GROUP,
        f"{name}, CPU time of an action",
        float(np.median(micro.mean(axis=1))),
        "us",
        floor=period,
        aim=0.1 * period,
        better="less",
        note=f"99th percentile {np.percentile(micro, 99.0):.3g} us, design {design:.2g} s",
    )


def _episode(controller: Any, env: Any) -> list[NDArray[Any]]:
    """Return the first observations of an episode under a controller."""
    observation, _ = env.reset(seed=1)
    state, made = None, []
    for step in range(STEPS):
        made.append(observation)
        action, state = controller.predict(observation, state, step == 0, True)
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            break
    return made


def _answers(controller: Any, observations: list[NDArray[Any]]) -> NDArray[np.float64]:
    """Return the CPU time of each action [s], shape (``STEPS``,); a short episode is repeated."""
    seconds, state = [], None
    for step in range(STEPS):
        number = step % len(observations)
        begin = time.process_time()
        _, state = controller.predict(observations[number], state, number == 0, True)
        seconds.append(time.process_time() - begin)
    return np.array(seconds)
