"""Bad input raises a clear error and leaves the environment unchanged."""

import dataclasses
import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.plants.core.plant import UnstableParameters
from pam_envs.plants.single_muscle.plant import SingleMuscle
from tests.envs.cases import IDS

EVERY = pytest.mark.parametrize("name", IDS)


def bad_actions(n: int) -> list[Any]:
    """Return invalid actions for ``n`` numbers."""
    return [
        *([value] * n for value in (np.nan, np.inf, -np.inf, 10**400, 1j)),
        [0.1] * (n - 1) + [np.nan],
        [0.1] * (n + 1),
        np.zeros(0, np.float32),
        np.zeros(n + 1, np.float32),
        np.zeros((1, n), np.float32),
        np.zeros((n, 1), np.float32),
        np.float32(0.1),
        np.array(["up"] * n),
        "up",
        None,
        {},
        [[0.1], [0.2, 0.3]],
        object(),
        np.array([1j] * n),
    ]


@EVERY
@pytest.mark.parametrize("warm", [0, 80])
def test_bad_actions_change_nothing(name: str, warm: int) -> None:
    env, twin = gym.make(name).unwrapped, gym.make(name).unwrapped
    env.reset(seed=0)
    twin.reset(seed=0)
    good = np.full(env.action_space.shape, 0.3, np.float32)
    for _ in range(warm):
        env.step(good)
        twin.step(good)
    before = env.get_state()
    for action in bad_actions(env.action_space.shape[0]):
        with pytest.raises(ValueError, match="action"):
            env.step(action)
    after = env.get_state()
    assert all(np.array_equal(after[k], before[k]) for k in before)
    assert np.array_equal(env.step(good)[0], twin.step(good)[0])


@EVERY
def test_actions_out_of_range_are_clipped_and_reported(name: str) -> None:
    env, twin = gym.make(name), gym.make(name)
    env.reset(seed=2)
    twin.reset(seed=2)
    far, edge = env.action_space.high * 7, env.action_space.high
    a, b = env.step(far), twin.step(edge)
    assert np.array_equal(a[0], b[0])
    assert (a[4]["saturated"], b[4]["saturated"]) == (1.0, 0.0)


@pytest.mark.parametrize("which", range(6))
def test_one_of_several_actions_out_of_range_is_clipped_and_reported(which: int) -> None:
    env, twin = (gym.make("PAM/RedundantManipulator-v0") for _ in range(2))
    env.reset(seed=2)
    twin.reset(seed=2)
    action = np.zeros(6, np.float32)
    action[which] = 1.0
    edge = twin.step(action)
    far = env.step(4.0 * action)
    assert np.array_equal(edge[0], far[0])
    assert (edge[4]["saturated"], far[4]["saturated"]) == (0.0, 1.0)


def test_message_on_a_wrong_action_names_the_signals() -> None:
    env = gym.make("PAM/AntagonisticJoint-v0", action="pressures").unwrapped
    env.reset(seed=0)
    with pytest.raises(ValueError, match="pressure_a_set_point, pressure_b_set_point"):
        env.step(np.zeros(3))
    with pytest.raises(ValueError, match=r"action\[1\] \(pressure_b_set_point\) is nan"):
        env.step(np.array([0.0, np.nan]))


@EVERY
def test_bad_batches_change_nothing(name: str) -> None:
    envs = gym.make_vec(name, 4, vectorization_mode="vector_entry_point")
    envs.reset(seed=0)
    before = envs.get_state()
    shape = envs.action_space.shape
    broken = np.zeros(shape)
    broken[2, -1] = np.nan
    for actions in (broken, np.zeros((3, shape[1])), np.zeros(5), None, "no", [[1.0], [2.0, 3.0]]):
        with pytest.raises(ValueError, match="actions"):
            envs.step(actions)
    assert all(np.array_equal(v, before[k]) for k, v in envs.get_state().items())
    for seed in (-1, 1.5, "a", [1, 2], True):
        with pytest.raises(ValueError, match="seed"):
            envs.reset(seed=seed)
    with pytest.raises(ValueError, match="num_envs"):
        gym.make_vec(name, 0, vectorization_mode="vector_entry_point")


@EVERY
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"hysteresis": "bouc_wen"}, "hysteresis = 'bouc_wen' is not known; choose one of"),
        ({"reference": "no such one"}, "reference = 'no such one' is not known; choose one of"),
        ({"reference": object()}, "reference"),
        ({"reference": [np.nan]}, "reference"),
        ({"preview": -1}, "preview = -1 must be from 0 to 20"),
        ({"preview": 2.5}, "whole number"),
        ({"preview_stride": 0}, "preview_stride = 0"),
        ({"episode_seconds": 0}, "from 0.02 to 3600 s"),
        ({"episode_seconds": float("nan")}, "episode_seconds = nan"),
        ({"episode_seconds": "long"}, "episode_seconds = 'long'"),
        ({"normalize": 1}, "normalize = 1"),
        ({"randomize": 3}, "randomize = 3"),
        ({"randomize": {"mass.colour": (1, 2)}}, "'mass.colour' is not a parameter"),
        ({"randomize": {"regulator.time_constant": 0.1}}, r"needs \(low, high\)"),
        ({"randomize": {"regulator.time_constant": (0.2, 0.1)}}, "swap them"),
        ({"randomize": {"regulator.time_constant": (0.1, 1e9)}}, "outside its bounds"),
        ({"randomize": {"regulator.max_pressure": (3e5, 3e5)}}, "that can be drawn"),
        ({"reward": {"luck": 1.0}}, "keys among "),
        ({"reward": {"effort_weight": -1.0}}, "outside its bounds"),
        ({"plant": "/nowhere/rig.yaml"}, "cannot be read"),
        ({"plant": 7}, "plant must be a "),
    ],
)
def test_bad_common_arguments_are_refused(name: str, arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        gym.make(name, **arguments)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"reference": "stairs"}, "choose one of 'steps'"),
        ({"reference": [0.0, np.nan]}, "finite sample"),
        ({"reference": [5.0]}, "reference reaches 5 m; at most 0.2 m is accepted"),
        ({"load": -1.0}, "load = -1.0 must be a number from 0 to 5 kg"),
        ({"load": 25.0}, "from 0 to 5 kg"),
        ({"load": []}, "load = "),
        ({"load": "heavy"}, "load = 'heavy'"),
        ({"load_disturbance": -0.1}, "load_disturbance"),
        ({"start": "middle"}, "start = 'middle'"),
        ({"randomize": {"mass.moving_mass": (0.05, 0.2)}}, "use at least"),
        ({"reward": {"speed": 1.0}}, "keys among tracking_weight"),
        ({"plant": 7}, "must be a SingleMuscle"),
    ],
)
def test_bad_arguments_of_muscle_positioning_are_refused(
    arguments: dict[str, Any], said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        gym.make("PAM/MusclePositioning-v0", **arguments)


@EVERY
def test_unknown_argument_suggests_the_nearest(name: str) -> None:
    said = "no argument 'previev'; did you mean 'preview'"
    with pytest.raises(TypeError, match=said):
        gym.make(name, previev=3)
    with pytest.raises(TypeError, match=said):
        gym.make_vec(name, 2, vectorization_mode="vector_entry_point", previev=3)


def test_plant_with_another_hysteresis_is_refused() -> None:
    plant = SingleMuscle.mas10("preisach")
    with pytest.raises(ValueError, match="the plant's hysteresis is 'preisach'"):
        gym.make("PAM/MusclePositioning-v0", plant=plant, hysteresis="maxwell_slip")
    env = gym.make("PAM/MusclePositioning-v0", plant=plant, hysteresis="none")
    assert env.unwrapped.plant.hysteresis.kind == "none"


MUSCLE = "schema: 1\nfamily: single_muscle\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "is not YAML"),
        ("just text", "must hold a mapping"),
        ("schema: 2\nfamily: single_muscle", "schema is 2"),
        ("schema: 1\nfamily: leg", "family is 'leg'"),
        (MUSCLE + "colour: red", "unknown key 'colour'"),
        (MUSCLE + "parameters: {mass.weight: 1}", "unknown parameter"),
        (MUSCLE + "parameters: {mass.load: heavy}", "must be a number"),
        (MUSCLE + "parameters: {mass.load: .nan}", "outside its bounds"),
        (MUSCLE + "parameters: {mass.load: 999}", r"mass.load = 999 kg"),
        (MUSCLE + "parameters: {mass.load: {value: 1, unit: g}}", "expected 'kg'"),
        (MUSCLE + "parameters: {mass.load: {value: 1, why: x}}", "unknown key 'why'"),
        (MUSCLE + "parameters: {mass.load: {value: 1, provenance: rumour}}", "provenance 'rumour'"),
        (MUSCLE + "parameters: [1]", "must be a mapping"),
        (MUSCLE + "hysteresis: {kind: rope}", "hysteresis must be a mapping"),
        (MUSCLE + "hysteresis: {kind: preisach}", "needs exactly the keys"),
        (
            MUSCLE + "hysteresis: {kind: maxwell_slip, linear: 0.2, thresholds: [1e4], "
            "weights: [0.5]}",
            "total slope",
        ),
        (MUSCLE + "substeps: 0", "substeps"),
        (MUSCLE + "ensemble: [3]", "must be a mapping"),
        (MUSCLE + "parameters: {mass.moving_mass: 0.05}", "too fast for 4 sub-steps"),
    ],
)
def test_bad_plant_files_are_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(text)
    with pytest.raises(ValueError, match=said) as error:
        gym.make("PAM/MusclePositioning-v0", plant=str(path))
    assert re.search("rig.yaml", str(error.value))


def test_unstable_parameters_name_the_remedy() -> None:
    with pytest.raises(UnstableParameters, match=r"use at least \d sub-steps") as error:
        SingleMuscle.mas10(mass__moving_mass=0.06)
    enough = int(re.findall(r"at least (\d+) sub-steps", str(error.value))[0])
    plant = SingleMuscle.mas10()
    made = dataclasses.replace(plant, substeps=enough).replace({"mass.moving_mass": 0.06})
    assert made.mass.moving_mass == 0.06
