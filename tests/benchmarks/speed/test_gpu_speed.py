"""Measurements of batches on a GPU, with the processor in its place."""

import sys
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from benchmarks.speed import gpu
from benchmarks.speed.groups import measure
from pam_envs.envs.device.device import HostDevice
from pam_envs.kernels.build import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="batches on a device are compiled")
ID = gpu.ENVS[0]


def test_no_value_differs_from_the_batch_on_the_processor() -> None:
    assert gpu.differing_values(ID, "host", 5, 110) == 0


def test_differing_values_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    read = HostDevice.read

    def wrong(self: HostDevice, array: Any) -> Any:
        values = read(self, array)
        if values.dtype == np.float32:  # the observations
            values[0, 0, 0] += 1.0
        return values

    monkeypatch.setattr(HostDevice, "read", wrong)
    assert gpu.differing_values(ID, "host", 5, 3) == 3


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_steps_are_counted_in_each_type(dtype: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)  # actions of the device are taken as they are
    envs: Any = gym.make_vec(ID, 3, device="host", dtype=dtype, info=False)
    monkeypatch.setattr(gpu, "CALLS", 1)
    assert gpu._stepping(envs)() == 60


def test_missing_gpu_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cuda.core", None)
    (found,) = measure(("gpu",))
    assert found.value is None
    assert found.verdict == "not measured"
    assert "pip install 'pam-envs[cuda]'" in found.note
