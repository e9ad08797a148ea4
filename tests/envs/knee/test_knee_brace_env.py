"""Brace alone: tracked quantity, start, range of references."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from tests.envs.cases import record


def series(name: str, seconds: float, pressure: float, **arguments: Any) -> dict[str, np.ndarray]:
    """Return ``info`` as arrays under a constant setpoint [Pa]."""
    env = gym.make(name, normalize=False, episode_seconds=60.0, **arguments)
    info = record(env, [[pressure]] * round(100 * seconds))
    assert len(info["time"]) == round(100 * seconds) + 1
    return info


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [("PAM/KneeTension-v0", 80.0, 205.0), ("PAM/KneeStiffness-v0", 100.0, 7100.0)],
)
def test_default_reference_is_a_sine_of_a_tenth_hertz_from_its_lowest_value(
    name: str, low: float, high: float
) -> None:
    info = series(name, 10.0, 1e5)
    expected = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(0.2 * np.pi * info["time"])
    assert np.allclose(info["reference"], expected, rtol=1e-9)


def test_paper_start_has_a_tension_of_55_newtons() -> None:
    info = series("PAM/KneeTension-v0", 0.0, 0.5e5, start="paper")
    assert info["output"][0] == pytest.approx(55.0, abs=2.0)
    assert info["reference"][0] == pytest.approx(80.0)


def test_every_reference_is_within_reach_of_the_capacity() -> None:
    for name in ("PAM/KneeTension-v0", "PAM/KneeStiffness-v0"):
        for plant in (KneeOrthosis.no_load(), KneeOrthosis.rig()):
            low = series(name, 3.0, 0.0, plant=plant, start="paper")["output"][-1]
            info = series(name, 3.0, 4.5e5, plant=plant, start="paper", reference="sines")
            assert low < info["reference"].min()
            assert info["output"][-1] > info["reference"].max()


def test_output_is_tension_or_stiffness() -> None:
    for name, key in (("PAM/KneeTension-v0", "tension"), ("PAM/KneeStiffness-v0", "stiffness")):
        info = series(name, 1.0, 2e5)
        assert np.array_equal(info["output"], info[f"state/{key}"])
        stretch = info["state/length"] - 0.17
        assert np.allclose(info["state/tension"], info["state/stiffness"] * stretch)


def test_sensed_stiffness_follows_from_sensed_tension_and_angle() -> None:
    info = series("PAM/KneeTension-v0", 1.0, 2e5)
    plant = KneeOrthosis.no_load()
    expected = plant.stiffness_for(info["sensor/tension"], info["sensor/angle"])
    assert np.allclose(info["sensor/stiffness"], expected, rtol=1e-9)
    assert not np.array_equal(info["sensor/stiffness"], info["state/stiffness"])


def test_orthosis_on_a_leg_is_refused() -> None:
    with pytest.raises(ValueError, match=r"give KneeOrthosis.no_load\(\) or KneeOrthosis.rig\(\)"):
        gym.make("PAM/KneeTension-v0", plant=KneeOrthosis.on_leg("walk"))
