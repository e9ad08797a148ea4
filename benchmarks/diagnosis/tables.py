"""What a load-blind muscle gets wrong on the 375 measured readings, as a ladder of models.

``python -m benchmarks.diagnosis.tables`` prints the page; ``--write`` also puts it where the
documentation keeps it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tyro

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis_tables.md"
INTRODUCTION = """\
# Diagnosis of the measured tables

Made by `python -m benchmarks.diagnosis.tables --write`.

The second input of the diagnosis is a table of settled readings: no time, only load, pressure, way,
repeat and contraction. The shipped one holds 375 readings of a MAS-10-N-100 (three loads, 25
pressures up and down, five repeats).
`pam_envs.diagnosis.static.diagnosis.diagnose_readings(table)` takes any such table: other loads
and pressures, one repeat or many, paths with several turns.

The base knows nothing of the load: a spring with a stiff start and a hardening end behind play
operators on the pressure (nine parameters). Causes are added to it one at a time and in pairs.
"""
METHOD = """\
## How to read this

- **cells**: root mean square error on the mean readings that the model was fitted to (72 cells; a
  reading that is zero by definition does not count). **repeat left out**: on single readings of a
  repeat, fitted to the others; the floor is a repeat against the mean of the others. **load left
  out**: fitted to the other loads, averaged over the loads.
- **p**: the larger of a test that takes four neighbouring cells as one draw, since what a model
  gets wrong is alike in neighbours, and the plain F test. It counts one form; the rule multiplies
  it by the number of forms tried at that stage.
- **The rule** (`readings-1`): causes are looked for while the residual is larger than repeats
  explain. A form is accepted if its p, times the number tried, is at most 0.05, if it lowers the
  mean squared error on repeats left out by at least 5 %, and if it does not raise the error on
  loads left out by over 2 %. Of several forms of a cause that cannot be told apart the first in
  the catalogue is named. What was accepted earlier is tested again beside the rest.
- **Intervals** are of 95 %: of parameters from 200 refits to residuals whose blocks of four cells
  changed sign at random, of errors and gains from resampled blocks. The interval of a gain is wide
  because a few cells (5.5 bar) carry much of the error; acceptance rests on p and the margin.
- **Load laws.** Linear in load was fixed beforehand. An exponent or a dead zone has seen the load
  that it is judged on, unless the table has five loads or more: then it is fitted anew without
  each, and held out.
- With one load, causes of the load are not testable. With one repeat the floor is unknown, and
  errors are judged on every sixth cell left out.
"""
LIMITS = """\
## What this does not settle

- The shift as read and the shift with each load's rest length as zero fit alike, with different
  values per kilogram: how far a load alone stretches the muscle was not measured.
- The rule's margins (5 %, four cells) were set while this table was in view, on made-up tables
  without effects; it has no second measured table to be judged on. The order of the causes and
  the shift do not depend on them.
- Pressure-dependent friction is the weakest of the three: its interval is wide, and a load left
  out gains little from it.
- Residual creep, where it is fitted last, comes near the margin but predicts loads left out worse.
"""


def main(write: bool = False) -> str:
    """Diagnose the measured tables and print the page.

    Parameters
    ----------
    write : bool
        Also write it to ``docs/diagnosis_tables.md``.
    """
    from pam_envs.data.tables import load_contraction_table
    from pam_envs.diagnosis.static.diagnosis import audit_polynomials, diagnose_readings

    table = load_contraction_table()
    text = page(diagnose_readings(table), audit_polynomials(table, published()))
    print(text)
    if write:
        PAGE.write_text(text, encoding="utf-8")
    return text


def published() -> dict[str, tuple[float, bool, Sequence[float]]]:
    """Return the published cubics of contraction over pressure, Equations 1 to 6, as printed."""
    from baselines.positioning.contraction_tables import BRANCHES, LOADS, PUBLISHED_FORWARD

    places = [(load, way) for load in LOADS for way in BRANCHES]
    rows = PUBLISHED_FORWARD.reshape(len(places), -1).tolist()
    return {f"({i})": (*at, row) for i, (at, row) in enumerate(zip(places, rows, strict=True), 1)}


def page(report: dict[str, Any], curves: dict[str, Any]) -> str:
    """Return the page of a report and of the published curves."""
    parts = [
        INTRODUCTION,
        f"**Verdict: {report['verdict']}.** {report['text']}\n",
        *["## Ladder\n", ladder(report)],
        *["## Causes\n", causes(report)],
        *["## One cause hides another\n", hidden(report)],
        *["## How the load acts\n", laws(report)],
        *["## Warnings\n", _bullets(report["warnings"])],
        *["## The published polynomials\n", polynomials(curves)],
        METHOD,
        LIMITS,
    ]
    return "\n".join(parts)


def _bullets(lines: Sequence[str]) -> str:
    return "".join(f"- {line}\n" for line in lines)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _errors(rung: dict[str, Any]) -> list[str]:
    by_load = " / ".join(f"{value:.2f}" for value in rung["by_load_mm"])
    return [
        str(rung["parameters"]),
        f"{rung['cells_mm']:.3f}",
        f"{rung['left_out_mm']:.3f}",
        f"{rung['load_left_out_mm']:.3f}",
        by_load,
    ]


def _p(value: float) -> str:
    return f"{value:.2g}"


def ladder(report: dict[str, Any]) -> str:
    """Return every model tried, stage by stage."""
    rows, first = [], report["readings"]["ladder"][0]
    rows.append(["**load-blind**", *_errors(first), "", ""])
    for rung in report["readings"]["ladder"]:
        prefix = "".join("+ " for _ in range(len(rung["model"]) + 1))
        for tried in rung["tried"]:
            taken = tried["form"] == rung["chosen"]
            name = f"{tried['name'].replace('_', ' ')}: {tried['form']}"
            name = f"**{name}**" if taken else name
            mark = "taken" if taken else ("as good" if not tried["excluded"] else "")
            rows.append([prefix + name, *_errors(tried), _p(tried["p"]), mark])
    for law in report["readings"]["load_laws"]:
        name = f"all taken, {law['law']} {law['value']:.2f}{_unit(law['unit'])}"
        rows.append([name, *_errors(law), _p(law["p"]), law["status"]])
    head = ["model", "parameters", "cells", "repeat left out", "load left out"]
    floor = report["noise_floor"]["contraction"]["value"]
    note = (
        "\nErrors in mm; each `+` is a cause on top of those taken above. "
        f"The floor of the repeats is {floor:.3f} mm.\n"
    )
    return _table([*head, "each load", "p", ""], rows) + note


def causes(report: dict[str, Any]) -> str:
    """Return the named causes with intervals."""
    rows = []
    for cause in report["causes"]:
        for number in cause["parameters"]:
            low, high = number["interval"]
            bottom, top = cause["gain"]["interval"]
            rows.append(
                [
                    f"`{cause['name']}`",
                    cause["form"],
                    f"{number['value']:.4f}{_unit(number['unit'])}",
                    f"{low:.3f} to {high:.3f}",
                    f"{cause['effect']['contraction']['value']:.2f} mm",
                    f"{cause['gain']['value']:.2f} ({bottom:.2f} to {top:.2f})",
                ]
            )
    return _table(["cause", "form", "value", "interval", "effect (RMS)", "gain"], rows)


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def hidden(report: dict[str, Any]) -> str:
    """Return, for pairs of causes, what each is worth alone and beside the other."""
    rows = [
        [
            f"`{pair['names'][i]}`",
            f"`{pair['names'][1 - i]}`",
            _p(pair["p_alone"][i]),
            _p(pair["p_beside"][i]),
            "hidden" if pair["names"][i] in pair["masked"] else "",
        ]
        for pair in report["readings"]["pairs"]
        for i in (0, 1)
    ]
    rows.sort(key=lambda row: (row[4] == "", row[0], row[1]))
    note = (
        "\nA search that drops what shows nothing on the load-blind model would lose the hidden "
        "ones.\n"
    )
    return _table(["cause", "beside", "p alone", "p beside it", ""], rows) + note


def laws(report: dict[str, Any]) -> str:
    """Return what is said of the law of the load, and which loads to hang next."""
    lines = [_law(law) for law in report["readings"]["load_laws"]]
    cut = report["readings"]["loads_left_out"]
    if cut:
        percent = cut["cut_percent"]
        low, high = percent["interval"]
        lines.insert(
            0,
            f"linear, fixed beforehand: {cut['after']['value']:.2f} mm on a load left out instead "
            f"of {cut['before']['value']:.2f} mm, {percent['value']:.0f} % less "
            f"({low:.0f} to {high:.0f})",
        )
    experiment = report["experiment"]
    if experiment:
        lines.append(f"to tell them apart, {experiment['description']}")
    return _bullets(lines)


def _law(law: dict[str, Any]) -> str:
    low, high = law["interval"]
    return (
        f"{law['law']}: {law['value']:.2f}{_unit(law['unit'])} ({low:.2f} to {high:.2f}), "
        f"{law['cells_mm']:.4f} mm on the cells, {law['load_left_out_mm']:.2f} mm on a load left "
        f"out ({law['status']})"
    )


def polynomials(curves: dict[str, Any]) -> str:
    """Return the published polynomials against the readings that they claim."""
    rows = [
        [
            equation["name"],
            f"{equation['load']:g} kg {'inflating' if equation['inflating'] else 'deflating'}",
            f"{equation['rms']:.3f}",
            f"{equation['refit']:.3f}",
            f"{equation['best']['load']:g} kg: {equation['best']['rms']:.3f}",
            equation["copy_of"] or "",
        ]
        for equation in curves["equations"]
    ]
    head = ["equation", "claims", "RMS mm", "refit mm", "fits best", "copy of"]
    return _table(head, rows) + "\n" + _bullets(curves["discrepancies"])


if __name__ == "__main__":
    tyro.cli(main)
