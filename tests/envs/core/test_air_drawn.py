"""Air drawn from the supply: what a leak loses and the supply refills counts as drawn."""

from collections.abc import Callable, Mapping
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.constants import ATMOSPHERE, PRESSURE_PER_DENSITY
from pam_envs.pneumatics.flow import AIRS
from tests.envs.cases import IDS

STEPS, BEFORE = 48, 30
"""Control periods of an episode, and those before the balance begins."""
HELD = 2e5
"""Setpoint [Pa]."""
LEAK = 0.5
Air = tuple[Any, Any]
"""Gauge pressures [Pa] and volumes [m3] of all muscles, shape (T, muscles)."""


def muscle(plant: Any, info: Mapping[str, Any]) -> Air:
    rest = plant._absolute(np.zeros(()), np.asarray(info["state/load"][0]))
    strain = (info["state/contraction"] + rest) / plant.muscle.rest_length
    return info["state/pressure"][:, None], plant.muscle.volume_at(strain)[:, None]


def brace(plant: Any, info: Mapping[str, Any]) -> Air:
    return info["state/pressure"][:, None], plant.muscle.volume_at(info["state/length"])[:, None]


def joint(plant: Any, info: Mapping[str, Any]) -> Air:
    pressures = np.stack([info["state/pressure_a"], info["state/pressure_b"]], axis=1)
    return pressures, plant.volumes(info["state/angle"])[0]


def elbow(plant: Any, info: Mapping[str, Any]) -> Air:
    pressures = np.stack([info["state/pressure_a"], info["state/pressure_b"]], axis=1)
    short_a, short_b = plant.pulley.contractions(info["state/angle"])
    volumes = [plant.bundle_a.volume(short_a), plant.bundle_b.volume(short_b)]
    return pressures, np.stack(volumes, axis=1)


def arm(plant: Any, info: Mapping[str, Any]) -> Air:
    names = [f"{k}{side}" for k in range(plant.stages) for side in "ab"]
    pressures = np.stack([info[f"state/pressure_{name}"] for name in names], axis=1)
    volumes = [plant.volumes(info[f"state/angle_{k}"])[0] for k in range(plant.stages)]
    return pressures, np.concatenate(volumes, axis=1)


OF: dict[str, Callable[[Any, Mapping[str, Any]], Air]] = {
    "Muscle": muscle,
    "Knee": brace,
    "Antagonistic": joint,
    "Elbow": elbow,
    "Redundant": arm,
}


def held(name: str, air: str, leak: float) -> tuple[Any, dict[str, Any]]:
    """Return an environment and its signals after it has moved to a held setpoint."""
    env: Any = gym.make(name, normalize=False, air=air).unwrapped
    env = gym.make(name, normalize=False, plant=env.plant.replace({"regulator.leak": leak}))
    _, info = env.reset(seed=5)
    action = np.full(env.action_space.shape, HELD, np.float32)
    if name.startswith(("PAM/Antagonistic", "PAM/Redundant")):
        action[:] = 0.1
    infos = [info, *(env.step(action)[4] for _ in range(STEPS))][BEFORE:]
    return env.unwrapped, {k: np.array([i[k] for i in infos]) for k in info}


@pytest.mark.parametrize("air", AIRS)
@pytest.mark.parametrize("name", IDS)
def test_refilled_leak_is_drawn_from_the_supply(name: str, air: str) -> None:
    env, info = held(name, air, LEAK)
    family = next(f for key, f in OF.items() if name.startswith(f"PAM/{key}"))
    pressure, volume = family(env.plant, info)
    mass = (pressure + ATMOSPHERE) * volume / PRESSURE_PER_DENSITY
    loss = LEAK * pressure * volume / PRESSURE_PER_DENSITY
    leaked = 0.5 * env.plant.control_period * (loss[1:] + loss[:-1])
    growth = np.diff(mass, axis=0)
    if not name.startswith("PAM/Elbow"):  # whose bundles count one by one
        growth, leaked = growth.sum(axis=1), leaked.sum(axis=1)
    drawn = np.maximum(0.0, growth + leaked).sum()
    assert drawn > 1.2 * np.maximum(0.0, growth).sum()
    assert info["effort/air"][1:].sum() == pytest.approx(drawn, rel=2e-3)
