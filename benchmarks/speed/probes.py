"""Probes of environments, batches, start-up and training; a missing library omits only its line."""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.rates import Chunk, Measurement, Missing, interleaved, median, ratio
from pam_envs.mechanics.redundancy.resolution import resolve
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.pneumatics.flow import AIRS
from pam_envs.references.path import PATHS
from sweeps.limits import scaled

ENV = "PAM/MusclePositioning-v0"
KNEE, BRACE = "PAM/KneeWalk-v0", "PAM/KneeTension-v0"
ELBOW = "PAM/ElbowOrthosis-v0"
ROOT = Path(__file__).resolve().parents[2]
JOINT, ARM = "PAM/AntagonisticJoint-v0", "PAM/RedundantManipulator-v0"
REPEATS = 5  # repetitions of each planned path, there and back
PENDULUM, CARTPOLE, HOPPER = "InvertedPendulum-v5", "CartPole-v1", "Hopper-v5"


def stepping(env: Any, steps: int) -> Chunk:
    """Return a chunk that steps a single environment with prepared random actions."""
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(512)]
    env.reset(seed=0)

    def chunk() -> int:
        step, reset, given = env.step, env.reset, actions
        for i in range(steps):
            _, _, terminated, truncated, _ = step(given[i & 511])
            if terminated or truncated:
                reset()
        return steps

    return chunk


def stepping_batch(env: Any, calls: int) -> Chunk:
    """Return a chunk that steps a batch with prepared random actions."""
    number, shape = env.num_envs, env.single_action_space.shape
    generator = np.random.default_rng(0)
    actions = [generator.uniform(-1.0, 1.0, (number, *shape)).astype(np.float32) for _ in range(8)]
    env.reset(seed=0)

    def chunk() -> int:
        for i in range(calls):
            env.step(actions[i & 7])
        return calls * number

    return chunk


def _gym() -> Any:
    import gymnasium

    import pam_envs  # noqa: F401  registers the ids

    return gymnasium


def _batch(number: int, mode: str = "vector_entry_point", env: str = ENV, **kwargs: Any) -> Any:
    return _gym().make_vec(env, num_envs=number, vectorization_mode=mode, **kwargs)


# --- one environment ------------------------------------------------------------------------


def _peers(subjects: dict[str, Chunk], steps: dict[str, int]) -> dict[str, str]:
    """Add environments of other libraries; return by name the reason for each missing one."""
    gym, notes = _gym(), {}
    for name, number in steps.items():
        try:
            subjects[name] = stepping(gym.make(name), number)
        except (ImportError, gym.error.DependencyNotInstalled) as error:
            notes[name] = f"not installed: {error}"
    return notes


def _rates(rates: dict[str, list[float]]) -> list[Measurement]:
    return [
        Measurement("single", f"{name}, steps per CPU second", median(found), "1/s")
        for name, found in rates.items()
    ]


def single(rounds: int) -> list[Measurement]:
    """Single environment through gym.make, with info."""
    gym = _gym()
    subjects = {
        "ours": stepping(gym.make(ENV), 20000),
        "preisach": stepping(gym.make(ENV, hysteresis="preisach"), 20000),
        "KneeWalk": stepping(gym.make(KNEE), 10000),
    }
    notes = _peers(subjects, {PENDULUM: 2000, CARTPOLE: 10000})
    rates = interleaved(subjects, rounds)
    results = _rates(rates)
    for name, peer, floor, aim in (
        ("ours", PENDULUM, 10.0, 20.0),
        ("ours", CARTPOLE, 3.0, 5.0),
        ("KneeWalk", PENDULUM, 5.0, 10.0),
    ):
        value, note = ratio(rates[name], rates.get(peer)), notes.get(peer, "")
        results.append(Measurement("single", f"{name} / {peer}", value, "x", floor, aim, note=note))
    return results


def single_joints(rounds: int) -> list[Measurement]:
    """Elbow with either type of valves, one joint, arm of six, compared with MuJoCo's hopper."""
    gym = _gym()
    subjects = {
        "elbow": stepping(gym.make(ELBOW), 5000),
        "elbow, on/off valves": stepping(gym.make(ELBOW, valves="on_off"), 5000),
        "joint": stepping(gym.make(JOINT), 5000),
        "arm": stepping(gym.make(ARM), 2000),
    }
    note = _peers(subjects, {HOPPER: 1000}).get(HOPPER, "")
    rates = interleaved(subjects, rounds)
    results = _rates(rates)
    for name, title, floor in (
        ("elbow", ELBOW[4:-3], 8.0),
        ("elbow, on/off valves", f"{ELBOW[4:-3]}, on/off valves", 8.0),
        ("joint", JOINT[4:-3], 8.0),
        ("arm", ARM[4:-3], 2.0),
    ):
        value, what = ratio(rates[name], rates.get(HOPPER)), f"{title} / {HOPPER}"
        results.append(Measurement("single", what, value, "x", floor, 2 * floor, note=note))
    return results


# --- batches ----------------------------------------------------------------------------------


def batch(rounds: int) -> list[Measurement]:
    """Batch of 1,024 on one core."""
    subjects = {
        "ours": stepping_batch(_batch(1024, info=False, threads=1), 300),
        "with info": stepping_batch(_batch(1024, threads=1), 300),
    }
    note = ""
    try:
        subjects["envpool"] = _envpool_chunk(1024)
    except (ImportError, Missing) as error:
        note = f"envpool is not installed: {error}"
    rates = interleaved(subjects, rounds)
    title = "N = 1024, {}, env-steps per CPU second"
    targets = {"ours": (8e6, 20e6)}
    results = [
        Measurement("batch", title.format(name), median(found), "1/s", *targets.get(name, ()))
        for name, found in rates.items()
    ]
    value = ratio(rates["ours"], rates.get("envpool"))
    title = f"ours / envpool {CARTPOLE}, one thread, N = 1024"
    results.append(Measurement("batch", title, value, "x", 5.0, 20.0, note=note))
    return results


def variants(rounds: int) -> list[Measurement]:
    """Batch of 1,024 on one core, other plants."""
    kinds: dict[str, dict[str, Any]] = {
        "maxwell_slip": {},
        "preisach": {"hysteresis": "preisach"},
        "none": {"hysteresis": "none"},
        "randomized": {"randomize": True},
    }
    subjects = {
        name: stepping_batch(_batch(1024, info=False, threads=1, **kwargs), 200)
        for name, kwargs in kinds.items()
    }
    rates = interleaved(subjects, rounds)
    first = rates["maxwell_slip"]
    return [
        Measurement("batch", f"N = 1024, {name} / maxwell_slip", ratio(rates[name], first))
        for name in list(kinds)[1:]
    ]


def airs(rounds: int) -> list[Measurement]:
    """Cost of flow through orifices over that of closed-loop regulators, batch on one core."""
    results = []
    for env, calls in ((ENV, 200), (JOINT, 100), (ARM, 8), (ELBOW, 80), (BRACE, 100), (KNEE, 40)):
        subjects = {
            air: stepping_batch(_batch(1024, env=env, info=False, threads=1, air=air), calls)
            for air in AIRS
        }
        rates = interleaved(subjects, rounds)
        value, title = ratio(rates["regulator"], rates["flow"]), f"N = 1024, {env[4:-3]}"
        results.append(Measurement("air", f"{title}, flow", value, "x", 2.0, 1.5, "less"))
    return results


def _envpool_chunk(number: int) -> Chunk:
    """Return a chunk that steps envpool's CartPole on one thread."""
    import envpool

    pool = envpool.make(
        CARTPOLE, env_type="gymnasium", num_envs=number, batch_size=number, num_threads=1
    )
    pool.reset()
    generator = np.random.default_rng(0)
    actions = [generator.integers(0, 2, number).astype(np.int32) for _ in range(8)]

    def chunk() -> int:
        for i in range(200):
            pool.step(actions[i & 7])
        return 200 * number

    return chunk


def growth(rounds: int) -> list[Measurement]:
    """Cost of a step from 256 to 131,072 environments on one core."""
    small = stepping_batch(_batch(256, info=False, threads=1), 1024)
    large = stepping_batch(_batch(131072, info=False, threads=1), 4)
    rates = interleaved({"small": small, "large": large}, rounds)
    value = ratio(rates["small"], rates["large"])
    title = "cost per env-step, N = 131,072 / N = 256"
    return [Measurement("batch", title, value, "x", 1.2, 1.05, "less")]


def cores(rounds: int) -> list[Measurement]:
    """Speed-up of all cores over one, from 4,096 environments on."""
    number = len(os.sched_getaffinity(0))
    if number < 2:
        raise Missing("there is one core only")
    results = []
    for size in (4096, 16384, 65536):
        calls = max(4, 4_000_000 // size)
        subjects = {
            "one": stepping_batch(_batch(size, info=False, threads=1), calls),
            "all": stepping_batch(_batch(size, info=False), calls),
        }
        rates = interleaved(subjects, rounds, time.perf_counter)
        value = ratio(rates["all"], rates["one"])
        floor = 1.7 if number == 2 else None
        title = f"{number} cores / one, N = {size}, wall"
        results.append(Measurement("batch", title, value, "x", floor))
    return results


def processes(rounds: int) -> list[Measurement]:
    """Comparison with AsyncVectorEnv of the same environment, wall time."""
    pool = _batch(16, "async")
    try:
        subjects = {
            "async": stepping_batch(pool, 300),
            "ours": stepping_batch(_batch(1024, info=False, threads=1), 300),
            "ours of 16": stepping_batch(_batch(16, info=False, threads=1), 3000),
        }
        rates = interleaved(subjects, min(rounds, 5), time.perf_counter)
    finally:
        pool.close()
    small = ratio(rates["ours of 16"], rates["async"])
    title = "ours N = 1024 / AsyncVectorEnv N = 16, wall"
    return [
        Measurement("batch", "AsyncVectorEnv N = 16, wall", median(rates["async"]), "1/s"),
        Measurement("batch", title, ratio(rates["ours"], rates["async"]), "x", 300.0, 1000.0),
        Measurement("batch", "ours N = 16 / AsyncVectorEnv N = 16, wall", small),
    ]


def planning(rounds: int) -> list[Measurement]:
    """Inverse kinematics of the poses on the arm's three paths, there and back."""
    arm = SerialChain.uniform()
    lines = [np.vstack([path.angles(), path.angles()[::-1]] * REPEATS) for path in PATHS]
    paths = [(arm.pose(line), line[0]) for line in lines]

    def chunk() -> int:
        for poses, start in paths:
            resolve(arm, poses, start=start)
        return sum(len(poses) for poses, _ in paths)

    rate = median(interleaved({"poses": chunk}, rounds)["poses"])
    title = "weighted joint angles of an arm of six, poses per CPU second"
    return [Measurement("planning", title, rate, "1/s", 2000.0, 20000.0)]


# --- uncompiled, and fitting --------------------------------------------------------------------

_UNCOMPILED = """
import json, sys
import gymnasium as gym
import pam_envs
from benchmarks.speed.rates import interleaved
from benchmarks.speed.probes import ENV, PENDULUM, stepping
subjects = {"ours": stepping(gym.make(ENV), 600)}
subjects["peer"] = stepping(gym.make(PENDULUM), 600)
print(json.dumps(interleaved(subjects, int(sys.argv[1]))))
"""


def _python(code: str, *arguments: str, **environment: str) -> str:
    """Run code in a fresh interpreter and return what it prints."""
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        check=False,
        env={**os.environ, "PYTHONPATH": paths, **environment},
        capture_output=True,
        text=True,
        timeout=scaled(300.0),
    )
    if done.returncode:
        raise Missing((done.stderr.strip().splitlines() or ["no output"])[-1])
    return done.stdout.strip().splitlines()[-1]


def uncompiled(rounds: int) -> list[Measurement]:
    """Uncompiled single step compared with InvertedPendulum-v5."""
    rates = json.loads(_python(_UNCOMPILED, str(rounds), PAM_ENVS_COMPILE="0"))
    value = ratio(rates["ours"], rates["peer"])
    return [
        Measurement("plain", "uncompiled, steps per CPU second", median(rates["ours"]), "1/s"),
        Measurement("plain", f"uncompiled / {PENDULUM}", value, "x", 1.0, 2.0),
    ]


# --- start-up -------------------------------------------------------------------------------------

_START = """
import sys, time
import gymnasium as gym
import pam_envs
env = gym.make(sys.argv[1])
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.process_time())
"""
_LONGEST = """
import sys, time
import gymnasium as gym
import pam_envs
env = gym.make(sys.argv[1])
env.reset(seed=0)
longest = 0.0
while not env.unwrapped._compiled:
    began = time.perf_counter()
    env.step(env.action_space.sample())
    longest = max(longest, time.perf_counter() - began)
print(longest)
"""


def start_up(rounds: int) -> list[Measurement]:
    """Import and first step in a fresh interpreter; longest step until machine code runs.

    An environment begins in plain Python and changes to machine code when it is ready.
    """
    tries = max(3, min(rounds, 5))
    results = []
    with tempfile.TemporaryDirectory() as folder:
        caches = [f"{folder}/{i}" for i in range(tries)]
        for program, title, note, limits in (
            (_LONGEST, "longest step until machine code runs", "wall", (0.5, 0.5)),
            (_START, "interpreter, import and first step", "CPU of the whole process", (0.7, 0.35)),
        ):
            for state in ("cold", "warm"):
                variables = [{"PAM_ENVS_CACHE": c, "PAM_ENVS_COMPILE": "1"} for c in caches]
                times = [float(_python(program, ENV, **v)) for v in variables]
                name = f"{title}, {state}"
                shown = Measurement("start", name, median(times), "s", better="less", note=note)
                results.append(replace(shown, floor=limits[0], aim=limits[1]))
    return results
