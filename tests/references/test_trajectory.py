"""References: seeded, within range, with exact previews."""

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401
from pam_envs.references.trajectory import FAMILIES

NAME = "PAM/MusclePositioning-v0"


def record(seed: int, seconds: float = 12.0, **arguments: object) -> np.ndarray:
    env = gym.make(NAME, episode_seconds=seconds, **arguments)
    _, info = env.reset(seed=seed)
    made = [info["reference"]]
    for _ in range(int(seconds * 100)):
        made.append(env.step(np.zeros(1, np.float32))[4]["reference"])
    return np.array(made)


@pytest.mark.parametrize("family", FAMILIES)
def test_family_is_seeded_and_stays_in_range(family):
    several = [record(seed, reference=family) for seed in range(4)]
    assert np.array_equal(several[0], record(0, reference=family))
    assert len({r.tobytes() for r in several}) == 4
    for r in several:
        assert r.min() >= 0.001 - 1e-12
        assert r.max() <= 0.013 + 1e-12
        assert np.ptp(r) > 0.001


def test_each_family_has_its_characteristic_shape():
    steps, ramps = record(0, reference="steps"), record(0, reference="ramps")
    assert np.mean(np.diff(steps) == 0.0) > 0.98
    assert np.abs(np.diff(ramps)).max() < 0.012 * 0.01 + 1e-9  # at most the range in a second
    assert np.mean(np.diff(ramps) == 0.0) < 0.05
    stairs = record(0, 30.0, reference="staircase")
    jumps = np.diff(stairs)[np.diff(stairs) != 0]
    assert np.allclose(np.abs(jumps), 0.002)
    up = np.argmax(stairs)
    assert (np.diff(stairs[: up + 1]) >= 0).all()
    sine = record(3, 60.0, reference="sines")
    power = np.abs(np.fft.rfft((sine - sine.mean()) * np.hanning(len(sine)))) ** 2
    peak = int(np.argmax(power))
    assert power[max(0, peak - 4) : peak + 5].sum() > 0.98 * power.sum()
    multi = record(3, 60.0, reference="multisine")
    power = np.abs(np.fft.rfft((multi - multi.mean()) * np.hanning(len(multi)))) ** 2
    peak = int(np.argmax(power))
    assert power[max(0, peak - 4) : peak + 5].sum() < 0.9 * power.sum()


@pytest.mark.parametrize(("preview", "stride"), [(5, 4), (1, 1), (20, 3), (3, 50)])
def test_preview_equals_the_future_reference(preview, stride):
    env = gym.make(NAME, preview=preview, preview_stride=stride, reference="mixed", normalize=False)
    observation, info = env.reset(seed=5)
    seen, previews = [info["reference"]], [observation[4:]]
    for _ in range(400):
        observation, _, _, _, info = env.step(np.zeros(1, np.float32))
        seen.append(info["reference"])
        previews.append(observation[4:])
    for k, future in enumerate(previews):
        for i, value in enumerate(future):
            if k + i * stride < len(seen):
                assert value == np.float32(seen[k + i * stride])


def test_given_samples_are_followed_and_the_last_is_held():
    samples = 0.005 + 0.002 * np.sin(0.05 * np.arange(200))
    env = gym.make(NAME, reference=samples, preview=2, preview_stride=10, normalize=False)
    observation, info = env.reset(seed=0)
    assert info["reference"] == samples[0]
    for k in range(1, 260):
        observation, _, _, _, info = env.step(np.zeros(1, np.float32))
        assert info["reference"] == samples[min(k, 199)]
        assert observation[6] == np.float32(samples[min(k + 20, 199)])
