"""Tampered states are refused unwritten, and those sealed anew crash no step."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.envs.core.saved_state import STATE_KEYS, sealed
from pam_envs.envs.core.step import CHOICE, MEMBER
from pam_envs.kernels.build import COMPILED
from tests.envs.cases import IDS

ROOT = Path(__file__).parents[3]
CASES = [(name, args) for name in IDS for args in ({}, {"randomize": True})]
CASES += [("PAM/KneeTension-v0", {"hysteresis": "preisach"})]


def single(name: str, **arguments: Any) -> Any:
    env = gym.make(name, **arguments).unwrapped
    env.reset(seed=3)
    env.step(np.zeros(env.action_space.shape))
    return env


def batch(name: str, **arguments: Any) -> Any:
    envs = gym.make_vec(name, 3, vectorization_mode="vector_entry_point", **arguments)
    envs.reset(seed=3)
    envs.step(np.zeros(envs.action_space.shape))
    return envs


@pytest.mark.parametrize("make", [single, batch])
@pytest.mark.parametrize(("name", "arguments"), CASES)
def test_every_integer_is_bounded_on_both_sides(
    make: Any, name: str, arguments: dict[str, Any]
) -> None:
    env = make(name, **arguments)
    state = env.get_state()
    for row in range(state["counts"].shape[1]):
        for value in (-1, 2**32, 2**40, np.iinfo(np.int64).max, np.iinfo(np.int64).min):
            counts = state["counts"].copy()
            counts[-1, row, -1] = value
            with pytest.raises(ValueError, match="'counts' hold"):
                env.set_state({**state, "counts": counts})
    counts = state["counts"].copy()
    counts[0, MEMBER, 0] = env.setup.shared[-1][CHOICE.members]  # one beyond the last member
    with pytest.raises(ValueError, match="'counts' hold"):
        env.set_state({**state, "counts": counts})
    unchanged(env, state)


@pytest.mark.parametrize("make", [single, batch])
@pytest.mark.parametrize(("name", "arguments"), CASES)
def test_parameters_outside_their_ranges_are_refused(
    make: Any, name: str, arguments: dict[str, Any]
) -> None:
    env = make(name, **arguments)
    state = env.get_state()
    env.set_state(state)
    for row in range(state["fixed"].shape[1]):
        for change in (-1e9, 1e9):
            fixed = state["fixed"].copy()
            fixed[-1, row, -1] += change
            with pytest.raises(ValueError, match="'fixed' hold"):
                env.set_state({**state, "fixed": fixed})
    unchanged(env, state)


@pytest.mark.parametrize("make", [single, batch])
@pytest.mark.parametrize("name", IDS)
def test_missing_keys_wrong_types_and_values_that_are_not_finite_are_refused(
    make: Any, name: str
) -> None:
    env = make(name)
    state = env.get_state()
    for key, value in state.items():
        others: list[Any] = [None, "text", value.astype(object), value.astype(complex), value[None]]
        others.append(np.full(value.shape, "a"))
        if value.dtype.kind == "f":
            for bad in (np.nan, np.inf, -np.inf):
                others.append(value.copy())
                others[-1].flat[value.size // 2] = bad
        else:
            others.append(value.astype(float))
        for other in others:
            with pytest.raises(ValueError, match="state"):
                env.set_state({**state, key: other})
        with pytest.raises(ValueError, match="state"):
            env.set_state({k: v for k, v in state.items() if k != key})
    for other in (None, [], "state"):
        with pytest.raises(ValueError, match="state"):
            env.set_state(other)
    unchanged(env, state)


@pytest.mark.parametrize("make", [single, batch])
@pytest.mark.parametrize("name", IDS)
def test_any_changed_number_is_noticed_unless_the_state_is_sealed_anew(
    make: Any, name: str
) -> None:
    env = make(name)
    state = env.get_state()
    random = np.random.default_rng(1)
    for key in ("rows", "ahead", "infos", "last", "digest"):
        for _ in range(10 if state.get(key, np.zeros(0)).size else 0):
            changed = state[key].copy()
            place = tuple(int(random.integers(n)) for n in changed.shape)
            whole = changed.dtype.kind == "u"
            changed[place] = changed[place] ^ 1 if whole else np.nextafter(changed[place], 1e9)
            with pytest.raises(ValueError, match=r"changed since get_state.*sealed\(state\)"):
                env.set_state({**state, key: changed})
    with pytest.raises(ValueError, match="changed since get_state"):
        env.set_state({**state, 7: "more"})
    unchanged(env, state)
    env.set_state(sealed({**state, "more": np.ones(1)}))
    unchanged(env, state)


def test_state_changed_on_purpose_is_restored_after_sealing() -> None:
    env = single("PAM/MusclePositioning-v0")
    state = env.get_state()
    state["ahead"] = state["ahead"] + 1e-3
    with pytest.raises(ValueError, match="changed since get_state"):
        env.set_state(state)
    env.set_state(sealed(state))
    assert np.array_equal(env.get_state()["ahead"], state["ahead"])


def run_drawn_changes(name: str, changes: int) -> None:
    """Change numbers of a state and seal it; let compiled code step from those accepted."""
    random = np.random.default_rng(0)
    env = single(name)
    env._use(env.setup.kernels.single.wait(), compiled=True)
    state = env.get_state()
    refused = 0
    for _ in range(changes):
        key = str(random.choice(STATE_KEYS))
        tampered = state[key].copy()
        place = tuple(int(random.integers(n)) for n in tampered.shape)
        value = random.choice([1e300, -1e300, 1e9, -1e9, 2.0**40, -3.0, 200.0])
        tampered[place] = np.clip(value, -(2.0**62), 2.0**62) if key == "counts" else value
        try:
            env.set_state(sealed({**state, key: tampered}))
        except ValueError:
            refused += 1
        for _ in range(3):
            env.step(np.zeros(env.action_space.shape))
    assert refused > changes // 10
    env.set_state(state)
    unchanged(env, state)


@pytest.mark.skipif(not COMPILED, reason="plain Python does not read beyond an array")
@pytest.mark.parametrize("name", IDS)
def test_drawn_changes_are_refused_or_compiled_code_steps_on(name: str) -> None:
    module = ".".join(Path(__file__).relative_to(ROOT).with_suffix("").parts)
    call = f"from {module} import run_drawn_changes as run; run({name!r}, 150)"
    command = [sys.executable, "-c", call]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr


def test_index_of_the_path_is_bounded() -> None:
    env = single("PAM/RedundantManipulator-v0")
    state = env.get_state()
    ((row, _),) = env.setup.kernels.indices.items()
    for value in (-1.0, 1e9, -1e9, float(len(env.setup.shared[1]))):
        rows = state["rows"].copy()
        rows[0, row, 0] = value
        with pytest.raises(ValueError, match=r"'rows\[:, \d+\]' hold"):
            env.set_state({**state, "rows": rows})


@pytest.mark.parametrize("make", [gym.make, gym.make_vec])
def test_state_before_the_first_reset_is_restored(make: Any) -> None:
    env = make("PAM/MusclePositioning-v0", hysteresis="preisach").unwrapped
    state = env.get_state()
    env.reset(seed=1)
    env.set_state(state)
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(env.action_space.shape))


def unchanged(env: Any, state: dict[str, np.ndarray]) -> None:
    """Assert that the state of an environment is still ``state``."""
    assert all(np.array_equal(value, state[key]) for key, value in env.get_state().items())
