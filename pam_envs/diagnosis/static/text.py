"""The diagnosis of a table of readings in a few sentences."""

from __future__ import annotations

import numpy as np

from pam_envs.diagnosis.static.compare import lack_of_fit
from pam_envs.diagnosis.static.findings import Findings, verdict
from pam_envs.diagnosis.static.models import Term, units
from pam_envs.diagnosis.static.search import Trial


def sentences(f: Findings) -> str:
    """Return the verdict in one to four sentences."""
    word = verdict(f)
    if word == "insufficient":
        cells, needed = int(f.study.cells.used.sum()), 2 * len(f.base.fit.numbers)
        return (
            f"The table has {cells} cells; at least {needed} are needed to fit a static law with "
            "hysteresis and to judge it. Measure more pressures, up and down."
        )
    if not f.search.accepted:
        return _nothing(f, word == "adequate")
    return " ".join(part for part in (_missed(f), _named(f), _loads(f), _left(f)) if part)


def _nothing(f: Findings, adequate: bool) -> str:
    told = _missed(f)
    if adequate:
        return f"{told} No cause that the table can show is needed: the load-blind model will do."
    _, _, size = lack_of_fit(f.study, f.base)
    much = f" ({size:.2f} mm of it more than repeats explain)" if np.isfinite(size) else ""
    return f"{told} Something is left{much}, and no cause of the catalogue carries it."


def _missed(f: Findings) -> str:
    held, kind = f.base.held_out, f.study.lanes.kind
    told = f"A load-blind muscle misses {kind} left out by {held:.2f} mm"
    if np.isfinite(f.floor):
        return f"{told}, {held / f.floor:.1f} times the floor of {f.floor:.3f} mm."
    return f"{told}; without repeats no floor is known to hold it against."


def _named(f: Findings) -> str:
    parts = [_cause(f, trial) for trial in f.search.accepted]
    rivals = sorted({rival.term.cause for _, rival in f.ties})
    told = f"Named: {'; '.join(parts)}."
    return f"{told} Not told apart from {' and '.join(rivals)}." if rivals else told


def _cause(f: Findings, trial: Trial) -> str:
    hidden = f" (hidden until {f.shown_by(trial.term)} is in)" if f.shown_by(trial.term) else ""
    numbers = ", ".join(_number(f, trial.term, i) for i in range(len(trial.term.numbers)))
    return f"{trial.term.cause} as {trial.term.form}, {numbers}{hidden}"


def _number(f: Findings, term: Term, i: int) -> str:
    number = term.numbers[i]
    scale = units(number, f.study.cells.scale)
    low, high = (bound * scale for bound in f.interval(number.name))
    value = f.value(number.name) * scale
    if number.unit == "1/kg":
        return f"{100 * value:+.1f} %/kg ({100 * low:+.1f} to {100 * high:+.1f})"
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{value:.3g}{unit} ({low:.2g} to {high:.2g})"


def _loads(f: Findings) -> str:
    before, after = f.base.left_load, f.model.left_load
    if not np.isfinite(before):
        return ""
    cut = 100.0 * (1.0 - after / before)
    told = f"A load left out is predicted to {after:.2f} instead of {before:.2f} mm ({-cut:+.0f} %)"
    if not f.bent:
        return told + " by effects linear in load."
    power = f.laws[0]
    label = "post hoc, not held out" if power.post_hoc else "held out"
    return (
        f"{told} by effects linear in load, as fixed beforehand; to {power.left_load:.2f} mm with "
        f"the exponent {power.value:.1f} ({label})."
    )


def _left(f: Findings) -> str:
    ratio = f.model.held_out / f.floor
    if not np.isfinite(ratio):
        return ""
    held = f"{f.model.held_out:.2f} mm on {f.study.lanes.kind} left out"
    if ratio <= f.reached:
        return f"The floor is reached: {held}."
    f_value, _, size = lack_of_fit(f.study, f.model)
    return (
        f"The floor is not reached: {held} is {ratio:.1f} times it, {size:.2f} mm are left that "
        f"repeats do not explain (lack of fit F = {f_value:.0f})."
    )
