"""Page and statistics of the study over families, from its records."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosis.counts import Answer, Numbers, firsts, line, share, spread
from benchmarks.diagnosis.families.cases import HELD_OUT, PLACES, effects_of, parts_of
from benchmarks.diagnosis.markdown import (
    bullets,
    counted,
    named_counts,
    number,
    share_text,
    table,
    write_page,
)
from tests.diagnosis.pair_worlds import FAMILIES

PREFACE = Path(__file__).with_suffix(".md")


def figures(records: Sequence[Mapping[str, Any]]) -> Numbers:
    """Return all statistics of the page from the records."""
    made = [record for record in records if not record.get("unmade")]
    answers = [Answer.of(record) for record in made]
    unmade = Counter(
        f"{r['case']['world']} {'+'.join(r['case']['names'])}" for r in records if r.get("unmade")
    )
    return {
        "cases": dict(sorted(Counter(one.kind for one in answers).items())),
        "unmade": dict(unmade.most_common()),
        "rule_versions": sorted({r["rule_version"] for r in made if not r["failure"]}),
        "places": {p: of_some([one for one in answers if one.world == p]) for p in PLACES},
        "families": {
            name: of_some([one for one in answers if parts_of(one.world)[0] == name])
            for name in FAMILIES
        },
        "causes": {
            family: {
                name: of_some([one for one in _of(answers, family) if one.truth == (name,)])
                for name in effects_of(family)
            }
            for family in FAMILIES
        },
        "failures": [f"{line(one)}: {one.record['failure']}" for one in answers if one.failed],
    }


def _of(answers: Sequence[Answer], family: str) -> list[Answer]:
    return [one for one in answers if parts_of(one.world)[0] == family]


def of_some(answers: Sequence[Answer]) -> Numbers:
    """Return the statistics of some answers."""
    single = [one for one in answers if one.kind == "single"]
    clean = [one for one in answers if one.kind == "clean"]
    errors = [one.held_out for one in answers if one.held_out is not None]
    return {
        "right_first": share(one.right_first for one in single),
        "exact": share(one.exact for one in single),
        "wrong": share(one.wrong for one in single),
        "unexplained": share(one.verdict == "unexplained" for one in single),
        "false_names": share(one.claims or one.failed for one in clean),
        "unexplained_clean": share(one.verdict == "unexplained" for one in clean),
        "mistaken": firsts(one for one in single if not one.right_first),
        "alarms": firsts(one for one in clean if one.claims or one.failed),
        "error": float(np.median(errors)) if errors else None,
        "runtime_s": spread(
            one.record.get("volatile", {}).get("runtime_s") for one in answers if not one.failed
        ),
    }


def page(made: Numbers, arguments: str) -> str:
    """Return the page, in Markdown, from the figures and the arguments of the command."""
    preface = PREFACE.read_text(encoding="utf-8").format(
        arguments=arguments,
        cases=sum(made["cases"].values()),
        rules=", ".join(made["rule_versions"]) or "-",
    )
    parts = [preface, "\n## By family\n\n", _table("family", made["families"])]
    parts += ["\n## By family and world\n\n", _table("family and world", made["places"])]
    parts += ["\n## By cause\n\n", _causes_table(made)]
    alarms = {name: found["alarms"] for name, found in made["families"].items()}
    lines = [
        f"`{name}`, names on clean rigs: {named_counts(found)}" for name, found in alarms.items()
    ]
    lines.append(
        f"effects that did not reach their size, not diagnosed: {named_counts(made['unmade'])}"
    )
    parts += ["\n## Further counts\n\n", bullets(lines)]
    if made["failures"]:
        parts += ["\n## Failed runs\n\n", bullets(made["failures"])]
    return "".join(parts).rstrip() + "\n"


def _table(what: str, rows: Mapping[str, Numbers]) -> str:
    head = [what, "n", "correct first", "without doubt", "wrong name", "`unexplained`"]
    head += ["clean: wrong name", "clean: `unexplained`", "error", "median s"]
    lines = []
    for name, found in rows.items():
        bold = "**" if parts_of(name)[1] in HELD_OUT else ""
        first = found["right_first"]
        cells = [f"{bold}`{name}`{bold}", first["n"], share_text(first)]
        keys = ("exact", "wrong", "unexplained", "false_names", "unexplained_clean")
        cells += [counted(found[key]) for key in keys]
        cells += [number(found["error"]), number(found["runtime_s"]["median"], ".0f")]
        lines.append(cells)
    return table(head, lines, True)


def _causes_table(made: Numbers) -> str:
    head = ["cause", *made["causes"], "otherwise"]
    names = list(dict.fromkeys(name for by in made["causes"].values() for name in by))
    rows = []
    for name in names:
        found = [by.get(name) for by in made["causes"].values()]
        mistaken: Counter[str] = Counter()
        for one in found:
            mistaken.update(one["mistaken"] if one else {})
        shares = [counted(one["right_first"]) if one else "-" for one in found]
        rows.append([f"`{name}`", *shares, named_counts(dict(mistaken.most_common()))])
    return table(head, rows, True)


def write(records: Sequence[Mapping[str, Any]], folder: Path, arguments: str = "") -> list[Path]:
    """Write ``diagnosis_families.md`` and ``diagnosis_families.json`` and return their paths."""
    made = figures(records)
    cases = [line(Answer.of(record)) for record in records if not record.get("unmade")]
    numbers = {"arguments": arguments, "figures": made, "cases": cases}
    return write_page(folder / "diagnosis_families", page(made, arguments), **numbers)
