"""Cases of the diagnosis benchmark: a drawn rig, hidden effects of given size, and a recording.

The *size* of an effect is the RMS, over the noise, of the part of its trace that a refit of the
plant's flexible base does not absorb (:mod:`benchmarks.diagnosis.absorbed`), on the output where it
is largest. A case gives a target size, for which the amplitude is solved. The diagnosis
sees only recording and rig file.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import combinations
from typing import Any

import numpy as np

from benchmarks.diagnosis.absorbed import Absorbed
from benchmarks.diagnosis.sources import (
    HOME,
    Effects,
    columns_of,
    draw_effect,
    draw_rig,
    outputs_of,
    sheet_of,
    with_clock,
)
from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.diagnosis import Study
from pam_envs.diagnosis.fit.single_muscle import start_plant
from tests.diagnosis import hidden

NOISE = np.array([hidden.CONTRACTION_NOISE_MM * MM, hidden.PRESSURE_NOISE_BAR * BAR])
"""RMS noise of the sensors [m], [Pa]."""
CAMPAIGNS = {
    "standard": hidden.campaign_standard,
    "short": hidden.campaign_short,
    "idle": hidden.campaign_idle,
}
SETS = {"small": 0, "tune": 1, "final": 2, "worlds": 3, "mutilated": 4, "families": 5}
LARGE, WEAK = (1.0, 5.0), (0.1, 1.0)  # ranges of sizes
LOUDER = 3.0  # relative noise of the ``loud`` cases
BRIEF = (30.0, 60.0, 120.0)  # durations of the ``brief`` recordings [s]
LACKING = {
    "leak": "closed valve",
    "temperature": "temperature",
    "payload_error": "tolerance of the loads",
    "wire_slack": "loads",
}
"""Causes of the ``untestable`` cases, and what their recording lacks."""
ONE_LOAD = 15.0  # of a recording without other loads [N]
STRONG = 6.0  # amplitude of an untestable effect that a refit absorbs at any amplitude
MOST_AMPLITUDE = 20.0
NEAR = 0.03  # tolerance of a size, in the logarithm
ROUNDS, DRAWS = 16, 12  # largest numbers of trials of an amplitude, and of rigs


class Unmade(ValueError):
    """An effect that has not the drawn size on any drawn rig, at any amplitude."""


@dataclass(frozen=True)
class Case:
    """Specification of a case; equal cases give equal recordings."""

    # "loud": a single effect under three times the noise with the same absolute size; "idle": a
    # clean rig without motion, which cannot be decided; "brief": a recording of a clean rig of some
    # seconds; "clock": a clean rig whose readings are late; "untestable": a single effect whose
    # experiment the recording lacks
    kind: str
    seed: int
    names: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()  # over the usual noise
    campaign: str = "standard"
    noise: float = 1.0  # over the usual noise
    seconds: float = 0.0  # 0 for the whole campaign
    world: str = HOME
    late: float = 0.0  # rows by which the readings of a ``clock`` case are late

    @property
    def lacking(self) -> str:
        """What the recording of an untestable effect lacks."""
        return LACKING[self.names[0]] if self.kind == "untestable" else ""

    def record(self) -> dict[str, Any]:
        """Return the case in plain types."""
        return asdict(self)

    @property
    def title(self) -> str:
        """Short description for messages."""
        sizes = [f" {size:.2g}" for size in self.sizes] or [""] * len(self.names)
        parts = [name + size for name, size in zip(self.names, sizes, strict=True)]
        return f"{self.world} {self.kind} {' + '.join(parts)} seed {self.seed}".replace(
            "  ", " "
        ).strip()


@dataclass(frozen=True)
class Truth:
    """One hidden effect with its solved amplitude."""

    effect: Any
    amplitude: float
    size: float  # after the refit of the base, over the usual noise
    raw: float  # before it
    trace: Array  # contribution to the outputs beside the other effects [m], [Pa], shape (2, T)

    @property
    def name(self) -> str:
        """Name in the catalogue."""
        return self.effect.name


@dataclass(frozen=True)
class Ground:
    """A clean rig under a campaign, and the changes that a refit can make."""

    base: Any  # the rig
    campaign: hidden.Campaign
    clean: Array  # outputs without effect and noise [m], [Pa], shape (2, T)
    absorbed: Absorbed | None  # None if no size is asked

    def left(self, trace: Array, name: str) -> Array:
        """Return the part of the trace of an effect that a refit does not absorb, over noise.

        The trace has the shape (2, T) [m], [Pa].
        """
        rows = trace / NOISE[:, None]
        return rows if self.absorbed is None else self.absorbed.left(rows, name)

    def size(self, trace: Array, name: str) -> float:
        """Return the size of the trace of an effect."""
        return loudest(self.left(trace, name)) if np.isfinite(trace).all() else np.inf


@dataclass(frozen=True)
class Made:
    """A generated case: input of the diagnosis, hidden ground truth, and RMS noise [m], [Pa]."""

    recording: Recording
    sheet: Rig
    ground: Ground
    truths: tuple[Truth, ...]
    noise: Array

    @property
    def effects(self) -> Effects:
        """Hidden effects with their amplitudes."""
        return [(truth.effect, truth.amplitude) for truth in self.truths]


def loudest(rows: Array) -> float:
    """Return the larger of the RMS values of two rows."""
    return float(np.sqrt((rows**2).mean(axis=1)).max())


def recording_of(columns: dict[str, Any], sheet: Rig, source: str) -> Recording:
    """Return the recording of a rig from its columns."""
    return Recording.from_arrays(
        columns["time_s"],
        columns["pressure_command_bar"] * BAR,
        pressure=columns["pressure_bar"] * BAR,
        contraction=columns["contraction_mm"] * MM,
        load=columns["load_N"],
        segment=columns["segment"].tolist(),
        temperature=columns.get("temperature_C"),
        valve_closed=sheet.valve_closed,
        source=source,
    )


def observed(
    case: Case, base: Any, effects: Effects, campaign: hidden.Campaign, source: str
) -> tuple[Recording, Rig]:
    """Return recording and rig file of a rig, without what the case lacks."""
    sheet = sheet_of(base, campaign, case.noise)
    columns = columns_of(base, effects, campaign, case.seed + 7, case.noise)
    if case.lacking == "temperature":
        del columns["temperature_C"]
    if case.lacking == "tolerance of the loads":
        sheet = replace(sheet, tolerance={})
    return recording_of(columns, sheet, source), sheet


def ground_of(case: Case, base: Any, campaign: hidden.Campaign) -> Ground:
    """Fit the plant's flexible base to a recording of a clean rig."""
    clean = outputs_of(base, [], campaign)
    if not case.names:  # nothing whose size is asked
        return Ground(base, campaign, clean, None)
    recording, sheet = observed(replace(case, noise=1.0), base, [], campaign, "clean")
    floor = noise_floor(recording, sheet)
    study = Study.begin(recording, sheet, start_plant(sheet), floor)
    study.make_flexible(catalogue())
    return Ground(base, campaign, clean, Absorbed.of(study, catalogue(), clean))


def solve(ground: Ground, effect: Any, target: float) -> tuple[float, Array] | None:
    """Return the amplitude and trace of an effect of a target size, or None if out of reach."""
    low, high, amplitude = 0.0, np.inf, min(1.0, target)
    for _ in range(ROUNDS):
        trace = outputs_of(ground.base, [(effect, amplitude)], ground.campaign) - ground.clean
        size = ground.size(trace, effect.name)
        if abs(np.log(max(size, 1e-9) / target)) < NEAR:
            return amplitude, trace
        low, high = (amplitude, high) if size < target else (low, amplitude)
        if low >= MOST_AMPLITUDE:
            return None
        amplitude = _next(amplitude, size, target, low, high)
    return None


def _next(amplitude: float, size: float, target: float, low: float, high: float) -> float:
    """Return the next amplitude: in proportion, within the known bounds."""
    guess = amplitude * target / max(size, 1e-6) if np.isfinite(size) else 0.5 * amplitude
    if np.isinf(high):
        return float(min(guess, 6.0 * amplitude, MOST_AMPLITUDE))
    may_be_within = low + 0.02 * (high - low) < guess < high - 0.02 * (high - low)
    return float(guess if may_be_within else 0.5 * (low + high))


def _draw(case: Case, attempt: int) -> tuple[Ground, list[tuple[Any, float, Array]]] | None:
    """Draw a rig and its effects; None if a size is out of reach."""
    rng = np.random.default_rng([case.seed, attempt])
    base, campaign = draw_rig(case.world, rng, decoy=case.kind == "decoy"), _campaign(case)
    if case.kind == "clock":
        base = with_clock(base, case.late * campaign.period)
    ground = ground_of(case, base, campaign)
    found = []
    for name, size in zip(case.names, case.sizes, strict=True):
        effect = draw_effect(name, base, rng)
        solved = solve(ground, effect, size)
        if solved is None and case.kind == "untestable":
            solved = STRONG, outputs_of(base, [(effect, STRONG)], campaign) - ground.clean
        if solved is None:
            return None
        found.append((effect, *solved))
    return ground, found


def _campaign(case: Case) -> hidden.Campaign:
    """Return the campaign of a case, up to the end of its recording."""
    whole = CAMPAIGNS[case.campaign](case.seed)
    if case.lacking == "closed valve":
        whole = replace(whole, valve_closed=np.zeros_like(whole.valve_closed))
    if case.lacking == "loads":
        whole = replace(whole, load_N=np.full_like(whole.load_N, ONE_LOAD))
    if not case.seconds:
        return whole
    n = round(case.seconds / whole.period)
    arrays = {f.name: getattr(whole, f.name)[:n] for f in fields(whole) if f.name != "period"}
    return replace(whole, **arrays)


def make(case: Case) -> Made:
    """Draw a case; raise Unmade if no drawn rig has effects of the target sizes."""
    drawn = next(filter(None, (_draw(case, k) for k in range(DRAWS))), None)
    if drawn is None:
        raise Unmade(f"{case.title}: the effect is too small on all of {DRAWS} drawn rigs")
    ground, found = drawn
    effects = [(effect, amplitude) for effect, amplitude, _ in found]
    outputs = outputs_of(ground.base, effects, ground.campaign)
    source = f"case {case.seed}"
    recording, sheet = observed(case, ground.base, effects, ground.campaign, source)
    return Made(
        recording,
        sheet,
        ground,
        tuple(_truths(ground, found, outputs)),
        case.noise * NOISE,
    )


def _truths(
    ground: Ground, found: list[tuple[Any, float, Array]], outputs: Array
) -> Iterator[Truth]:
    """Yield the hidden effects; with several, the trace of one is the change when it is removed."""
    for k, (effect, amplitude, alone) in enumerate(found):
        trace = alone
        if len(found) > 1:
            others = [(e, a) for i, (e, a, _) in enumerate(found) if i != k]
            trace = outputs - outputs_of(ground.base, others, ground.campaign)
        raw = loudest(alone / NOISE[:, None])
        yield Truth(effect, amplitude, ground.size(alone, effect.name), raw, trace)


SMALL: dict[str, int] = {
    **{"single": 1, "weak": 0, "clean": 3, "decoy": 2, "pair": 2},
    **{"unknown": 2, "idle": 1, "brief": 1, "loud": 0},
}
FULL: dict[str, int] = {
    **{"single": 40, "weak": 20, "clean": 200, "decoy": 100, "pair": 100},
    **{"unknown": 60, "idle": 20, "brief": 60, "loud": 6},
}
"""Number of cases of each kind of a set, for each cause or in total."""


def first_seed(selected: str, offset: int = 0) -> int:
    """Return the first seed of a set; sets and offsets use disjoint seeds."""
    if not 0 <= offset < 100:
        raise ValueError(f"seed offset {offset} is outside [0, 99]; choose another")
    return 10_000_000 * (SETS[selected] + 1) + 100_000 * offset


def check_each(each: Mapping[str, int] | None, most: Mapping[str, int]) -> None:
    """Raise ``ValueError`` if a kind of ``each`` does not exist, or has fewer cases than asked."""
    for kind, number in (each or {}).items():
        if not 0 <= number <= most.get(kind, -1):
            known = ", ".join(f"{name} (at most {n})" for name, n in most.items())
            raise ValueError(f"--each {kind} {number}: there are {known}")


def sizes_in(low: float, high: float, number: int, rng: np.random.Generator) -> Array:
    """Draw stratified log-uniform sizes."""
    parts = (np.arange(number) + rng.random(number)) / max(number, 1)
    return np.asarray(rng.permutation(low * (high / low) ** parts))


def cases(selected: str = "small", offset: int = 0) -> list[Case]:
    """Return the cases of the set "small", "tune" or "final"; another offset draws other cases."""
    counts = SMALL if selected == "small" else FULL
    unknown = hidden.FINAL_UNKNOWN if selected == "final" else hidden.TUNING_UNKNOWN
    start = first_seed(selected, offset)
    rng = np.random.default_rng(start)
    numbered = [
        replace(case, seed=start + i) for i, case in enumerate(_specified(counts, unknown, rng))
    ]
    loud = [
        case
        for name in hidden.EFFECTS
        for case in [
            case
            for case in numbered
            if case.kind == "single" and case.names == (name,) and case.sizes[0] >= LOUDER
        ][: counts["loud"]]
    ]
    return numbered + [replace(case, kind="loud", noise=LOUDER) for case in loud]


def _specified(
    counts: dict[str, int], unknown: Sequence[str], rng: np.random.Generator
) -> Iterator[Case]:
    """Yield the cases of a set without their seeds."""
    for name in hidden.EFFECTS:
        for size in sizes_in(*LARGE, counts["single"], rng):
            yield Case("single", 0, (name,), (float(size),))
        for size in sizes_in(*WEAK, counts["weak"], rng):
            yield Case("weak", 0, (name,), (float(size),))
    yield from [Case("clean", 0)] * counts["clean"]
    yield from [Case("decoy", 0)] * counts["decoy"]
    pairs = list(combinations(hidden.EFFECTS, 2))
    both = zip(*(sizes_in(*LARGE, counts["pair"], rng) for _ in range(2)), strict=True)
    for k, (one, two) in zip(rng.permutation(len(pairs)), both, strict=False):
        yield Case("pair", 0, pairs[k], (float(one), float(two)))
    for i, size in enumerate(sizes_in(*LARGE, counts["unknown"], rng)):
        yield Case("unknown", 0, (unknown[i % len(unknown)],), (float(size),))
    yield from [Case("idle", 0, campaign="idle")] * counts["idle"]
    for i in range(counts["brief"]):
        yield Case("brief", 0, campaign="short", seconds=BRIEF[i % len(BRIEF)])
