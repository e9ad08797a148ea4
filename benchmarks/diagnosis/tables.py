"""Diagnosis of the 375 measured readings (positioning2021): page of the documentation.

``python -m benchmarks.diagnosis.tables`` prints the page; ``--write`` also writes it to ``docs``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tyro

from benchmarks.diagnosis.markdown import bullets, table

PAGE = Path(__file__).parents[2] / "docs" / "diagnosis_tables.md"
INTRODUCTION = """\
# Diagnosis of the measured tables

Made by `python -m benchmarks.diagnosis.tables --write`.

Besides recordings the diagnosis accepts tables of settled readings: load, pressure, direction,
repeat and contraction, without time. The shipped table contains 375 readings of a MAS-10-N-100
(three loads, 25 pressures up and down, five repeats).
`pam_envs.diagnosis.static.diagnosis.diagnose_readings(table)` accepts any such table: other loads
and pressures, one or more repeats, paths with several reversals.

The base is load-blind: a spring with a stiff start and a hardening end behind play operators on
the pressure (nine parameters). Causes are added to it one at a time and in pairs.
"""
METHOD = """\
## How to read this

- **cells**: root mean square error on the mean readings to which the model was fitted (72 cells,
  without readings that are zero by definition). **held-out repeat**: error on the readings of a
  repeat, fitted to the others; the noise floor is the difference of a repeat from the mean of the
  others. **held-out load**: fitted to the other loads, averaged over the loads.
- **p**: the larger p-value of a block test with four neighbouring cells as one block, since model
  errors of neighbours are dependent, and of the F test. It is of one form; the rule multiplies it
  by the number of forms of the stage.
- **Rule** (`readings-1`): the search continues while the residual is larger than repeats explain.
  A form is accepted if its p, times the number of forms, is at most 0.05, if it reduces the mean
  squared error on held-out repeats by at least 5 %, and if it does not increase the error on
  held-out loads by more than 2 %. Of several forms of a cause that cannot be separated the first
  of the catalogue is named. Accepted causes are tested again beside later ones.
- **Intervals** are 95 % confidence intervals: of parameters from 200 refits to residuals with
  random signs of blocks of four cells, of errors and gains from resampled blocks. The interval of
  a gain is wide because a few cells (5.5 bar) have much of the error; acceptance is based on p and
  the margin.
- **Load laws**: a linear law was fixed beforehand. An exponent or a dead zone is fitted to the load
  on which it is judged, unless the table has five loads or more: then it is refitted without each
  load, and held out.
- With one load, causes of the load are not testable. With one repeat the noise floor is unknown,
  and errors are of every sixth cell held out.
"""
LIMITS = """\
## Limits

- The pressure shift as read and the shift with each load's rest length as zero fit equally well,
  with different values per kilogram: the stretch of the muscle by a load alone was not measured.
- The margins of the rule (5 %, four cells) were set with knowledge of this table, on synthetic
  tables without effects; there is no second measured table to judge them. The order of the causes
  and the shift do not depend on them.
- Pressure-dependent friction is the weakest of the three causes: its interval is wide, and it
  hardly improves a held-out load.
- Residual creep, fitted last, is close to the margin but predicts held-out loads worse.
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

    readings = load_contraction_table()
    text = page(diagnose_readings(readings), audit_polynomials(readings, published()))
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
        *["## Models\n", ladder(report)],
        *["## Causes\n", causes(report)],
        *["## Masked causes\n", hidden(report)],
        *["## Load law\n", laws(report)],
        *["## Warnings\n", bullets(report["warnings"])],
        *["## The published polynomials\n", polynomials(curves)],
        METHOD,
        LIMITS,
    ]
    return "\n".join(parts)


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
    """Return the table of models, stage by stage."""
    rows, first = [], report["readings"]["ladder"][0]
    rows.append(["**load-blind**", *_errors(first), "", ""])
    for rung in report["readings"]["ladder"]:
        prefix = "".join("+ " for _ in range(len(rung["model"]) + 1))
        for tried in rung["tried"]:
            taken = tried["form"] == rung["chosen"]
            name = f"{tried['name'].replace('_', ' ')}: {tried['form']}"
            name = f"**{name}**" if taken else name
            mark = "accepted" if taken else ("equally good" if not tried["excluded"] else "")
            rows.append([prefix + name, *_errors(tried), _p(tried["p"]), mark])
    for law in report["readings"]["load_laws"]:
        name = f"all accepted, {law['law']} {law['value']:.2f}{_unit(law['unit'])}"
        rows.append([name, *_errors(law), _p(law["p"]), law["status"]])
    head = ["model", "parameters", "cells", "held-out repeat", "held-out load"]
    floor = report["noise_floor"]["contraction"]["value"]
    note = (
        "\nErrors in mm; each `+` is a cause added to those accepted above. "
        f"The noise floor from the repeats is {floor:.3f} mm.\n"
    )
    return table([*head, "each load", "p", ""], rows) + note


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
    return table(["cause", "form", "value", "interval", "effect (RMS)", "gain"], rows)


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def hidden(report: dict[str, Any]) -> str:
    """Return the p-values of each cause alone and beside another one."""
    rows = [
        [
            f"`{pair['names'][i]}`",
            f"`{pair['names'][1 - i]}`",
            _p(pair["p_alone"][i]),
            _p(pair["p_beside"][i]),
            "masked" if pair["names"][i] in pair["masked"] else "",
        ]
        for pair in report["readings"]["pairs"]
        for i in (0, 1)
    ]
    rows.sort(key=lambda row: (row[4] == "", row[0], row[1]))
    note = "\nA search without pairs would miss masked causes, which are not significant alone.\n"
    return table(["cause", "beside", "p alone", "p beside it", ""], rows) + note


def laws(report: dict[str, Any]) -> str:
    """Return the load laws, and the loads to measure next."""
    lines = [_law(law) for law in report["readings"]["load_laws"]]
    cut = report["readings"]["loads_left_out"]
    if cut:
        percent = cut["cut_percent"]
        low, high = percent["interval"]
        lines.insert(
            0,
            f"linear, fixed beforehand: {cut['after']['value']:.2f} mm on a held-out load instead "
            f"of {cut['before']['value']:.2f} mm, {percent['value']:.0f} % less "
            f"({low:.0f} to {high:.0f})",
        )
    experiment = report["experiment"]
    if experiment:
        lines.append(f"to separate them, {experiment['description']}")
    return bullets(lines)


def _law(law: dict[str, Any]) -> str:
    low, high = law["interval"]
    return (
        f"{law['law']}: {law['value']:.2f}{_unit(law['unit'])} ({low:.2f} to {high:.2f}), "
        f"{law['cells_mm']:.4f} mm on the cells, {law['load_left_out_mm']:.2f} mm on a held-out "
        f"load ({law['status']})"
    )


def polynomials(curves: dict[str, Any]) -> str:
    """Return the comparison of published polynomials with their readings."""
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
    return table(head, rows) + "\n" + bullets(curves["discrepancies"])


if __name__ == "__main__":
    tyro.cli(main)
