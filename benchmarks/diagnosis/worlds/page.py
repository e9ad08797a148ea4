"""Page and statistics of the study over worlds, from its records."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.diagnosis.cases import DRAWS
from benchmarks.diagnosis.counts import Answer, Numbers, line
from benchmarks.diagnosis.markdown import (
    bound_text,
    bullets,
    counted,
    named_counts,
    number,
    percent,
    reached,
    share_text,
    table,
    write_page,
)
from benchmarks.diagnosis.sources import HELD_OUT
from benchmarks.diagnosis.worlds.counts import GROUPS, figures

PREFACE = Path(__file__).with_suffix(".md")
TITLES = {"held_out": "held-out worlds", "tuned": "worlds of development", "all": "all worlds"}

Row = tuple[str, str, str, int, bool | None]


def targets(made: Numbers, group: str) -> list[Row]:
    """Return figure, target, reached value, number of cases, and whether the target is met."""
    rows: list[Row] = []
    found = made["groups"][group]

    def row(label: str, target: str, value: str, n: int, met: Any) -> None:
        rows.append((label, target, value if n else "not run", n, bool(met) if n else None))

    def at_least(label: str, some: Numbers, least: float, more: str = "") -> None:
        n = some["n"]
        met = n and some["value"] >= least
        row(label, f"at least {100 * least:g} %", share_text(some) + more, n, met)

    def at_most(label: str, some: Numbers, most: float, key: str = "value") -> None:
        what = "bound at most" if key == "upper" else "at most"
        met = some["n"] and some[key] <= most
        row(label, f"{what} {100 * most:g} %", reached(some, key), some["n"], met)

    def never(label: str, some: Numbers) -> None:
        row(label, "0", f"{some['count']} of {some['n']}", some["n"], some["count"] == 0)

    world, cause, oracle = found["least_world"], found["least_cause"], found["oracle"]
    at_least("correct name first, sizes above 1", found["right_first"], 0.92)
    at_least("the same, for the worst world", world, 0.85, f" (`{world['name']}`)")
    at_least("the same, for the worst cause", cause, 0.75, f" (`{cause['name']}`)")
    at_least("correct and without doubt", found["exact"], 0.85)
    at_most("false alarm: a wrong name on a clean rig", found["false_names"], 0.02, "upper")
    never("clock offset: `resonance` or `sensor_delay` named", found["clock_delays"])
    at_most("wrong extra cause beside the right one", found["extra"], 0.03)
    at_least("two effects: both", found["pair"], 0.85)
    at_least("three effects: all", found["triple"], 0.70)
    at_most("three effects: a wrong name", found["triple_wrong"], 0.03)
    at_least("outside the catalogue: `unexplained`", found["unknown"], 0.95)
    at_least("`stick_slip`: correct name first", found["stick_slip"], 0.90)
    label = "named: held-out error over that of an oracle"
    for key, words, most in (("median", "median", 1.05), ("q90", "90 % quantile", 1.35)):
        met = oracle["n"] and oracle[key] <= most
        row(f"{label}, {words}", f"at most {most:g}", number(oracle[key], ".3f"), oracle["n"], met)
    never("untestable rival: another cause named without doubt", found["untestable"])
    if group == "all":
        at_least("proposed experiment resolves the ambiguity", made["next"]["resolved"], 0.80)
    return rows


def page(made: Numbers, arguments: str) -> str:
    """Return the page, in Markdown, from the figures and the arguments of the command."""
    parts = [
        PREFACE.read_text(encoding="utf-8").format(
            arguments=arguments,
            cases=sum(made["cases"].values()),
            rules=", ".join(made["rule_versions"]) or "-",
            draws=DRAWS,
        )
    ]
    for group, title in TITLES.items():
        parts += [f"\n## Figures and targets: {title}\n\n", _targets_table(made, group)]
    cases = ", ".join(f"{n} {kind}" for kind, n in made["cases"].items())
    parts += [f"\nCases: {cases}.\n", "\n## By world\n\n", _worlds_table(made)]
    parts += ["\n## By cause\n\n", _causes_table(made), "\n## Further counts\n\n", _others(made)]
    if made["failures"]:
        parts += ["\n## Failed runs\n\n", bullets(made["failures"])]
    return "".join(parts).rstrip() + "\n"


def _targets_table(made: Numbers, group: str) -> str:
    words = {True: "reached", False: "**missed**", None: "not run"}
    rows = [(*row[:4], words[row[4]]) for row in targets(made, group)]
    return table(["figure", "target", "reached", "n", ""], rows, True)


def _worlds_table(made: Numbers) -> str:
    head = ["world", "n", "correct first", "without doubt", "wrong name", "extra cause"]
    head += ["clean: wrong name", "clean: `unexplained`", "clock: wrong name", "both of a pair"]
    rows = []
    for world, found in made["worlds"].items():
        name = f"**`{world}`**" if world in HELD_OUT else f"`{world}`"
        cells = [name, found["right_first"]["n"], share_text(found["right_first"])]
        cells += [percent(found[key]) for key in ("exact", "wrong", "extra")]
        keys = ("false_names", "unexplained_clean", "clock_names", "pair")
        rows.append([*cells, *[counted(found[key]) for key in keys]])
    return table(head, rows, True) + "\nBold: held-out worlds.\n"


def _causes_table(made: Numbers) -> str:
    head = ["cause", *[f"correct first, {TITLES[group]}" for group in GROUPS]]
    head += ["without doubt", "wrong name", "otherwise"]
    rows = []
    for name, by_group in made["causes"].items():
        every = by_group["all"]
        mistaken = ", ".join(f"`{said}` {n}" for said, n in every["mistaken"].items())
        shares = [counted(by_group[group]["right_first"]) for group in GROUPS]
        rows.append(
            [f"`{name}`", *shares, counted(every["exact"]), counted(every["wrong"]), mistaken]
        )
    return table(head, rows, True)


def _others(made: Numbers) -> str:
    every, ahead, took = made["groups"]["all"], made["next"], made["runtime_s"]
    lines = [
        f"false alarms, clean rigs: {bound_text(every['false_names'])}; "
        + named_counts(every["alarms"]),
        f"clean rigs called `unexplained`: {share_text(every['unexplained_clean'])}",
        f"wrong names with a clock offset: {bound_text(every['clock_names'])}; "
        + named_counts(every["late"]),
        f"pairs with a wrong name: {share_text(every['pair_wrong'])}",
        "untestable effects, another cause named without doubt: "
        + _each(made["untestable"])
        + f"; below the noise before any refit and left out: {made['invisible']}",
        "outside the catalogue, `unexplained`: " + _each(made["unknown"]),
        f"{ahead['ambiguous']} ambiguous cases, {ahead['promised']} with a proposed experiment of "
        f"at least one noise variance; resolved {share_text(ahead['resolved'])}",
        f"seconds a diagnosis: median {number(took['median'], '.1f')}, 90 % quantile "
        f"{number(took['q90'], '.1f')}, most {number(took['most'], '.1f')}",
        "effects that did not reach their size on any drawn rig, not diagnosed: "
        + named_counts(made["unmade"]),
    ]
    return bullets(lines)


def _each(shares: Mapping[str, Numbers]) -> str:
    return ", ".join(f"`{name}` {counted(found)}" for name, found in shares.items()) or "not run"


def write(records: Sequence[Mapping[str, Any]], folder: Path, arguments: str = "") -> list[Path]:
    """Write ``diagnosis_worlds.md`` and ``diagnosis_worlds.json`` and return their paths."""
    made = figures(records)
    cases = [line(Answer.of(record)) for record in records if not record.get("unmade")]
    numbers = {"arguments": arguments, "figures": made, "cases": cases}
    return write_page(folder / "diagnosis_worlds", page(made, arguments), **numbers)
