"""PTX: one environment a thread, step and restart as two kernels, coalesced rows."""

import importlib.util
import json
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.envs.core.lanes import ARCHITECTURE, PARTS, LaneKernel
from pam_envs.export.model import Model


def ptx_of(model: Model, part: str, architecture: str = ARCHITECTURE) -> str:
    """Return the PTX of one part, ``"step"`` or ``"restart"``, of an environment."""
    if not model.episodic:
        raise ValueError(
            "PTX is for environments, not for plants: give the id of an environment, or export "
            "the plant as C"
        )
    kernel = LaneKernel(model.kernels["kernel"], part)
    return kernel.ptx(f"{model.prefix}_{part}", architecture).decode()


def export_ptx(model: Model, folder: Path, architecture: str = ARCHITECTURE) -> None:
    """Write a PTX file for each part, the constant arrays, a layout file and README."""
    folder.mkdir(parents=True, exist_ok=True)
    said = {}
    for part in PARTS:
        path = folder / f"{model.name}_{part}.ptx"
        path.write_text(ptx_of(model, part, architecture), encoding="utf-8")
        said[part] = assembled(path, architecture)
    tables, samples, settings, choices = (
        model.block(name).values for name in ("tables", "samples", "settings", "choices")
    )
    np.savez(
        folder / f"{model.name}_constants.npz",
        tables=tables, samples=samples, settings=settings, choices=choices,
    )  # fmt: skip
    (folder / "layout.json").write_text(
        json.dumps(layout(model), indent=1) + "\n", encoding="utf-8"
    )
    (folder / "README.md").write_text(readme(model, said), encoding="utf-8")


def layout(model: Model) -> dict[str, Any]:
    """Return shape and type of every array of the address book, N for the number of lanes."""
    shapes: dict[str, list[Any]] = {
        name: [model.block(name).values.shape[1], "N"] for name in ("rows", "counts", "ahead")
    }
    own = {
        **shapes,
        "fixed": [model.block("fixed").values.shape[1], "N"],
        "action": ["N", len(model.inputs)],
        "observation": [1, "N", model.block("observation").values.shape[2]],
        "report": [1, model.block("report").values.shape[1], "N"],
        "flags": [3, "N"],
    }
    found = []
    for block in model.blocks:
        shape = own.get(block.name, list(block.values.shape))
        found.append({"name": block.name, "type": block.values.dtype.name, "shape": shape})
    return {"digest": model.digest, "period": model.period, "book": found}


def assembled(path: Path, architecture: str = ARCHITECTURE) -> str:
    """Return what ``ptxas`` says about registers and spills, or that it is not installed."""
    ptxas = find_ptxas()
    if ptxas is None:
        return "not assembled: ptxas is not installed"
    with tempfile.TemporaryDirectory() as work:
        done = subprocess.run(
            [ptxas, f"-arch={architecture}", "-v", str(path), "-o", f"{work}/out.cubin"],
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        raise RuntimeError(f"ptxas refused {path}: {done.stderr.strip()[-1000:]}")
    lines = [line.removeprefix("ptxas info    :").strip() for line in done.stderr.splitlines()]
    return "; ".join(line for line in lines if "registers" in line or "spill" in line)


def find_ptxas() -> str | None:
    """Return the path of ``ptxas``: of the CUDA toolkit, or of the package nvidia-cuda-nvcc."""
    if found := shutil.which("ptxas"):
        return found
    package = importlib.util.find_spec("nvidia")
    roots = package.submodule_search_locations if package is not None else None
    places = [p for root in roots or () for p in Path(root).glob("*/bin/ptxas")]
    return str(places[0]) if places else None


def readme(model: Model, said: dict[str, str]) -> str:
    """Return the page of a folder with PTX."""
    assembly = "\n".join(f"- `{part}`: {text}" for part, text in said.items())
    p = model.prefix
    return f"""# {model.title} as PTX

`{p}_step(int64_t *book, int64_t number)` steps environment `i` of a batch in thread `i`;
`{p}_restart` starts an episode of those whose flags are set: the next one, or with `flags[0] = 2`
the one that `counts[2]` gives. `layout.json` lists the arrays of the address book in order. It
holds four 64-bit words for each: device address and up to three sizes. State, parameters, whole
numbers and previews have the shape (rows, N), so that neighbouring threads read neighbouring
addresses. `{model.name}_constants.npz` has the arrays that all share.

The last two rows of `counts` are the key words of the seed (`pam_envs.kernels.random.seed_words`).

Arithmetic is in float64 and without fused multiply-add. The kernels are those of
`gym.make_vec(..., device="cuda")`, whose bits on a GPU are those of pam-envs on a CPU.

{assembly}

{chr(10).join(f"- {line}" for line in model.lines)}
"""
