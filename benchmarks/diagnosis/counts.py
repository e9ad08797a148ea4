"""Statistics of the diagnosis benchmark: shares with bounds, confusion matrix, detection curve.

Pure functions of the records. Shares have exact (Clopper-Pearson) 95 % confidence intervals;
``upper`` is the one-sided 95 % bound. A failed run counts as wrong.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy import stats

from pam_envs.diagnosis.closed_loop.gain import COMPENSABLE
from tests.diagnosis.hidden import EFFECTS

VERDICTS = ("named", "ambiguous", "adequate", "unexplained", "insufficient", "failed")
BINS = ((0.1, 0.3), (0.3, 1.0), (1.0, 2.0), (2.0, 5.0))  # bins of sizes of the tables
CURVE = (0.1, 0.2, 0.35, 0.6, 1.0, 1.5, 2.2, 3.3, 5.0)  # edges of the detection curve
HELD_OUT = 1.1
WITHOUT_CAUSE = {
    **dict.fromkeys(("clean", "decoy", "brief"), "adequate"),
    **{"idle": "insufficient", "unknown": "unexplained"},
}
"""Correct verdict on rigs without a hidden cause of the catalogue, by kind."""
GAP = 0.15
WORSE = 1.05
LEVEL = 0.95

Numbers = dict[str, Any]


@dataclass(frozen=True)
class Answer:
    """The verdict of a record in the categories of the statistics.

    Names that the rig deserves by nature are left out; a verdict ``named`` on nothing else is
    ``adequate``.
    """

    kind: str
    world: str
    truth: tuple[str, ...]
    sizes: tuple[float, ...]
    verdict: str
    names: tuple[str, ...]
    others: tuple[frozenset[str], ...]
    record: Mapping[str, Any]

    @classmethod
    def of(cls, record: Mapping[str, Any]) -> "Answer":
        """Read a record."""
        case, failed = record["case"], bool(record["failure"])
        nature = set(record.get("nature", ())) - set(case["names"])
        said = [] if failed else record["names"]
        names = tuple(name for name in said if name not in nature)
        others = [] if failed else [frozenset(name.split("+")) - nature for name in record["open"]]
        verdict = "failed" if failed else record["verdict"]
        return cls(
            case["kind"],
            case["world"],
            tuple(case["names"]),
            tuple(case["sizes"]),
            "adequate" if verdict == "named" and said and not names else verdict,
            names,
            tuple(others),
            record,
        )

    @property
    def size(self) -> float:
        """Size of the first effect over the usual noise."""
        return self.sizes[0]

    @property
    def claims(self) -> bool:
        """True if it names a cause, ambiguous or not."""
        return self.verdict in ("named", "ambiguous") and bool(self.names)

    @property
    def first(self) -> str:
        """The first claimed cause, or the verdict if there is none."""
        return self.names[0] if self.claims else self.verdict

    @property
    def failed(self) -> bool:
        """True if the run failed."""
        return self.verdict == "failed"

    @property
    def right_first(self) -> bool:
        """True if the first cause is a hidden one."""
        return self.first in self.truth

    @property
    def exact(self) -> bool:
        """True if exactly the hidden causes are named, without ambiguity."""
        return self.verdict == "named" and set(self.names) == set(self.truth)

    @property
    def both(self) -> bool:
        """True if exactly the hidden causes are claimed, ambiguous or not."""
        return self.claims and set(self.names) == set(self.truth)

    @property
    def wrong(self) -> bool:
        """True if an absent cause is named without ambiguity."""
        absent = bool(set(self.names) - set(self.truth))
        return self.failed or (self.verdict == "named" and absent)

    @property
    def extra(self) -> bool:
        """True if an absent cause is claimed beside the hidden ones."""
        return self.claims and set(self.names) > set(self.truth)

    @property
    def listed(self) -> bool:
        """True if the hidden causes are among the models that are not excluded."""
        return set(self.truth) in [set(self.names), *self.others]

    @property
    def alarm(self) -> bool:
        """True if a model error is reported."""
        return self.verdict not in ("adequate", "insufficient")

    def right_answer(self, verdict: str, names: Iterable[str]) -> bool:
        """Return whether another verdict on the same rig is correct."""
        if self.kind in WITHOUT_CAUSE:
            return verdict == WITHOUT_CAUSE[self.kind]
        return verdict == "named" and set(names) == set(self.truth)

    @property
    def right(self) -> bool:
        """True if the verdict is the correct one."""
        return self.right_answer(self.verdict, self.names)

    @property
    def held_out(self) -> float | None:
        """Held-out error over the noise floor of the worse output."""
        return max(self.record.get("held_out", {}).get("error_after", {}).values(), default=None)

    @property
    def traces(self) -> Mapping[str, Any]:
        """Errors of the traces of correctly named causes."""
        return self.record.get("traces") or {}

    @property
    def trace_error(self) -> float | None:
        """RMS error of the first effect's trace over its RMS."""
        found = self.traces.get(self.truth[0])
        return found and found["error"]


SHARES: dict[str, tuple[str, Callable[[Answer], bool]]] = {
    "right_first": ("single", lambda one: one.right_first),
    "exact": ("single", lambda one: one.exact),
    "wrong": ("single weak", lambda one: one.wrong),
    "wrong_first": ("single weak", lambda one: one.wrong and not one.extra),
    "extra": ("single", lambda one: one.extra or one.failed),
    "extra_weak": ("weak", lambda one: one.extra or one.failed),
    "loud": ("loud", lambda one: one.right_first),
    "loud_exact": ("loud", lambda one: one.exact),
    "loud_wrong": ("loud", lambda one: one.wrong),
    "false_alarms": ("clean decoy", lambda one: one.alarm),
    "false_alarms_clean": ("clean", lambda one: one.alarm),
    "false_alarms_decoy": ("decoy", lambda one: one.alarm),
    "false_alarms_brief": ("brief", lambda one: one.alarm),
    "false_names": ("clean decoy", lambda one: one.claims or one.failed),
    "unknown": ("unknown", lambda one: one.right),
    "idle": ("idle", lambda one: one.right),
    "pair": ("pair", lambda one: one.both),
    "pair_exact": ("pair", lambda one: one.exact),
    "pair_one": ("pair", lambda one: one.right_first and len(one.names) == 1),
    "pair_wrong": ("pair", lambda one: one.wrong),
    "pair_first": ("pair", lambda one: one.right_first),
}
"""Shares of the page: kinds of cases, and the counted property."""


def share(marks: Iterable[bool]) -> Numbers:
    """Return count and share of true marks with bounds; None without marks."""
    listed = [bool(mark) for mark in marks]
    count, n = sum(listed), len(listed)
    if n == 0:
        return {"count": 0, "n": 0, "value": None, "interval": None, "upper": None}
    both, less = (stats.binomtest(count, n, alternative=a) for a in ("two-sided", "less"))
    return {
        "count": count,
        "n": n,
        "value": count / n,
        "interval": list(both.proportion_ci(LEVEL, "exact")),
        "upper": less.proportion_ci(LEVEL, "exact").high,
    }


def spread(values: Iterable[float | None]) -> Numbers:
    """Return the median and quantiles of values."""
    known = [float(v) for v in values if v is not None]
    names = ("median", "q10", "q90", "q99", "most")
    if not known:
        return {"n": 0, **dict.fromkeys(names)}
    found = np.quantile(known, [0.5, 0.1, 0.9, 0.99, 1.0]).tolist()
    return {"n": len(known), **dict(zip(names, found, strict=True))}


def shares(by_kind: Mapping[str, list[Answer]]) -> Numbers:
    """Return all of :data:`SHARES`."""
    return {
        name: share(mark(one) for kind in kinds.split() for one in by_kind[kind])
        for name, (kinds, mark) in SHARES.items()
    }


def firsts(answers: Iterable[Answer]) -> dict[str, int]:
    """Return the counts of first causes, or of verdicts without a cause."""
    return dict(Counter(one.first for one in answers).most_common())


def unknown_by_kind(unknown: Sequence[Answer]) -> Numbers:
    """Return the answers to each effect outside the catalogue."""
    made = {}
    for name in sorted({one.truth[0] for one in unknown}):
        ones = [one for one in unknown if one.truth == (name,)]
        others = firsts(one for one in ones if not one.right)
        made[name] = {**share(one.right for one in ones), "others": others}
    return made


def _bin(size: float) -> str:
    low, high = next((pair for pair in BINS if size < pair[1]), BINS[-1])
    return f"{low:g}-{high:g}"


def verdicts_by_size(alone: Sequence[Answer]) -> Numbers:
    """Return the counts of verdicts by cause and size."""
    counts = Counter((one.truth[0], _bin(one.size), one.verdict) for one in alone)
    return {
        name: {
            size: {v: counts[name, size, v] for v in VERDICTS if counts[name, size, v]}
            for size in (f"{low:g}-{high:g}" for low, high in BINS)
        }
        for name in EFFECTS
    }


def confusion(single: Sequence[Answer]) -> Numbers:
    """Return the counts of first causes, or verdicts, for each hidden cause, without zeros."""
    counts: Numbers = {truth: Counter() for truth in EFFECTS}
    for one in single:
        counts[one.truth[0]][one.first] += 1
    return {truth: dict(sorted(row.items())) for truth, row in counts.items()}


def confused(alone: Sequence[Answer]) -> Numbers:
    """Return the most frequent confusions, by role: first cause, open rival, or extra cause."""
    first = Counter((o.truth[0], o.first) for o in alone if o.claims and not o.right_first)
    rivals = Counter(
        (one.truth[0], "+".join(sorted(names)))
        for one in alone
        if one.verdict == "ambiguous"
        for names in {frozenset(one.names), *one.others}
        if names != set(one.truth)
    )
    extra = Counter(
        (one.truth[0], name) for one in alone if one.extra for name in set(one.names) - {*one.truth}
    )
    return {
        what: [[*pair, n] for pair, n in sorted(counts.items(), key=lambda e: (-e[1], e[0]))]
        for what, counts in (("first", first), ("open", rivals), ("extra", extra))
    }


def curve(alone: Sequence[Answer]) -> list[Numbers]:
    """Return shares against size."""
    made = []
    for low, high in pairwise(CURVE):
        ones = [one for one in alone if low <= one.size < high]
        marks = {mark: share(getattr(o, mark) for o in ones) for mark in ("right_first", "exact")}
        detected = share(one.alarm and not one.failed for one in ones)
        wrong = share(one.wrong for one in ones)
        made.append({"low": low, "high": high, "detected": detected, **marks, "wrong": wrong})
    return made


def held_out_share(ones: Iterable[Answer]) -> Numbers:
    """Return the share of named cases with a held-out error near the noise floor."""
    return share((one.held_out or np.inf) <= HELD_OUT for one in ones if one.verdict == "named")


def of_cause(name: str, single: Sequence[Answer], weak: Sequence[Answer]) -> Numbers:
    """Return the statistics of one cause at sizes above 1, and of wrong names at any size."""
    ones = [one for one in single if one.truth == (name,)]
    small = [one for one in weak if one.truth == (name,)]
    return {
        "right_first": share(one.right_first for one in ones),
        "exact": share(one.exact for one in ones),
        "ambiguous_with_truth": share(o.listed for o in ones if o.verdict == "ambiguous"),
        "wrong": share(one.wrong for one in ones + small),
        "weak_right_first": share(one.right_first for one in small),
        "raw": spread(t["raw"] / t["size"] for o in ones for t in o.record.get("truths", ())),
        "trace": spread(one.trace_error for one in ones if one.right_first),
        "held_out": held_out_share(ones),
        "recovery": recovery(ones + small),
    }


def least_right(single: Sequence[Answer]) -> Numbers:
    """Return the cause with the smallest share of correct first names."""
    by_cause = [
        {"name": name, **share(one.right_first for one in single if one.truth == (name,))}
        for name in EFFECTS
    ]
    made = [found for found in by_cause if found["n"]]
    return min(made, key=lambda found: found["value"], default={"name": None, **share(())})


def recovery(alone: Sequence[Answer]) -> Numbers:
    """Return the accuracy of the recovered sizes of correctly named causes."""
    pairs = [(t["found"], t["true"]) for one in alone for t in one.traces.values()]
    if not pairs:
        return {"n": 0, "rank_correlation": None, "median_ratio": None}
    found, true = np.array(pairs).T
    varied = len(pairs) > 2 and np.ptp(found) > 0.0 and np.ptp(true) > 0.0
    return {
        "n": len(pairs),
        "rank_correlation": float(stats.spearmanr(found, true).statistic) if varied else None,
        "median_ratio": float(np.median(found / true)),
    }


def following(answers: Sequence[Answer]) -> Numbers:
    """Return the statistics of proposed experiments."""
    ambiguous = [one for one in answers if one.verdict == "ambiguous"]
    plans = [one.record.get("experiment") or {} for one in ambiguous]
    done = [one for one in ambiguous if one.record.get("next")]
    resolved = [
        not one.record["next"].get("failure")
        and one.right_answer(one.record["next"]["verdict"], one.record["next"]["names"])
        for one in done
    ]
    return {
        "ambiguous": len(ambiguous),
        "promised": sum(bool(plan.get("enough")) for plan in plans),
        "resolved": share(resolved),
        "told_none": share(bool(plan) for plan in plans if not plan.get("enough")),
        "unresolved": [
            f"{line(one)}; after {one.record['next'].get('plan', 'a failure')}: "
            f"{one.record['next'].get('verdict')} {'+'.join(one.record['next'].get('names', []))}"
            for one, good in zip(done, resolved, strict=True)
            if not good
        ],
    }


def closed_loops(answers: Sequence[Answer]) -> Numbers:
    """Return the closed-loop improvement by the extended plants on the hidden rigs."""
    ran = [(one.truth[0], one.record["loop"]) for one in answers if one.record.get("loop")]
    loops = [(name, loop) for name, loop in ran if not loop.get("failure")]
    failed = [True] * (len(ran) - len(loops))

    def of(name: str | None) -> Numbers:
        some = [loop for other, loop in loops if name in (None, other)]
        wide = [loop for loop in some if loop["gap"] >= GAP]
        return {
            "n": len(some),
            "gap": len(wide),
            "recovered": spread(loop["recovered"] for loop in wide),
            "better_percent": spread(loop["better_percent"]["value"] for loop in some),
        }

    worse = [(loop["gap"], loop["after_mm"] > WORSE * loop["before_mm"]) for _, loop in loops]
    return {
        **of(None),
        "n": len(ran),
        "failed": len(failed),
        "worse": share([mark for gap, mark in worse if gap >= GAP] + failed),
        "worse_of_all": share([mark for _, mark in worse] + failed),
        "by_cause": {name: of(name) for name in COMPENSABLE},
    }


def line(one: Answer) -> str:
    """Return a case and its outcome in one line."""
    hidden = "+".join(f"{n}@{s:.2f}" for n, s in zip(one.truth, one.sizes, strict=True))
    said = " ".join([one.verdict, "+".join(one.names)]).strip()
    rivals = "".join(f" or {'+'.join(sorted(names))}" for names in one.others)
    numbers = [f"trace {t['error']:.2f}" for t in one.traces.values()]
    if one.held_out is not None:
        numbers.append(f"held out {one.held_out:.2f}")
    tail = f" ({', '.join(numbers)})" if numbers else ""
    seed = one.record["case"]["seed"]
    return f"{one.kind} {seed} {hidden or 'nothing'}: {said}{rivals}{tail}"
