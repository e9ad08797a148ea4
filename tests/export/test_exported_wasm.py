"""WebAssembly: equal bits, size, and the JavaScript class."""

import gzip
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks.exported import SEED, WasmModel, differing, run_wasm
from pam_envs.export.wasm import export_wasm

pytest.importorskip("wasmtime")
pytest.importorskip("ziglang")
MOST = 40_000
"""Bytes, gzipped, of one environment."""
NODE = shutil.which("node")


@pytest.fixture(scope="module")
def exported(case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of an environment."""
    folder = tmp_path_factory.mktemp("wasm")
    export_wasm(case.model, folder)
    return folder


def test_thousand_steps_in_wasm_have_the_bits_of_python(case, exported: Path) -> None:
    assert differing(run_wasm(case.model, exported, case.actions), case.reference) == 0


def test_second_reset_gives_the_outputs_of_the_first(case, exported: Path) -> None:
    made = WasmModel(case.model, exported)
    made.call("reset", SEED, 0)
    for action in case.actions[:50]:
        made.inputs[:] = action
        made.call("step")
    made.call("reset", SEED, 0)
    assert differing(made.outputs, case.reference[0]) == 0


def test_module_is_small_and_imports_nothing(case, exported: Path) -> None:
    import wasmtime

    path = exported / f"{case.model.name}.wasm"
    assert len(gzip.compress(path.read_bytes(), 9)) <= MOST
    assert not wasmtime.Module.from_file(wasmtime.Engine(), str(path)).imports


@pytest.mark.skipif(NODE is None, reason="node is not installed")
def test_javascript_class_gives_the_same_bits(case, exported: Path) -> None:
    lines = "\n".join(" ".join(repr(float(v)) for v in row) for row in case.actions)
    done = subprocess.run(
        [str(NODE), "example.mjs", "17"],
        cwd=exported,
        input=lines,
        capture_output=True,
        text=True,
        check=True,
    )
    words = [[int(word, 16) for word in line.split()] for line in done.stdout.splitlines()]
    assert differing(np.array(words, np.uint64).view(float), case.reference) == 0


pytestmark = pytest.mark.xdist_group("exported_wasm")  # each module is built once

CHECK = """
import {{ readFileSync }} from "node:fs";
import {{ Model, parameters }} from "./{name}.mjs";

const model = await Model.create(readFileSync("./{name}.wasm"));
const at = () => model.get("info.state/pressure");
model.reset(3);
for (let k = 0; k < 20; k++) model.step([0.5]);
const saved = model.save();
model.step([1]);
const after = at();
model.restore(saved);
model.step([1]);
console.log(at() === after);
const heavy = parameters.find((p) => p.name === "mass.damping");
model.set("mass.damping", heavy.high);
try {{ model.set("mass.damping", 2 * heavy.high); }} catch (e) {{ console.log(e.message); }}
try {{ model.get("nothing"); }} catch (e) {{ console.log(e.message); }}
"""


@pytest.mark.skipif(NODE is None, reason="node is not installed")
def test_javascript_class_saves_states_and_refuses_bad_values(small, tmp_path: Path) -> None:
    export_wasm(small.model, tmp_path)
    (tmp_path / "check.mjs").write_text(CHECK.format(name=small.model.name))
    command = [str(NODE), "check.mjs"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    same, high, unknown = done.stdout.splitlines()
    assert same == "true"
    assert "mass.damping" in high
    assert "must be from" in high
    assert "no output named nothing" in unknown
