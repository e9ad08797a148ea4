"""Identification of the shipped MAS-10-N-100 plants from the shipped readings, and its report."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pam_envs.data.tables import load_contraction_table
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.none import NoHysteresis
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.hysteresis.slip import PreisachSlip, StraightSlip
from pam_envs.identification import contraction_cycles as cycles
from pam_envs.identification.preisach_forc import congruency_error
from pam_envs.plants.core import plant_file
from pam_envs.plants.single_muscle.plant import SingleMuscle

MISSED = (
    "the flat step of the inflating curve from 5 to 5.5 bar at 0 and 2.55 kg",
    "the steep drop of the deflating curve from 3.5 to 3 bar",
    "the drift of +0.03 mm per repeat at 0 kg",
    "a nonlinear dependence of the loop width on load (three loads cannot show it)",
)
"""Structure of the residuals that the model does not represent."""

STOCK = (
    StraightSlip.kind, PreisachSlip.kind, PlayOperator.kind, Preisach.kind, NoHysteresis.kind,
)  # fmt: skip
"""Kinds of hysteresis that are identified on the tables."""


def minor_loops(plant: SingleMuscle, low: float = 2e5, high: float = 3e5) -> tuple[float, float]:
    """Return the congruency error of minor loops, in effective pressure and in contraction.

    The same excursion of the pressure, on the first inflation (which has just reached its upper
    end) and after the highest pressure. A Preisach operator's loops are congruent, a muscle's
    contraction loops are not.
    """
    operator, load = plant.hysteresis.at_load(plant.mass.load), plant.mass.load
    if operator is None:
        return 0.0, 0.0
    legs = np.linspace(low, high, 41)
    loop = np.concatenate([legs, legs[::-1][1:]])
    curves: tuple[list[Any], list[Any]] = ([], [])
    for peak in (high, plant.regulator.max_pressure):
        path = np.concatenate([[0.0, peak], loop])
        felt = operator.simulate(path)[0][-len(loop) :]
        curves[0].append((loop, felt))
        curves[1].append((loop, plant.contraction_at(felt, load)))
    return congruency_error(curves[0]), congruency_error(curves[1])


def _rank(fit: cycles.CyclesFit) -> str:
    """Return the number of determined parameters in words."""
    if fit.preisach is not None:
        return f"{fit.preisach.rank} of {fit.preisach.unknowns} relay weights"
    if fit.plant.hysteresis.kind == PlayOperator.kind:
        found = cycles.identifiability(fit)
        return f"{found.rank} of {len(found.names)} parameters"
    if fit.plant.hysteresis.drive == "length":
        return "see the prior"
    return f"{len(cycles.STATIC)} of {len(cycles.STATIC)} static parameters"


def identify_all(
    folder: Path, members: int = 8, say: Callable[[str], None] = lambda line: None
) -> str:
    """Identify the plants, write them to ``folder`` and return the report (Markdown)."""
    table = load_contraction_table()
    floor = 1e3 * cycles.repeatability_floor(table)
    lines = [
        "# Identification of the MAS-10-N-100 from the tables",
        "",
        "Made by `pam-envs identify`. RMS errors in mm, without the readings that are zero by "
        "definition. The repeatability floor (one repeat against the mean of the others) is "
        f"{floor:.3f} mm.",
        "",
        "| hysteresis | RMS 0 kg | 2.55 kg | 4.55 kg | all | held-out repeat | widest loops, model "
        "(measured) | rank | members |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    fits: dict[str, cycles.CyclesFit] = {}
    for kind in STOCK:
        say(f"identifying with hysteresis {kind}")
        plant, fit = cycles.identify_mas10(table, kind, members if kind != NoHysteresis.kind else 0)
        fits[kind] = fit
        rms, left_out = 1e3 * fit.rms(), 1e3 * cycles.leave_one_repeat_out(table, kind)
        cells = " | ".join(f"{1e3 * fit.rms(float(load)):.3f}" for load in fit.cycles.loads)
        widths = ", ".join(
            f"{1e3 * model:.2f} ({1e3 * measured:.2f} at {pressure / 1e5:g} bar)"
            for pressure, measured, model in zip(*fit.widths(), strict=True)
        )
        lines.append(
            f"| {kind} | {cells} | {rms:.3f} | {left_out:.3f} | {widths} | {_rank(fit)} | "
            f"{len(plant.ensemble) + 1} |"
        )
        notes = {"rms_mm": round(rms, 4), "left_out_repeat_mm": round(left_out, 4)}
        plant_file.write(plant, folder / f"mas10_{kind}.yaml", notes)
        if fit.preisach is not None:
            inner, outer = minor_loops(plant)
            congruency = (
                "Preisach's congruency error (minor loops between 2 and 3 bar after 3 and after 6 "
                f"bar): {inner:.1e} in effective pressure, {outer:.1%} in contraction. For a "
                "single muscle a Preisach map from pressure directly to contraction is therefore "
                "an approximation; this model has the static law in between."
            )
    lines += ["", congruency, "", "## Identifiability of the parameters", ""]
    found = cycles.identifiability(fits[PlayOperator.kind])
    lines += [
        "For `maxwell_slip`: share (0 to 1) of each parameter in the parameter combinations that "
        "the mean readings determine to better than 20 %. A parameter near 0 is assumed (its range "
        "is in the plant file) or follows from the prior, equal weight on every threshold, which "
        "determines the minor loops.",
        "",
        "| parameter | share |",
        "|---|---|",
        *(f"| {n} | {v:.2f} |" for n, v in zip(found.names, found.fixed, strict=True)),
        "",
        "## Unmodelled structure",
        "",
        *(f"- {line}" for line in MISSED),
        "",
    ]
    return "\n".join(lines)
