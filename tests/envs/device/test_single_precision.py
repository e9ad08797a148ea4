"""Batches in float32: error against float64, share of float32 in the code, rounding."""

import importlib.util
import math
import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.kernels import emission, random
from pam_envs.kernels.build import COMPILED, array_at, kernel
from pam_envs.kernels.machine_code import load

pytestmark = pytest.mark.skipif(not COMPILED, reason="batches on a device are compiled")
ID = "PAM/MusclePositioning-v0"
EXAMPLE = Path(__file__).parents[3] / "docs/examples/gpu/precision.py"
LANES, STEPS, SECONDS = 8, 300, 1.0


@pytest.fixture(scope="module")
def example() -> Any:
    """Return the module of the example."""
    spec = importlib.util.spec_from_file_location("device_precision", EXAMPLE)
    assert spec is not None and spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", [ID, "PAM/KneeTension-v0", "PAM/ElbowOrthosis-v0"])
def test_error_is_far_below_the_sensor_noise(example: Any, name: str) -> None:
    pair = example.Comparison(name, "host", LANES, SECONDS)
    pair.run(STEPS)
    noise = pair.sensor_noise()
    assert 0.0 < pair.rms("output") < 0.01 * noise
    assert pair.largest("output") < 0.1 * noise
    assert pair.rms("reading") < noise  # readings half-way between two steps round either way
    assert pair.rms("reward") < 1e-3
    assert pair.resets >= 2 * LANES
    assert pair.differing_resets == 0


def test_results_and_arrays_are_float32() -> None:
    envs: Any = gym.make_vec(ID, LANES, device="host", dtype="float32")
    envs.reset(seed=0)
    _, reward, *_, info = envs.step(np.zeros(envs.action_space.shape))
    assert np.asarray(reward).dtype == np.asarray(info["output"]).dtype == np.float32
    for name in ("rows", "fixed", "ahead", "settings", "tables", "actions", "report"):
        assert envs.values(name).dtype == np.float32
    assert envs.values("counts").dtype == np.int64


@pytest.mark.parametrize("part", ["step", "restart"])
def test_only_random_numbers_are_computed_in_float64(example: Any, part: str) -> None:
    single, double = (example.ptx_of(ID, dtype, part) for dtype in ("float32", "float64"))
    found, before = example.operations(single), example.operations(double)
    assert before["f32"] == 0
    assert found["f64"] < 0.4 * before["f64"]
    assert found["f32"] + found["f64"] < 1.05 * before["f64"]
    drawn = len(re.findall(r"cvt\.rn\.f64\.u64", single))
    assert len(re.findall(r"cvt\.rn\.f32\.f64", single)) <= drawn
    assert re.findall(r"cvt\.\S*f64\.(?:f32|s64)", single) == []  # no state or step is widened


@pytest.mark.parametrize("part", ["step", "restart"])
def test_ptx_is_exactly_rounded_and_not_fused(example: Any, part: str) -> None:
    ptx = example.ptx_of(ID, "float32", part)
    assert re.findall(r"\b\w+\.\S*(?:approx|full|ftz)\S*|\b(?:fma|mad)\.\S*f\d\d", ptx) == []


@pytest.mark.parametrize(("device", "dtype"), [("host", "float16"), ("cpu", "float32")])
def test_types_that_a_device_lacks_are_refused(device: str, dtype: str) -> None:
    with pytest.raises(ValueError, match=f"dtype.*'{dtype}'.*float64"):
        gym.make_vec(ID, 2, device=device, dtype=dtype)


uniform: Any = random.uniform


@kernel
def numbers(book: Any, count: int) -> None:
    """Write a uniform number, a quotient of integers, a root and a minimum."""
    values = array_at(book, 0, 1, 0)
    values[0] = uniform(1, 2, 3, 4)
    values[1] = count / 3
    values[2] = math.sqrt(values[1])
    values[3] = max(-1.0, min(values[4], 0.5))


@kernel
def nearly_one(key_a: int, key_b: int, stream: int, draw: int) -> float:
    """Return the largest number that ``uniform`` can give, in float64."""
    return 4294967295.5 * 2.3283064365386963e-10


def compute(count: int, given: float) -> np.ndarray:
    """Return the values of ``numbers`` in float32."""
    from pam_envs.kernels.single_precision import intermediate

    values = np.array([0.0, 0.0, 0.0, 0.0, given], np.float32)
    book = np.array([values.ctypes.data, len(values), 0, 0])
    load(emission.emit(intermediate(numbers, {}, 4), emission.host()))(book.ctypes.data, count)
    return values


def test_numbers_are_rounded_to_float32() -> None:
    third = np.float32(7.0) / np.float32(3.0)
    expected = [random.uniform(1, 2, 3, 4), third, np.sqrt(third), -0.75, -0.75]
    assert np.array_equal(compute(7, -0.75), np.array(expected, np.float32))


def test_uniform_numbers_stay_below_one(monkeypatch: pytest.MonkeyPatch) -> None:
    assert np.float32(nearly_one(0, 0, 0, 0)) == 1.0
    monkeypatch.setattr(random, "uniform", nearly_one)
    assert compute(1, 0.0)[0] == np.nextafter(np.float32(1.0), np.float32(0.0))


def test_float64_code_called_with_float32_is_found() -> None:
    from pam_envs.kernels.single_precision import check_calls

    text = "define void @f(ptr %x) {\n  %v = load float, ptr %x\n"
    text += "  call void @g(float %v)\n  ret void\n}\ndeclare void @g(TYPE)\n"
    check_calls(text.replace("TYPE", "float"))
    with pytest.raises(TypeError, match=r"g takes \['double'\] and is given \['float'\]"):
        check_calls(text.replace("TYPE", "double"))
