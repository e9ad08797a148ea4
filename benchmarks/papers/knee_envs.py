"""Figures of yeh2010 in the environments, with the paper's control system.

:mod:`benchmarks.papers.knee` combines the printed transfer functions with the hysteresis alone;
here the plant is complete.
"""

from benchmarks.papers.gait import MISMATCH, NAMES, printed_change
from benchmarks.papers.knee import LOOP_WIDTHS
from benchmarks.papers.knee_studies import (
    TensionErrors,
    emg_ratios,
    stiffness_errors,
    stride,
    switching,
    tension_errors,
)
from benchmarks.papers.published import Group, Values
from pam_envs.references.gait import NATURAL_STRIDE, PAPER_STRIDE

HANDOVERS = (
    (
        "without bumpless transfer",
        False,
        False,
        "the tension in swing is what the angle needs, so that there is a mismatch at 0 N too",
    ),
    (
        "with bumpless transfer",
        True,
        False,
        "what is left without mismatch is the lag: the reference falls by 100 N in 0.2 s",
    ),
    ("with bumpless transfer, one lag of preview", True, True, "the paper has no preview"),
)
"""Bumpless transfer and preview of the controllers, and a remark."""


def stiffness_environment() -> Values:
    """Stiffness tracking in ``PAM/KneeStiffness-v0``."""
    inverse, line = stiffness_errors()
    yield "KneeStiffness, knee_inverse", inverse
    yield "KneeStiffness, knee_line", line


def tension_environment() -> Values:
    """Tension tracking in ``PAM/KneeTension-v0``, by loop width, and with the wearable brace."""
    for width in LOOP_WIDTHS:
        rig = "KneeTension, rig, {bar:g} bar"
        yield from _tension(rig, tension_errors(width), bar=1e-5 * width)
    wearable = tension_errors(feedback="designed", mounting="no_load", dynamics="lag")
    yield from _tension("KneeTension, wearable, our design", wearable)


def _tension(title: str, found: TensionErrors, **known: float) -> Values:
    yield f"{title}, LTR", found.feedback, known
    yield f"{title}, LTR + straight line", found.with_line, known
    yield f"{title}, LTR + inverse", found.with_inverse, known


def switch_environment() -> Values:
    """Transient after the switch to stance in ``PAM/KneeWalk-v0``: 5 s a stride, then faster."""
    for mismatch in (0.0, MISMATCH):
        for how, bumpless, preview, remark in HANDOVERS:
            found = switching(mismatch, bumpless, preview)
            known = {"mismatch": mismatch, "how": how, "remark": remark}
            bound = {} if not mismatch or preview else {"at_most": 15.0} if bumpless else SLOW
            title = "KneeWalk, {mismatch:g} N, {how}: "
            yield f"{title}tension error", found.tension, known | bound
            yield f"{title}error at the switch", found.at_switch, known
            yield f"{title}excess after it", found.excess, known
            yield f"{title}command jump", 1e-3 * found.command, known
    for how, bumpless, preview, _ in HANDOVERS:  # increase by the mismatch
        with_it, none = (switching(m, bumpless, preview).tension for m in (MISMATCH, 0.0))
        yield "KneeWalk, 10 N less none, {how}: tension error", with_it - none, {"how": how}
    rough, smooth = (switching(MISMATCH, bumpless).tension for bumpless in (False, True))
    yield "tension error without over with bumpless", rough / smooth
    for pace in (3.0, 2.0, NATURAL_STRIDE):  # the saturated swing leaves most of the transient
        for how, bumpless, preview, _ in HANDOVERS[:2]:
            found = switching(MISMATCH, bumpless, preview, pace)
            at = {"pace": pace, "how": how}
            title = "KneeWalk, {pace:g} s a stride, {how}: "
            yield f"{title}error at the switch", found.at_switch, at
            yield f"{title}excess after it", found.excess, at


SLOW = {
    "at_least": 40.0,
    "why": "the load of a slow stride shifts more slowly than that of the paper's wearer",
}
"""Bound of the tension error at the mismatch [N] without bumpless transfer."""
READINGS = {
    "uncalibrated": "emg_extensors_ratio",
    "uncalibrated, with the flexors": "emg_ratio",
    "calibrated A": "emg_extensors_ratio_fitted_a",
    "calibrated B": "emg_extensors_ratio_fitted_b",
}


def emg_environment() -> Values:
    """EMG proxy with the assistance as the controller delivers it, in its three readings."""
    for activity, name in NAMES.items():
        found = emg_ratios(activity)
        for reading, key in READINGS.items():
            title = f"EMG, {{activity}}, as delivered, {reading}"
            known = {"activity": name, **printed_change(activity)}
            yield title, 100.0 * (found[key] - 1.0), known
        if activity == "walk":
            ratio = found["emg_extensors_ratio"]
            yield "EMG proxy of the extensors, with over without", ratio
    yield from peak_pressures()


def peak_pressures() -> Values:
    """Peak of the pressure in stance at an assistive ratio of 20 %, and at a faster pace."""
    peaks = []
    for pace in (PAPER_STRIDE, 2.0):
        signals = stride("walk", pace=pace)
        stance = signals["sensor/stance"] > 0.5
        peaks.append(1e-5 * float(signals["state/pressure"][stance].max()))
    yield "peak pressure at 20 %, 5 s a stride", peaks[0]
    yield "peak pressure at 2 s over 5 s a stride", peaks[1] / peaks[0]


GROUPS: tuple[Group, ...] = (
    stiffness_environment,
    tension_environment,
    switch_environment,
    emg_environment,
)
