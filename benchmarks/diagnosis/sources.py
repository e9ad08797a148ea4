"""Simulated rigs without code of the plants: that of the first study, and twenty-one worlds.

A *world* is a force law, a hysteresis and a regulator of a laboratory of its own
(``tests/diagnosis/worlds``). Its authors knew neither the base of the diagnosis nor its causes'
equations.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.rig_file import Rig
from tests.diagnosis import hidden, worlds

Effects = list[tuple[Any, float]]
"""Hidden effects with their amplitudes."""

HOME = ""
"""Name of the rig of the first study."""
WORLDS: tuple[str, ...] = worlds.WORLDS
HELD_OUT = (
    "braid_gas_spring_lugre_orifice",
    "logistic_skewed_play_all_at_once",
    "braid_lock_power_law_iwan_integrating",
    "rubber_energy_root_coulomb_pulsed",
    "end_caps_slack_tanh_play_long_tube",
    "drawn_curve_dead_zone_play_bulging_offset",
    "hyperbolic_tendon_rate_weak_cascade",
)
"""Worlds that are never used in the development of the diagnosis."""
TUNED = tuple(world for world in WORLDS if world not in HELD_OUT)
"""Worlds on which the diagnosis is developed."""
BENT = "sensor_nonlinearity"
"""Cause whose form for the pressure also names a regulator that is not linear."""
BY_NATURE = (
    *("static_law", "hysteresis_shape", "hysteresis_drive"),
    *("slew_limit", "dead_time", "exhaust_asymmetry", BENT),
)
"""Names that a clean rig may deserve: it differs from the base plant by nature."""


def draw_rig(world: str, rng: np.random.Generator, decoy: bool = False) -> Any:
    """Draw a clean rig; a decoy of the first study has unusual constants."""
    if world == HOME:
        return hidden.draw_base(rng, decoy)
    return worlds.draw_rig(world, rng)


def draw_effect(name: str, rig: Any, rng: np.random.Generator) -> Any:
    """Draw the form of an effect for a rig."""
    if isinstance(rig, hidden.Base):
        return hidden.draw_effect(name, rng)
    return worlds.draw_effect(name, rig, rng)


def outputs_of(rig: Any, effects: Effects, campaign: hidden.Campaign) -> Array:
    """Return the outputs of a rig without noise, shape (2, T) [m], [Pa]."""
    simulate = hidden.simulate if isinstance(rig, hidden.Base) else worlds.simulate
    run = simulate(rig, effects, campaign)
    return np.stack([run["contraction_mm"] * MM, run["pressure_bar"] * BAR])


def columns_of(
    rig: Any, effects: Effects, campaign: hidden.Campaign, seed: int, noise_factor: float = 1.0
) -> dict[str, Any]:
    """Return the columns of a recording with sensor noise."""
    record = hidden.make_recording if isinstance(rig, hidden.Base) else worlds.make_recording
    return dict(record(rig, effects, campaign, seed, noise_factor=noise_factor))


def nature_of(rig: Any) -> Mapping[str, bool]:
    """Return which of the names in :data:`BY_NATURE` a clean rig certainly deserves."""
    return {} if isinstance(rig, hidden.Base) else worlds.truth_of(rig)


def deserved(rig: Any) -> list[str]:
    """Return the names that are right on a clean rig, since it differs from the base by nature.

    A rig of another world has another force law and other loops. Its rate limit, dead time,
    exhaust, drive of the loop and nonlinear regulator are right only where they are present.
    """
    if isinstance(rig, hidden.Base):
        return []
    there = nature_of(rig)
    return [name for name in BY_NATURE if there.get(name, True)]


def with_clock(rig: Any, seconds: float) -> Any:
    """Return a rig of a world whose readings are taken so much later than stated [s]."""
    return replace(rig, nuisance=replace(rig.nuisance, clock_offset_s=seconds))


def sheet_of(rig: Any, campaign: hidden.Campaign, noise: float = 1.0) -> Rig:
    """Return the rig file: all that the laboratory knows.

    The first study's rig begins at rest, and its clocks agree. A laboratory of another world knows
    neither.
    """
    home = isinstance(rig, hidden.Base)
    return Rig(
        rest_length=rig.length_mm * MM,
        diameter=rig.diameter_mm * MM,
        max_pressure=6.0 * BAR,
        contraction_noise=hidden.CONTRACTION_NOISE_MM * noise * MM,
        pressure_noise=hidden.PRESSURE_NOISE_BAR * noise * BAR,
        settled=home,
        clock_tolerance=0.0 if home else None,
        repeats=tuple(tuple(group) for group in campaign.repeats()),
        valve_closed=tuple(campaign.closed_segments()),
        tolerance={"mass.load": 0.02},
    )
