"""Diagnosis of the 375 measured readings (positioning2021): page of the documentation.

``python -m benchmarks.diagnosis.tables`` prints the page; ``--write`` also writes it to ``docs``.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tyro

from benchmarks.diagnosis.markdown import bullets, table

TEMPLATE = Path(__file__).with_suffix(".md")
PAGE = Path(__file__).parents[2] / "docs" / "diagnosis_tables.md"


def main(write: bool = False) -> str:
    """Diagnose the measured tables and print the page.

    Args:
        write: Also write it to ``docs/diagnosis_tables.md``.
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
    return TEMPLATE.read_text(encoding="utf-8").format(
        verdict=report["verdict"],
        text=report["text"],
        ladder=ladder(report),
        causes=causes(report),
        hidden=hidden(report),
        laws=laws(report),
        warnings=bullets(report["warnings"]),
        polynomials=polynomials(curves),
    )


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
