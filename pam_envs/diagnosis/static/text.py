"""Verdict on a table of readings in a few sentences."""

from __future__ import annotations

import numpy as np

from pam_envs.diagnosis.static.compare import lack_of_fit
from pam_envs.diagnosis.static.findings import FLOOR_REACHED, Findings
from pam_envs.diagnosis.static.models import Number, units
from pam_envs.diagnosis.static.search import Trial


def sentences(f: Findings) -> str:
    """Return the verdict in one to four sentences."""
    if f.verdict == "insufficient":
        cells, needed = int(f.study.cells.used.sum()), 2 * len(f.base.fit.numbers)
        return (
            f"The table has {cells} cells; a static law with hysteresis needs at least {needed} to "
            "be fitted and judged. Measure more pressures, up and down."
        )
    if f.search.accepted:
        return " ".join(part for part in (_missed(f), _named(f), _loads(f), _left(f)) if part)
    if f.verdict == "adequate":
        return f"{_missed(f)} The load-blind model is adequate: the table shows no cause."
    _, _, size = lack_of_fit(f.study, f.base)
    much = f" of {size:.2f} mm" if np.isfinite(size) else ""
    text = f"An error{much} beyond the repeats is left, which no known cause explains."
    return f"{_missed(f)} {text}"


def _missed(f: Findings) -> str:
    held, kind = f.base.held_out, f.study.lanes.kind
    text = f"The error of a load-blind muscle on held-out {kind} is {held:.2f} mm"
    if np.isfinite(f.floor):
        return f"{text}, {held / f.floor:.1f} times the noise floor of {f.floor:.3f} mm."
    return f"{text}; without repeats the noise floor is unknown."


def _named(f: Findings) -> str:
    parts = [_cause(f, trial) for trial in f.search.accepted]
    rivals = sorted({rival.term.cause for _, rival in f.search.ties})
    text = f"Named: {'; '.join(parts)}."
    return f"{text} Not separated from {' and '.join(rivals)}." if rivals else text


def _cause(f: Findings, trial: Trial) -> str:
    masking = f.shown_by(trial.term)
    hidden = f" (significant only beside {masking})" if masking else ""
    return f"{trial.term.cause} as {trial.term.form}, {_number(f, trial.term.number)}{hidden}"


def _number(f: Findings, number: Number) -> str:
    scale = units(number, f.study.cells.scale)
    value, (low, high) = f.estimate(number.name)
    value, low, high = value * scale, low * scale, high * scale
    if number.unit == "1/kg":
        return f"{100 * value:+.1f} %/kg ({100 * low:+.1f} to {100 * high:+.1f})"
    unit = "" if number.unit == "1" else f" {number.unit}"
    return f"{value:.3g}{unit} ({low:.2g} to {high:.2g})"


def _loads(f: Findings) -> str:
    before, after = f.base.left_load, f.model.left_load
    if not np.isfinite(before):
        return ""
    cut = 100.0 * (1.0 - after / before)
    text = f"The error on a held-out load is {after:.2f} instead of {before:.2f} mm ({-cut:+.0f} %)"
    if not f.bent:
        return text + " with effects linear in load."
    power = f.laws[0]
    label = "post hoc, not held out" if power.post_hoc else "held out"
    return (
        f"{text} with effects linear in load, as fixed beforehand; {power.model.left_load:.2f} mm "
        f"with the exponent {power.value:.1f} ({label})."
    )


def _left(f: Findings) -> str:
    ratio = f.model.held_out / f.floor
    if not np.isfinite(ratio):
        return ""
    held = f"{f.model.held_out:.2f} mm on held-out {f.study.lanes.kind}"
    if ratio <= FLOOR_REACHED:
        return f"The noise floor is reached: {held}."
    f_value, _, size = lack_of_fit(f.study, f.model)
    return (
        f"The noise floor is not reached: {held} is {ratio:.1f} times it, {size:.2f} mm are not "
        f"explained by repeats (lack of fit F = {f_value:.0f})."
    )
