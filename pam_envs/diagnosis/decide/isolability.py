"""Isolability and testability of causes, simulated before any residual is used."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pam_envs.arrays import Array
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import undecidable, unmet_needs
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.fit.blocks import BLOCK_SECONDS, EVERY
from pam_envs.diagnosis.fit.candidate import initial_fits
from pam_envs.diagnosis.fit.least_squares import Fit, Free, PlantFamily, Problem, column_of

DIRECTIONS = 1e-8  # relative size of the singular directions of the base's Jacobian that count
TOGETHER = 96  # number of columns simulated in one replay
NO_TRACE = 1e-3  # size over the noise below which an effect is invisible
FAR, FAR_LOG = 30.0, 6.0
"""Factor, and power for logarithmic ones, of the largest tried value over the starting value."""
ALIKE = 0.9  # cosine above which two causes can only be separated by a further sensor
SHORT = "The recording is too short to decide anything"
"""Beginning of the warning on a short recording."""
ROUNDING = 1e-9  # size over the noise that is only rounding
LEAST_SIZE = 1.0  # size over the noise that a testable cause must reach within its bounds
LEAST_TESTABLE, LEAST_SHARE = 5, 0.5
"""Least number of testable causes, or least share of the requested ones, for a decision."""


def base_subspace(base: Fit) -> Array:
    """Return an orthonormal basis of the changes that a refit of the base can make, (k, m)."""
    j = base.slopes
    spreads = np.array([1.0 / f.prior if np.isfinite(f.prior) else 0.0 for f in base.frees])
    values, vectors = np.linalg.eigh(j @ j.T + np.diag(spreads**2))
    keep = values > DIRECTIONS * values[-1]
    basis = (vectors[:, keep].T @ j) / np.sqrt(values[keep])[:, None]
    return np.asarray(basis)


def projected(traces: Array, basis: Array) -> Array:
    """Return traces, shape (n, m), without the part that a refit of the base absorbs."""
    return np.asarray(traces - (traces @ basis.T) @ basis)


@dataclass(frozen=True)
class Isolability:
    """Cosines between the effects of causes after a refit of the base."""

    names: tuple[str, ...]
    cosine: Array  # (n, n): absolute values
    absorbed: Array  # (n,): share of the RMS that a refit of the base absorbs; NaN if invisible
    reach: Array  # (n,): largest size over the noise at the starting points or at the bounds


@dataclass(frozen=True)
class Shown:
    """Effect of one parameter column relative to the base."""

    left: Array  # (m,): part that a refit of the base does not absorb
    size: float  # RMS of that part over the noise, on the channel where it is largest
    raw: float  # RMS before the refit over the noise

    @property
    def absorbed(self) -> float:
        """Share of the RMS absorbed by the refit; NaN for an invisible effect."""
        rms = float(np.linalg.norm(self.left)) / np.sqrt(self.left.size)
        return 1.0 - rms / self.raw if self.raw > NO_TRACE else np.nan


def isolability(
    problem: Problem, family: PlantFamily, base: Fit, causes: Sequence[Cause]
) -> Isolability:
    """Simulate each cause at its starting points and bounds, and compare the effects."""
    columns: list[Array] = []
    begins: dict[str, list[int]] = {}
    bounds: dict[str, list[int]] = {}
    for cause in causes:
        for form in cause.forms:
            fits = initial_fits(problem, family, base, cause, form)
            for at, more in ((begins, [column_of(f, f.z) for f in fits]), (bounds, ends(fits))):
                places = range(len(columns), len(columns) + len(more))
                at.setdefault(cause.name, []).extend(places)
                columns += more
    if not columns:
        return Isolability((), np.zeros((0, 0)), np.zeros(0), np.zeros(0))
    shown = list(_shown(problem, base, columns))
    names = tuple(name for name, places in begins.items() if places)
    kept, absorbed, reach = [], [], []
    for name in names:
        best = max((shown[k] for k in begins[name]), key=lambda s: s.size)
        ends_of = max((shown[k] for k in bounds[name]), key=lambda s: s.size)
        kept.append(best.left if best.raw > NO_TRACE else ends_of.left)
        absorbed.append(best.absorbed)
        reach.append(max(best.size, ends_of.size))
    rows = np.array([row / max(float(np.linalg.norm(row)), 1e-12) for row in kept])
    return Isolability(names, np.abs(rows @ rows.T), np.array(absorbed), np.array(reach))


def ends(fits: Sequence[Fit]) -> list[Array]:
    """Return columns with all amounts of a form at their bounds and far from their starts.

    An effect need not grow monotonically: far beyond its usual size the refit may absorb it.
    """
    if not fits:
        return []
    fit = fits[0]
    terms = fit.label[1].terms
    frees = fit.frees[len(fit.frees) - len(terms) :]
    made = []
    for place_of in (lambda f: f.low, lambda f: f.high, lambda f: far(f, fit.column[f.place])):
        column = column_of(fit, fit.z)
        for term, free in zip(terms, frees, strict=True):
            if term.amount:
                column[free.place] = place_of(free)
        made.append(column)
    return made


def far(free: Free, here: float) -> float:
    """Return a value far beyond a parameter's starting value, within its bounds."""
    value = FAR * free.start
    if free.log:
        value = here * (free.start / here) ** FAR_LOG if here > 0.0 else free.start
    return float(np.clip(value, free.low, free.high))


def _shown(problem: Problem, base: Fit, columns: Sequence[Array]) -> Iterator[Shown]:
    """Yield the effect of each column relative to the base."""
    basis = base_subspace(base)
    for traces in changes(problem, column_of(base, base.z), columns):
        for trace, left in zip(traces, projected(traces, basis), strict=True):
            raw = float(np.linalg.norm(trace)) / np.sqrt(trace.size)
            yield Shown(left, size_over_noise(left, problem), raw)


def changes(problem: Problem, here: Array, columns: Sequence[Array]) -> Iterator[Array]:
    """Yield the changes of the residual by parameter columns, some at a time, shape (n, m)."""
    without = problem.residuals(here[None])[0]
    for at in range(0, len(columns), TOGETHER):
        yield problem.residuals(np.array(columns[at : at + TOGETHER])) - without


def lookalikes(found: Isolability, causes: Sequence[Cause]) -> dict[str, str]:
    """Return, for causes in valve or line, another cause with the same effect if any."""
    names = {cause.name: k for k, cause in enumerate(causes)}
    made = {}
    for k, name in enumerate(found.names):
        cosines = np.delete(found.cosine[k], k)
        if causes[names[name]].in_valve and len(cosines) and cosines.max() >= ALIKE:
            made[name] = np.delete(np.array(found.names), k)[np.argmax(cosines)]
    return {name: str(other) for name, other in made.items()}


def size_over_noise(trace: Array, problem: Problem) -> float:
    """Return the RMS of a trace over the noise, on the channel where it is largest."""
    good = np.isfinite(problem.measured)
    rows = problem.rows(trace)
    sizes = [float(np.sqrt(np.mean(r[g] ** 2))) for r, g in zip(rows, good, strict=True) if g.any()]
    return max(sizes, default=0.0)


def not_testable(
    problem: Problem,
    family: PlantFamily,
    base: Fit,
    causes: Sequence[Cause],
    recording: Recording,
    sheet: Rig,
    unmet: Mapping[str, str] | None = None,
) -> tuple[Isolability, dict[str, str]]:
    """Return the isolability of the causes, and the reason for each that is not testable.

    ``unmet`` are the needs that the recording does not meet; default: of a single muscle.
    """
    unmet = unmet_needs(recording, sheet) if unmet is None else unmet
    reasons = undecidable(recording, sheet, causes, unmet)
    present = {f.name for f in base.frees}
    for cause in causes:
        if all(any(t.name in present for t in form.terms) for form in cause.forms):
            reasons[cause.name] = "it is a parameter of the plant already: see calibration"
    left = [c for c in causes if c.name not in reasons]
    found = isolability(problem, family, base, left)
    reasons |= _too_small(found, left)
    if "pressure" in unmet:
        for name, other in lookalikes(found, left).items():
            reasons.setdefault(name, f"cannot be separated from {other} without pressure_bar")
    return found, {c.name: reasons[c.name] for c in causes if c.name in reasons}


def unseen_rivals(
    problem: Problem,
    family: PlantFamily,
    base: Fit,
    causes: Sequence[Cause],
    recording: Recording,
    sheet: Rig,
    unmet: Mapping[str, str] | None = None,
) -> list[Cause]:
    """Return the causes that lack their experiment, but would show on the recording.

    None of them can be named, and a cause that looks like one of them is in doubt.
    """
    reasons = undecidable(recording, sheet, causes, unmet)
    lacking = [c for c in causes if c.name in reasons]
    found = isolability(problem, family, base, lacking)
    small = _too_small(found, lacking)
    return [c for c in lacking if c.name not in small]


def shown(size: float) -> str:
    """Return a size over the noise in digits, 0 for rounding errors."""
    return f"{size:.2g}" if size > ROUNDING else "0"


def _too_small(found: Isolability, causes: Sequence[Cause]) -> dict[str, str]:
    reach = dict(zip(found.names, found.reach, strict=True))
    return {
        cause.name: (
            f"within its bounds it shows at most {shown(reach.get(cause.name, 0.0))} times the "
            "noise of this recording after a refit of the plant"
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
