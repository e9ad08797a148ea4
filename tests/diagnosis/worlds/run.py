"""Simulated recordings of a rig."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .engine import SCALARS, run
from .forms import Effect
from .laws import balance
from .names import ALL, STEP
from .recipes import RECIPES
from .rig import Rig, law_arrays
from .sensors import distort, dropouts, noisy

EXTRA_ROWS = 4
"""Rows simulated beyond the last, for a logger that reads late."""


def _walk(rng: np.random.Generator, rows: int, period: float) -> np.ndarray:
    """Random walk that returns within half a minute or so, of standard deviation 1."""
    keep = np.exp(-period / 25.0)
    steps = rng.normal(size=rows) * np.sqrt(1.0 - keep**2)
    out, value = np.empty(rows), 0.0
    for i, step in enumerate(steps.tolist()):
        value = keep * value + step
        out[i] = value
    return out


def _bursts(rng: np.random.Generator, rows: int, period: float) -> np.ndarray:
    """Draws of another consumer: steep dips that recover exponentially."""
    out = np.zeros(rows)
    time = period * np.arange(rows)
    start = rng.exponential(6.0)
    while start < time[-1]:
        since = time - start
        size, tau = rng.uniform(0.4, 1.2), rng.uniform(0.15, 0.9)
        alive = (since >= 0.0) & (since < 12.0 * tau)
        out[alive] += size * np.exp(-since[alive] / tau)
        start += rng.exponential(6.0)
    return out


def _envelope(rng: np.random.Generator, rows: int, period: float) -> np.ndarray:
    """Strength of a building's vibration, which comes and goes."""
    return np.abs(_walk(rng, rows, 4.0 * period)) + 0.2


def _catches(rng: np.random.Generator, rows: int, period: float) -> np.ndarray:
    """Times at which a cable is caught: 1, else 0."""
    out = np.zeros(rows)
    start = rng.exponential(8.0)
    while start < rows * period:
        end = start + rng.uniform(1.0, 6.0)
        out[int(start / period) : int(end / period)] = 1.0
        start = end + rng.exponential(10.0)
    return out


COURSES = {
    "gain_random_walk": (0, _walk),
    "supply_crosstalk": (1, _bursts),
    "building_vibration": (2, _envelope),
    "cable_catch": (3, _catches),
}


def _table(effects: Sequence[tuple[Effect, float]]) -> np.ndarray:
    """Return strength, form and constants of all effects, shape (effects, 8)."""
    table = np.zeros((len(ALL), 8))
    for effect, amplitude in effects:
        row = table[ALL.index(effect.name)]
        if row[0] != 0.0:
            raise ValueError(f"{effect.name} is given twice")
        row[0], row[1] = effect.strength(amplitude), effect.form
        row[2 : 2 + len(effect.constants)] = effect.constants
    return table


def _operators(rig: Rig, effects: Sequence[tuple[Effect, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return kinds and constants of the normal, the alternative and the partner loop."""
    chosen = [rig.loop, rig.loop, rig.partner]
    for effect, _ in effects:
        if effect.loop is not None:
            chosen[1 if effect.name == "hysteresis_shape" else 2] = effect.loop
    kinds = np.array([kind for kind, _ in chosen])
    return kinds, np.array([op for _, op in chosen]).reshape(3, 3, -1)


def _solve(
    rig: Rig, effects: Sequence[tuple[Effect, float]], campaign: Any, step: float
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return true pressure [bar] and contraction [mm] at every step, and steps in a row."""
    period = float(campaign.period)
    sub = max(1, round(period / step))
    rows = campaign.command_bar.size + EXTRA_ROWS
    q, knots = law_arrays(rig.law, rig.table)
    load = np.asarray(campaign.load_N, float)
    rest = {
        weight: rig.length_mm * balance(rig.law_kind, q, knots, 0.0, weight)
        for weight in np.unique(load).tolist()
    }
    courses = np.zeros((load.size, 4))
    for effect, amplitude in effects:
        if effect.name in COURSES and effect.strength(amplitude) > 0.0:
            column, draw = COURSES[effect.name]
            rng = np.random.default_rng(effect.seed)
            courses[:, column] = draw(rng, load.size, period)
    scalars = {
        "length": rig.length_mm,
        "half": rig.half_width_bar,
        "friction": rig.friction_N,
        "growth": rig.growth,
        "carriage": rig.carriage_kg,
        "damping": rig.damping_N_s_mm,
        "stiffness": rig.stiffness_N_mm,
        "length_driven": float(rig.length_driven),
        "start_bar": rig.nuisance.start_pressure_bar,
        "start_strain": rig.nuisance.start_strain,
        "settling": rig.nuisance.start_settling_s,
        "memory": rig.nuisance.loop_memory,
        "squeeze": rig.squeeze_bar,
    }
    kinds, ops = _operators(rig, effects)
    pressure, position = run(
        rig.law_kind,
        q,
        knots,
        kinds,
        ops,
        RECIPES[rig.world].valve_kind,
        np.array(rig.valve),
        np.array([scalars[key] for key in SCALARS]),
        _table(effects),
        np.asarray(campaign.command_bar, float),
        load,
        np.asarray(campaign.temperature_C, float) - 20.0,
        np.asarray(campaign.valve_closed, bool),
        np.array([rest[weight] for weight in load.tolist()]),
        courses,
        period,
        sub,
        rows,
    )
    return pressure, position, sub


def simulate(
    rig: Rig, effects: Sequence[tuple[Effect, float]], campaign: Any, step: float = STEP
) -> dict[str, np.ndarray]:
    """Return the readings of a rig without noise, and the true position, one per row.

    The campaign has command [bar], load [N], temperature [deg C], segment, `valve_closed` and
    period [s]. `effects` are pairs of an effect and its amplitude; `step` [s] is
    the integrator's.
    """
    effects = [pair for pair in effects if pair[1] > 0.0]
    count = campaign.command_bar.size
    period = float(campaign.period)
    pressure, position, sub = _solve(rig, effects, campaign, step)
    true = position[::sub][:count].copy()
    dt = period / sub
    read_p, read_x = distort(list(effects), pressure, position, dt)
    grid = np.arange(read_p.size, dtype=float)
    at = np.arange(count) * sub + rig.clock_offset_s / dt
    contraction = np.interp(at, grid, read_x) + rig.nuisance.zero_mm
    gauge = np.interp(at, grid, read_p) + rig.nuisance.zero_bar
    for effect, amplitude in effects:
        if effect.name == "position_dropouts":
            contraction += effect.strength(amplitude) * dropouts(effect, count, period)
    return {
        "time": period * np.arange(count),
        "segment": np.asarray(campaign.segment),
        "command_bar": np.asarray(campaign.command_bar, float),
        "declared_load_N": np.asarray(campaign.load_N, float),
        "temperature_C": np.asarray(campaign.temperature_C, float),
        "contraction_mm": contraction,
        "pressure_bar": gauge,
        "position_mm": true,
    }


def make_recording(
    rig: Rig,
    effects: Sequence[tuple[Effect, float]],
    campaign: Any,
    noise_seed: int,
    noise_factor: float = 1.0,
) -> dict[str, np.ndarray]:
    """Return a recording with noise, one column per quantity of a file."""
    columns = simulate(rig, effects, campaign)
    contraction, pressure = noisy(
        rig.noise,
        columns["contraction_mm"],
        columns["pressure_bar"],
        noise_seed,
        noise_factor,
        float(campaign.period),
    )
    return {
        "time_s": columns["time"],
        "segment": columns["segment"],
        "pressure_command_bar": columns["command_bar"],
        "pressure_bar": pressure,
        "contraction_mm": contraction,
        "load_N": columns["declared_load_N"],
        "temperature_C": columns["temperature_C"],
    }
