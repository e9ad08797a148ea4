"""Policies as kernels: actions of every shipped preset compared with onnxruntime."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import onnx
import pytest

from agents.policies.catalogue import CONTROLLERS, load_pretrained
from agents.policies.emission import Program, policy_model
from agents.policies.policy import OnnxPolicy
from benchmarks.exported import run_c
from pam_envs.arrays import Array
from pam_envs.export.c import export_c
from pam_envs.export.toolchain import host_platform
from pam_envs.kernels.build import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="the kernels are compiled")
STEPS = 1000
LARGEST = 1e-6
"""Largest difference of an action, of a range from -1 to 1."""
PAST = 40
"""Steps before the compared ones that a policy with a state has seen."""


def answers(name: str, steps: int = STEPS) -> tuple[Any, Array, Array]:
    """Return a policy, its inputs under random observations, and its actions."""
    return answers_of(load_pretrained(name), CONTROLLERS[name].envs[0], steps)


def answers_of(policy: OnnxPolicy, env_id: str, steps: int = STEPS) -> tuple[Any, Array, Array]:
    """Return a policy, its inputs under random observations of an environment, and its actions."""
    env: Any = gym.make(env_id).unwrapped
    random = np.random.default_rng(4)
    n, m = len(policy.signals), len(policy.action_signals)
    observation = env.reset(seed=1)[0]
    walk = 0.1 * random.standard_normal((steps, n)).cumsum(axis=0)
    seen = np.sin(observation + walk).astype(np.float32)
    given = random.uniform(-1.0, 1.0, (steps, m)).astype(np.float32)
    state, actions = None, []
    for k in range(steps):
        base = given[k] if policy.corrects else None
        action, state = policy.answer(seen[k], state, k == 0, base)
        actions.append(action)
    inputs = np.hstack([seen, given]) if policy.corrects else seen
    return policy, inputs.astype(float), np.array(actions, float)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_thousand_actions_in_c_are_those_of_onnxruntime(name: str, tmp_path: Path) -> None:
    policy, inputs, actions = answers(name)
    model = policy_model(name, policy, 0.01)
    export_c(model, tmp_path, [host_platform()])
    found = run_c(model, tmp_path, inputs)
    assert np.abs(found - actions).max() <= LARGEST
    assert np.ptp(actions) > 0.5


def test_correction_in_proportion_to_the_error_in_c(short_run: Any, tmp_path: Path) -> None:
    trained = OnnxPolicy.load(short_run("residual_in_proportion")[1] / "policy.onnx")
    policy, inputs, actions = answers_of(trained, str(trained.card["env"]), 200)
    model = policy_model("proportional", policy, 0.01)
    export_c(model, tmp_path, [host_platform()])
    assert np.abs(run_c(model, tmp_path, inputs) - actions).max() <= LARGEST
    correction = np.abs(actions - inputs[:, len(policy.signals) :])
    assert correction.max() > 100.0 * LARGEST


def test_first_step_begins_an_episode(tmp_path: Path) -> None:
    differences = []
    for name in ("residual_knee_tension", "residual_knee_stiffness", "residual_elbow"):
        policy, inputs, actions = answers(name, 2 * PAST)
        n = len(policy.signals)
        late = inputs[PAST:].astype(np.float32)
        state, fresh = None, []
        for row in late:
            action, state = policy.answer(row[:n], state, None, row[n:])
            fresh.append(action)
        model = policy_model(name, policy, 0.01)
        export_c(model, tmp_path / name, [host_platform()])
        found = run_c(model, tmp_path / name, inputs[PAST:])
        assert np.abs(found - np.array(fresh, float)).max() <= LARGEST
        differences.append(np.abs(actions[PAST:] - np.array(fresh, float)).max())
    assert max(differences) > 1e-3  # the past matters


def test_unknown_operation_is_refused() -> None:
    node = onnx.helper.make_node("Erf", ["observation"], ["action"])
    graph = onnx.helper.make_graph([node], "g", [], [])
    with pytest.raises(ValueError, match="the operation Erf cannot be exported"):
        Program(graph, 3, 3, 0, False)
