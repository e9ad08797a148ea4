"""Campaign of a rig: commands, loads and room temperature in labelled segments.

A label is a kind of experiment and a letter of the instance: `random_b` is the second of `random`.
The load changes only in rests near 0 bar.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

PERIOD = 0.02


@dataclass(frozen=True)
class Campaign:
    """A plan of n rows, each held until the time of the next one."""

    command_bar: np.ndarray
    segment: np.ndarray  # labels
    load_N: np.ndarray  # as declared in the recording
    temperature_C: np.ndarray
    valve_closed: np.ndarray  # bool
    period: float = PERIOD  # [s]

    @property
    def time(self) -> np.ndarray:
        """Time of every row [s], shape (n,)."""
        return self.period * np.arange(self.command_bar.size)

    def closed_segments(self) -> list[str]:
        """Return the labels of the segments with the valve shut, in order."""
        return list(dict.fromkeys(self.segment[self.valve_closed].tolist()))

    def repeats(self) -> list[list[str]]:
        """Return the groups of segments that repeat one another."""
        names = set(self.segment.tolist())
        pairs = ([f"{kind}_a", f"{kind}_b"] for kind in ("condition", "holds"))
        return [pair for pair in pairs if names.issuperset(pair)]


Blocks = list[tuple[float, Callable[[], None]]]
"""Load [N] and action of each block of a campaign."""


@dataclass
class _Plan:
    """Pieces in the making."""

    rng: np.random.Generator
    pieces: list[tuple[str, np.ndarray, float, bool]] = field(default_factory=list)
    load: float = 0.0

    def add(self, name: str, command: np.ndarray, shut: bool = False) -> None:
        kind_count = sum(label.rpartition("_")[0] == name for label, *_ in self.pieces)
        label = f"{name}_{chr(ord('a') + kind_count)}"
        self.pieces.append((label, np.asarray(command, float), self.load, shut))

    def rest(self, seconds: float = 1.0, load: float | None = None) -> None:
        self.load = self.load if load is None else load
        self.add("rest", constant(0.0, seconds))

    def finish(self) -> Campaign:
        command = np.concatenate([piece[1] for piece in self.pieces])
        sizes = [piece[1].size for piece in self.pieces]

        def spread(column: int) -> np.ndarray:
            return np.repeat([piece[column] for piece in self.pieces], sizes)

        return Campaign(
            np.round(np.clip(command, 0.0, 6.0), 4),
            spread(0),
            spread(2).astype(float),
            room(self.rng, command.size),
            spread(3).astype(bool),
        )


def rows(seconds: float) -> int:
    """Return how many samples a duration has."""
    return round(seconds / PERIOD)


def constant(level: float, seconds: float) -> np.ndarray:
    """Hold one level [bar]."""
    return np.full(rows(seconds), level)


def levels(values: np.ndarray | list[float], seconds: float) -> np.ndarray:
    """Hold one level [bar] after the other, each for as long."""
    return np.repeat(values, rows(seconds))


def triangle(top: float, seconds: float) -> np.ndarray:
    """Ramp up to `top` [bar] and down again."""
    phase = np.linspace(0.0, 2.0, rows(seconds), endpoint=False)
    return top * (1.0 - np.abs(1.0 - phase))


def sine(middle: float, swing: float, hertz: float, seconds: float) -> np.ndarray:
    """Swing about `middle` [bar], from the lowest point on."""
    time = PERIOD * np.arange(rows(seconds))
    return middle - swing * np.cos(2 * np.pi * hertz * time)


def chirp(middle: float, swing: float, low: float, high: float, seconds: float) -> np.ndarray:
    """Swing about `middle` [bar] from a low to a high frequency [Hz]."""
    time = PERIOD * np.arange(rows(seconds))
    phase = low * seconds / np.log(high / low) * ((high / low) ** (time / seconds) - 1.0)
    return middle + swing * np.sin(2 * np.pi * phase)


def three_steps(low: float, sizes: list[float], seconds: float) -> np.ndarray:
    """Step up from `low` [bar] by each size and down again."""
    return levels([v for size in sizes for v in (low + size, low)], seconds)


def random_holds(rng: np.random.Generator, seconds: float, top: float = 5.6) -> np.ndarray:
    """Hold random levels [bar] for random times of 0.4 to 2.2 s."""
    parts: list[np.ndarray] = []
    while sum(part.size for part in parts) < rows(seconds):
        parts.append(constant(rng.uniform(0.3, top), rng.uniform(0.4, 2.2)))
    return np.concatenate(parts)[: rows(seconds)]


def room(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return the temperature of the muscle [deg C]: a slow wave and a warm-up, shape (count,)."""
    time = PERIOD * np.arange(count)
    wave = rng.uniform(1.0, 1.8) * np.sin(2 * np.pi * time / rng.uniform(150.0, 220.0))
    warm = rng.uniform(1.0, 2.5) * (1.0 - np.exp(-time / rng.uniform(60.0, 120.0)))
    return np.round(20.0 + wave + warm, 2)


STAIRS = [1.2, 2.5, 3.6, 4.6, 5.6, 4.2, 3.0, 1.8, 0.6]
FINE_STAIRS = [0.7, 1.5, 2.3, 3.1, 3.9, 4.7, 5.5, 5.0, 4.2, 3.4, 2.6, 1.8, 1.0]
HELD = [2.0, 4.4, 3.2, 5.3, 1.4, 2.6]


def _repeat_pair(plan: _Plan) -> None:
    for _ in range(2):
        plan.rest(1.0)
        plan.add("condition", triangle(5.8, 4.0))
        plan.add("holds", levels(HELD, 1.6))


def _shut(plan: _Plan, level: float) -> None:
    plan.add("approach", np.concatenate([constant(0.5 * level, 0.8), constant(level, 1.6)]))
    plan.add("shut", constant(level, 10.0), shut=True)
    plan.add("reopen", constant(level, 1.4))


def _blocks(plan: _Plan) -> Blocks:
    rng = plan.rng
    return [
        (0.0, lambda: plan.add("staircase", levels(STAIRS, 3.0))),
        (0.0, lambda: plan.add("sine_fast", sine(2.8, 2.2, 0.5, 6.0))),
        (30.0, lambda: plan.add("triangle", triangle(5.8, 40.0))),
        (30.0, lambda: plan.add("steps", three_steps(0.8, [0.8, 2.0, 4.4], 1.3))),
        (30.0, lambda: plan.add("random", random_holds(rng, 20.0))),
        (60.0, lambda: plan.add("staircase", levels(STAIRS, 3.0))),
        (60.0, lambda: plan.add("chirp", chirp(3.2, 0.5, 0.3, 3.0, 8.0))),
        (60.0, lambda: _shut(plan, 2.0)),
        (15.0, lambda: plan.add("sine_slow", sine(2.8, 2.6, 0.1, 10.0))),
        (15.0, lambda: plan.add("random", random_holds(rng, 20.0))),
        (15.0, lambda: plan.add("steps", three_steps(1.5, [0.6, 1.6, 3.8], 1.3))),
        (45.0, lambda: _repeat_pair(plan)),
        (45.0, lambda: _shut(plan, 4.5)),
        (0.0, lambda: plan.add("triangle", triangle(5.4, 20.0))),
        (0.0, lambda: plan.add("chirp", chirp(2.4, 0.6, 0.3, 3.0, 8.0))),
        (60.0, lambda: plan.add("sine_slow", sine(3.0, 2.4, 0.1, 10.0))),
        (45.0, lambda: plan.add("sine_fast", sine(3.0, 2.0, 0.5, 6.0))),
    ]


def _performed(
    seed: int,
    start: float,
    end: float,
    kept: tuple[int, ...] | None = None,
    more: Callable[[_Plan], Blocks] = lambda plan: [],
) -> Campaign:
    """Return a campaign of some blocks between two rests [s]."""
    plan = _Plan(np.random.default_rng(seed))
    plan.rest(start, 0.0)
    blocks = _blocks(plan)
    for load, block in [blocks[i] for i in kept or range(len(blocks))] + more(plan):
        if load != plan.load:
            plan.rest(1.0, load)
        block()
    plan.rest(end, 0.0)
    return plan.finish()


def campaign_standard(seed: int = 0) -> Campaign:
    """Return the usual campaign of about 300 s; `seed` draws random holds and the room."""
    return _performed(seed, 5.0, 4.0)


def campaign_long(seed: int = 0) -> Campaign:
    """Return a campaign of about 600 s with finer stairs and more random holds."""
    return _performed(seed, 5.0, 5.0, more=_long_blocks)


def _long_blocks(plan: _Plan) -> Blocks:
    return [
        (15.0, lambda: plan.add("staircase", levels(FINE_STAIRS, 4.0))),
        (45.0, lambda: plan.add("triangle", triangle(5.8, 60.0))),
        (60.0, lambda: plan.add("random", random_holds(plan.rng, 40.0))),
        (30.0, lambda: plan.add("staircase", levels(FINE_STAIRS, 4.0))),
        (0.0, lambda: plan.add("random", random_holds(plan.rng, 40.0))),
        (30.0, lambda: plan.add("sine_slow", sine(2.9, 2.5, 0.1, 20.0))),
        (30.0, lambda: plan.add("steps", three_steps(0.6, [1.0, 2.4, 4.8], 1.5))),
        (15.0, lambda: plan.add("sine_fast", sine(2.6, 1.8, 0.5, 12.0))),
    ]


def campaign_short(seed: int = 0) -> Campaign:
    """Return a campaign of about 120 s with one instance of most kinds, for quick tests."""
    return _performed(seed, 3.0, 3.0, kept=(0, 3, 4, 6, 7, 9, 12))


def campaign_idle(seed: int = 0, level: float = 0.0) -> Campaign:
    """Return 120 s under one load at one command [bar], which excites nothing."""
    plan = _Plan(np.random.default_rng(seed))
    plan.load = 30.0
    for seconds in (40.0, 40.0, 40.0):
        plan.add("idle", constant(level, seconds))
    return plan.finish()
