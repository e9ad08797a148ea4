"""FMU: co-simulation for FMI 3.0 and FMI 2.0, with binaries for one or several platforms."""

import html
import tempfile
import uuid
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from pam_envs.export.c import literal, readme_body, write_sources
from pam_envs.export.model import Model, Variable
from pam_envs.export.toolchain import (
    ZIG,
    cross_compiler,
    emit_object,
    host_platform,
    native_compiler,
    run,
)

_FMI = Path(__file__).with_name("fmi")
OUTPUT, PARAMETER, SEED = 10000, 20000, 30000
"""First value references, as in ``fmi/component.h``; inputs begin at 1, 0 is the time."""
_PLATFORM2 = {"x86_64-linux": "linux64", "x86_64-windows": "win64", "x86_64-darwin": "darwin64"}
"""Names of platforms in FMI 2.0, which has no ARM."""
_SUFFIX = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}
_BASE = {
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "N m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "N m s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
    "N/m": {"kg": 1, "s": -2},
    "kg": {"kg": 1},
    "K": {"K": 1},
    "s": {"s": 1},
    "1": {},
}
"""Exponents of base units, where they are known; other units have a name only."""


def export_fmu(model: Model, folder: Path, platforms: Iterable[str] = ()) -> None:
    """Write ``NAME.fmu`` (FMI 3.0), ``NAME_fmi2.fmu``, an example and README.

    Parameters
    ----------
    platforms : iterable of str
        Platforms of ``toolchain.ZIG`` besides this one; they need zig.
    """
    folder.mkdir(parents=True, exist_ok=True)
    every = list(dict.fromkeys([host_platform(), *platforms]))
    with tempfile.TemporaryDirectory() as work:
        place = Path(work)
        write_sources(model, place)
        (place / "fmi_model.h").write_text(fmi_header(model), encoding="utf-8")
        for name in ("component.h", "instance.h", "fmi2.c", "fmi3.c"):
            (place / name).write_text((_FMI / name).read_text(encoding="utf-8"), encoding="utf-8")
        binaries = {platform: _link(model, place, platform) for platform in every}
    page = documentation(model)
    three = {f"binaries/{p}/{model.name}{_suffix(p)}": made[0] for p, made in binaries.items()}
    two = {
        f"binaries/{_PLATFORM2[p]}/{model.name}{_suffix(p)}": made[1]
        for p, made in binaries.items()
        if p in _PLATFORM2
    }
    _pack(folder / f"{model.name}.fmu", description3(model), page, three)
    if two:
        _pack(folder / f"{model.name}_fmi2.fmu", description2(model), page, two)
    (folder / "example.py").write_text(example(model), encoding="utf-8")
    (folder / "README.md").write_text(readme(model, every), encoding="utf-8")


def _suffix(platform: str) -> str:
    return _SUFFIX[platform.rpartition("-")[2]]


def _link(model: Model, place: Path, platform: str) -> tuple[bytes, bytes]:
    """Return the shared libraries of FMI 3.0 and 2.0 for a platform."""
    if platform not in ZIG:
        raise ValueError(f"platform = {platform!r}; choose one of {', '.join(ZIG)}")
    compiler = native_compiler() if platform == host_platform() else cross_compiler(platform)
    if compiler is None:
        raise OSError(
            f'to link for {platform} on {host_platform()}, pip install "pam-envs[export]" (zig)'
        )
    kernel = f"kernel-{platform}.o"
    (place / kernel).write_bytes(emit_object(model, platform))
    made = []
    for interface in ("fmi3", "fmi2"):
        out = f"{interface}-{platform}{_suffix(platform)}"
        flags = ["-O2", "-std=c99", "-shared", "-s", "-fvisibility=hidden"]
        if not platform.endswith("windows"):
            flags.append("-fPIC")
        run([*compiler, *flags, f"{interface}.c", f"{model.name}.c", kernel, "-o", out], place)
        made.append((place / out).read_bytes())
    return made[0], made[1]


def fmi_header(model: Model) -> str:
    """Return the header that names the model for ``fmi/component.h``."""
    p = model.prefix
    starts = ", ".join(literal(v.start) for v in model.inputs)
    lows = ", ".join(literal(v.low or 0.0) for v in model.parameters) or "0"
    highs = ", ".join(literal(v.high or 0.0) for v in model.parameters) or "0"
    aliases = "\n".join(
        f"#define MODEL_{word} {p}_{word}"
        for word in ("init", "reset", "step", "output", "parameter")
    )
    return f"""#include "{model.name}.h"

#define MODEL {p}
#define MODEL_NAME "{model.name}"
{aliases}
#define TOKEN "{token(model)}"
#define PERIOD {literal(model.period)}
#define EPISODIC {int(model.episodic)}
#define INPUTS {len(model.inputs)}u
#define OUTPUTS {len(model.outputs)}u
#define PARAMETERS {len(model.parameters)}u
#define INPUT_STARTS {{{starts}}}
#define PARAMETER_LOW {{{lows}}}
#define PARAMETER_HIGH {{{highs}}}
"""


def token(model: Model) -> str:
    """Return the token by which an FMU recognises its library: from the digest."""
    return f"{{{uuid.UUID(model.digest[:32])}}}"


def dotted(variable: Variable) -> str:
    """Return a name in the structured naming convention: ``info.reward.tracking``."""
    return variable.name.replace("/", ".")


class Declared(NamedTuple):
    """A variable of a model description.

    ``kind`` is "number", "flag" or "seed"; ``variable`` has unit and bounds, None for the seed.
    """

    name: str
    reference: int
    kind: str
    causality: str
    variability: str
    variable: Variable | None = None


def declared(model: Model) -> Iterator[Declared]:
    """Yield inputs, outputs, parameters and the seed of a model."""
    for k, v in enumerate(model.inputs):
        yield Declared(f"input.{dotted(v)}", 1 + k, "number", "input", "continuous", v)
    for k, v in enumerate(model.outputs):
        kind, variability = ("flag", "discrete") if _flag(v) else ("number", "continuous")
        yield Declared(dotted(v), OUTPUT + k, kind, "output", variability, v)
    for k, v in enumerate(model.parameters):
        name = f"parameter.{dotted(v)}"
        yield Declared(name, PARAMETER + k, "number", "parameter", "fixed", v)
    if model.episodic:
        yield Declared("seed", SEED, "seed", "parameter", "fixed")


def description3(model: Model) -> str:
    """Return ``modelDescription.xml`` of FMI 3.0."""
    root = _root(model, "3.0", instantiationToken=token(model))
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model.name,
        canHandleVariableCommunicationStepSize="false",
        fixedInternalStepSize=repr(model.period),
        canGetAndSetFMUState="true",
        canSerializeFMUState="true",
    )
    _units(model, root)
    _experiment(model, root)
    variables = ElementTree.SubElement(root, "ModelVariables")
    ElementTree.SubElement(
        variables, "Float64", name="time", valueReference="0", causality="independent",
        variability="continuous", unit="s",
    )  # fmt: skip
    types = {"number": "Float64", "flag": "Boolean", "seed": "Int64"}
    for d in declared(model):
        made = _variable(variables, types[d.kind], d)
        if d.causality == "output":
            made.set("initial", "calculated")
        _describe(made, made, d)
    structure = ElementTree.SubElement(root, "ModelStructure")
    for kind in ("Output", "InitialUnknown"):
        for k in range(len(model.outputs)):
            ElementTree.SubElement(structure, kind, valueReference=str(OUTPUT + k))
    return _text(root)


def description2(model: Model) -> str:
    """Return ``modelDescription.xml`` of FMI 2.0."""
    root = _root(model, "2.0", guid=token(model))
    ElementTree.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=model.name,
        canHandleVariableCommunicationStepSize="false",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    _units(model, root)
    _experiment(model, root)
    variables = ElementTree.SubElement(root, "ModelVariables")
    types = {"number": "Real", "flag": "Boolean", "seed": "Integer"}
    initial = {"output": "calculated", "parameter": "exact"}
    for d in declared(model):
        made = _variable(variables, "ScalarVariable", d)
        if d.causality in initial:
            made.set("initial", initial[d.causality])
        _describe(made, ElementTree.SubElement(made, types[d.kind]), d)
    structure = ElementTree.SubElement(root, "ModelStructure")
    first = 1 + len(model.inputs)
    for kind in ("Outputs", "InitialUnknowns"):
        listed = ElementTree.SubElement(structure, kind)
        for k in range(len(model.outputs)):
            ElementTree.SubElement(listed, "Unknown", index=str(first + k))
    return _text(root)


def _root(model: Model, version: str, **identity: str) -> ElementTree.Element:
    return ElementTree.Element(
        "fmiModelDescription",
        {
            "fmiVersion": version,
            "modelName": model.name,
            **identity,
            "description": model.title,
            "version": model.digest[:16],
            "generationTool": "pam-envs",
            "variableNamingConvention": "structured",
        },
    )


def _variable(parent: ElementTree.Element, tag: str, d: Declared) -> ElementTree.Element:
    return ElementTree.SubElement(
        parent, tag, name=d.name, valueReference=str(d.reference), causality=d.causality,
        variability=d.variability,
    )  # fmt: skip


def _describe(outer: ElementTree.Element, typed: ElementTree.Element, d: Declared) -> None:
    """Set description, unit, bounds and start value; FMI 2.0 has all but the first in ``typed``."""
    v = d.variable
    if v is None:
        outer.set("description", "seed of the episode")
        typed.set("start", "0")
        typed.set("min", "0")
    elif d.kind == "number":
        if v.text or v.meant:
            outer.set("description", v.text or f"-1 .. 1 for {v.meant}")
        typed.set("unit", v.unit)
        if v.low is not None and v.high is not None:
            typed.set("min", repr(float(v.low)))
            typed.set("max", repr(float(v.high)))
        if d.causality != "output":
            typed.set("start", repr(float(v.start)))


def _flag(variable: Variable) -> bool:
    return variable.block == "flags"


def _units(model: Model, root: ElementTree.Element) -> None:
    used = {v.unit for v in (*model.inputs, *model.outputs, *model.parameters)} | {"s"}
    parent = ElementTree.SubElement(root, "UnitDefinitions")
    for name in sorted(used):
        unit = ElementTree.SubElement(parent, "Unit", name=name)
        if name in _BASE:
            base = ElementTree.SubElement(unit, "BaseUnit")
            for dimension, power in _BASE[name].items():
                base.set(dimension, str(power))


def _experiment(model: Model, root: ElementTree.Element) -> None:
    ElementTree.SubElement(
        root, "DefaultExperiment", startTime="0", stopTime="10", stepSize=repr(model.period)
    )


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, "unicode") + "\n"


def _pack(path: Path, description: str, page: str, binaries: dict[str, bytes]) -> None:
    files = {
        "modelDescription.xml": description.encode(),
        "documentation/index.html": page.encode(),
        **binaries,
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)  # without the time of the export
            entry.compress_type = zipfile.ZIP_DEFLATED
            packed.writestr(entry, data)


def documentation(model: Model) -> str:
    """Return the page inside the FMU."""
    body = html.escape(f"{model.title}\n\n{readme_body(model)}")
    title = html.escape(model.title)
    return f'<!DOCTYPE html><meta charset="utf-8"><title>{title}</title><pre>{body}</pre>\n'


def example(model: Model) -> str:
    """Return a program that simulates the FMU with fmpy."""
    first = dotted(model.outputs[0])
    return f'''"""Simulate {model.title} with fmpy (pip install fmpy)."""

from fmpy import simulate_fmu

result = simulate_fmu(
    "{model.name}.fmu", stop_time=1.0, output_interval={model.period!r}, output=["{first}"]
)
for time, value in result[::10]:
    print(f"{{time:6.2f}} s  {first} = {{value:.6g}}")
'''


def readme(model: Model, platforms: Iterable[str]) -> str:
    """Return the page of a folder with FMUs."""
    return f"""# {model.title} as FMU

`{model.name}.fmu` is an FMU for co-simulation of FMI 3.0, `{model.name}_fmi2.fmu` the same for
FMI 2.0, with binaries for {", ".join(platforms)}. They hold everything that they need. Give the
simulator a communication step of {model.period:g} s, or a multiple of it: inputs are held for a
control period. States can be saved and restored.

    pip install fmpy
    python example.py

{readme_body(model)}"""
