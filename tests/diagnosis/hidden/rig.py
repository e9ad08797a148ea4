"""Simulation of a rig under a campaign, and its recording."""

import csv
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from .base import CONTRACTION_NOISE_MM, PRESSURE_NOISE_BAR, Base
from .campaign import Campaign
from .catalogue import constants
from .effect import Effect
from .kernel import run
from .kernel_tools import STEP
from .records import STATE, blank

Hidden = list[tuple[Effect, float]]
CORRELATION = 1.0  # of the slow part of the noise [s]

_DECIMALS = {
    "time_s": 4,
    "pressure_command_bar": 4,
    "pressure_bar": 5,
    "contraction_mm": 5,
    "load_N": 3,
    "temperature_C": 2,
}


def steps_in(period: float) -> int:
    """Return the number of integration steps in a period."""
    steps = round(period / STEP)
    if steps < 1 or abs(steps * STEP - period) > 1e-9:
        raise ValueError(f"period {period} s is not a whole number of {STEP} s; choose another")
    return steps


def simulate(base: Base, effects: Hidden, campaign: Campaign) -> dict[str, np.ndarray]:
    """Run a campaign on a rig, without sensor noise.

    Time [s], segment, command [bar], declared load [N], temperature [deg C], readings of
    contraction [mm] and pressure [bar], and the true contraction [mm], each of shape (n,).
    """
    duration = campaign.period * campaign.command_bar.size
    rows = run(
        constants(base, effects, duration),
        blank(STATE),
        campaign.command_bar,
        campaign.load_N,
        campaign.temperature_C,
        campaign.valve_closed,
        steps_in(campaign.period),
    )
    return {
        "time": campaign.time,
        "segment": campaign.segment,
        "command_bar": campaign.command_bar,
        "declared_load_N": campaign.load_N,
        "temperature_C": campaign.temperature_C,
        "contraction_mm": rows[:, 0].copy(),
        "pressure_bar": rows[:, 1].copy(),
        "position_mm": rows[:, 2].copy(),
    }


def coloured_noise(
    rng: np.random.Generator, count: int, period: float, rms: float, coloured: float
) -> np.ndarray:
    """Return noise, shape (count,): a white part and, by a share of its variance, a slow one."""
    keep = np.exp(-period / CORRELATION)
    white = np.sqrt(1.0 - coloured) * rng.standard_normal(count)
    drive = np.sqrt(coloured * (1.0 - keep**2)) * rng.standard_normal(count)
    first = np.sqrt(coloured) * rng.standard_normal()
    slow, _ = lfilter([1.0], [1.0, -keep], drive, zi=np.array([keep * first]))
    return rms * (white + slow)


def make_recording(
    base: Base,
    effects: Hidden,
    campaign: Campaign,
    noise_seed: int,
    noise_factor: float = 1.0,
) -> dict[str, np.ndarray]:
    """Run a campaign and return the columns of its recording, with sensor noise."""
    truth = simulate(base, effects, campaign)
    rng = np.random.default_rng(noise_seed)
    count = campaign.command_bar.size

    def noisy(name: str, rms: float, grain: float) -> np.ndarray:
        noise = coloured_noise(rng, count, campaign.period, noise_factor * rms, base.coloured)
        values = truth[name] + noise
        return values if grain <= 0.0 else grain * np.round(values / grain)

    contraction = noisy("contraction_mm", CONTRACTION_NOISE_MM, base.grain_mm)
    pressure = noisy("pressure_bar", PRESSURE_NOISE_BAR, base.grain_bar)
    return {
        "time_s": truth["time"],
        "segment": truth["segment"],
        "pressure_command_bar": truth["command_bar"],
        "pressure_bar": pressure,
        "contraction_mm": contraction,
        "load_N": truth["declared_load_N"],
        "temperature_C": truth["temperature_C"],
    }


def rig_yaml(base: Base, campaign: Campaign, noise_factor: float = 1.0) -> dict:
    """Return the true contents of RIG.yaml, as plain values."""
    return {
        "plant": "single_muscle",
        "muscle": {"rest_length_mm": base.length_mm, "diameter_mm": base.diameter_mm},
        "regulator": {"max_pressure_bar": 6.0},
        "load": "hanging_mass",
        "sensors": {
            "contraction_noise_mm": CONTRACTION_NOISE_MM * noise_factor,
            "pressure_noise_bar": PRESSURE_NOISE_BAR * noise_factor,
        },
        "history": {"cycles_since_rest": 0, "rezeroed": False, "settled": True},
        "clock": {"tolerance_ms": 0.0},
        "repeats": campaign.repeats(),
        "valve_closed": campaign.closed_segments(),
        "tolerance": {"mass.load": 0.02},
    }


def write_csv(columns: dict[str, np.ndarray], path: str | Path) -> None:
    """Write the columns of a recording, one row a sample."""

    def text(name: str, value: object) -> str:
        return f"{value:.{_DECIMALS[name]}f}" if name in _DECIMALS else str(value)

    with Path(path).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*(values.tolist() for values in columns.values()), strict=True):
            writer.writerow([text(name, value) for name, value in zip(columns, row, strict=True)])
