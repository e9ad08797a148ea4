"""Distance of the best classical controllers from the oracle, and gain of those beyond the papers.

The share of the gap closed is (paper - best) / (paper - oracle), of means over the same episodes:
the first public ones of each scenario, on which the oracle has run (:mod:`benchmarks.bounds.run`).
*paper* is the best controller as published or by a textbook rule: without preview and without
tuning. *best* is the best classical controller that is built from the nominal model.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.board import accessors as views
from benchmarks.board import claims, standings
from benchmarks.board.format import bounded, chance, number, percent, tables
from benchmarks.board.standings import Track
from benchmarks.board.words import short_env
from benchmarks.bounds.run import Bounds
from benchmarks.runs.cells import AUDIT, PUBLIC
from benchmarks.runs.rows import Row
from benchmarks.scenarios import kinds
from benchmarks.scoring import statistics
from benchmarks.scoring.metrics import headline_of
from benchmarks.scoring.statistics import Interval
from pam_envs import yaml_file
from pam_envs.arrays import Array

FILE = Path(__file__).with_name("gap.yaml")
ENOUGH = 0.6
"""Share of the gap below which the page gives the reason."""
TRAVEL = "pressure_travel"
INTRODUCTION = """\
# Distance from the oracle

Written by `python -m benchmarks board` from the rows and from the episodes of the oracle in
`benchmarks/results/oracle.json.xz`; do not edit. `python -m benchmarks gap` prints this page.

The *oracle* is a predictive controller with the true plant, the state without noise and the future
reference over its horizon
([controllers](../../docs/controllers.md#estimate-of-the-smallest-error)). It has no rank. Its error
is an estimate of the smallest one from above and no bound: the search may end in a local minimum,
and a controller may err less in single episodes. The *paper's controller* of a track is the best
one as published or by a textbook rule, without preview and without tuning. *Best classical* is the
best controller that is built from the nominal model, tuned or not. *Closed* is
(paper - best) / (paper - oracle), with its 95 % interval (episodes resampled within scenarios; too
narrow with two episodes of a scenario, and missing with one). *Travel* is the pressure travel of
the best controller relative to the paper's. All means of a line are over the same public episodes,
those of the oracle; controllers are chosen by their audit episodes.
"""
MATCHED = """\
The best classical controllers that use no preview, and those that use it (as measured, see the
pages of the environments). Anticipating controllers of the gaits also know the stride of the
nominal wearer and repeat the last one, and so plan beyond the preview.
"""
BEYOND = """\
The controllers of [docs/controllers.md](../../docs/controllers.md) against the best other classical
controller of the track (of a paper or by a textbook rule, tuned or not). *P* is the probability of
improvement; *matched* is the best other controller with the same use of preview; *tried* are the
numbers of settings that the searches of both have tried. *Better*: P above 0.95 with a lower bound
above 0.5, and an interval of the mean's reduction above zero. Both controllers of a line are chosen
and compared on the same audit episodes, without a correction for the number of tracks.
"""


@lru_cache(maxsize=1)
def _lists() -> Mapping[str, Any]:
    return yaml_file.read(FILE, "lists of controllers and reasons")


def beyond() -> tuple[str, ...]:
    """Return the names of the controllers beyond the papers."""
    return tuple(_lists()["beyond"])


def reasons() -> dict[str, str]:
    """Return what prevents a smaller error, by environment."""
    return dict(_lists()["reasons"])


def is_beyond(row: Row) -> bool:
    """Return whether a row is of a controller beyond the papers, tuned or not."""
    name = views.name_of(row)
    return any(name == base or name.startswith(f"{base}_tuned") for base in beyond())


def is_as_published(row: Row) -> bool:
    """Return whether a row is of a controller as published or by a textbook rule."""
    untuned = views.cost_of(row).trials == 0 and not views.preview_of(row)
    return claims.is_rival(row) and untuned and not is_beyond(row)


def best(rows: Sequence[Row], accepted: Callable[[Row], bool]) -> Row | None:
    """Return the row with the lowest mean among the accepted classical ones, ``None`` without one.

    The mean is over the audit episodes if all classical rows have them, else over the public ones.
    """
    classical = [r for r in rows if views.is_classical(r) and not views.is_informed(r)]
    split = AUDIT if all(map(views.is_audited, classical)) else PUBLIC
    found = list(filter(accepted, classical))
    return min(found, key=lambda row: views.mean_of(row, split=split)) if found else None


@dataclass(frozen=True)
class Gap:
    """A controller of a track between the paper's controller and the oracle."""

    paper: Row
    row: Row
    errors: Mapping[str, Interval]  # of paper, row and oracle [SI]
    closed: Interval
    travel: float  # pressure travel relative to the paper's controller


def gap(paper: Row, row: Row, bounds: Bounds) -> Gap | None:
    """Return the share of the gap that a row closes, ``None`` if the bounds are of another task."""
    if not row["task"] == paper["task"] == bounds.task:
        return None
    headline = headline_of(views.content_of(row))
    strata = [episode.scenario for episode in bounds.episodes]
    tables = {
        "paper": _scores(paper, headline, bounds),
        "row": _scores(row, headline, bounds),
        "oracle": np.array([episode.scores[headline] for episode in bounds.episodes]),
    }
    columns = statistics.resample_indices(strata, statistics.RESAMPLES, statistics.BOOTSTRAP_SEED)
    means = {name: np.array([v.mean(), *v[columns].mean(axis=1)]) for name, v in tables.items()}
    whole = means["paper"] - means["oracle"]
    travel = _scores(row, TRAVEL, bounds).mean() / _scores(paper, TRAVEL, bounds).mean()
    alone = min(Counter(strata).values()) < 2  # then resamples do not differ

    def between(values: Array) -> Interval:
        found = statistics.between(float(values[0]), values[1:])
        return Interval(found.value, np.nan, np.nan) if alone else found

    errors = {name: between(values) for name, values in means.items()}
    closed = statistics.NOTHING  # of a gap that is not resolved
    if (whole > 0.0).all():
        closed = between((means["paper"] - means["row"]) / whole)
    return Gap(paper, row, errors, closed, float(travel))


def _scores(row: Row, metric: str, bounds: Bounds) -> Array:
    """Return a metric of a row in the episodes of the oracle."""
    found = {(e["scenario"], e["seed"]): e["scores"][metric] for e in _public(row)}
    return np.array([found[e.scenario, e.seed] for e in bounds.episodes], float)


def _public(row: Row) -> list[Mapping[str, Any]]:
    return [episode for episode in row["episodes"] if episode["split"] == PUBLIC]


def gap_of_best(
    rows: Sequence[Row], bounds: Bounds | None, accepted: Callable[[Row], bool] = bool
) -> Gap | None:
    """Return the gap of the best accepted classical controller of a track."""
    paper, row = best(rows, is_as_published), best(rows, accepted)
    if paper is None or row is None or bounds is None:
        return None
    return gap(paper, row, bounds)


def page_text(tracks: Mapping[str, Track], bounds: Mapping[str, Bounds]) -> str:
    """Return the page as Markdown."""
    found = {name: gap_of_best(rows, bounds.get(name)) for name, rows in tracks.items()}
    nominal = {n: rows for n, rows in tracks.items() if kinds.is_of(n, kinds.NOMINAL)}
    gaps = {name: found[name] for name in nominal}
    lines = [INTRODUCTION, "## Nominal tracks", ""]
    lines += [*_gaps(gaps, bounds), "", *_reasons(gaps)]
    lines += ["## Matched preview", "", MATCHED, *_matched(nominal, bounds), ""]
    others = {name: made for name, made in found.items() if name not in nominal}
    lines += ["## Other tracks", "", *_gaps(others, bounds), ""]
    lines += ["## Controllers beyond the papers", "", BEYOND, *_gains(tracks)]
    return "\n".join(lines).rstrip() + "\n"


def _gaps(gaps: Mapping[str, Gap | None], bounds: Mapping[str, Bounds]) -> list[str]:
    heading = ["track", "oracle", "best classical", "paper's controller", "closed", "travel"]
    lines = []
    for name, found in gaps.items():
        if found is not None:
            oracle = _score(found, "oracle")
            both = _named(found.row, found, "row"), _named(found.paper, found, "paper")
            lines.append([f"`{name}`", oracle, *both, _share(found), f"{found.travel:.2f}x"])
    missing = [f"`{name}`" for name in gaps if name not in bounds]
    beside = ["", f"The oracle has not run on {', '.join(missing)}."] if missing else []
    for name in gaps:
        if name in bounds and (start := bounds[name].start):
            words = f"On `{name}` the actions of `{start}` are a candidate of every search"
            beside += ["", f"{words} of the oracle."]
    return [*tables(heading, lines), *beside] if lines else ["The oracle has not run."]


def _score(found: Gap, which: str) -> str:
    unit, factor = views.unit_of(found.row)
    return f"{bounded(found.errors[which], factor)} {unit}"


def _named(row: Row, found: Gap, which: str) -> str:
    return f"`{views.name_of(row)}`<br>{_score(found, which)}"


def _share(found: Gap) -> str:
    return "-" if np.isnan(found.closed.value) else percent(found.closed)


def _reasons(gaps: Mapping[str, Gap | None]) -> list[str]:
    """Return what prevents a smaller error where less than ``ENOUGH`` of the gap is closed."""
    lines = []
    for found in gaps.values():
        if found is not None and not found.closed.value >= ENOUGH:
            env = short_env(views.env_of(found.row))
            lines.append(f"- `{env}`: {reasons().get(env, 'no reason is known.')}")
    title = f"Less than {100.0 * ENOUGH:.0f} % of the gap is closed:"
    return [title, "", *lines, ""] if lines else []


def _matched(tracks: Mapping[str, Track], bounds: Mapping[str, Bounds]) -> list[str]:
    heading = ["track", "best without preview", "closed", "best with preview", "closed by it"]
    lines = []
    for name, rows in tracks.items():
        cells = [f"`{name}`"]
        for used in (False, True):
            found = gap_of_best(rows, bounds.get(name), _previewing(used))
            cells += (
                ["-", "-"] if found is None else [_named(found.row, found, "row"), _share(found)]
            )
        lines.append(cells)
    return tables(heading, lines)


def _previewing(used: bool) -> Callable[[Row], bool]:
    return lambda row: (views.preview_of(row) > 0.0) == used


@dataclass(frozen=True)
class Gain:
    """Best controller beyond the papers against the best other classical one."""

    row: Row
    rival: Row
    probability: Interval
    lower_by: Interval

    @property
    def holds(self) -> bool:
        """Whether the controller is better."""
        likely = self.probability.value > claims.PROBABILITY
        sure = self.probability.low > claims.LOWER_BOUND
        return likely and sure and self.lower_by.low > 0.0


def gain(rows: Sequence[Row], matched: bool = False) -> Gain | None:
    """Return the gain in a track, ``None`` if no controller beyond the papers has run.

    ``matched`` compares with the best other controller with the same use of preview.
    """
    row = best(rows, is_beyond)
    if row is None:
        return None
    same = _previewing(views.preview_of(row) > 0.0)
    rival = best(rows, lambda r: not is_beyond(r) and (same(r) or not matched))
    if rival is None:
        return None
    share = standings.improvement(row, rival)
    if share is None:
        return None
    return Gain(row, rival, share, claims.gain(row, rival))


def _gains(tracks: Mapping[str, Track]) -> list[str]:
    heading = ["track", "controller", "RMS", "best other", "its RMS", "reduction", "P", "result"]
    heading += ["tried", "matched", "reduction against matched"]
    lines: list[list[str]] = []
    gains = {name: gain(rows) for name, rows in tracks.items()}
    for name, found in gains.items():
        if found is None:
            continue
        same = gain(tracks[name], matched=True)
        unit, factor = views.unit_of(found.row)
        split = views.common_split(found.row, found.rival) or PUBLIC
        cells = [f"`{name}`"]
        for row in (found.row, found.rival):
            mean = number(factor * views.mean_of(row, split=split))
            cells += [f"`{views.name_of(row)}`", f"{mean} {unit}"]
        cells += [percent(found.lower_by), chance(found.probability)]
        cells.append("**better**" if found.holds else "not shown")
        cells.append(f"{claims.tried(found.row)}, {claims.tried(found.rival)}")
        cells += (
            ["-", "-"]
            if same is None
            else [f"`{views.name_of(same.rival)}`", percent(same.lower_by)]
        )
        lines.append(cells)
    counts = {
        kind: [
            made is not None and made.holds
            for name, made in gains.items()
            if kinds.is_of(name, kind)
        ]
        for kind in (*kinds.NOT_THE_MODEL, kinds.EVERYDAY)
    }
    words = ", ".join(
        f"{sum(held)} of {len(held)} {kind.replace('_', '-')} tracks"
        for kind, held in counts.items()
        if held
    )
    counted = ["", f"Better on {words}."] if words else []
    return [*tables(heading, lines), *counted] if lines else ["None has run."]
