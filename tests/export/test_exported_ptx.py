"""PTX: the coalesced layout computes the bits of Python; the code is emitted and assembled."""

import re
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from pam_envs.envs.core.lanes import REGISTERS
from pam_envs.envs.core.step import EPISODE
from pam_envs.export.command import model_of
from pam_envs.export.ptx import PARTS, LaneKernel, export_ptx, find_ptxas, layout, ptx_of
from pam_envs.kernels.build import address_book
from pam_envs.kernels.machine_code import MachineCode
from pam_envs.kernels.random import seed_words

LANES, SEED = 5, 40


class Lanes:
    """A batch in the layout (rows, N), run lane by lane on the CPU."""

    def __init__(self, model: Any, number: int) -> None:
        kernels = model.kernels["kernel"]
        self.parts = {part: MachineCode(LaneKernel(kernels, part)).wait() for part in PARTS}
        self.arrays: dict[str, Any] = {}
        for entry in layout(model)["book"]:
            shape = [number if size == "N" else size for size in entry["shape"]]
            start = model.block(entry["name"]).values
            whole = start if list(start.shape) == shape else np.zeros(shape, entry["type"])
            self.arrays[entry["name"]] = np.ascontiguousarray(whole)
        self.number = number
        self.book = address_book(list(self.arrays.values()))

    def run(self, part: str) -> None:
        """Run one part as the threads of a GPU would, in any order."""
        for lane in reversed(range(self.number)):
            self.parts[part](self.book.ctypes.data, lane)

    def reset(self, seed: int) -> None:
        """Start episode 0 of a seed for each lane."""
        counts = self.arrays["counts"]
        for lane in range(self.number):
            counts[-2, lane], counts[-1, lane] = seed_words(seed + lane)
        counts[EPISODE] = 0
        self.arrays["flags"][0] = 2
        self.run("restart")


def test_lanes_side_by_side_have_the_bits_of_single_environments() -> None:
    seconds = 0.3
    name = "PAM/MusclePositioning-v0"
    envs: list[Any] = [gym.make(name, episode_seconds=seconds) for _ in range(LANES)]
    from pam_envs.export.environment import environment_model

    lanes = Lanes(environment_model(name, envs[0].unwrapped), LANES)
    lanes.reset(SEED)
    seen, report = lanes.arrays["observation"][0], lanes.arrays["report"][0]
    flags, actions = lanes.arrays["flags"], lanes.arrays["action"]
    for lane, env in enumerate(envs):
        observation, info = env.reset(seed=SEED + lane)
        assert np.array_equal(seen[lane], observation)
        assert list(report[1:, lane]) == list(info.values())
    random = np.random.default_rng(2)
    for _ in range(70):  # over two ends of episodes
        actions[:] = random.uniform(-1.0, 1.0, actions.shape).astype(np.float32)
        lanes.run("step")
        ended = []
        for lane, env in enumerate(envs):
            observation, reward, over, cut, info = env.step(actions[lane].astype(np.float32))
            assert np.array_equal(seen[lane], observation)
            assert [report[0, lane], *report[1:, lane]] == [reward, *info.values()]
            assert (flags[0, lane], flags[1, lane]) == (over, cut)
            if over or cut:
                ended.append((lane, env.reset()[0]))
        lanes.run("restart")
        for lane, observation in ended:
            assert np.array_equal(seen[lane], observation)


@pytest.mark.parametrize("part", PARTS)
def test_ptx_has_one_kernel_that_calls_nothing(small, part: str) -> None:
    text = ptx_of(small.model, part)
    assert re.findall(r"\.visible \.entry (\w+)", text) == [f"{small.model.prefix}_{part}"]
    assert not re.search(r"\.extern \.func", text)
    assert re.findall(r"\.maxnreg (\d+)", text) == [
        str(REGISTERS[p]) for p in REGISTERS if p == part
    ]


@pytest.mark.parametrize("part", PARTS)
def test_ptx_rounds_every_operation_to_nearest(small, part: str) -> None:
    text = ptx_of(small.model, part)
    operation = r"^\s*((?:add|sub|mul|div|rcp|sqrt|fma|mad|ex2|lg2|sin|cos)\.\S*f(?:16|32|64))\b"
    found = set(re.findall(operation, text, re.MULTILINE))
    assert {"add.rn.f64", "mul.rn.f64", "div.rn.f64"} <= found
    assert found <= {f"{name}.rn.f64" for name in ("add", "sub", "mul", "div", "rcp", "sqrt")}


@pytest.mark.skipif(find_ptxas() is None, reason="ptxas is not installed")
def test_ptx_is_assembled(small, tmp_path: Path) -> None:
    export_ptx(small.model, tmp_path)
    page = (tmp_path / "README.md").read_text()
    assert page.count("registers") == page.count("spill stores") == len(PARTS)
    assert len(list(tmp_path.glob("*.ptx"))) == len(PARTS)


def test_plant_has_no_ptx() -> None:
    with pytest.raises(ValueError, match="PTX is for environments"):
        ptx_of(model_of("single_muscle"), "step")
