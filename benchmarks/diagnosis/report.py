"""Page, statistics and figure of the diagnosis benchmark, from its records."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.diagnosis import counts as counting
from benchmarks.diagnosis.counts import BINS, GAP, HELD_OUT, VERDICTS, Answer, Numbers, share
from benchmarks.diagnosis.figure import picture
from benchmarks.diagnosis.markdown import (
    bound_text,
    bullets,
    number,
    percent,
    reached,
    share_text,
    table,
)
from benchmarks.runs.store import write_record
from pam_envs.files import write_bytes, write_text
from tests.diagnosis.hidden import EFFECTS

LETTERS = dict(zip(VERDICTS, "NAOUIF", strict=True))
MOST_CONFUSED = 15
CASES, CLEAN = 40, 300
"""Least numbers of cases of every cause at sizes above 1, and of rigs without a cause."""
SECONDS, POST_HOC_MM = 10.0, 0.23

PREFACE = Path(__file__).with_suffix(".md")


def figures(
    records: Sequence[Mapping[str, Any]],
    tables: Mapping[str, Any] | None = None,
    whole_report_s: Sequence[float] = (),
) -> Numbers:
    """Return all statistics of the page from the records, the tables report and durations [s]."""
    answers = [Answer.of(record) for record in records]
    kinds = defaultdict[str, list[Answer]](list)
    for one in answers:
        kinds[one.kind].append(one)
    cases = {kind: len(ones) for kind, ones in sorted(kinds.items())}
    single, weak = kinds["single"], kinds["weak"]
    alone, named = single + weak, [one for one in answers if one.verdict == "named"]
    failed = [one for one in answers if one.failed]
    pairs = [found["error"] for one in kinds["pair"] for found in one.traces.values()]
    return {
        "cases": cases,
        "rule_versions": sorted({r["rule_version"] for r in records if not r["failure"]}),
        "verdicts": counting.verdicts_by_size(alone),
        "confusion": counting.confusion(single),
        "confused": counting.confused(alone + kinds["loud"]),
        "curve": counting.curve(alone),
        "by_cause": {name: counting.of_cause(name, single, weak) for name in EFFECTS},
        **counting.shares(kinds),
        "least_right_first": counting.least_right(single),
        "ambiguous_with_truth": share(o.listed for o in alone if o.verdict == "ambiguous"),
        "alarms": counting.firsts(o for o in kinds["clean"] + kinds["decoy"] if o.alarm),
        "brief": counting.firsts(kinds["brief"]),
        "unknown_by_kind": counting.unknown_by_kind(kinds["unknown"]),
        "trace": counting.spread(one.trace_error for one in single if one.right_first),
        "trace_pairs": counting.spread(pairs),
        "held_out": counting.held_out_share(answers),
        "held_out_spread": counting.spread(one.held_out for one in named),
        "recovery": counting.recovery(alone),
        "next": counting.following(answers),
        "loop": counting.closed_loops(answers),
        "tables": _of_tables(tables),
        "whole_report_s": counting.spread(whole_report_s),
        "runtime_s": counting.spread(r.get("volatile", {}).get("runtime_s") for r in records),
        "failures": [f"{counting.line(one)}: {one.record['failure']}" for one in failed],
    }


def _of_tables(report: Mapping[str, Any] | None) -> Numbers:
    """Return the decrease of the error on a held-out load; None without a report."""
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


def targets(made: Numbers) -> list[tuple[str, str, str, int, bool | None]]:
    """Return figure, target, reached value, number of cases, and whether the target is met."""
    rows: list[tuple[str, str, str, int, bool | None]] = []

    def row(label: str, target: str, value: str, n: int, met: Any) -> None:
        rows.append((label, target, value if n else "not run", n, bool(met) if n else None))

    def at_least(
        label: str, found: Numbers, least: float, more: str = "", key: str = "value"
    ) -> None:
        n = found["n"]
        met = n and found[key] >= least
        row(label, f"at least {100 * least:g} %", reached(found, key) + more, n, met)

    def at_most(label: str, found: Numbers, most: float, key: str = "upper", of: int = 1) -> None:
        n, what = found["n"], "bound at most" if key == "upper" else "at most"
        target = f"{what} {100 * most:g} %" + f", n at least {of}" * (of > 1)
        row(label, target, reached(found, key), n, n >= of and found[key] <= most)

    single, least, ahead = made["right_first"], made["least_right_first"], made["next"]
    few, name = min((c["right_first"]["n"], name) for name, c in made["by_cause"].items())
    value = f"{few} (`{name}`)"
    label = "cases of the rarest cause, sizes above 1"
    row(label, f"at least {CASES}", value, single["n"], few >= CASES)
    at_least("correct name first, sizes above 1", single, 0.98)
    at_least("the same, for the worst cause", least, 0.85, f" (`{least['name']}`)")
    at_least("correct and unambiguous", made["exact"], 0.95)
    at_most("wrong name, any size", made["wrong"], 0.01)
    at_most("false alarm, clean rigs and decoys", made["false_alarms"], 0.01, of=CLEAN)
    at_least("outside the catalogue: `unexplained`", made["unknown"], 0.95)
    at_least("two effects: both", made["pair"], 0.85)
    at_most("wrong extra cause on single effects", made["extra"], 0.05, "value")
    at_most("error of the effect's trace, median", made["trace"], 0.15, "median")
    at_least(f"held-out error at most {HELD_OUT:g} times the noise floor", made["held_out"], 0.90)
    at_least("proposed experiment resolves the ambiguity", ahead["resolved"], 0.80)
    at_least("no sufficient experiment: reported as such", ahead["told_none"], 1.0)
    at_least("three times the noise: correct name first", made["loud"], 0.97)
    took, table, loop = made["whole_report_s"], made["tables"], made["loop"]
    n, most, label = took["n"], took["most"], "10 minutes at 50 Hz on 2 cores: whole report"
    row(label, f"at most {SECONDS:g} s", f"{number(most, '.1f')} s", n, n and most <= SECONDS)
    value = f", {number(table['before_mm'])} to {number(table['linear_mm'])} mm"
    at_least("measured tables, held-out load, linear law: error decrease", table, 0.30, value)
    n, late = table["n"], table["post_hoc_mm"]
    value = f"{number(late)} mm; noise floor {number(table['floor_mm'], '.3f')} mm"
    met, label = n and round(late, 2) <= POST_HOC_MM, "the same, exponent post hoc, not held out"
    row(label, f"about {POST_HOC_MM} mm", value, n, met)
    gap = f"closed loop, gap of at least {100 * GAP:g} %"
    at_least(f"{gap}: part recovered, median", loop["recovered"], 0.70, key="median")
    at_most(f"{gap}: over 5 % worse", loop["worse"], 0.05, "value")
    return rows


def page(made: Numbers, arguments: str) -> str:
    """Return the page, in Markdown, from :func:`figures` and the arguments of the command."""
    words = {True: "reached", False: "**missed**", None: "not run"}
    head = ["figure", "target", "reached", "n", ""]
    rows = [(*row[:4], words[row[4]]) for row in targets(made)]
    parts = [
        PREFACE.read_text(encoding="utf-8").format(
            arguments=arguments,
            cases=sum(made["cases"].values()),
            rules=", ".join(made["rule_versions"]) or "-",
        ),
        "\n## Figures and targets\n\n",
        table(head, rows, True) + "\n",
        "The measured tables in full: `docs/diagnosis_tables.md`.\n\n",
        "Cases: " + ", ".join(f"{n} {kind}" for kind, n in made["cases"].items()) + ".\n\n",
        "![confusion matrix and detection curve](diagnosis.png)\n\n",
        *["## By cause, sizes above 1\n\n", _causes_table(made)],
        *["## Confusions\n\n", _confused_lists(made)],
        *["## Verdicts by cause and size\n\n", _verdict_table(made)],
        *["## Detection against size\n\n", _curve_table(made)],
        *["## Rigs without a cause, unknown effects, pairs\n\n", _others(made)],
        *["## Errors, experiments, closed loop\n\n", _after(made)],
    ]
    if made["failures"]:
        parts += ["## Failed runs\n\n", bullets(made["failures"]), "\n"]
    return "".join(parts).rstrip() + "\n"


def _causes_table(made: Numbers) -> str:
    head = ["cause", "n", "correct first", "unambiguous", "ambiguous, listed", "wrong, any size"]
    head += ["raw / size", "trace error", "held out", "found / true", "rank correlation"]
    rows = []
    for name, found in made["by_cause"].items():
        if not found["wrong"]["n"]:
            continue
        doubt, wrong, back = found["ambiguous_with_truth"], found["wrong"], found["recovery"]
        right, raw, trace = found["right_first"], found["raw"], found["trace"]
        cells = [f"`{name}`", right["n"], share_text(right), percent(found["exact"])]
        cells += [f"{some['count']} of {some['n']}" for some in (doubt, wrong)]
        cells += [number(raw["median"]), percent(trace, "median"), percent(found["held_out"])]
        rows.append([*cells, number(back["median_ratio"]), number(back["rank_correlation"])])
    note = (
        "*Raw / size*: the effect before the refit of the base over its size, median. "
        f"*Held out*: share of the named cases with at most {HELD_OUT:g} times the noise floor. "
        "*Found / true*: RMS of the found over the hidden effect, median, and their rank "
        "correlation over all sizes.\n\n"
    )
    return table(head, rows, True) + "\n" + note


def _confused_lists(made: Numbers) -> str:
    titles = {
        "first": "A wrong first cause (any size, any noise)",
        "extra": "A wrong cause beside the correct one",
        "open": "Rivals that are not excluded",
    }
    text = ""
    for what, title in titles.items():
        listed = made["confused"][what][:MOST_CONFUSED]
        lines = [f"`{truth}` as `{said}`: {n}" for truth, said, n in listed] or ["none"]
        text += f"{title}:\n\n{bullets(lines)}\n"
    return text


def _verdict_table(made: Numbers) -> str:
    legend = ", ".join(f"{LETTERS[verdict]} {verdict}" for verdict in VERDICTS)
    head = ["cause", *[f"{low:g} to {high:g}" for low, high in BINS]]
    rows = [
        [f"`{name}`", *[" ".join(f"{LETTERS[v]}{n}" for v, n in c.items()) for c in bins.values()]]
        for name, bins in made["verdicts"].items()
    ]
    return f"{legend}.\n\n" + table(head, rows, True) + "\n"


def _curve_table(made: Numbers) -> str:
    keys = ("detected", "right_first", "exact", "wrong")
    head = ["size", "n", "model error detected", "correct first", "unambiguous", "wrong name"]
    rows = [
        [f"{c['low']:g} to {c['high']:g}", c["exact"]["n"], *[share_text(c[k]) for k in keys]]
        for c in made["curve"]
    ]
    return table(head, rows, True) + "\n"


def _others(made: Numbers) -> str:
    alarms = ", ".join(f"`{name}` {n}" for name, n in made["alarms"].items()) or "none"
    lines = [
        f"false alarm, clean: {bound_text(made['false_alarms_clean'])}",
        f"false alarm, decoys (a wrong value of a base parameter): "
        f"{bound_text(made['false_alarms_decoy'])}",
        f"a cause claimed on either: {bound_text(made['false_names'])}",
        f"answers of the false alarms: {alarms}",
        f"recordings without motion: `insufficient` {share_text(made['idle'])}",
        f"false alarm, clean rigs recorded for 30, 60 or 120 s: "
        f"{bound_text(made['false_alarms_brief'])}; answers: "
        + (", ".join(f"`{name}` {n}" for name, n in made["brief"].items()) or "none"),
        f"pairs: both named unambiguously {share_text(made['pair_exact'])}, only one of them "
        f"{share_text(made['pair_one'])}, a wrong name {share_text(made['pair_wrong'])}, "
        f"correct name first {share_text(made['pair_first'])}; trace error "
        f"{percent(made['trace_pairs'], 'median')}",
        f"wrong extra cause on weak effects: {share_text(made['extra_weak'])}",
        f"wrong first name, any size: {bound_text(made['wrong_first'])}",
        "ambiguous, with the hidden cause not excluded: "
        f"{share_text(made['ambiguous_with_truth'])}",
        f"three times the noise: unambiguous {share_text(made['loud_exact'])}, a wrong name "
        f"{share_text(made['loud_wrong'])}",
    ]
    rows = []
    for name, found in made["unknown_by_kind"].items():
        others = ", ".join(f"{k} {n}" for k, n in found["others"].items())
        rows.append([f"`{name}`", found["n"], share_text(found), others])
    head = ["outside the catalogue", "n", "`unexplained`", "else"]
    unknown = table(head, rows, True) + "\n" if rows else ""
    return bullets(lines) + "\n" + unknown


def _after(made: Numbers) -> str:
    held, back, took = made["held_out_spread"], made["recovery"], made["runtime_s"]
    ahead, loop = made["next"], made["loop"]
    better = loop["better_percent"]
    lines = [
        f"held-out error over the noise floor, the worse output, of {held['n']} named cases: "
        f"median {number(held['median'])}, 90 % quantile {number(held['q90'])}",
        f"RMS of the found over the hidden effect: median {number(back['median_ratio'])}, rank "
        f"correlation {number(back['rank_correlation'])} (n = {back['n']})",
        f"{ahead['ambiguous']} ambiguous cases, {ahead['promised']} with a proposed experiment of "
        f"at least one noise variance; resolved {share_text(ahead['resolved'])}",
        f"closed loop on the hidden rig: {loop['n']} cases, {loop['gap']} with a gap of at least "
        f"{100 * GAP:g} % between the plant before and the rig itself; error of all lower by "
        f"{number(better['median'], '.1f')} % in the median ({number(better['q10'], '.1f')} to "
        f"{number(better['q90'], '.1f')}); over 5 % worse {share_text(loop['worse_of_all'])}",
        f"seconds a diagnosis: median {number(took['median'], '.1f')}, 90 % quantile "
        f"{number(took['q90'], '.1f')}, 99 % {number(took['q99'], '.1f')}, most "
        f"{number(took['most'], '.1f')}",
    ]
    text = bullets(lines) + "\n"
    if loop["n"]:
        rows = [
            [
                f"`{name}`",
                *[found["n"], found["gap"], percent(found["recovered"], "median")],
                number(found["better_percent"]["median"], ".1f"),
            ]
            for name, found in loop["by_cause"].items()
        ]
        head = ["closed loop", "n", "with a gap", "recovered", "better [%]"]
        text += table(head, rows, True) + "\n"
    if ahead["unresolved"]:
        text += "Experiments that did not resolve the ambiguity:\n\n"
        text += bullets(ahead["unresolved"]) + "\n"
    return text


def write(
    records: Sequence[Mapping[str, Any]], folder: Path, arguments: str = "", **beside: Any
) -> list[Path]:
    """Write ``diagnosis.md``, ``.json.xz`` and ``.png`` and return their paths.

    ``arguments`` are those of the command, ``beside`` the further arguments of :func:`figures`.
    """
    made = figures(records, **beside)
    paths = [folder / f"diagnosis.{kind}" for kind in ("md", "json.xz", "png")]
    write_text(paths[0], page(made, arguments))
    lines = [counting.line(Answer.of(record)) for record in records]
    write_record(paths[1], {"schema": 1, "arguments": arguments, "figures": made, "cases": lines})
    write_bytes(paths[2], picture(made))
    return paths
