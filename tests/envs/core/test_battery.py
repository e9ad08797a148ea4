"""Properties of every registered environment."""

import copy
import importlib.util
import itertools
import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from tests.envs.cases import CASES, IDS, LIVELY, VARIANTS, actions_for, trajectory

PREFIXES = ("state/", "reward/", "cost/", "margin/", "effort/", "sensor/")
PLAIN = ("time", "reference", "output", "saturated")
EVERY = pytest.mark.parametrize("name", IDS)
EVERY_CASE = pytest.mark.parametrize(("name", "variant"), CASES)


@EVERY
def test_environment_passes_gymnasium_and_sb3_checkers(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn = importlib.util.find_spec("pygame") is not None
        env = gym.make(name, render_mode="rgb_array" if drawn else None)
        check_env(env.unwrapped, skip_render_check=not drawn)
        sb3 = pytest.importorskip("stable_baselines3.common.env_checker")
        sb3.check_env(gym.make(name).unwrapped, skip_render_check=True)


@EVERY_CASE
def test_episode_bits_depend_on_the_seed_alone(name: str, variant: str) -> None:
    env = gym.make(name, **VARIANTS[name][variant])
    first, again = trajectory(env, 5), trajectory(gym.make(name, **VARIANTS[name][variant]), 5)
    assert first == again
    assert first == trajectory(env, 5)  # nothing is left over from the run before
    assert first != trajectory(env, 6)


@EVERY
def test_reset_without_seed_starts_the_next_episode(name: str) -> None:
    env, other = gym.make(name), gym.make(name)
    env.reset(seed=1)
    other.reset(seed=1)
    second, _ = env.reset()
    assert not np.array_equal(second, other.reset(seed=1)[0])
    assert np.array_equal(second, other.reset()[0])


@EVERY
def test_global_random_numbers_are_neither_used_nor_disturbed(name: str) -> None:
    env = gym.make(name)
    np.random.seed(3)  # noqa: NPY002 (the point of the test)
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    first = trajectory(env, 2, 20)
    assert np.array_equal(before, np.random.get_state()[1])  # noqa: NPY002
    inner = env.unwrapped.np_random.bit_generator.state
    env.step(env.action_space.sample())
    assert env.unwrapped.np_random.bit_generator.state == inner
    np.random.seed(4)  # noqa: NPY002
    assert trajectory(env, 2, 20) == first


@EVERY_CASE
def test_observations_are_in_their_space_and_every_signal_varies(name: str, variant: str) -> None:
    env = gym.make(name, **{**LIVELY.get(name, {}), **VARIANTS[name][variant]})
    seen = []
    for seed in range(4):
        observation, _ = env.reset(seed=seed)
        seen.append(observation)
        for action in actions_for(env.action_space, 400, seed):
            observation, *_ = env.step(action)
            assert env.observation_space.contains(observation)
            seen.append(observation)
    assert (np.ptp(seen, axis=0) > 0).all()


@EVERY
def test_observations_of_steps_share_no_memory(name: str) -> None:
    env = gym.make(name)
    kept = [env.reset(seed=0)[0]]
    infos = []
    for action in actions_for(env.action_space, 80):
        observation, _, _, _, info = env.step(action)
        kept.append(observation)
        infos.append(info)
    assert not any(np.shares_memory(a, b) for a, b in itertools.pairwise(kept))
    times = [info["time"] for info in infos]  # looked at long after the step
    assert times == sorted(times)
    assert len(set(times)) == len(times)


@EVERY
def test_info_has_the_documented_schema(name: str) -> None:
    env = gym.make(name)
    _, first = env.reset(seed=0)
    _, reward, _, _, info = env.step(env.action_space.sample())
    assert tuple(first) == tuple(info) == env.unwrapped.setup.info_keys
    for key, value in info.items():
        assert key in PLAIN or key.startswith(PREFIXES), key
        assert isinstance(value, float)
        assert np.isfinite(value), key
    terms = [v for k, v in info.items() if k.startswith("reward/")]
    assert reward == sum(terms)
    assert all(info[k] >= 0.0 for k in info if k.startswith(("cost/", "effort/")))


@EVERY
def test_signals_decode_the_readings(name: str) -> None:
    env, raw = gym.make(name), gym.make(name, normalize=False)
    scaled, info = env.reset(seed=4)
    plain, _ = raw.reset(seed=4)
    for signal in env.unwrapped.signals:
        value = signal.decode(scaled)
        step = 1e-6 * (signal.high - signal.low)
        assert abs(value - raw.unwrapped.signals[signal.name].decode(plain)) < step
        assert abs(float(signal.encode(value)) - scaled[signal.index]) < 1e-6
        if f"sensor/{signal.name}" in info:
            assert abs(value - info[f"sensor/{signal.name}"]) < step
    bad = "nothing"
    with pytest.raises(KeyError, match="no signal named 'nothing'"):
        env.unwrapped.signals[bad]


@EVERY_CASE
def test_restored_state_continues_with_equal_bits(name: str, variant: str) -> None:
    env = gym.make(name, episode_seconds=1.0, **VARIANTS[name][variant]).unwrapped
    drive = actions_for(env.action_space, 240, 1)

    def run(e: gym.Env, some: np.ndarray) -> list[bytes]:
        out = []
        for action in some:
            observation, reward, terminated, truncated, info = e.step(action)
            out.append(observation.tobytes() + np.array([reward, *info.values()]).tobytes())
            if terminated or truncated:
                out.append(e.reset()[0].tobytes())
        return out

    env.reset(seed=11)
    run(env, drive[:70])
    state = env.get_state()
    copies = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    after = run(env, drive[70:])
    env.set_state(state)
    assert run(env, drive[70:]) == after
    fresh = gym.make(name, episode_seconds=1.0, **VARIANTS[name][variant]).unwrapped
    fresh.set_state(state)
    assert run(fresh, drive[70:]) == after
    for other in copies:
        assert run(other, drive[70:]) == after


@EVERY
def test_state_of_other_arguments_is_refused(name: str) -> None:
    env, other = gym.make(name, preview=0).unwrapped, gym.make(name, preview=9).unwrapped
    env.reset(seed=0)
    other.reset(seed=0)
    before = env.get_state()
    with pytest.raises(ValueError, match="taken with other arguments"):
        env.set_state(other.get_state())
    with pytest.raises(ValueError, match="has no 'steps'"):
        env.set_state({})
    for part, value, message in (
        ("rows", np.nan, "'rows' hold nan"),
        ("counts", -1, "'counts' hold -1"),
        ("seed", None, "not made by get_state"),
    ):
        spoilt = env.get_state()
        spoilt[part] = None if value is None else np.full_like(spoilt[part], value)
        with pytest.raises(ValueError, match=message):
            env.set_state(spoilt)
    assert all(np.array_equal(v, before[k]) for k, v in env.get_state().items())


@EVERY
def test_spec_survives_json(name: str) -> None:
    env = gym.make(name, preview=2)
    again = gym.make(gym.spec(name))
    assert again.spec is not None
    assert env.spec is not None
    assert gym.envs.registration.EnvSpec.from_json(env.spec.to_json()).kwargs == {"preview": 2}


@EVERY
def test_step_before_reset_raises(name: str) -> None:
    env = gym.make(name)
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        env.step(env.action_space.sample())


@EVERY
def test_episode_is_truncated_after_its_duration(name: str) -> None:
    env = gym.make(name, episode_seconds=0.5)
    env.reset(seed=0)
    flags = [env.step(a)[2:4] for a in np.zeros((50, *env.action_space.shape), np.float32)]
    assert flags[:-1] == [(False, False)] * 49
    assert flags[-1] == (False, True)
