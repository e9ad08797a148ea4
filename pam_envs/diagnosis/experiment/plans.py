"""List of experiments that a rig can do.

Loads, pressures, a closed valve and a warmer muscle are proposed only if the recording shows that
the rig has them; no experiment exceeds the recorded loads and the largest recorded command.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.audit import load_levels
from pam_envs.wording import enumeration

PERIOD = 0.02
WARMER = 10.0  # temperature rise of a warmed muscle [K]
STAIRS = tuple(v / 10.0 for v in (*range(1, 10), *range(8, 0, -1)))


@dataclass(frozen=True)
class Means:
    """Capabilities of a rig."""

    full: float  # largest setpoint [Pa]
    loads: tuple[float, ...]  # available loads [N], ascending
    shut: bool  # the valve can be closed
    warm: bool  # the muscle's temperature is measured

    @classmethod
    def of(cls, recording: Recording, rig: Rig) -> "Means":
        """Return the capabilities that a recording shows."""
        return cls(
            full=float(recording.command.max()),
            loads=tuple(load_levels(recording)),
            shut=bool(rig.valve_closed) or bool(recording.valve_closed.any()),
            warm=recording.temperature is not None,
        )

    def near(self, share: float) -> float:
        """Return the load nearest to a share of the range from the lightest to the heaviest."""
        return near(self.loads, share)


def near(levels: Sequence[float], share: float) -> float:
    """Return the level nearest to a share of the range of ascending levels."""
    target = levels[0] + share * (levels[-1] - levels[0])
    return min(levels, key=lambda level: abs(level - target))


@dataclass(frozen=True)
class Piece:
    """A ramp or sine of an experiment."""

    seconds: float  # duration [s]
    start: float  # setpoint over the largest one; the lowest of a sine
    end: float  # setpoint over the largest one; the highest of a sine
    hertz: float = 0.0  # frequency of a sine [Hz]; 0 for a ramp
    shut: bool = False  # with the valve closed no setpoint acts

    @property
    def samples(self) -> int:
        """Number of samples."""
        return round(self.seconds / PERIOD)

    @property
    def command(self) -> Array:
        """Setpoints over the largest one, shape (n,); negative with the valve closed."""
        n = self.samples
        if self.shut:
            return np.full(n, -1.0)
        if self.hertz == 0.0:
            return np.linspace(self.start, self.end, n)
        swing = 0.5 * (self.end - self.start)
        phase = 2.0 * np.pi * self.hertz * PERIOD * np.arange(n)
        return np.asarray(self.start + swing * (1.0 - np.cos(phase)))


@dataclass(frozen=True)
class Plan:
    """An experiment."""

    name: str
    description: str
    pieces: tuple[Piece, ...]  # repeated for each load
    loads: tuple[float, ...]  # in turn [N]
    full: float  # largest setpoint [Pa]
    warmer: float = 0.0  # temperature rise of the muscle until the middle of the experiment [K]

    @property
    def command(self) -> Array:
        """Setpoints [Pa], shape (n,); negative with the valve closed."""
        one = np.concatenate([p.command for p in self.pieces])
        return np.tile(np.where(one < 0.0, -1.0, self.full * one), len(self.loads))

    @property
    def load(self) -> Array:
        """Load [N], shape (n,)."""
        return np.repeat(self.loads, sum(p.samples for p in self.pieces))

    @property
    def kelvin(self) -> Array:
        """Temperature rise [K], shape (n,)."""
        n = len(self.load)
        return self.warmer * np.minimum(1.0, np.arange(n) / max(1, n // 2))

    @property
    def segments(self) -> list[dict[str, Any]]:
        """Instructions piece by piece, for the report."""
        kelvin, made, at = self.kelvin, [], 0
        for load in self.loads:
            for piece in self.pieces:
                at += piece.samples
                made.append(
                    {
                        "seconds": piece.seconds,
                        "from_bar": round(piece.start * self.full / BAR, 4),
                        "to_bar": round(piece.end * self.full / BAR, 4),
                        **({"swing_hz": piece.hertz} if piece.hertz else {}),
                        "load_N": load,
                        "valve": "closed" if piece.shut else "open",
                        "warmer_by_K": round(float(kelvin[at - 1]), 2),
                    }
                )
        return made


def hold(level: float, seconds: float) -> Piece:
    """Return a hold."""
    return Piece(seconds, level, level)


def swing(middle: float, size: float, hertz: float, seconds: float) -> Piece:
    """Return a sine about a mean level."""
    return Piece(seconds, middle - size, middle + size, hertz)


REST = hold(0.0, 3.0)
TRIANGLE = (Piece(10.0, 0.0, 0.95), Piece(10.0, 0.95, 0.0))
CYCLE = (Piece(1.5, 0.0, 0.9), Piece(1.5, 0.9, 0.0))
SMALL = (Piece(3.0, 0.45, 0.55), Piece(3.0, 0.55, 0.45))
STEPS = tuple(hold(v, 2.0) for v in (0.1, 0.2, 0.1, 0.4, 0.1, 0.7, 0.1, 0.95, 0.1))
FILLS = (hold(0.98, 1.0), hold(0.1, 0.8))
LIST: tuple[tuple[str, str, Sequence[Piece]], ...] = (
    ("long_hold", "hold half the pressure for 60 s", (hold(0.5, 60.0), REST)),
    (
        "both_sides",
        "hold one pressure, reached from below and from above",
        (hold(0.2, 5.0), hold(0.5, 25.0), hold(0.9, 5.0), hold(0.5, 25.0)),
    ),
    ("slow_triangle", "ramp up and down slowly", TRIANGLE * 2),
    ("minor_loops", "small triangles about half the pressure", (*TRIANGLE, *SMALL * 4)),
    ("cycles_after_rest", "rest overnight, then cycle", CYCLE * 12),
    ("three_step_sizes", "steps of several sizes", STEPS * 2),
    ("staircase", "stairs of 4 s up and down", tuple(hold(v, 4.0) for v in STAIRS)),
    (
        "frequencies",
        "one swing at 0.2, 0.5, 1 and 2 Hz",
        tuple(swing(0.5, 0.35, f, 12.0) for f in (0.2, 0.5, 1.0, 2.0)),
    ),
    (
        "amplitudes",
        "1 Hz at four small swings",
        tuple(swing(0.5, s, 1.0, 10.0) for s in (0.02, 0.05, 0.1, 0.2)),
    ),
    ("full_pressure", "fill to the top again and again", FILLS * 16),
)
"""Experiments of any rig: name, instruction, and the pieces after a rest."""


def plans(means: Means) -> tuple[Plan, ...]:
    """Return the experiments of 35 to 120 s that a rig can do."""
    return tuple(_plans(means))


def listed_pieces(shut: bool) -> Iterator[tuple[str, str, tuple[Piece, ...]]]:
    """Return name, instruction and pieces of experiments under one load."""
    for name, words, pieces in LIST:
        yield name, words, (REST, *pieces)
    if shut:
        closed = [(hold(v, 3.0), Piece(30.0, v, v, shut=True)) for v in (0.4, 0.8)]
        words = "close the valve for 30 s at two pressures"
        yield "valve_shut", words, (REST, *closed[0], *closed[1])


def _plans(means: Means) -> Iterator[Plan]:
    usual = (means.near(0.5),)
    for name, words, pieces in listed_pieces(means.shut):
        yield Plan(name, words, pieces, usual, means.full)
    slow = Plan("slow", "", (REST, *TRIANGLE * 2), usual, means.full)
    if means.warm:
        pieces = (REST, *(hold(v, 4.0) for v in STAIRS))
        words = f"stairs while the muscle is warmed by {WARMER:g} K"
        yield Plan("warm_muscle", words, pieces, usual, means.full, WARMER)
    if len(means.loads) > 1:
        least, most = means.loads[0], means.loads[-1]
        for name, load in (("heavy_load", most), ("light_load", least)):
            words = f"slow triangles under {load:g} N"
            yield replace(slow, name=name, description=words, loads=(load,))
        several = tuple(dict.fromkeys(means.near(k / 4) for k in range(5)))
        loads = enumeration([f"{load:g}" for load in several])
        words = f"the same slow triangle under {loads} N"
        pieces = (REST, *TRIANGLE)
        yield Plan("several_loads", words, pieces, several, means.full)
