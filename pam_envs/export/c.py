"""C: a header with named signals, one source file with the data, and objects of the kernels."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.export.model import Block, Model, Variable
from pam_envs.export.toolchain import OBJECTS, emit_object, host_platform

_STEP = {
    "environment": "Apply inputs for one control period.",
    "plant": "Apply inputs for one control period.",
    "controller": "Compute the actions for an observation, once in a control period.",
}
SUBJECT = {
    "environment": "physics, compiled from the\nkernels that run in Python",
    "plant": "physics, compiled from the\nkernels that run in Python",
    "controller": "control law",
}
"""Content of the object code, by kind of model."""
_TYPES = {"float64": "double", "float32": "float", "int64": "int64_t", "int8": "int8_t"}


def export_c(model: Model, folder: Path, platforms: Iterable[str] = OBJECTS) -> None:
    """Write header, source, example, README and objects for some processors of ``OBJECTS``."""
    write_sources(model, folder)
    for platform in platforms:
        place = folder / "objects" / platform
        place.mkdir(parents=True, exist_ok=True)
        (place / f"{model.name}_kernel.o").write_bytes(emit_object(model, platform))
    (folder / "example.c").write_text(example(model), encoding="utf-8")
    (folder / "README.md").write_text(readme(model), encoding="utf-8")


def write_sources(model: Model, folder: Path) -> None:
    """Write header and source."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{model.name}.h").write_text(header(model), encoding="utf-8")
    (folder / f"{model.name}.c").write_text(source(model), encoding="utf-8")


def header(model: Model) -> str:
    """Return the header: variables by name with units, the state, and the functions."""
    p, upper = model.prefix, model.prefix.upper()
    groups = {"input": model.inputs, "output": model.outputs, "parameter": model.parameters}
    enums = "\n".join(_enum(p, group, variables) for group, variables in groups.items())
    facts = "\n".join(f" * {line}" for line in model.lines)
    fields = "\n".join(
        f"    {_TYPES[b.values.dtype.name]} {b.name}[{b.values.size}];"
        for b in model.blocks
        if not b.constant
    )
    if model.episodic:
        begin = f"""/* Start episode 0 of a seed, at most 2^63 - 1. */
void {p}_reset({p} *model, uint64_t seed);
/* Start the next episode of the seed. */
void {p}_next_episode({p} *model);"""
    else:
        what = (
            "Begin an episode; the outputs are the actions for its first observation, which\n"
            " * the first step takes again."
            if model.kind == "controller"
            else "Bring the plant to rest under its inputs."
        )
        begin = f"""/* {what} */
void {p}_reset({p} *model, const double *inputs);"""
    return f"""/* {model.title}, exported from the kernels of pam-envs. All quantities are SI.
 *
{facts}
 */
#ifndef {upper}_H
#define {upper}_H
#include <stdint.h>
#ifdef __cplusplus
extern "C" {{
#endif

#define {upper}_DIGEST "{model.digest}"
#define {upper}_PERIOD {model.period!r} /* s: control period, the length of a step */

{enums}
/* The whole state, without pointers: copy it to save it. */
typedef struct {p} {{
{fields}
}} {p};

/* Set the parameters to their defaults; call it first. */
void {p}_init({p} *model);
{begin}
/* {_STEP[model.kind]} */
void {p}_step({p} *model, const double *inputs);
/* Return an output of the last step, or of the start. */
double {p}_output(const {p} *model, int output);
/* Return the address of a parameter, which the next reset reads; null if there is none. */
double *{p}_parameter({p} *model, int parameter);
/* Name and unit of a variable. */
extern const char *const {p}_input_names[], *const {p}_input_units[];
extern const char *const {p}_output_names[], *const {p}_output_units[];
extern const char *const {p}_parameter_names[], *const {p}_parameter_units[];

#ifdef __cplusplus
}}
#endif
#endif
"""


def _enum(p: str, group: str, variables: Sequence[Variable]) -> str:
    first = f"{p}_{group}".upper()
    lines = []
    for k, variable in enumerate(variables):
        unit = "" if variable.unit == "1" else f" [{variable.unit}]"
        span = f", {variable.span}" if variable.span else ""
        start = f", default {variable.start:g}" if group == "parameter" else ""
        lines.append(
            f"    {first}_{variable.word.upper()} = {k}, /* {variable.name}{unit}{span}{start} */"
        )
    lines.append(f"    {first}S = {len(variables)}")
    return "enum {\n" + "\n".join(lines) + "\n};\n"


def source(model: Model) -> str:
    """Return the source file."""
    p = model.prefix
    constants = [_constant(block) for block in model.blocks if block.constant]
    starts = [
        _constant(block, "start_") for block in model.blocks if not block.constant and _given(block)
    ]
    copies = "\n".join(
        f"    memcpy(model->{b.name}, start_{b.name}, sizeof start_{b.name});"
        for b in model.blocks
        if not b.constant and _given(b)
    )
    names = "\n".join(
        _names(p, group, variables)
        for group, variables in (
            ("input", model.inputs),
            ("output", model.outputs),
            ("parameter", model.parameters),
        )
    )
    declared = "\n".join(
        f"void {p}_{suffix}(int64_t *book, int64_t mode);" for suffix in model.kernels
    )
    return f"""/* Data of {model.title}, and its functions around the kernels. Generated. */
#include <stddef.h>
#include "{model.name}.h"

void *memcpy(void *to, const void *from, size_t size); /* all that is needed of <string.h> */
void *memset(void *to, int value, size_t size);
{declared}

{chr(10).join([*constants, *starts])}

typedef struct {{
    int64_t words[{4 * len(model.blocks)}];
}} address_book;

static void enter(int64_t *row, const void *data, int64_t a, int64_t b, int64_t c) {{
    row[0] = (int64_t)(intptr_t)data;
    row[1] = a;
    row[2] = b;
    row[3] = c;
}}

static address_book book_of({p} *model) {{
    address_book book;
{_book(model)}
    return book;
}}

void {p}_init({p} *model) {{
    memset(model, 0, sizeof *model);
{copies}
}}

{_functions(model)}
double {p}_output(const {p} *model, int output) {{
{_outputs(model)}
    return 0.0;
}}

double *{p}_parameter({p} *model, int parameter) {{
{_parameters(model)}
}}

#ifndef PAM_WITHOUT_NAMES
{names}
#endif
"""


def _functions(model: Model) -> str:
    p = model.prefix
    take = f"memcpy(model->{model.inputs[0].block}, inputs, sizeof model->{model.inputs[0].block});"
    if model.episodic:
        return f"""static void begin({p} *model) {{
    address_book book = book_of(model);
    model->flags[0] = 1;
    model->flags[1] = 0;
    {p}_kernel(book.words, 2);
    model->flags[0] = 0;
    model->report[0] = 0; /* the reward: no step yet */
}}

void {p}_reset({p} *model, uint64_t seed) {{
    address_book book = book_of(model);
    {p}_seed(book.words, (int64_t)seed);
    begin(model);
}}

void {p}_next_episode({p} *model) {{
    model->counts[2] += 1;
    begin(model);
}}

void {p}_step({p} *model, const double *inputs) {{
    address_book book = book_of(model);
    {take}
    {p}_kernel(book.words, 0);
}}
"""
    return f"""void {p}_reset({p} *model, const double *inputs) {{
    {p} tried;
    address_book book;
    {take}
    model->numbers[2] = 0;
    tried = *model; /* outputs at the beginning of a period that is not kept */
    tried.numbers[3] = 1;
    book = book_of(&tried);
    {p}_kernel(book.words, 1);
    memcpy(model->output, tried.output, sizeof model->output);
}}

void {p}_step({p} *model, const double *inputs) {{
    address_book book = book_of(model);
    {take}
    {p}_kernel(book.words, model->numbers[2] == 0 ? 1 : 0);
}}
"""


def _given(block: Block) -> bool:
    return bool(np.any(block.values))


def _book(model: Model) -> str:
    lines = []
    for k, block in enumerate(model.blocks):
        shape = [*block.shape, 0, 0, 0][:3]
        where = block.name if block.constant else f"model->{block.name}"
        sizes = ", ".join(map(str, shape))
        lines.append(f"    enter(book.words + {4 * k}, {where}, {sizes});")
    return "\n".join(lines)


def _outputs(model: Model) -> str:
    """Return the cases of runs of outputs that are neighbours in one block."""
    lines, first = [], 0
    while first < len(model.outputs):
        begin = model.outputs[first]
        last = first
        while last + 1 < len(model.outputs) and (
            model.outputs[last + 1].block == begin.block
            and model.outputs[last + 1].index == begin.index + last + 1 - first
        ):
            last += 1
        at = f"output - {first} + {begin.index}"
        lines.append(
            f"    if (output >= {first} && output <= {last})\n"
            f"        return (double)model->{begin.block}[{at}];"
        )
        first = last + 1
    return "\n".join(lines)


def _parameters(model: Model) -> str:
    if not model.parameters:
        return "    (void)model;\n    (void)parameter;\n    return 0;"
    rows = ", ".join(str(v.index) for v in model.parameters)
    block = model.parameters[0].block
    return f"""    static const int rows[] = {{{rows}}};
    if (parameter < 0 || parameter >= {len(model.parameters)})
        return 0;
    return model->{block} + rows[parameter];"""


def _names(p: str, group: str, variables: Sequence[Variable]) -> str:
    parts = []
    for word, texts in (
        ("names", [v.name for v in variables]),
        ("units", [v.unit for v in variables]),
    ):
        body = _wrapped(f'"{text}"' for text in texts) if texts else "    0"
        parts.append(f"const char *const {p}_{group}_{word}[] = {{\n{body}\n}};")
    return "\n".join(parts)


def _constant(block: Block, prefix: str = "") -> str:
    kind = _TYPES[block.values.dtype.name]
    body = _wrapped(map(literal, block.values.ravel()))
    return f"static const {kind} {prefix}{block.name}[] = {{\n{body}\n}};"


def literal(value: Any) -> str:
    """Return a number as C reads it, to the last bit."""
    if isinstance(value, np.integer):
        return str(int(value))
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{number!r} cannot be written into C: check the model's parameters")
    return "0" if number == 0.0 and math.copysign(1.0, number) > 0 else number.hex()


def _wrapped(words: Iterable[str], width: int = 96) -> str:
    """Return words with commas between them on lines of limited width."""
    lines = [""]
    for word in words:
        if len(lines[-1]) + len(word) + 2 > width:
            lines.append("")
        lines[-1] += f" {word}," if lines[-1] else f"    {word},"
    return "\n".join(lines).removesuffix(",")


def example(model: Model) -> str:
    """Return a program that prints every output of some steps as hexadecimal numbers."""
    p, n = model.prefix, len(model.inputs)
    begin = "reset(&model, 17);" if model.episodic else "reset(&model, inputs);"
    starts = _wrapped(literal(np.float64(v.start)) for v in model.inputs)
    acts = model.kind == "controller"
    shown = "each step" if acts else "the start and of\n * each step"
    return f"""/* Runs {model.title}.
 *
 * example SEED < inputs: a line of inputs is one control period; prints every output of {shown},
 * as hexadecimal numbers, which show every bit.
 * example SEED STEPS: constant inputs; prints the outputs of the last step.
 */
#include <stdio.h>
#include <stdlib.h>
#include "{model.name}.h"

static {p} model;

static void print(void) {{
    for (int k = 0; k < {len(model.outputs)}; k++)
        printf(k ? " %a" : "%a", {p}_output(&model, k));
    printf("\\n");
}}

int main(int count, char **words) {{
    double inputs[{n}] = {{
{starts}
    }};
    unsigned long long seed = count > 1 ? strtoull(words[1], 0, 10) : 17;
    long steps = count > 2 ? atol(words[2]) : 0; /* 0: as many as there are lines of inputs */
    {p}_init(&model);
    {p}_{begin.replace("17", "seed")}
    {"" if model.episodic else "(void)seed;"}
    if (steps > 0) {{
        for (long step = 0; step < steps; step++)
            {p}_step(&model, inputs);
        print();
        return 0;
    }}
    for (;;) {{
        {"" if acts else "print();"}
        for (int k = 0; k < {n}; k++)
            if (scanf("%lf", inputs + k) != 1)
                return 0;
        {p}_step(&model, inputs);
        {"print();" if acts else ""}
    }}
}}
"""


def readme(model: Model) -> str:
    """Return the page of a folder with C."""
    here = host_platform()
    link = f"objects/{here}/{model.name}_kernel.o"
    changed = f"""Parameters are changed between `{model.prefix}_init` and `{model.prefix}_reset`.
pam-envs checks their bounds; the C code does not.

"""
    changed = changed if model.parameters else ""
    return f"""# {model.title} in C

`{model.name}.h` names inputs, outputs and parameters, with units (SI). `{model.name}.c` holds the
data; `objects/PROCESSOR/{model.name}_kernel.o` the {SUBJECT[model.kind]}.
Nothing else is needed: no Python, no libm, no memory allocation.

    cc -O2 example.c {model.name}.c {link} -o example
    ./example 17 1000

prints every output after 1,000 steps with constant inputs. Outputs are {model.agreement}.

{changed}{readme_body(model)}"""


def readme_body(model: Model) -> str:
    """Return facts, inputs, outputs and parameters of a model in Markdown."""
    facts = "\n".join(f"- {line}" for line in model.lines)
    note = """A parameter changes the plant alone: what an environment derives from its nominal
plant stays as exported. Parameters of effects that are switched off are left out.

"""
    return f"""{facts}

{note if model.parameters else ""}{table("Inputs", model.inputs)}
{table("Outputs", model.outputs)}
{table("Parameters", model.parameters)}"""


def table(title: str, variables: Sequence[Variable]) -> str:
    """Return variables as a Markdown table."""
    if not variables:
        return ""
    lines = [f"## {title}", "", "| # | name | unit | range |", "|---|---|---|---|"]
    for k, v in enumerate(variables):
        lines.append(f"| {k} | `{v.name}` | {v.unit} | {v.span} |")
    return "\n".join(lines) + "\n"
