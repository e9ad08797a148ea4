"""C: equal bits without Python, parameters, plants, objects for other processors."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from benchmarks.exported import differing, run_c
from pam_envs.export.c import export_c, literal
from pam_envs.export.command import model_of, plant_of
from pam_envs.export.environment import environment_model
from pam_envs.export.toolchain import OBJECTS, emit_object, host_platform
from pam_envs.plants.single_muscle.rollout import simulate

HEADS = {
    "x86_64-linux": b"\x7fELF\x02",
    "aarch64-linux": b"\x7fELF\x02",
    "cortex-m7": b"\x7fELF\x01",
    "x86_64-windows": b"\x64\x86",
    "x86_64-darwin": b"\xcf\xfa\xed\xfe",
    "aarch64-darwin": b"\xcf\xfa\xed\xfe",
}
"""First bytes of object files: ELF, COFF, Mach-O."""
MACHINES = {"x86_64-linux": 62, "aarch64-linux": 183, "cortex-m7": 40}
"""Processors in ELF files."""


def test_thousand_steps_in_c_have_the_bits_of_python(case, tmp_path: Path) -> None:
    export_c(case.model, tmp_path, [host_platform()])
    assert differing(run_c(case.model, tmp_path, case.actions), case.reference) == 0


def test_plant_in_c_has_the_bits_of_its_rollout(tmp_path: Path) -> None:
    plant, model = plant_of("single_muscle"), model_of("single_muscle")
    export_c(model, tmp_path, [host_platform()])
    inputs = np.tile([v.start for v in model.inputs], (60, 1))
    inputs[:, 0] = np.repeat([3e5, 1e5, 5e5], 20)
    rows = run_c(model, tmp_path, inputs)
    reference = simulate(plant, inputs[:, 0])
    assert [v.name for v in model.outputs] == [f"output.{name}" for name in reference]
    assert differing(rows[1:], np.array(list(reference.values())).T.copy()) == 0
    assert rows[0, 2] == 0.0 < rows[-1, 2]  # no pressure at the beginning


@pytest.mark.parametrize("platform", OBJECTS)
def test_object_is_of_its_processor(small, platform: str) -> None:
    data = emit_object(small.model, platform)
    assert data.startswith(HEADS[platform])
    if platform in MACHINES:
        assert int.from_bytes(data[18:20], "little") == MACHINES[platform]
    assert f"{small.model.prefix}_kernel".encode() in data


def test_every_variable_is_in_the_header_with_its_unit(small, tmp_path: Path) -> None:
    export_c(small.model, tmp_path, [])
    text = (tmp_path / f"{small.model.name}.h").read_text()
    for variable in (*small.model.inputs, *small.model.outputs, *small.model.parameters):
        unit = "" if variable.unit == "1" else f" [{variable.unit}]"
        assert f"/* {variable.name}{unit}" in text
    assert small.model.digest in text


def test_digest_depends_on_the_plant(small) -> None:
    env: Any = gym.make("PAM/MusclePositioning-v0").unwrapped
    plant = env.plant.replace({"mass.damping": 300.0})
    changed: Any = gym.make("PAM/MusclePositioning-v0", plant=plant).unwrapped
    other = environment_model("PAM/MusclePositioning-v0", changed)
    assert other.digest != small.model.digest == model_of("MusclePositioning").digest


@pytest.mark.parametrize("value", [0.1, -0.0, 1e-310, 6.02e23, 3])
def test_literals_keep_every_bit(value: float) -> None:
    text = literal(np.asarray(value)[()])
    read = float.fromhex(text) if "0x" in text else float(text)
    assert read.hex() == float(value).hex()


def test_number_that_c_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="nan"):
        literal(np.float64("nan"))
