"""WebAssembly: one module without imports, and a JavaScript class with named signals."""

import gzip
import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pam_envs.export.c import readme_body, write_sources
from pam_envs.export.model import Model, Variable
from pam_envs.export.toolchain import WASM, run, zig
from pam_envs.kernels.emission import emit

_EXPORTS = ("init", "reset", "next_episode", "step", "inputs", "outputs", "parameters")
_STATE = ("state", "state_size")


def export_wasm(model: Model, folder: Path) -> None:
    """Write ``NAME.wasm``, ``NAME.mjs``, an example and README."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{model.name}.wasm").write_bytes(link(model))
    (folder / f"{model.name}.mjs").write_text(script(model), encoding="utf-8")
    (folder / "example.mjs").write_text(example(model), encoding="utf-8")
    (folder / "README.md").write_text(readme(model), encoding="utf-8")


def link(model: Model) -> bytes:
    """Return the linked module.

    Raises
    ------
    OSError
        If there is no linker for WebAssembly.
    """
    with tempfile.TemporaryDirectory() as work:
        place = Path(work)
        write_sources(model, place)
        (place / "interface.c").write_text(interface(model), encoding="utf-8")
        (place / "kernel.o").write_bytes(emit(model.intermediates, WASM))
        names = [*_EXPORTS, *_STATE]
        exports = [f"-Wl,--export={name}" for name in names]
        flags = [
            "-Os",
            "-std=c99",
            "-DPAM_WITHOUT_NAMES",
            "-Wl,--no-entry",
            "-Wl,--strip-all",
            *exports,
        ]
        run([*_compiler(), *flags, "interface.c", "kernel.o", "-o", "model.wasm"], place)
        return (place / "model.wasm").read_bytes()


def _compiler() -> list[str]:
    found = zig()
    features = "-mcpu=generic+simd128+bulk_memory+nontrapping_fptoint"
    if found is not None:
        return [*found, "-target", "wasm32-freestanding", features]
    if shutil.which("clang") and shutil.which("wasm-ld"):
        flags = ["-msimd128", "-mbulk-memory", "-mnontrapping-fptoint", "-nostdlib"]
        return ["clang", "--target=wasm32-unknown-unknown", *flags]
    raise OSError(
        'linking WebAssembly needs zig (pip install "pam-envs[export]") or clang with wasm-ld '
        "(Debian: clang lld)"
    )


def interface(model: Model) -> str:
    """Return the C functions that the module exports: one instance, in fixed memory."""
    p = model.prefix
    count, n = len(model.outputs), len(model.inputs)
    if model.episodic:
        begin = f"""void reset(uint32_t low, uint32_t high) {{
    take();
    {p}_reset(&model, ((uint64_t)high << 32) | low);
    write();
}}

void next_episode(void) {{
    take();
    {p}_next_episode(&model);
    write();
}}"""
    else:
        begin = f"""void reset(uint32_t low, uint32_t high) {{
    (void)low, (void)high;
    take();
    {p}_reset(&model, given);
    write();
}}

void next_episode(void) {{
    reset(0, 0);
}}"""
    starts = ", ".join(float(v.start).hex() for v in model.inputs)
    return f"""#include "{model.name}.c"

static {p} model;
static double given[{n}] = {{{starts}}};
static double found[{count}];
static double changed[{max(1, len(model.parameters))}];

static void write(void) {{
    for (int k = 0; k < {count}; k++)
        found[k] = {p}_output(&model, k);
}}

static void take(void) {{
    for (int k = 0; k < {len(model.parameters)}; k++)
        *{p}_parameter(&model, k) = changed[k];
}}

void init(void) {{
    {p}_init(&model);
    for (int k = 0; k < {len(model.parameters)}; k++)
        changed[k] = *{p}_parameter(&model, k);
}}

{begin}

void step(void) {{
    {p}_step(&model, given);
    write();
}}

double *inputs(void) {{
    return given;
}}

double *outputs(void) {{
    return found;
}}

double *parameters(void) {{
    return changed;
}}

void *state(void) {{
    return &model;
}}

uint32_t state_size(void) {{
    return sizeof model;
}}
"""


def description(model: Model) -> dict[str, Any]:
    """Return what the JavaScript class needs to know of a model, as plain values."""

    def listed(variables: Sequence[Variable]) -> list[dict[str, Any]]:
        words = ("name", "unit", "start", "low", "high")
        return [{word: getattr(v, word) for word in words} for v in variables]

    return {
        "digest": model.digest,
        "period": model.period,
        "inputs": listed(model.inputs),
        "outputs": listed(model.outputs),
        "parameters": listed(model.parameters),
    }


INSTANCE = (Path(__file__).parent / "instance.js").read_text(encoding="utf-8")
"""JavaScript class of an instance of a module."""


def script(model: Model) -> str:
    """Return the JavaScript module."""
    exported = "\n".join(
        f"export const {name} = {json.dumps(value, indent=1)};{' // s' if name == 'period' else ''}"
        for name, value in description(model).items()
    )
    return f"""// {model.title}, exported from the kernels of pam-envs. All quantities are SI.
{exported}

{INSTANCE}
export class Model extends Instance {{
  // source: the bytes of {model.name}.wasm, or a WebAssembly.Module
  static async create(source) {{
    const made = source instanceof WebAssembly.Module ? source : await WebAssembly.compile(source);
    return new Model(await WebAssembly.instantiate(made, {{}}), {{ inputs, outputs, parameters }});
  }}
}}
"""


def example(model: Model) -> str:
    """Return a program for Node that prints the bits of every output of some steps."""
    return f"""// node example.mjs SEED < inputs
// A line of inputs is one control period. Prints the bits of every output of the start and of each
// step as hexadecimal numbers.
// node example.mjs SEED STEPS: constant inputs; prints the bits after the last step.
import {{ readFileSync }} from "node:fs";
import {{ Model, inputs }} from "./{model.name}.mjs";

const seed = Number(process.argv[2] ?? 17), steps = Number(process.argv[3] ?? 0);
const file = new URL("./{model.name}.wasm", import.meta.url);
const model = await Model.create(readFileSync(file));
const print = (values) => {{
  const bits = new BigUint64Array(values.slice().buffer);
  console.log(Array.from(bits, (b) => b.toString(16)).join(" "));
}};
model.reset(seed);
if (steps > 0) {{
  const constant = inputs.map((i) => i.start), begun = performance.now();
  for (let k = 0; k < steps; k++) model.step(constant);
  console.error(`${{Math.round((1000 * steps) / (performance.now() - begun))}} steps per second`);
  print(model.outputs);
}} else {{
  print(model.outputs);
  for (const line of readFileSync(0, "utf8").trim().split("\\n"))
    print(model.step(line.split(" ").map(Number)));
}}
"""


def readme(model: Model) -> str:
    """Return the page of a folder with WebAssembly."""
    return f"""# {model.title} in WebAssembly

`{model.name}.wasm` imports nothing. `{model.name}.mjs` has the class `Model` with named inputs,
outputs and parameters; it runs in browsers and in Node. Outputs are {model.agreement}.

    node example.mjs 17 1000

{readme_body(model)}"""


def packed_size(data: bytes) -> int:
    """Return the size of data as a web server sends them."""
    return len(gzip.compress(data, 9))
