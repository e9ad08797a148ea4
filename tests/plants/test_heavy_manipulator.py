"""Masses that the arm's muscles bear, and the heavier arm of the page: its snippets and figures."""

import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from baselines.core.catalogue import make_controller
from benchmarks.runs.rollout import run
from pam_envs.envs.manipulator.paths import paths_for
from pam_envs.kernels.build import COMPILED
from pam_envs.plants.antagonistic_joint.statics import UnbearableLoad, bearable_payload
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from pam_envs.plants.redundant_manipulator.rollout import simulate_manipulator

PAGE = Path(__file__).parents[2] / "docs/envs/redundant_manipulator.md"
SECTION = PAGE.read_text().partition("## Masses and damping")[2].partition("\n## ")[0]
ID = "PAM/RedundantManipulator-v0"
slow = pytest.mark.skipif(not COMPILED, reason="too many sub-steps for plain Python")


def numbers(heading: str) -> list[float]:
    """Return the numbers of a line of the section's tables, by its first cell."""
    (line,) = (line for line in SECTION.splitlines() if line.startswith(f"| {heading}"))
    return [float(cell.split()[0]) for cell in line.strip("|").split("|")[1:]]


@pytest.fixture(scope="module")
def page() -> dict[str, Any]:
    """Names that the section's Python snippets make."""
    names: dict[str, Any] = {}
    for snippet in re.findall(r"^```python\n(.*?)^```$", SECTION, re.MULTILINE | re.DOTALL):
        exec(snippet, names)
    return names


def plans(plant: RedundantManipulator) -> dict[str, np.ndarray]:
    return {name: path[6:].T for name, path in paths_for(plant, "paths", True).items()}


def heaviest(plant: RedundantManipulator, plan: np.ndarray) -> float:
    """Largest mass of a link [kg] that the muscles bear along a plan."""
    low, high = plant.torque_range(plan)
    weight = plant.weight_torque(plan)
    return plant.masses[0] / float(np.maximum(weight / high, weight / low).max())


def test_page_states_the_torques_and_the_heaviest_links() -> None:
    plant = RedundantManipulator.paper()
    angles, torques = numbers("angle of a joint"), numbers("largest torque")
    assert plant.torque_range(np.radians(angles))[1] == pytest.approx(torques, abs=0.006)
    masses = {name: heaviest(plant, plan) for name, plan in plans(plant).items()}
    for name, mass in masses.items():
        assert re.search(rf"{mass:.3f} kg on\s+`{name}`", SECTION)
        for factor, borne in ((0.999, True), (1.001, False)):
            changed = plant.replace({"arm.mass_factor": factor * mass / plant.masses[0]})
            assert (bearable_payload(changed, plans(plant)[name]) >= 0.0) == borne
    heavy = RedundantManipulator.paper(arm__mass_factor=10.0)
    assert f"reaches {np.degrees(heavy.reachable_angle()):.1f} degrees" in SECTION


def test_page_command_shows_the_torque_that_is_missing() -> None:
    (command,) = re.findall(r'^python -c "(import gymnasium.*)"$', SECTION, re.MULTILINE)
    needed = r"needs ([\d.]+ N m) at (\S+) degrees, where the muscles give ([\d.]+)"
    words = re.search(needed, " ".join(SECTION.split()))
    assert words
    expected = f"needs {words[1]} at {words[2]} degrees and its muscles exert {words[3]} N m"
    with pytest.raises(UnbearableLoad, match=expected):
        exec(command, {})


def test_heavy_arm_bears_the_paths_and_the_light_muscles_do_not(page: dict[str, Any]) -> None:
    heavy = page["heavy"]
    assert heavy.masses == (1.0,) * 6
    assert page["env"].unwrapped.plant == heavy
    assert heavy.muscle.force(6.5e5, 0.0) == pytest.approx(10.0 * 543.0, rel=1e-3)
    with pytest.raises(UnbearableLoad):
        gym.make(ID, plant=RedundantManipulator.paper(chain=heavy.chain), reference="path_1")
    heaviest_links = min(heaviest(heavy, plan) for plan in plans(heavy).values())
    assert f"up to {heaviest_links:.1f} kg per joint" in SECTION


def test_heavy_arm_rests_at_the_ends_of_the_paths(page: dict[str, Any]) -> None:
    plant = page["heavy"].replace({"hysteresis.width": 0.0})
    for plan in plans(plant).values():
        for pose in plan[[0, -1]]:
            commands = pose + plant.gravity_shift(pose)
            assert np.abs(commands).max() < plant.link.limit
            made = simulate_manipulator(plant, np.tile(commands, (3, 1)))
            assert np.allclose(made["angle"][-1], pose, atol=1e-6)


@slow
@pytest.mark.parametrize("path", ["path_1", "path_2", "path_3"])
def test_heavy_arm_follows_the_paths(page: dict[str, Any], path: str) -> None:
    text = " ".join(SECTION.split())
    ((name, bound),) = re.findall(r"`(joint_\w+)` follows them .*? below (\d+) mm", text)
    env = gym.make(ID, plant=page["heavy"], reference=path).unwrapped
    controller = make_controller(name, env.plant, env.signals, env.action_signals, 0)  # type: ignore[attr-defined]
    episode = run(env, controller, 0)
    assert not episode.failed
    settled = episode.signals["time"] > 1.0
    assert np.sqrt(np.mean(episode.signals["output"][settled] ** 2)) < 1e-3 * float(bound)


@slow
def test_ripple_after_a_step_is_that_of_the_page(page: dict[str, Any]) -> None:
    bare = RedundantManipulator.paper("none")
    arms = {"0.1 kg per joint |": page["light"], "1 kg per joint": page["heavy"]}
    for line, plant in (arms | {"0.1 kg per joint, muscles without": bare}).items():
        stated = numbers(line)
        made = [page["ripple"](plant, share) for share in (0.0, 0.25, 1.0)]
        assert made == pytest.approx(stated, abs=0.02)
        assert made[0] > 2.0 > 0.6 > made[2]  # degrees
