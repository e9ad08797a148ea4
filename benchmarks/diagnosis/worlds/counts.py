"""Statistics of the study over worlds: held-out worlds beside those of development.

Pure functions of the records, with the shares and intervals of :mod:`benchmarks.diagnosis.counts`.
A failed diagnosis counts as wrong. A case whose effect cannot be made as large as drawn on any rig
of its world was never diagnosed: it is counted apart.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from benchmarks.diagnosis.counts import Answer, Numbers, firsts, following, line, share, spread
from benchmarks.diagnosis.sources import HELD_OUT, TUNED, WORLDS
from benchmarks.diagnosis.study import needs_oracle
from tests.diagnosis.hidden import EFFECTS

GROUPS = {"held_out": HELD_OUT, "tuned": TUNED, "all": WORLDS}
CLOCK_NAMES = ("resonance", "sensor_delay")
"""Causes for which a clock offset is mistaken."""

SHARES: dict[str, tuple[str, Callable[[Answer], bool]]] = {
    "right_first": ("single", lambda one: one.right_first),
    "exact": ("single", lambda one: one.exact),
    "wrong": ("single", lambda one: one.wrong),
    "extra": ("single", lambda one: one.extra or one.failed),
    "stick_slip": ("stick_slip", lambda one: one.right_first),
    "false_names": ("clean", lambda one: one.claims or one.failed),
    "unexplained_clean": ("clean", lambda one: one.verdict == "unexplained"),
    "clock_delays": ("clock", lambda one: one.failed or claims_any(one, CLOCK_NAMES)),
    "clock_names": ("clock", lambda one: one.claims or one.failed),
    "unknown": ("unknown", lambda one: one.right),
    "untestable": ("untestable", lambda one: one.wrong),
    "pair": ("pair", lambda one: one.both),
    "pair_wrong": ("pair", lambda one: one.wrong),
    "triple": ("triple", lambda one: one.both),
    "triple_wrong": ("triple", lambda one: one.wrong),
}
"""Shares of the page: kind of cases, and the counted property."""


def claims_any(one: Answer, names: Iterable[str]) -> bool:
    """Return whether one of some causes is named, with or without doubt."""
    return one.claims and not set(names).isdisjoint(one.names)


def figures(records: Sequence[Mapping[str, Any]]) -> Numbers:
    """Return all statistics of the page from the records."""
    made = [record for record in records if not record.get("unmade")]
    answers = [Answer.of(record) for record in made]
    unmade = Counter("+".join(r["case"]["names"]) for r in records if r.get("unmade"))
    return {
        "cases": dict(sorted(Counter(one.kind for one in answers).items())),
        "unmade": dict(unmade.most_common()),
        "rule_versions": sorted({r["rule_version"] for r in made if not r["failure"]}),
        "groups": {name: of_group(answers, worlds) for name, worlds in GROUPS.items()},
        "worlds": {world: of_group(answers, (world,)) for world in WORLDS},
        "causes": {
            name: {group: of_cause(answers, name, worlds) for group, worlds in GROUPS.items()}
            for name in EFFECTS
        },
        "untestable": {
            name: share(one.wrong for one in _of_kind(answers, "untestable") if name in one.truth)
            for name in sorted({one.truth[0] for one in _of_kind(answers, "untestable")})
        },
        "invisible": sum(o.kind == "untestable" and not (o.failed or visible(o)) for o in answers),
        "unknown": {
            name: share(one.right for one in _of_kind(answers, "unknown") if name in one.truth)
            for name in sorted({one.truth[0] for one in _of_kind(answers, "unknown")})
        },
        "next": following(answers),
        "runtime_s": spread(r.get("volatile", {}).get("runtime_s") for r in made),
        "failures": [f"{line(one)}: {one.record['failure']}" for one in answers if one.failed],
    }


def _of_kind(answers: Sequence[Answer], kind: str) -> list[Answer]:
    """Return the answers of a kind; ``stick_slip`` is the single effects of that name.

    Untestable effects that are below the noise of their recording before any refit cannot mislead
    and are left out.
    """
    if kind == "stick_slip":
        return [one for one in answers if one.kind == "single" and one.truth == (kind,)]
    if kind == "untestable":
        return [one for one in answers if one.kind == kind and (one.failed or visible(one))]
    return [one for one in answers if one.kind == kind]


def visible(one: Answer) -> bool:
    """Return whether a hidden effect is above the noise before a refit."""
    return any(truth["raw"] >= 1.0 for truth in one.record.get("truths", ()))


def of_group(answers: Sequence[Answer], worlds: Sequence[str]) -> Numbers:
    """Return the statistics of some worlds."""
    ones = [one for one in answers if one.world in worlds]
    single = _of_kind(ones, "single")
    made: Numbers = {
        name: share(mark(one) for one in _of_kind(ones, kind))
        for name, (kind, mark) in SHARES.items()
    }
    return made | {
        "least_world": _least({w: [o for o in single if o.world == w] for w in worlds}),
        "least_cause": _least({n: [o for o in single if o.truth == (n,)] for n in EFFECTS}),
        "oracle": spread(map(over_oracle, single)),
        "alarms": firsts(one for one in _of_kind(ones, "clean") if one.claims or one.failed),
        "late": firsts(one for one in _of_kind(ones, "clock") if one.claims or one.failed),
    }


def of_cause(answers: Sequence[Answer], name: str, worlds: Sequence[str]) -> Numbers:
    """Return the statistics of one hidden cause in some worlds."""
    ones = [o for o in _of_kind(answers, "single") if o.truth == (name,) and o.world in worlds]
    return {
        "right_first": share(one.right_first for one in ones),
        "exact": share(one.exact for one in ones),
        "wrong": share(one.wrong for one in ones),
        "mistaken": firsts(one for one in ones if not one.right_first),
    }


def _least(by_name: Mapping[str, Sequence[Answer]]) -> Numbers:
    """Return the world or cause with the smallest share of correct first names."""
    made = [
        {"name": name, **share(one.right_first for one in ones)} for name, ones in by_name.items()
    ]
    known = [found for found in made if found["n"]]
    return min(known, key=lambda found: found["value"], default={"name": None, **share(())})


def over_oracle(one: Answer) -> float | None:
    """Return the held-out error of a named case over that of an oracle; None without one.

    The oracle knows the hidden causes: it has them and the common ones as its only candidates.
    With no other names and none missing it is the same model.
    """
    if one.record.get("verdict") != "named" or one.held_out is None:
        return None
    if not needs_oracle(dict(one.record)):
        return 1.0
    known = one.record.get("oracle") or {}
    errors = known.get("held_out", {}).get("error_after", {}).values()
    return one.held_out / max(errors) if errors else None
