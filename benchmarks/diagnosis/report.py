"""The page, the numbers and the figure of the diagnosis benchmark, from its records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosis import counts as counting
from benchmarks.diagnosis.counts import BINS, GAP, HELD_OUT, VERDICTS, Numbers, Told, share
from benchmarks.diagnosis.figure import picture
from benchmarks.runs.store import write_bytes, write_record, write_text
from tests.diagnosis.hidden import EFFECTS

LETTERS = dict(zip(VERDICTS, "NAOUIF", strict=True))
MOST_CONFUSED = 15
CASES, CLEAN = 40, 300
"""Cases wanted of every cause at size 1 and above, and of rigs without one."""
SECONDS, POST_HOC_MM = 10.0, 0.23

PREFACE = """\
# Diagnosis of rigs that hide an effect

Made by `python -m benchmarks diagnosis {arguments}`; do not edit. {cases} drawn cases, decision
rule {rules}.

Each case is a simulated rig that shares no code with the plants and hides effects in another
mathematical form than the diagnosis fits. The diagnosis sees its recording (five minutes at 50 Hz)
and what an honest owner tells of it.

- The **size** of an effect is the RMS of what remains of it after the base has been refitted to the
  rig without noise, over the noise, on the output where it is largest. Sizes are drawn
  log-uniformly, alike for every cause: from 1 to 5 (*single*) and from 0.1 to 1 (*weak*).
- A cause counts as **named** where the verdict is `named`, or `ambiguous` with it in the first
  place. **Without doubt** is `named`, with all that is there and nothing else. A **wrong name** is
  the verdict `named` with a cause that is not there, alone or beside the right one.
- A trace found and the true one are compared after the same projection: without what refitting the
  base takes up. In closed loop errors are those of the true position; the causes that a controller
  can compensate are fixed beforehand.
- A failed run counts as wrong. Intervals are exact (Clopper-Pearson) at 95 %, bounds one-sided.
"""


def figures(
    records: Sequence[Mapping[str, Any]],
    tables: Mapping[str, Any] | None = None,
    whole_report_s: Sequence[float] = (),
) -> Numbers:
    """Return all numbers of the page.

    Parameters
    ----------
    records : sequence of mappings
        From :func:`benchmarks.diagnosis.run.run`.
    tables : mapping, optional
        Report of :func:`pam_envs.diagnosis.static.diagnosis.diagnose_readings` on the measured
        tables.
    whole_report_s : sequence of float
        Time [s] that whole reports of 10 minutes at 50 Hz took on 2 cores.
    """
    told = [Told.of(record) for record in records]
    by_kind: dict[str, list[Told]] = {}
    for one in told:
        by_kind.setdefault(one.kind, []).append(one)
    single, weak = by_kind.get("single", []), by_kind.get("weak", [])
    alone = single + weak
    return {
        "cases": {kind: len(ones) for kind, ones in sorted(by_kind.items())},
        "rule_versions": sorted({r["rule_version"] for r in records if not r["failure"]}),
        "verdicts": counting.verdicts_by_size(alone),
        "confusion": counting.confusion(single),
        "confused": counting.confused(alone + by_kind.get("loud", [])),
        "curve": counting.curve(alone),
        "by_cause": {name: counting.of_cause(name, single, weak) for name in EFFECTS},
        "right_first": share(one.right_first for one in single),
        "least_right_first": counting.least_right(single),
        "exact": share(one.exact for one in single),
        "wrong": share(one.wrong for one in alone),
        "wrong_first": share(one.wrong and not one.extra for one in alone),
        "extra": share(one.extra or one.verdict == "failed" for one in single),
        "extra_weak": share(one.extra or one.verdict == "failed" for one in weak),
        "ambiguous_with_truth": share(o.listed for o in alone if o.verdict == "ambiguous"),
        "loud": share(one.right_first for one in by_kind.get("loud", [])),
        "loud_exact": share(one.exact for one in by_kind.get("loud", [])),
        "loud_wrong": share(one.wrong for one in by_kind.get("loud", [])),
        **counting.without_truth(by_kind),
        **counting.of_pairs(by_kind.get("pair", [])),
        "trace": counting.spread(one.trace_error for one in single if one.right_first),
        "trace_pairs": counting.spread(
            found["error"] for one in by_kind.get("pair", []) for found in one.traces.values()
        ),
        "held_out": share(
            (one.held_out or np.inf) <= HELD_OUT for one in told if one.verdict == "named"
        ),
        "held_out_spread": counting.spread(one.held_out for one in told if one.verdict == "named"),
        "recovery": counting.recovery(alone),
        "next": counting.following(told),
        "loop": counting.closed_loops(told),
        "tables": _of_tables(tables),
        "whole_report_s": counting.spread(whole_report_s),
        "runtime_s": counting.spread(r.get("volatile", {}).get("runtime_s") for r in records),
        "failures": [
            f"{counting.line(one)}: {one.record['failure']}"
            for one in told
            if one.verdict == "failed"
        ],
    }


def _of_tables(report: Mapping[str, Any] | None) -> Numbers:
    """Return by how much the error on a load left out is cut; None for all without a report."""
    names = ("value", "interval", "before_mm", "linear_mm", "post_hoc_mm", "floor_mm")
    if report is None:
        return {"n": 0, **dict.fromkeys(names)}
    read, floor = report["readings"], report["noise_floor"]["contraction"]["value"]
    cut, laws = read["loads_left_out"], [law["load_left_out_mm"] for law in read["load_laws"]]
    share_cut = [0.01 * v for v in (cut["cut_percent"]["value"], *cut["cut_percent"]["interval"])]
    errors = (cut["before"]["value"], cut["after"]["value"], min(laws, default=None), floor)
    found = (share_cut[0], share_cut[1:], *errors)
    n = sum(len(repeat) for repeat in read["curves"]["readings_mm"])
    return {"n": n, **dict(zip(names, found, strict=True))}


def _percent(found: Mapping[str, Any], key: str = "value") -> str:
    return "-" if found[key] is None else f"{100.0 * found[key]:.1f} %"


def _told(found: Mapping[str, Any]) -> str:
    """Return a share with its interval."""
    if not found["n"]:
        return "not run"
    low, high = (100.0 * v for v in found["interval"])
    return f"{_percent(found)} [{low:.1f}, {high:.1f}]"


def _bound(found: Mapping[str, Any]) -> str:
    """Return a share with its upper bound."""
    return f"{_percent(found)}, bound {_percent(found, 'upper')}" if found["n"] else "not run"


def _reached(found: Mapping[str, Any], key: str) -> str:
    """Return a share with its interval or bound, or a quantile."""
    told = {"value": _told, "upper": _bound}.get(key)
    return told(found) if told else _percent(found, key)


def _number(value: float | None, form: str = ".2f") -> str:
    return "-" if value is None else format(value, form)


def _table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    lines = [head, [":--", *["--:"] * (len(head) - 1)], *rows]
    return "".join(f"| {' | '.join(map(str, row))} |\n" for row in lines) + "\n"


def targets(made: Numbers) -> list[tuple[str, str, str, int, bool | None]]:
    """Return figure, target, what was reached, of how many, and whether it is met."""
    rows: list[tuple[str, str, str, int, bool | None]] = []

    def row(label: str, target: str, told: str, n: int, met: Any) -> None:
        rows.append((label, target, told if n else "not run", n, bool(met) if n else None))

    def at_least(
        label: str, found: Numbers, least: float, more: str = "", key: str = "value"
    ) -> None:
        n = found["n"]
        met = n and found[key] >= least
        row(label, f"at least {100 * least:g} %", _reached(found, key) + more, n, met)

    def at_most(label: str, found: Numbers, most: float, key: str = "upper", of: int = 1) -> None:
        n, what = found["n"], "bound at most" if key == "upper" else "at most"
        target = f"{what} {100 * most:g} %" + f", n at least {of}" * (of > 1)
        row(label, target, _reached(found, key), n, n >= of and found[key] <= most)

    single, least, ahead = made["right_first"], made["least_right_first"], made["next"]
    few, name = min((c["right_first"]["n"], name) for name, c in made["by_cause"].items())
    told = f"{few} (`{name}`)"
    label = "cases of the rarest cause, size 1 and above"
    row(label, f"at least {CASES}", told, single["n"], few >= CASES)
    at_least("right name first, size 1 and above", single, 0.98)
    at_least("the same, for the worst cause", least, 0.85, f" (`{least['name']}`)")
    at_least("named right without doubt", made["exact"], 0.95)
    at_most("wrong name, any size", made["wrong"], 0.01)
    at_most("false alarm, clean rigs and decoys", made["false_alarms"], 0.01, of=CLEAN)
    at_least("outside the catalogue: `unexplained`", made["unknown"], 0.95)
    at_least("two effects: both", made["pair"], 0.85)
    at_most("a wrong extra cause on single ones", made["extra"], 0.05, "value")
    at_most("error of the effect's trace, median", made["trace"], 0.15, "median")
    at_least(f"held-out error at most {HELD_OUT:g} times the floor", made["held_out"], 0.90)
    at_least("next experiment resolves, where it promises to", ahead["resolved"], 0.80)
    at_least("where none promises to, it says so", ahead["told_none"], 1.0)
    at_least("three times the noise: right name first", made["loud"], 0.97)
    took, table, loop = made["whole_report_s"], made["tables"], made["loop"]
    n, most, label = took["n"], took["most"], "10 minutes at 50 Hz on 2 cores: whole report"
    row(label, f"at most {SECONDS:g} s", f"{_number(most, '.1f')} s", n, n and most <= SECONDS)
    told = f", {_number(table['before_mm'])} to {_number(table['linear_mm'])} mm"
    at_least("measured tables, a load left out, linear law: error cut", table, 0.30, told)
    n, late = table["n"], table["post_hoc_mm"]
    told = f"{_number(late)} mm; floor {_number(table['floor_mm'], '.3f')} mm"
    met, label = n and round(late, 2) <= POST_HOC_MM, "the same, exponent post hoc, not held out"
    row(label, f"about {POST_HOC_MM} mm", told, n, met)
    gap = f"closed loop, gap of at least {100 * GAP:g} %"
    at_least(f"{gap}: part recovered, median", loop["recovered"], 0.70, key="median")
    at_most(f"{gap}: over 5 % worse", loop["worse"], 0.05, "value")
    return rows


def page(made: Numbers, arguments: str) -> str:
    """Return the page, in Markdown.

    Parameters
    ----------
    made : dict
        From :func:`figures`.
    arguments : str
        Of the command that makes it.
    """
    words = {True: "reached", False: "**missed**", None: "not run"}
    head = ["figure", "target", "reached", "n", ""]
    rows = [(*row[:4], words[row[4]]) for row in targets(made)]
    parts = [
        PREFACE.format(
            arguments=arguments,
            cases=sum(made["cases"].values()),
            rules=", ".join(made["rule_versions"]) or "-",
        ),
        "\n## Figures and targets\n\n",
        _table(head, rows),
        "The measured tables in full: `docs/diagnosis_tables.md`.\n\n",
        "Cases: " + ", ".join(f"{n} {kind}" for kind, n in made["cases"].items()) + ".\n\n",
        "![confusion matrix and detection curve](diagnosis.png)\n\n",
        *["## By cause, size 1 and above\n\n", _causes_table(made)],
        *["## What is taken for what\n\n", _confused_lists(made)],
        *["## Verdicts by cause and size\n\n", _verdict_table(made)],
        *["## Detection against size\n\n", _curve_table(made)],
        *["## Rigs without a cause, unknown effects, pairs\n\n", _others(made)],
        *["## After the diagnosis\n\n", _after(made)],
    ]
    if made["failures"]:
        parts += ["## Failed runs\n\n", _bullets(made["failures"])]
    return "".join(parts).rstrip() + "\n"


def _bullets(lines: Iterable[str]) -> str:
    return "".join(f"- {text}\n" for text in lines) + "\n"


def _causes_table(made: Numbers) -> str:
    head = ["cause", "n", "right first", "without doubt", "in doubt, listed", "wrong, any size"]
    head += ["raw / size", "trace error", "held out", "found / true", "rank correlation"]
    rows = []
    for name, found in made["by_cause"].items():
        if not found["wrong"]["n"]:
            continue
        doubt, wrong, back = found["ambiguous_with_truth"], found["wrong"], found["recovery"]
        right, raw, trace = found["right_first"], found["raw"], found["trace"]
        cells = [f"`{name}`", right["n"], _told(right), _percent(found["exact"])]
        cells += [f"{some['count']} of {some['n']}" for some in (doubt, wrong)]
        cells += [_number(raw["median"]), _percent(trace, "median"), _percent(found["held_out"])]
        rows.append([*cells, _number(back["median_ratio"]), _number(back["rank_correlation"])])
    note = (
        "*Raw / size*: the effect before the base is refitted over what remains, in the median. "
        f"*Held out*: part of the named cases with at most {HELD_OUT:g} times the noise floor. "
        "*Found / true*: RMS of the effect found over that hidden, in the median, and the rank "
        "correlation of the two over all sizes.\n\n"
    )
    return _table(head, rows) + note


def _confused_lists(made: Numbers) -> str:
    titles = {
        "first": "A wrong cause in the first place (any size, any noise)",
        "extra": "A wrong cause beside the right one",
        "open": "Not excluded beside the truth, or in its place",
    }
    text = ""
    for what, title in titles.items():
        listed = made["confused"][what][:MOST_CONFUSED]
        lines = [f"`{truth}` as `{said}`: {n}" for truth, said, n in listed] or ["none"]
        text += f"{title}:\n\n{_bullets(lines)}"
    return text


def _verdict_table(made: Numbers) -> str:
    legend = ", ".join(f"{LETTERS[verdict]} {verdict}" for verdict in VERDICTS)
    head = ["cause", *[f"{low:g} to {high:g}" for low, high in BINS]]
    rows = [
        [f"`{name}`", *[" ".join(f"{LETTERS[v]}{n}" for v, n in c.items()) for c in bins.values()]]
        for name, bins in made["verdicts"].items()
    ]
    return f"{legend}.\n\n" + _table(head, rows)


def _curve_table(made: Numbers) -> str:
    keys = ("detected", "right_first", "exact", "wrong")
    head = ["size", "n", "something is missing", "right first", "without doubt", "wrong name"]
    rows = [
        [f"{c['low']:g} to {c['high']:g}", c["exact"]["n"], *[_told(c[k]) for k in keys]]
        for c in made["curve"]
    ]
    return _table(head, rows)


def _others(made: Numbers) -> str:
    alarms = ", ".join(f"`{name}` {n}" for name, n in made["alarms"].items()) or "none"
    lines = [
        f"false alarm, clean: {_bound(made['false_alarms_clean'])}",
        f"false alarm, decoys (a wrong value of a base parameter): "
        f"{_bound(made['false_alarms_decoy'])}",
        f"a cause claimed on either: {_bound(made['false_names'])}",
        f"what the alarms said: {alarms}",
        f"recordings in which nothing moves: `insufficient` {_told(made['idle'])}",
        f"false alarm, clean rigs recorded for 30, 60 or 120 s: "
        f"{_bound(made['false_alarms_brief'])}; answers: "
        + (", ".join(f"`{name}` {n}" for name, n in made["brief"].items()) or "none"),
        f"pairs: both named without doubt {_told(made['pair_exact'])}, only one of them "
        f"{_told(made['pair_one'])}, a wrong name {_told(made['pair_wrong'])}, right name first "
        f"{_told(made['pair_first'])}; trace error {_percent(made['trace_pairs'], 'median')}",
        f"a wrong extra cause on weak ones: {_told(made['extra_weak'])}",
        f"a wrong name in the first place, any size: {_bound(made['wrong_first'])}",
        f"ambiguous, with the truth among what is not excluded: "
        f"{_told(made['ambiguous_with_truth'])}",
        f"three times the noise: without doubt {_told(made['loud_exact'])}, a wrong name "
        f"{_told(made['loud_wrong'])}",
    ]
    rows = []
    for name, found in made["unknown_by_kind"].items():
        others = ", ".join(f"{k} {n}" for k, n in found["others"].items())
        rows.append([f"`{name}`", found["n"], _told(found), others])
    unknown = _table(["outside the catalogue", "n", "`unexplained`", "else"], rows) if rows else ""
    return _bullets(lines) + unknown


def _after(made: Numbers) -> str:
    held, back, took = made["held_out_spread"], made["recovery"], made["runtime_s"]
    ahead, loop = made["next"], made["loop"]
    better = loop["better_percent"]
    lines = [
        f"held-out error over the noise floor, the worse output, of {held['n']} named cases: "
        f"median {_number(held['median'])}, 90 % quantile {_number(held['q90'])}",
        f"RMS of the effect found over that hidden: median {_number(back['median_ratio'])}, rank "
        f"correlation {_number(back['rank_correlation'])} (n = {back['n']})",
        f"{ahead['ambiguous']} ambiguous cases, {ahead['promised']} with an experiment that "
        f"promises at least one noise variance; resolved {_told(ahead['resolved'])}",
        f"closed loop on the hidden rig: {loop['n']} cases, {loop['gap']} with a gap of at least "
        f"{100 * GAP:g} % between the old plant and the rig itself; over all, better by "
        f"{_number(better['median'], '.1f')} % in the median ({_number(better['q10'], '.1f')} to "
        f"{_number(better['q90'], '.1f')}); over 5 % worse {_told(loop['worse_of_all'])}",
        f"seconds a diagnosis: median {_number(took['median'], '.1f')}, 90 % quantile "
        f"{_number(took['q90'], '.1f')}, 99 % {_number(took['q99'], '.1f')}, most "
        f"{_number(took['most'], '.1f')}",
    ]
    text = _bullets(lines)
    if loop["n"]:
        rows = [
            [
                f"`{name}`",
                *[found["n"], found["gap"], _percent(found["recovered"], "median")],
                _number(found["better_percent"]["median"], ".1f"),
            ]
            for name, found in loop["by_cause"].items()
        ]
        text += _table(["closed loop", "n", "with a gap", "recovered", "better [%]"], rows)
    if ahead["unresolved"]:
        text += "Experiments that did not resolve what they promised:\n\n"
        text += _bullets(ahead["unresolved"])
    return text


def write(
    records: Sequence[Mapping[str, Any]], folder: Path, arguments: str = "", **beside: Any
) -> list[Path]:
    """Write ``diagnosis.md``, ``diagnosis.json`` and ``diagnosis.png`` and return their paths.

    Parameters
    ----------
    records : sequence of mappings
    folder : Path
    arguments : str
        Of the command that makes them.
    **beside
        What :func:`figures` takes beside the records.
    """
    made = figures(records, **beside)
    paths = [folder / f"diagnosis.{kind}" for kind in ("md", "json", "png")]
    write_text(paths[0], page(made, arguments))
    lines = [counting.line(Told.of(record)) for record in records]
    write_record(paths[1], {"schema": 1, "arguments": arguments, "figures": made, "cases": lines})
    write_bytes(paths[2], picture(made))
    return paths
