"""Scale of hidden effects: amplitude 1 is about one noise RMS where it shows most."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np

from .forms import FORMS, Effect
from .loop_draws import DRAWS
from .names import POSITION_NOISE, PRESSURE_NOISE
from .recipes import RECIPES
from .rig import Rig
from .run import simulate


def trial_plan() -> SimpleNamespace:
    """Return a plan of 58 s with most kinds of motion, to scale effects with."""
    period = 0.02
    clock = {s: period * np.arange(round(s / period)) for s in (4.0, 5.0, 10.0)}
    pieces: list[tuple[str, np.ndarray, float, bool]] = []

    def add(name: str, values: np.ndarray | list[float], load: float, shut: bool = False) -> None:
        pieces.append((f"{name}_{len(pieces)}", np.asarray(values, float), load, shut))

    def hold(levels: list[float], seconds: float) -> np.ndarray:
        return np.repeat(levels, round(seconds / period))

    add("rest", hold([0.0], 1.5), 0.0)
    add("stairs", hold([1.5, 3.5, 5.6, 4.0, 2.0, 0.6], 2.0), 0.0)
    add("sine", 2.8 - 2.2 * np.cos(np.pi * clock[4.0]), 0.0)
    add("rest", hold([0.0], 1.0), 60.0)
    add("steps", hold([0.8, 1.6, 0.8, 5.2, 0.8], 1.2), 60.0)
    add("random", hold([3.7, 2.2, 5.1, 1.2, 2.9, 4.4, 0.6, 3.3, 2.4, 4.9], 0.8), 60.0)
    add("approach", hold([3.0], 1.5), 60.0)
    add("shut", hold([3.0], 6.0), 60.0, True)
    add("rest", hold([0.0], 1.0), 30.0)
    add("triangle", 5.6 * (1.0 - np.abs(1.0 - clock[10.0] / 5.0)), 30.0)
    sweep = 2 * np.pi * (0.4 * clock[5.0] + 0.25 * clock[5.0] ** 2)
    add("chirp", 3.0 + 0.5 * np.sin(sweep), 30.0)
    add("rest", hold([0.0], 1.0), 15.0)
    add("holds", hold([1.8, 4.5, 3.0], 1.2), 15.0)
    sizes = [piece[1].size for piece in pieces]
    count = sum(sizes)
    return SimpleNamespace(
        command_bar=np.concatenate([piece[1] for piece in pieces]),
        segment=np.repeat([piece[0] for piece in pieces], sizes),
        load_N=np.repeat([piece[2] for piece in pieces], sizes),
        temperature_C=20.0 + 2.4 * np.sin(np.pi * np.arange(count) / count),
        valve_closed=np.repeat([piece[3] for piece in pieces], sizes),
        period=period,
    )


PLAN = trial_plan()
TRIAL_STEP = 0.002  # [s]


@lru_cache(maxsize=64)
def _clean(rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    columns = simulate(rig, [], PLAN, TRIAL_STEP)
    return columns["contraction_mm"], columns["pressure_bar"]


def trace(rig: Rig, effect: Effect, amplitude: float) -> float:
    """Return the largest RMS change of a reading over a segment of the trial plan [noise RMS]."""
    columns = simulate(rig, [(effect, amplitude)], PLAN, TRIAL_STEP)
    position, pressure = _clean(rig)
    moved = (columns["contraction_mm"] - position) / POSITION_NOISE
    squashed = (columns["pressure_bar"] - pressure) / PRESSURE_NOISE
    starts = np.flatnonzero(np.r_[True, PLAN.segment[1:] != PLAN.segment[:-1]])
    sizes = np.diff(np.r_[starts, position.size])
    means = [np.sqrt(np.add.reduceat(y * y, starts) / sizes).max() for y in (moved, squashed)]
    return float(max(means))


def _strength_for(rig: Rig, effect: Effect, wanted: float, guess: float) -> tuple[float, float]:
    """Return a strength and its trace, close to a wanted one, by secants in logarithms."""
    low, high = 0.0, effect.bound
    size = min(guess, 0.7 * effect.bound)
    best = (size, 0.0)
    previous: tuple[float, float] | None = None
    for _ in range(10):
        got = max(trace(rig, replace(effect, unit=size, power=1.0), 1.0), 1e-9)
        if abs(np.log(got / wanted)) <= abs(np.log(max(best[1], 1e-9) / wanted)):
            best = (size, got)
        if abs(np.log(got / wanted)) < 0.18:
            break
        slope = 1.0
        if previous is not None and min(got, previous[1]) > 1e-6:
            slope = np.clip(np.log(got / previous[1]) / np.log(size / previous[0]), 0.3, 6.0)
        previous = (size, got)
        low, high = (size, high) if got < wanted else (low, size)
        aim = size * np.clip((wanted / got) ** (1.0 / slope), 0.02, 20.0)
        if aim >= high:
            aim = high if high == effect.bound else np.sqrt(max(low, 0.01 * high) * high)
        elif aim <= low:
            aim = np.sqrt(low * min(high, 9.0 * low))
        if aim == size:
            break
        size = float(aim)
    return best


def draw_effect(name: str, rig: Rig, rng: np.random.Generator) -> Effect:
    """Draw the form of an effect for a rig and scale it by trials on that rig."""
    form = FORMS[name](rng, rig)
    loop = None
    span = rig.length_mm if rig.length_driven else 0.0
    if name == "hysteresis_shape":
        sharp = "iwan" if RECIPES[rig.world].loop == "coulomb" else "backlash"
        loop = DRAWS[sharp if form.form == 0 else "blunt"](rng, rig.half_width_bar, span)
    if name == "hysteresis_drive" and form.form == 1:
        other = "preisach" if rig.length_driven else "dahl"
        loop = DRAWS[other](rng, rig.half_width_bar, rig.length_mm - span)
    seed = int(rng.integers(2**31))
    effect = Effect(name, form.form, form.constants, form.guess, 1.0, form.bound, seed, loop)
    if form.exact:
        return effect
    unit, first = _strength_for(rig, effect, 1.0, form.guess)
    large, last = _strength_for(rig, effect, 12.0, min(12.0 * unit, form.bound))
    if last < 3.0 * first or large <= unit:
        return replace(effect, unit=unit)
    if large < 3.5 * unit:
        slope = (large - unit) / (last - first)
        return replace(effect, unit=slope, base=unit - first * slope)
    power = np.clip(np.log(large / unit) / np.log(last / first), 0.4, 2.5)
    return replace(effect, unit=unit / first**power, power=float(power))
