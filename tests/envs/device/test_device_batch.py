"""Batch on a device: the same bits as the batch on the processor, without a GPU."""

import sys
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401  registers the environments
from pam_envs.envs.device import vector_env
from pam_envs.kernels.build import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="batches on a device are compiled")
SMALL = "PAM/MusclePositioning-v0"
CASES: list[tuple[str, dict[str, Any]]] = [
    (SMALL, {}),
    (SMALL, {"randomize": {"mass.damping": (100.0, 500.0)}}),
    ("PAM/AntagonisticJoint-v0", {}),
    ("PAM/KneeTension-v0", {}),
]
LANES, STEPS, SECONDS, SEED = 7, 300, 1.0, 40


def batch(name: str, device: str, number: int = LANES, **arguments: Any) -> Any:
    return gym.make_vec(name, number, device=device, episode_seconds=SECONDS, **arguments)


def actions_for(envs: Any, steps: int) -> list[np.ndarray]:
    generator = np.random.default_rng(2)
    shape = envs.action_space.shape
    return [generator.uniform(-1.0, 1.0, shape).astype(np.float32) for _ in range(steps)]


def same(ours: Any, theirs: Any) -> bool:
    """Return whether a result has the values, the shape and the type of another, to the bit."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    kinds = (ours.dtype, ours.shape) == (theirs.dtype, theirs.shape)
    return kinds and ours.tobytes() == theirs.tobytes()


@pytest.mark.parametrize(("name", "arguments"), CASES)
def test_lanes_have_the_bits_of_the_batch_on_the_processor(
    name: str, arguments: dict[str, Any]
) -> None:
    ours, theirs = batch(name, "host", **arguments), batch(name, "cpu", **arguments)
    (first, info), (expected, other) = ours.reset(seed=SEED), theirs.reset(seed=SEED)
    assert same(first, expected)
    assert all(same(info[key], other[key]) for key in other)
    ended = 0
    for actions in actions_for(theirs, STEPS):
        *found, info = ours.step(actions)
        *expected, other = theirs.step(actions)
        assert all(same(a, b) for a, b in zip(found, expected, strict=True))
        assert all(same(info[key], other[key]) for key in ours.setup.info_keys)
        over = expected[2] | expected[3]
        assert same(info["_final_obs"], over)
        for row in np.flatnonzero(over):
            assert same(info["final_obs"][row], other["final_obs"][row])
            last = {key: value[row] for key, value in other["final_info"].items()}
            assert all(same(info["final_info"][key][row], last[key]) for key in last)
        ended += int(over.sum())
    assert ended >= 2 * LANES


def test_some_rows_are_reset_with_their_own_seeds() -> None:
    ours, theirs = batch(SMALL, "host"), batch(SMALL, "cpu")
    for envs in (ours, theirs):
        envs.reset(seed=[5, 3, 8, 1, 2, 9, 4])
    for actions in actions_for(theirs, 5):
        ours.step(actions)
        theirs.step(actions)
    given = {"reset_mask": np.arange(LANES) % 2 == 0}
    for seed in (None, [7, None, None, None, 1, None, 2**40]):
        found, expected = (envs.reset(seed=seed, options=given) for envs in (ours, theirs))
        assert same(found[0], expected[0])
        assert all(same(found[1][key], expected[1][key]) for key in expected[1])
    actions = actions_for(theirs, 1)[0]
    assert same(ours.step(actions)[0], theirs.step(actions)[0])


def test_results_belong_to_the_caller() -> None:
    envs = batch(SMALL, "host", info=False)
    first, _ = envs.reset(seed=0)
    kept = np.from_dlpack(first).copy()
    second = envs.step(actions_for(envs, 1)[0])
    assert same(first, kept)
    second[0][:] = 0.0
    assert (np.from_dlpack(envs.step(actions_for(envs, 1)[0])[0]) != 0.0).any()


def test_tensors_and_arrays_are_actions() -> None:
    torch = pytest.importorskip("torch")
    found = []
    for convert in (np.asarray, torch.from_numpy, lambda a: torch.from_numpy(a).double()):
        envs = batch(SMALL, "host", info=False)
        observation, _ = envs.reset(seed=1)
        assert isinstance(observation, torch.Tensor)
        for actions in actions_for(envs, 10):
            observation, reward, terminated, *_ = envs.step(convert(actions))
        assert (reward.dtype, terminated.dtype) == (torch.float64, torch.bool)
        found.append(observation)
    assert same(found[0], found[1])
    assert same(found[0], found[2])


def test_without_torch_results_are_arrays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    envs = batch(SMALL, "host")
    observation, info = envs.reset(seed=1)
    assert isinstance(observation, np.ndarray)
    found = envs.step(np.zeros(envs.action_space.shape))
    assert all(isinstance(part, np.ndarray) for part in found[:4])
    assert isinstance(info["state/pressure"], np.ndarray)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"device": "tpu"}, "device = 'tpu' is not known; choose 'cpu', 'cuda'"),
        ({"device": "host", "autoreset_mode": "NextStep"}, "choose one of 'SameStep'"),
        ({"device": "host", "render_mode": "rgb_array"}, "render_mode of a batch on a device"),
        ({"device": "host", "num_envs": 0}, "num_envs = 0 must be from 1"),
    ],
)
def test_wrong_argument_is_refused(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        gym.make_vec(SMALL, **{"num_envs": 2, **arguments})


def test_wrong_actions_are_refused() -> None:
    envs = batch(SMALL, "host", 2)
    with pytest.raises(gym.error.ResetNeeded):
        envs.step(np.zeros((2, 1)))
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=r"shape \(3, 1\), expected \(2, 1\)"):
        envs.step(np.zeros((3, 1)))
    with pytest.raises(ValueError, match="is nan"):
        envs.step(np.full((2, 1), np.nan))
    torch = pytest.importorskip("torch")
    with pytest.raises(ValueError, match=r"shape \(3, 1\), expected \(2, 1\)"):
        envs.step(torch.zeros((3, 1)))


def test_missing_binding_is_named_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cuda.core", None)
    with pytest.raises(gym.error.DependencyNotInstalled, match=r"pip install 'pam-envs\[cuda\]'"):
        gym.make_vec(SMALL, 2, device="cuda")


def test_torch_is_used_where_it_is_installed() -> None:
    torch = pytest.importorskip("torch")
    assert vector_env._torch() is torch


def test_actions_with_gradients_leave_none_in_the_batch() -> None:
    torch = pytest.importorskip("torch")
    envs: Any = gym.make_vec("PAM/MusclePositioning-v0", 3, device="host", info=False)
    observations, _ = envs.reset(seed=0)
    policy = torch.nn.Linear(*map(int, (observations.shape[1], envs.action_space.shape[1])))
    for _ in range(3):
        observations, *_ = envs.step(policy(observations))
        assert not observations.requires_grad
    assert not any(tensor.requires_grad for tensor in envs._tensors.values())


def test_batch_made_in_inference_mode_steps_outside_it() -> None:
    torch = pytest.importorskip("torch")
    with torch.inference_mode():
        envs: Any = gym.make_vec("PAM/MusclePositioning-v0", 3, device="host", info=False)
        envs.reset(seed=0)
    envs.step(torch.zeros(envs.action_space.shape))
