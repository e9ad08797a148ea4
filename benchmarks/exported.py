"""Exported environments compared with Python, bit by bit, and their sizes and speeds."""

import gzip
import math
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from pam_envs.arrays import Array
from pam_envs.export.c import export_c
from pam_envs.export.command import model_of
from pam_envs.export.fmu import dotted, export_fmu
from pam_envs.export.model import Model
from pam_envs.export.toolchain import host_platform, native_compiler
from pam_envs.export.wasm import export_wasm

SEED, STEPS = 17, 1000


def drive(env: Any, steps: int = STEPS) -> Array:
    """Return random actions that are held for five control periods, shape (steps, n)."""
    space = env.action_space
    held = np.random.default_rng(3).uniform(space.low, space.high, (-(-steps // 5), *space.shape))
    return np.repeat(held, 5, axis=0)[:steps].astype(np.float32).astype(float)


def expected(env: Any, actions: Array, seed: int = SEED) -> Array:
    """Return the outputs of the start and of every step in Python, shape (steps + 1, outputs)."""
    observation, info = env.reset(seed=seed)
    rows = [[*observation, 0.0, *info.values(), False, False]]
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        rows.append([*observation, reward, *info.values(), terminated, truncated])
    return np.array(rows, float)


def differing(a: Array, b: Array) -> int:
    """Return the number of bits that differ between two arrays of one shape."""
    if a.shape != b.shape:
        raise ValueError(f"outputs of shape {a.shape} are compared with {b.shape}")
    words = np.ascontiguousarray(a).view(np.uint64) ^ np.ascontiguousarray(b).view(np.uint64)
    return int(np.bitwise_count(words).sum())


def run_c(model: Model, folder: Path, actions: Array, seed: int = SEED) -> Array:
    """Compile the example of an exported folder without Python, and return its outputs."""
    kernel = f"objects/{host_platform()}/{model.name}_kernel.o"
    flags = ["-O2", "-std=c99", "-Wall", "-Wextra", "-Werror"]
    command = [*native_compiler(), *flags, "example.c", f"{model.name}.c", kernel, "-o", "example"]
    subprocess.run(command, cwd=folder, check=True)
    lines = "\n".join(" ".join(float(v).hex() for v in row) for row in actions)
    done = subprocess.run(
        [folder / "example", str(seed)], input=lines, capture_output=True, text=True, check=True
    )
    return np.array([[float.fromhex(w) for w in row.split()] for row in done.stdout.splitlines()])


def time_c(folder: Path, steps: int = 200_000) -> float:
    """Return steps per second of the compiled example."""
    began = time.perf_counter()
    command = [str(folder / "example"), str(SEED), str(steps)]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return steps / (time.perf_counter() - began)


def time_wasm(folder: Path, steps: int = 100_000) -> float:
    """Return steps per second in Node, NaN without it."""
    node = shutil.which("node")
    if node is None:
        return math.nan
    command = [node, "example.mjs", str(SEED), str(steps)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return float(done.stderr.split()[0])


class WasmModel:
    """An exported WebAssembly module in wasmtime."""

    def __init__(self, model: Model, folder: Path) -> None:
        import wasmtime

        self._store = wasmtime.Store()
        code = wasmtime.Module.from_file(self._store.engine, str(folder / f"{model.name}.wasm"))
        self._names: Any = wasmtime.Instance(self._store, code, []).exports(self._store)
        self.call("init")
        memory: Any = self._names["memory"]
        view: Any = memory.get_buffer_ptr(self._store, memory.data_len(self._store))
        cells = np.frombuffer(view, np.uint8)

        def at(name: str, count: int) -> Array:
            first = self.call(name)
            return cells[first : first + 8 * count].view(float)

        self.inputs = at("inputs", len(model.inputs))
        self.outputs = at("outputs", len(model.outputs))
        self.parameters = at("parameters", len(model.parameters))

    def call(self, name: str, *arguments: int) -> Any:
        """Call an exported function."""
        return self._names[name](self._store, *arguments)


def run_wasm(model: Model, folder: Path, actions: Array, seed: int = SEED) -> Array:
    """Return the outputs of the WebAssembly module in wasmtime."""
    made = WasmModel(model, folder)
    made.call("reset", seed & 0xFFFFFFFF, seed >> 32)
    rows = [made.outputs.copy()]
    for action in actions:
        made.inputs[:] = action
        made.call("step")
        rows.append(made.outputs.copy())
    return np.array(rows)


class FmuModel:
    """An exported FMU in fmpy."""

    def __init__(self, model: Model, path: Path, work: Path) -> None:
        import fmpy
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        described = fmpy.read_model_description(str(path))
        place = fmpy.extract(str(path), str(work))
        self.three = described.fmiVersion == "3.0"
        self.references = {v.name: v.valueReference for v in described.modelVariables}
        kind = FMU3Slave if self.three else FMU2Slave
        self.slave = kind(
            guid=described.guid or described.instantiationToken,
            unzipDirectory=place,
            modelIdentifier=described.coSimulation.modelIdentifier,
            instanceName=model.name,
        )
        self.slave.instantiate()
        self._model = model
        self._time = 0.0
        self._inputs = [self.references[f"input.{dotted(v)}"] for v in model.inputs]
        self._flags = [self.references[v.name] for v in model.outputs if v.block == "flags"]
        numbers = (v for v in model.outputs if v.block != "flags")
        self._numbers = [self.references[dotted(v)] for v in numbers]

    def start(self, seed: int | None = None, **parameters: float) -> None:
        """Initialise with a seed and with parameters (``__`` for the dot)."""
        if self.three:
            self.slave.enterInitializationMode(startTime=0.0)
        else:
            self.slave.setupExperiment(startTime=0.0)
            self.slave.enterInitializationMode()
        if seed is not None:
            put = self.slave.setInt64 if self.three else self.slave.setInteger
            put([self.references["seed"]], [seed])
        for name, value in parameters.items():
            self.set([self.references[f"parameter.{name.replace('__', '.')}"]], [value])
        self.slave.exitInitializationMode()

    def set(self, references: list[int], values: list[float]) -> None:
        """Set numbers."""
        put = self.slave.setFloat64 if self.three else self.slave.setReal
        put(references, values)

    def step(self, action: Array) -> None:
        """Apply inputs for one control period."""
        self.set(self._inputs, [float(v) for v in action])
        period = self._model.period
        self.slave.doStep(currentCommunicationPoint=self._time, communicationStepSize=period)
        self._time += period

    def outputs(self) -> list[float]:
        """Return every output."""
        get = self.slave.getFloat64 if self.three else self.slave.getReal
        flags = self.slave.getBoolean(self._flags) if self._flags else []
        return [*get(self._numbers), *map(float, flags)]

    def close(self) -> None:
        """End the simulation and unload the library."""
        self.slave.terminate()
        self.slave.freeInstance()


def run_fmu(model: Model, path: Path, actions: Array, seed: int | None = SEED) -> Array:
    """Return the outputs of the FMU in fmpy."""
    with tempfile.TemporaryDirectory() as work:
        made = FmuModel(model, path, Path(work))
        made.start(seed)
        rows = [made.outputs()]
        for action in actions:
            made.step(action)
            rows.append(made.outputs())
        made.close()
    return np.array(rows, float)


@dataclass(frozen=True)
class Row:
    """Figures of one environment."""

    name: str
    c_bits: int
    wasm_bits: int
    fmu_bits: int
    fmu2_bits: int
    problems: int
    """Of fmpy's validation of both FMUs."""
    c_bytes: int
    wasm_bytes: int
    wasm_packed: int
    fmu_bytes: int
    c_rate: float
    wasm_rate: float
    """Steps per second on one core, of WebAssembly in Node."""
    c_seconds: float
    wasm_seconds: float
    fmu_seconds: float
    """To export, with IR in the cache."""


def measure(steps: int = STEPS) -> Iterator[Row]:
    """Export every environment and compare it with Python."""
    from fmpy.validation import validate_fmu

    for env_id in sorted(name for name in gym.registry if name.startswith("PAM/")):
        env: Any = gym.make(env_id).unwrapped
        actions = drive(env, steps)
        reference = expected(env, actions)
        model = model_of(env_id)
        _ = model.intermediates  # compiled at most once on a machine
        with tempfile.TemporaryDirectory() as work:
            folder = Path(work)
            seconds = []
            for name, export in (("c", export_c), ("wasm", export_wasm), ("fmu", export_fmu)):
                began = time.perf_counter()
                export(model, folder / name)
                seconds.append(time.perf_counter() - began)
            three, two = (folder / "fmu" / f"{model.name}{end}.fmu" for end in ("", "_fmi2"))
            wasm = (folder / "wasm" / f"{model.name}.wasm").read_bytes()
            c_bits = differing(run_c(model, folder / "c", actions), reference)
            wasm_bits = differing(run_wasm(model, folder / "wasm", actions), reference)
            kernel = folder / "c" / "objects" / host_platform() / f"{model.name}_kernel.o"
            yield Row(
                env_id,
                c_bits,
                wasm_bits,
                differing(run_fmu(model, three, actions), reference),
                differing(run_fmu(model, two, actions), reference),
                sum(len(validate_fmu(str(path))) for path in (three, two)),
                kernel.stat().st_size,
                len(wasm),
                len(gzip.compress(wasm, 9)),
                three.stat().st_size,
                time_c(folder / "c"),
                time_wasm(folder / "wasm"),
                *seconds,
            )
        env.close()


def table(rows: list[Row]) -> str:
    """Return the figures as a Markdown table."""
    lines = [
        "| environment | differing bits: C | wasm | FMI 3.0 | FMI 2.0 | FMU problems | object, kB "
        "| wasm, kB | gzipped, kB | FMU, kB | C, steps/s | wasm, steps/s "
        "| export, s: C | wasm | FMU |",
        "|---" * 15 + "|",
    ]
    for r in rows:
        cells = (
            r.name, r.c_bits, r.wasm_bits, r.fmu_bits, r.fmu2_bits, r.problems,
            f"{r.c_bytes / 1e3:.0f}", f"{r.wasm_bytes / 1e3:.0f}", f"{r.wasm_packed / 1e3:.1f}",
            f"{r.fmu_bytes / 1e3:.0f}", f"{r.c_rate:,.0f}", f"{r.wasm_rate:,.0f}",
            f"{r.c_seconds:.1f}", f"{r.wasm_seconds:.1f}", f"{r.fmu_seconds:.1f}",
        )  # fmt: skip
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)
