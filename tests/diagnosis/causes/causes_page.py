"""Generated parts of ``docs/diagnosis_causes.md``, from the declarations of the causes.

The page has three generated parts between marks. After a change of the catalogue
``python -m tests.diagnosis.causes.causes_page`` updates the parts.
"""

import ast
import re
from collections.abc import Callable
from pathlib import Path

from pam_envs.diagnosis.cause import NEEDS, Cause, Form, Term
from pam_envs.diagnosis.causes import FOLDER, catalogue
from pam_envs.diagnosis.fit.single_muscle import BASE
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle

PAGE = Path(__file__).parents[3] / "docs/diagnosis_causes.md"
EXAMPLE = Path(__file__).with_name("users_cause.py")
PLANT = SingleMuscle.mas10("maxwell_slip")
COMPONENTS = ("regulator", "hysteresis", "muscle", "mass", "position", "pressure")
WEIGHT = "hysteresis.weight"

GIVEN = {
    "regulator.max_pressure": "RIG.yaml, `regulator: {max_pressure_bar}`",
    "regulator.flow": "the base, where the pressure shows flow through orifices",
    "regulator.conductance": "the base, as `regulator.flow`",
    "regulator.exhaust_share": "the base, as `regulator.flow`",
    "regulator.critical_ratio": "the base, as `regulator.flow`",
    "regulator.opening_band": "the base, as `regulator.flow`",
    "regulator.opening_bend": "the base, as `regulator.flow`",
    "regulator.opening_integral": "the base, where such a valve integrates the error",
    "regulator.opening_windup": "the base, as `regulator.opening_integral`",
    "regulator.opening_lag": "the base, where the opening of such a valve lags",
    "regulator.polytropic": "the base, as `regulator.flow`",
    "regulator.source_pressure": "the base, as `regulator.flow`",
    "regulator.pilot_lag": "the base, where the pressure shows a regulator of second order",
    "regulator.pilot_damping": "the base, as `regulator.pilot_lag`",
    "regulator.rate_lag": "the base, as `regulator.pilot_lag`",
    "regulator.integral": "the base, where the pressure shows an integral part",
    "regulator.integral_release": "the base, as `regulator.integral`",
    "regulator.speed_2": "the base, where the rate is not proportional to the error",
    "regulator.speed_6": "the base, as `regulator.speed_2`",
    "regulator.speed_20": "the base, as `regulator.speed_2`",
    "regulator.speed_60": "the base, as `regulator.speed_2`",
    "muscle.rest_length": "RIG.yaml, `muscle: {rest_length_mm}`",
    "muscle.diameter": "RIG.yaml, `muscle: {diameter_mm}`; refitted with `regulator.flow`",
    "muscle.braid_angle": "the plant; only drawings depend on it",
    "muscle.map_pressure": "the plant; range of the map of `static_law`",
    "muscle.map_strain": "the plant; range of the map of `static_law`",
    "muscle.yield_share": "joint, elbow, knee and arm: the base, with the shape of the loops",
    "muscle.temperature": "the recording, `temperature_C`; 20 °C without it",
    "hysteresis.creep_time_1": "the plant; four fixed times cover 0.1 to 300 s",
    "hysteresis.creep_time_2": "the plant",
    "hysteresis.creep_time_3": "the plant",
    "hysteresis.creep_time_4": "the plant",
    "hysteresis.start": "the flexible base, from the start of the recording",
    "hysteresis.friction": "the plant; no cause uses it (friction driven by length)",
    "hysteresis.limit_per_pressure": "the plant, as `hysteresis.friction`",
    "hysteresis.limit_per_load": "the plant, as `hysteresis.friction`",
    "mass.load": "the recording, `load_N`; its error is `payload_error`",
    "mass.carried": "RIG.yaml, `load`: 1 for `hanging_mass`, 0 for `constant_force`",
    "position.noise": "RIG.yaml, `sensors: {contraction_noise_mm}`; estimated if it is not given",
    "position.resolution": "the recording; replays are not quantised",
    "pressure.delay": "the plant; no cause uses it",
    "pressure.slip": "the plant; no cause uses it",
    "pressure.slip_at": "the plant; no cause uses it",
    "pressure.noise": "RIG.yaml, `sensors: {pressure_noise_bar}`; estimated if it is not given",
    "pressure.resolution": "the recording; replays are not quantised",
}
"""Declared parameters and their source."""


def named_by() -> dict[str, list[str]]:
    """Return the causes that use each parameter."""
    found: dict[str, list[str]] = {}
    for cause in catalogue():
        for name in dict.fromkeys(t.name for form in cause.forms for t in form.terms):
            found.setdefault(name, []).append(cause.name)
    return found


def classes_of(name: str) -> list[tuple[str, str]]:
    """Return the classes of a parameter with a remark on each; there must be one."""
    causes = named_by().get(name, [])
    return [
        *([("base", "refitted")] if name in (*BASE, WEIGHT) else []),
        *([("cause", ", ".join(f"[{c}](#{c})" for c in causes))] if causes else []),
        *([("declared", GIVEN[name])] if name in GIVEN else []),
    ]


def parameters() -> list[str]:
    """Return every parameter of the plant, in the order of the signal."""
    names = [*R.NAMES, WEIGHT]
    return sorted(names, key=lambda n: COMPONENTS.index(n.partition(".")[0]))


def number(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


def limits(name: str) -> tuple[str, float, float, float | None]:
    """Return unit, bounds and neutral value."""
    if name == WEIGHT:
        return "1", 0.0, 1.0, None
    d = PLANT.declaration(name)
    return d.unit, d.low, d.high, d.neutral


def table() -> str:
    """Return the table of all parameters and their classes."""
    rows = ["| parameter | unit | bounds | neutral | class | |", "|---|---|---|---|---|---|"]
    for name in parameters():
        unit, low, high, neutral = limits(name)
        kind, words = classes_of(name)[0]
        shown = f"{name}[k]" if name == WEIGHT else name
        rows.append(
            f"| `{shown}` | {unit} | {low:g} to {high:g} | {number(neutral)} | {kind} | {words} |"
        )
    return "\n".join(rows)


def row_of(form: Form, term: Term) -> str:
    """Return the row of a fitted parameter with its bounds."""
    unit, low, high, neutral = limits(term.name)
    low = low if term.low is None else term.low
    high = high if term.high is None else term.high
    role = "size of the effect" if term.amount else "shape"
    cells = (form.name, f"`{term.name}`", unit, f"{low:g} to {high:g}")
    return f"| {' | '.join(cells)} | {number(neutral) if term.amount else ''} | {role} |"


def documentation(cause: Cause) -> str:
    """Return the text at the top of a cause's file."""
    (path,) = FOLDER.rglob(f"{cause.name}.py")
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


def section(cause: Cause) -> str:
    """Return the section of a cause."""
    lead, _, physics = documentation(cause).partition("\n\n")
    rows = [row_of(form, term) for form in cause.forms for term in form.terms]
    points = {
        "Residual": cause.signature + ".",
        "Similar causes": ", ".join(f"[{n}](#{n})" for n in cause.neighbours) + ".",
        "Separating experiment": cause.experiment,
        "Direct measurement": cause.sensor + ".",
        "Requirements": ", ".join(NEEDS[n] for n in cause.needs) + "." if cause.needs else "",
        "Source": cause.source,
    }
    return "\n".join(
        [
            f"### {cause.name}",
            "",
            f"**{lead}** {' '.join(physics.split())}",
            "",
            "| form | parameter | unit | bounds | neutral | |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            *(f"- *{name}*: {text}" for name, text in points.items() if text),
        ]
    )


def sections() -> str:
    """Return the sections of all causes."""
    return "\n\n".join(section(cause) for cause in catalogue())


def example() -> str:
    """Return the file of a user's cause, as a block of code."""
    return f"```python\n{EXAMPLE.read_text(encoding='utf-8')}```"


PARTS: dict[str, Callable[[], str]] = {"table": table, "sections": sections, "example": example}


def _between(name: str) -> re.Pattern[str]:
    return re.compile(rf"(?<=<!-- {name} -->\n).*?(?=\n<!-- /{name} -->)", re.DOTALL)


def part(name: str) -> str:
    """Return a part of the present page."""
    found = _between(name).search(PAGE.read_text(encoding="utf-8"))
    assert found is not None, f"{PAGE.name} has lost its marks of {name!r}"
    return found.group()


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8")
    for mark, make in PARTS.items():
        made = make()
        text = _between(mark).sub(lambda _, made=made: made, text)
    PAGE.write_text(text, encoding="utf-8")
