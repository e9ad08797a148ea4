"""Mutilated recordings: every one ends in a report or in an error that states the remedy.

A case is a simulated recording with an effect, written as CSV and rig file, spoiled in one or two
ways, and diagnosed as the command line does it. Its outcome is ``report``, ``refused`` (a
ValueError), or ``lost``: another exception, an error without a sentence, or a missing file.
"""

import json
import tempfile
import time as clock
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import yaml

from benchmarks.diagnosis.cases import CAMPAIGNS, Case, first_seed
from benchmarks.diagnosis.counts import Numbers, share
from benchmarks.diagnosis.example import csv_text, rig_content
from benchmarks.diagnosis.markdown import bullets, share_text, table, write_page
from benchmarks.diagnosis.sources import columns_of, draw_effect, draw_rig, sheet_of
from benchmarks.identity.hashing import plain
from benchmarks.runs import provenance
from pam_envs.data.recording.recording import Recording, read_input
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.diagnosis import diagnose
from tests.diagnosis.hidden import EFFECTS

NUMBER = 500
EVERY = 11  # one case of so many has a failing stage
AMPLITUDE = 6.0
OUTCOMES = ("report", "refused", "lost")
LEAST_SENTENCE = 20  # characters of an error that states a remedy
FILES = ("report.json", "report.html", "plant.yaml")
MEASURED = ("pressure_bar", "contraction_mm")
NUMBERS = ("time_s", "pressure_command_bar", *MEASURED, "load_N", "temperature_C")

Columns = dict[str, Any]
Spoil = Callable[[Columns, dict[str, Any], np.random.Generator], None]


def _rows(columns: Columns, keep: Any) -> None:
    """Keep or repeat rows."""
    for name in columns:
        columns[name] = columns[name][keep]


def _span(columns: Columns, rng: np.random.Generator, most: float = 0.3) -> slice:
    """Return a random block of rows."""
    n = len(columns["time_s"])
    length = max(int(n * rng.uniform(0.01, most)), 1)
    start = int(rng.integers(n - length + 1))
    return slice(start, start + length)


def _one_of(columns: Columns, rng: np.random.Generator, names: Sequence[str]) -> str:
    return str(rng.choice([name for name in names if name in columns]))


def drop_column(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Leave out one to three columns."""
    for name in rng.permutation(list(columns))[: rng.integers(1, 4)]:
        del columns[name]


def empty_block(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Empty a block of cells."""
    columns[_one_of(columns, rng, NUMBERS)][_span(columns, rng)] = np.nan


def repeat_rows(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Copy a block of rows: at once, or at the end."""
    n, block = len(columns["time_s"]), np.arange(len(columns["time_s"]))[_span(columns, rng)]
    at = n if rng.random() < 0.5 else block[0]
    _rows(columns, np.insert(np.arange(n), at, block))


def freeze(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Hold a channel at one value, throughout or for a block."""
    name = _one_of(columns, rng, NUMBERS[1:])
    rows = slice(None) if rng.random() < 0.5 else _span(columns, rng, 0.8)
    columns[name][rows] = columns[name][rows][0]


def swap_unit(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Give a channel in another unit."""
    columns[_one_of(columns, rng, NUMBERS)] *= rng.choice([1e-3, 1e-2, 0.1, 10.0, 1e2, 1e3, 1e5])


def truncate(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Keep the first seconds, or the last."""
    n = len(columns["time_s"])
    kept = int(rng.choice([0, 1, 5, 50, 500, 1500, n // 2]))
    _rows(columns, slice(None, kept) if rng.random() < 0.5 else slice(n - kept, None))


def cut_gap(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Leave out a block of rows."""
    block = _span(columns, rng)
    _rows(columns, np.delete(np.arange(len(columns["time_s"])), np.r_[block]))


def jump(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Shift a channel, the clock too, from a row on."""
    name = _one_of(columns, rng, NUMBERS)
    size = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 3.0)
    size *= max(np.nan_to_num(np.ptp(columns[name])), 1.0)
    columns[name][_span(columns, rng).start :] += size


def turn_sign(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Reverse the sign of a channel."""
    columns[_one_of(columns, rng, NUMBERS)] *= -1.0


def extremes(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Set single readings to values that no sensor gives."""
    values = columns[_one_of(columns, rng, NUMBERS[1:])]
    at = rng.integers(len(values), size=rng.integers(1, 20))
    values[at] = rng.choice([np.inf, -np.inf, 1e300, -1e30, 1e9, 9999.0, -999.0], size=len(at))


def scramble(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Exchange the order of rows, or the contents of two channels."""
    if rng.random() < 0.5:
        _rows(columns, rng.permutation(len(columns["time_s"])))
    elif set(MEASURED) <= set(columns):
        one, two = MEASURED
        columns[one], columns[two] = columns[two], columns[one]


def wrong_rig(columns: Columns, rig: dict[str, Any], rng: np.random.Generator) -> None:
    """Declare something else than the rig."""
    changes: list[dict[str, Any]] = [
        {"muscle": {"rest_length_mm": float(rng.choice([20.0, 60.0, 900.0, 5000.0]))}},
        {"muscle": {"rest_length_mm": 180.0, "diameter_mm": float(rng.choice([1.0, 3.0, 100.0]))}},
        {"regulator": {"max_pressure_bar": float(rng.choice([0.5, 2.0, 15.0]))}},
        {"load": "constant_force"},
        {"sensors": {"contraction_noise_mm": float(rng.choice([1e-5, 5.0]))}},
        {"sensors": {"pressure_noise_bar": float(rng.choice([1e-6, 1.0]))}},
        {"repeats": [], "valve_closed": [], "tolerance": {}},
        {"valve_closed": list(dict.fromkeys(map(str, columns.get("segment", ()))))[:3]},
        {"history": {"rezeroed": True, "cycles_since_rest": 50}},
        {"tolerance": {"mass.load": 1.0}},
    ]
    rig |= changes[int(rng.integers(len(changes)))]


SPOILS: dict[str, Spoil] = {
    spoil.__name__: spoil
    for spoil in (
        *(drop_column, empty_block, repeat_rows, freeze, swap_unit, truncate),
        *(cut_gap, jump, turn_sign, extremes, scramble, wrong_rig),
    )
}
STAGES = {
    "no_experiment": "pam_envs.diagnosis.diagnosis.Study.experiment",
    "no_closed_loop": "pam_envs.diagnosis.diagnosis.Study.close_loop",
    "no_plans": "pam_envs.diagnosis.diagnosis.propose",
    "no_controllers": "pam_envs.diagnosis.closed_loop.gain.closed_loop",
}
"""Optional stages that are made to fail, and the functions that raise."""


def cases(offset: int = 0) -> list[Case]:
    """Return the cases: every way to spoil a recording alone and two at once, failing stages."""
    start = first_seed("mutilated", offset)
    rng = np.random.default_rng(start)
    ways, stages, made = list(SPOILS), list(STAGES), []
    for k in range(NUMBER):
        turn, place = divmod(k, len(ways))
        names: tuple[str, ...] = (ways[place],)
        if k % EVERY == 0:
            names = (stages[k // EVERY % len(stages)],)
        elif turn % 2:
            names += (str(rng.choice([way for way in ways if way not in names])),)
        made.append(Case("mutilated", start + k, names, campaign="short"))
    return made


def files(case: Case, folder: Path) -> tuple[Path, Path]:
    """Write recording and rig file of a case and return their paths."""
    rng = np.random.default_rng(case.seed)
    campaign, rig = CAMPAIGNS[case.campaign](case.seed), draw_rig(case.world, rng)
    effects = [(draw_effect(str(rng.choice(EFFECTS)), rig, rng), AMPLITUDE)]
    columns: Columns = {
        name: np.array(values)
        for name, values in columns_of(rig, effects, campaign, case.seed).items()
    }
    content = rig_content(sheet_of(rig, campaign))
    with np.errstate(all="ignore"):
        for name in case.names:
            if name in SPOILS and len(columns.get("time_s", ())):
                SPOILS[name](columns, content, rng)
    paths = folder / "recording.csv", folder / "rig.yaml"
    paths[0].write_text(csv_text(columns).replace("nan", ""), encoding="utf-8")
    paths[1].write_text(yaml.safe_dump(content), encoding="utf-8")
    return paths


def study(case: Case, stages: Collection[str] = ("verdict",)) -> dict[str, Any]:
    """Spoil a recording, diagnose it, and return outcome and message as plain types."""
    started = clock.perf_counter()
    record: dict[str, Any] = {"schema": 1, "case": case.record(), "failure": None}
    spent = record["volatile"] = provenance.occasion() | {"runtime_s": None}
    try:
        with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
            for way in filter(STAGES.__contains__, case.names):
                fails = mock.patch(STAGES[way], side_effect=RuntimeError(f"{way} fails"))
                stack.enter_context(fails)
            record |= diagnosed(*files(case, Path(name)), Path(name) / "found")
    except Exception as error:
        record["failure"] = f"{type(error).__name__}: {error}"
    spent["runtime_s"] = clock.perf_counter() - started
    return dict(plain(record))


def diagnosed(recording: Path, rig: Path, out: Path) -> dict[str, Any]:
    """Diagnose two files as the command line does, and return outcome and message."""
    try:
        sheet = Rig.from_yaml(rig)
        data = read_input(recording, sheet)
        if not isinstance(data, Recording):
            return {"outcome": "refused", "message": "read as settled readings"}
        found = diagnose(data, rig=sheet, progress=False)
        found.write(out)
    except ValueError as error:
        clear = len(str(error)) >= LEAST_SENTENCE and " " in str(error)
        return {"outcome": "refused" if clear else "lost", "message": str(error)}
    missing = [name for name in FILES if not (out / name).is_file()]
    if missing:
        return {"outcome": "lost", "message": f"without {', '.join(missing)}"}
    verdict = json.loads((out / "report.json").read_text(encoding="utf-8"))["verdict"]
    return {"outcome": "report", "message": verdict}


def outcome(record: Mapping[str, Any]) -> str:
    """Return the outcome of a record; another exception than a ValueError loses the report."""
    return "lost" if record["failure"] else str(record["outcome"])


def figures(records: Sequence[Mapping[str, Any]]) -> Numbers:
    """Return the outcomes, in total and by way of spoiling."""
    return {
        "lost": share(outcome(record) == "lost" for record in records),
        "stages_lost": share(
            outcome(record) != "report"
            for record in records
            if not STAGES.keys().isdisjoint(record["case"]["names"])
        ),
        "by_way": {
            way: dict(Counter(outcome(r) for r in records if way in r["case"]["names"]))
            for way in (*SPOILS, *STAGES)
        },
        "verdicts": dict(
            Counter(r["message"] for r in records if outcome(r) == "report").most_common()
        ),
        "losses": list(_losses(records)),
    }


def _losses(records: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for record in records:
        if outcome(record) == "lost":
            ways = " + ".join(record["case"]["names"])
            said = record["failure"] or record["message"]
            yield f"{record['case']['seed']} {ways}: {said}"


def page(made: Numbers, arguments: str) -> str:
    """Return the page, in Markdown, from the figures and the arguments of the command."""
    rows = [
        [f"`{way}`", *[found.get(word, 0) for word in OUTCOMES]]
        for way, found in made["by_way"].items()
    ]
    lost, stages = made["lost"], made["stages_lost"]
    met = "reached" if lost["count"] == 0 else "**missed**"
    return (
        "# Diagnosis of mutilated recordings\n\n"
        f"Made by `python -m benchmarks diagnosis {arguments}`; do not edit. Each of {lost['n']} "
        "recordings is spoiled in one or two ways, or has an optional stage that fails. It ends in "
        "a *report*, is *refused* by an error that states the remedy, or is *lost*.\n\n"
        f"- lost: {lost['count']} of {lost['n']}, {share_text(lost)}; target 0, {met}\n"
        f"- without a report because an optional stage failed: {stages['count']} of "
        f"{stages['n']}; target 0\n\n"
        + table(["way", *OUTCOMES], rows, True)
        + "\nVerdicts of the reports: "
        + ", ".join(f"{verdict} {n}" for verdict, n in made["verdicts"].items())
        + ".\n"
        + ("\n## Lost\n\n" + bullets(made["losses"]) if made["losses"] else "")
    )


def write(records: Sequence[Mapping[str, Any]], folder: Path, arguments: str = "") -> list[Path]:
    """Write ``diagnosis_mutilated.md`` and ``.json`` and return their paths."""
    made = figures(records)
    numbers = {"arguments": arguments, "figures": made}
    return write_page(folder / "diagnosis_mutilated", page(made, arguments), **numbers)
