"""Testable causes of a recording, with the reason for each that is not testable."""

from __future__ import annotations

from collections.abc import Sequence

from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import undecidable
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.decide.isolability import Isolability, isolability, lookalikes
from pam_envs.diagnosis.fit.blocks import BLOCK_SECONDS, EVERY
from pam_envs.diagnosis.fit.least_squares import Fit, PlantFamily, Problem

SHORT = "The recording is too short to decide anything"
"""Beginning of the warning on a short recording."""
LEAST_SIZE = 1.0
"""Size over the noise that a testable cause must reach within its bounds."""
LEAST_TESTABLE, LEAST_SHARE = 5, 0.5
"""Least number of testable causes, or least share of the requested ones, for a decision."""


def not_testable(
    problem: Problem,
    family: PlantFamily,
    base: Fit,
    causes: Sequence[Cause],
    recording: Recording,
    sheet: Rig,
) -> tuple[Isolability, dict[str, str]]:
    """Return the isolability of the causes, and the reason for each that is not testable."""
    reasons = undecidable(recording, sheet, causes)
    present = {f.name for f in base.frees}
    for cause in causes:
        if all(any(t.name in present for t in form.terms) for form in cause.forms):
            reasons[cause.name] = "it is a parameter of the plant already: see calibration"
    left = [c for c in causes if c.name not in reasons]
    found = isolability(problem, family, base, left)
    reasons |= _too_small(found, left)
    if recording.pressure is None:
        for name, other in lookalikes(found, left).items():
            reasons.setdefault(name, f"cannot be separated from {other} without pressure_bar")
    return found, {c.name: reasons[c.name] for c in causes if c.name in reasons}


def _too_small(found: Isolability, causes: Sequence[Cause]) -> dict[str, str]:
    reach = dict(zip(found.names, found.reach, strict=True))
    return {
        cause.name: (
            f"within its bounds it shows at most {reach.get(cause.name, 0.0):.2g} times the noise "
            "here, once the plant is refitted"
        )
        for cause in causes
        # the time of an event is searched in the residual
        if not (cause.once and cause.forms[0].search is not None)
        and reach.get(cause.name, 0.0) < LEAST_SIZE
    }


def too_few_testable(testable: int, asked: int) -> bool:
    """Return whether too few causes are testable for a decision."""
    few = testable < LEAST_TESTABLE and testable < LEAST_SHARE * asked
    return testable == 0 or few


def shortness_warning(moved: int, least: int) -> str:
    """Return the warning on a recording with too little motion."""
    return (
        f"{SHORT}: the command moves in {moved} of the {BLOCK_SECONDS:g} s blocks that are held "
        f"out, and {least} are needed; record at least {EVERY * least * BLOCK_SECONDS:.0f} s of "
        "varied motion."
    )
