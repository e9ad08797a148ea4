"""Muscle with imposed length: its law and friction, and the coupling with MuJoCo."""

import importlib.util
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.exported import run_c
from pam_envs.arrays import Array
from pam_envs.export.actuator import muscle_model
from pam_envs.export.c import export_c
from pam_envs.export.command import model_of
from pam_envs.export.toolchain import host_platform, native_compiler
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate

EXAMPLE = Path(__file__).parents[2] / "docs/examples/mujoco/muscle.py"
PROMPT = {"regulator.dead_time": 0.0, "regulator.time_constant": 0.002, "regulator.slew_rate": 1e9}


def in_c(plant: SingleMuscle, folder: Path, inputs: Array) -> Array:
    """Return pressure [Pa] and tension [N] after each input, shape (T, 2)."""
    export_c(muscle_model(plant), folder, [host_platform()])
    return run_c(muscle_model(plant), folder, inputs)[1:]


def loop(amplitude: float, pressure: float) -> Array:
    """Return inputs of two cycles of the length [m] at a constant setpoint [Pa]."""
    turns = np.linspace(0.0, 2.0, 801)
    length = 0.095 + amplitude * np.cos(2.0 * np.pi * turns)
    return np.column_stack([np.full_like(length, pressure), length])


def test_tension_without_friction_is_that_of_the_static_law(tmp_path: Path) -> None:
    plant = SingleMuscle.mas10("none").replace(PROMPT)
    inputs = loop(0.004, 3e5)
    found = in_c(plant, tmp_path, inputs)[100:]
    strain = 1.0 - inputs[100:, 1] / plant.muscle.rest_length
    np.testing.assert_allclose(found[:, 0], 3e5, rtol=1e-9)
    np.testing.assert_allclose(found[:, 1], plant.muscle.tension(found[:, 0], strain), rtol=1e-9)


def test_friction_dissipates_energy_in_a_cycle_of_the_length(tmp_path: Path) -> None:
    inputs = loop(0.004, 3e5)
    found = in_c(SingleMuscle.mas10().replace(PROMPT), tmp_path, inputs)
    length, tension = inputs[400:, 1], found[400:, 1]
    work = np.sum(0.5 * (tension[1:] + tension[:-1]) * np.diff(length))  # done on the muscle
    assert 0.01 < work < 1.0  # J


def test_pressure_follows_dead_time_and_lag(tmp_path: Path) -> None:
    plant = SingleMuscle.mas10().replace({"regulator.slew_rate": 1e9})
    inputs = np.column_stack([np.full(400, 1e5), np.full(400, 0.1)])
    model = muscle_model(plant)
    export_c(model, tmp_path, [host_platform()])
    steps = np.vstack([[[0.0, 0.1]], inputs])
    pressure = run_c(model, tmp_path, steps)[2:, 0]
    time = 1e-3 * np.arange(1, 401)
    late = np.maximum(0.0, time - plant.regulator.dead_time)
    expected = 1e5 * (1.0 - np.exp(-late / plant.regulator.time_constant))
    np.testing.assert_allclose(pressure, expected, atol=1e-3)


@pytest.mark.parametrize("change", [{"muscle.creep_2": 0.1}, {"regulator.leak": 0.1}])
def test_plant_with_effects_is_refused(change: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="needs a single_muscle without effects"):
        muscle_model(SingleMuscle.mas10().replace(change))


def test_command_line_refuses_arguments_of_environments() -> None:
    with pytest.raises(ValueError, match="takes --plant alone"):
        model_of("muscle", hysteresis="none")


def shared_library(plant: SingleMuscle, folder: Path) -> Path:
    model = muscle_model(plant)
    export_c(model, folder, [host_platform()])
    kernel = f"objects/{host_platform()}/{model.name}_kernel.o"
    flags = ["-O2", "-shared", "-fPIC", f"{model.name}.c", kernel, "-o", "muscle.so"]
    subprocess.run([*native_compiler(), *flags], cwd=folder, check=True)
    return folder / "muscle.so"


def test_mujoco_lifts_the_load_as_the_plant_does(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="mujoco is not installed: pip install mujoco")
    spec = importlib.util.spec_from_file_location("mujoco_muscle", EXAMPLE)
    assert spec is not None and spec.loader is not None
    example: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    plant = SingleMuscle.mas10()
    set_points = np.repeat([0.0, 2e5, 4.5e5, 2e5, 0.5e5, 3e5], 100)
    lift = example.simulate(shared_library(plant, tmp_path), set_points)
    expected = simulate(plant, set_points)["contraction"]
    assert np.ptp(expected) > 8e-3
    assert np.abs(lift - expected).max() < 1e-4  # m, where the load moves fastest
    ends = np.arange(99, len(set_points), 100)
    np.testing.assert_allclose(lift[ends], expected[ends], atol=1e-5)
