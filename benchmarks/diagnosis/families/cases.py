"""Cases of the study over families, and the rigs that they are recorded on.

A rig is one of a family in a world (``tests/diagnosis/pair_worlds``). Every rig is recorded clean
and with each hidden effect in turn, so that the base is fitted to its clean recording only once.
The *size* of an effect is that of :mod:`benchmarks.diagnosis.cases`: the RMS, over the noise, of
the part of its trace that a refit of the flexible base does not absorb, on the loudest output.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from benchmarks.diagnosis.absorbed import Absorbed
from benchmarks.diagnosis.cases import (
    LARGE,
    NEAR,
    ROUNDS,
    Case,
    Unmade,
    check_each,
    first_seed,
    loudest,
    sizes_in,
)
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.diagnosis import Study
from pam_envs.diagnosis.families.kinds import kind_named
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.plants.redundant_manipulator.plant import RedundantManipulator
from tests.diagnosis.pair_worlds import FAMILIES, HIDDEN, WORLDS, record

EACH = {"single": 10, "clean": 50}
"""Number of cases of a kind on each family in each world; of single effects, for each effect."""
PLACE_SEEDS = 5_000  # numbers of seeds of a family in a world
FAINT, STRONGEST = 1e-3, 8.0
"""Amplitude whose trace is that of none, and the largest, over the usual strength of an effect."""
BY_NATURE = ("static_law", "hysteresis_shape", "hysteresis_drive", "slew_limit", "dead_time")
"""Names that every clean rig deserves: its law and loops differ from the base, and its regulators
have a dead time and a limited rate."""


def place_of(family: str, world: str) -> str:
    """Return the name of a family in a world, of :attr:`Case.world`."""
    return f"{family}.{world}"


def parts_of(place: str) -> tuple[str, str]:
    """Return family and world of such a name."""
    family, _, world = place.partition(".")
    return family, world


TUNED = ("braid", "exponential")
"""Worlds on which the diagnosis is developed; no threshold is tuned on the others."""
HELD_OUT = tuple(world for world in WORLDS if world not in TUNED)
PLACES = tuple(
    place_of(family, world)
    for worlds in (TUNED, HELD_OUT)
    for family in FAMILIES
    for world in worlds
)


def effects_of(family: str) -> tuple[str, ...]:
    """Return the hidden effects that the catalogue of a family has a cause of.

    A cause whose parameters all belong to the base, as the viscosity of a joint, does not count.
    """
    kind = kind_named(family)
    plant = kind.start(Rig(plant=family))
    known = {
        cause.name
        for cause in kind.causes(kind.catalogue)
        for form in cause.forms
        if any(t.amount and plant.declaration(t.name).neutral is not None for t in form.terms)
    }
    return tuple(name for name in HIDDEN if name in known)


def cases(offset: int = 0, each: Mapping[str, int] | None = None) -> list[Case]:
    """Return the cases; with ``each`` only the first so many of its kinds in each place.

    Raises
    ------
    ValueError
        If a kind does not exist, or has fewer cases.
    """
    check_each(each, EACH)
    numbers = {kind: (each or EACH).get(kind, 0) for kind in EACH}
    made = []
    for k, place in enumerate(PLACES):
        start = first_seed("families", offset) + PLACE_SEEDS * k
        made += list(_cases(place, start, numbers))
    return made


def _cases(place: str, start: int, numbers: Mapping[str, int]) -> Iterator[Case]:
    """Yield the cases of a place; the n-th of each kind and effect is of the n-th rig."""
    rng = np.random.default_rng(start)
    for name in effects_of(parts_of(place)[0]):
        sizes = sizes_in(*LARGE, EACH["single"], rng)
        for n in range(numbers["single"]):
            yield Case("single", start + n, (name,), (float(sizes[n]),), world=place)
    for n in range(numbers["clean"]):
        yield Case("clean", start + n, world=place)


def start_of(family: str) -> Any:
    """Return the plant to start from; None for the default one. The rigs' arms have two joints."""
    if family != "redundant_manipulator":
        return None
    return RedundantManipulator.paper(chain=SerialChain.uniform(("x", "x")))


@dataclass(frozen=True)
class Ground:
    """A clean rig, and the changes that a refit of the base can make."""

    place: str
    seed: int
    clean: Recording
    sheet: Rig
    study: Study
    absorbed: Absorbed

    def recorded(self, name: str, amplitude: float) -> Recording:
        """Return the recording with an effect, in parts of its usual strength."""
        hidden = {key: amplitude * value for key, value in HIDDEN[name].items()}
        return record(*parts_of(self.place), self.seed, hidden)[0]

    def size(self, recording: Recording, name: str) -> tuple[float, float]:
        """Return the size of an effect in a recording, and that before the refit.

        The noise of both recordings is the same and cancels.
        """
        problem, family = self.study.problem, self.study.family
        rows = np.zeros(problem.measured.shape)
        for k, channel in enumerate(family.channels):
            if channel in recording.outputs:
                moved = recording.outputs[channel] - self.clean.outputs[channel]
                rows[k] = moved / self.sheet.noise[channel]
        return loudest(self.absorbed.left(rows, name)), loudest(rows)

    def solved(self, name: str, target: float) -> tuple[Recording, float, float, float]:
        """Return the recording with an effect of a size, its amplitude, and both sizes.

        Raises
        ------
        Unmade
            If the effect is too small at its strongest.
        """
        low, high, amplitude = FAINT, STRONGEST, 1.0
        for _ in range(ROUNDS):
            made = self.recorded(name, amplitude)
            size, raw = self.size(made, name)
            if abs(np.log(max(size, 1e-9) / target)) < NEAR:
                return made, amplitude, size, raw
            low, high = (amplitude, high) if size < target else (low, amplitude)
            step = amplitude * target / max(size, 1e-9)
            amplitude = step if low < step < high else float(np.sqrt(low * high))
        raise Unmade(f"{self.place} {name}: size {size:.2g} instead of {target:.2g}")


@lru_cache(maxsize=8)
def ground_of(place: str, seed: int) -> Ground:
    """Fit the flexible base of a family to a clean recording of a rig."""
    family, world = parts_of(place)
    recording, sheet = record(family, world, seed)
    kind, plant = kind_named(family), start_of(family)
    start = kind.start(sheet) if plant is None else plant
    study = Study.begin(recording, sheet, start, noise_floor(recording, sheet), kind)
    causes = kind.causes(kind.catalogue)
    study.make_flexible(causes)
    absorbed = Absorbed.of(study, causes, study.outputs(study.normal))
    return Ground(place, seed, recording, sheet, study, absorbed)
