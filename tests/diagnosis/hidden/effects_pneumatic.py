"""Pneumatic effects: valve, line, supply, leak."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, coin, put, uniform
from .kernel_tools import STEP


def _plain(_: np.random.Generator) -> Shape:
    return {}


def _leak(record: np.ndarray, strength: float, _: Shape) -> None:
    """Air escapes through an orifice, choked above about 0.9 bar, also with the valve shut."""
    put(record, leak=strength)


def _valve_dead_band(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Lands of a spool overlap its ports; strength is the error that uncovers them [bar].

    The edge is rounded, so that flow sets in with a slope, and the overlap leaks.
    """
    put(record, overlap=strength, overlap_edge=shape["edge"], overlap_leak=shape["leak"])


def _dead_time(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The command passes a chain of short lags."""
    put(record, chain=strength, chain_lags=shape["lags"])


def _slew_limit(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The force of the valve's coil is limited; strength is the inverse of that error [1/bar]."""
    put(
        record,
        slew=strength,
        slew_kind=shape["iron"],
        slew_rest=shape["rest"],
        slew_lean=shape["lean"],
    )


def _supply_droop(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A finite reservoir is fed through an orifice and feeds the muscle through the valve.

    Strength is the muscle's volume over the reservoir's. `throat` [s] is how long the valve, fully
    open, takes for the muscle's volume, over the strength; `recovery` [s] the same for the
    orifice and the reservoir.
    """
    put(
        record,
        supply=shape["supply"],
        draw=strength,
        throat=strength * shape["throat"],
        critical=shape["critical"],
        recovery=shape["recovery"],
    )


def _exhaust_asymmetry(record: np.ndarray, strength: float, _: Shape) -> None:
    """Venting slows down as the absolute pressure falls."""
    put(record, exhaust=strength)


def _resonance(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Waves in a closed tube, or a sensor target on a bracket with a soft foot, ring after steps.

    The tube is tuned to a quarter of a wave, and strength becomes the share of the muscle's air
    that comes through it; its reflection damps the first mode as `damping` says. Bracket and foot
    swing in two modes, both of which the target shows, the foot's tilt by a lever.
    """
    if shape["line"] > 0.5:
        quarter = 0.25 / shape["hertz"]
        wall = shape["wall"] * quarter
        put(
            record,
            line=1.0 - np.exp(-strength),
            line_trip=(quarter - 0.5 * wall) / STEP,
            line_return=np.exp(-np.pi * shape["damping"]),
            line_wall=STEP / (STEP + wall),
        )
    else:
        omega = 2.0 * np.pi * shape["hertz"]
        put(record, target=0.4 * strength, target_omega=omega, target_zeta=shape["damping"])
        put(
            record,
            target_foot=omega * shape["foot"],
            target_share=shape["share"],
            target_lever=shape["lever"],
        )


PNEUMATIC = {
    "leak": Kind(_plain, _leak, 0.003),
    "valve_dead_band": Kind(
        lambda rng: {"edge": uniform(rng, 0.2, 0.8), "leak": uniform(rng, 0.003, 0.02)},
        _valve_dead_band,
        0.03,
    ),
    "dead_time": Kind(lambda rng: {"lags": float(rng.integers(4, 7))}, _dead_time, 0.004),
    "slew_limit": Kind(
        lambda rng: {
            "iron": coin(rng),
            "rest": uniform(rng, 0.1, 0.25),
            "lean": uniform(rng, -0.1, 0.1),
        },
        _slew_limit,
        0.3,
        0.5,
    ),
    "supply_droop": Kind(
        lambda rng: {
            "supply": uniform(rng, 6.1, 6.8),
            "throat": uniform(rng, 0.05, 0.15),
            "critical": uniform(rng, 0.2, 0.5),
            "recovery": uniform(rng, 2.0, 8.0),
        },
        _supply_droop,
        0.15,
        0.6,
    ),
    "exhaust_asymmetry": Kind(_plain, _exhaust_asymmetry, 0.08),
    "resonance": Kind(
        lambda rng: {
            "hertz": uniform(rng, 3.5, 10.0),
            "damping": uniform(rng, 0.03, 0.12),
            "line": coin(rng, 0.6),
            "wall": uniform(rng, 0.05, 0.25),
            "foot": uniform(rng, 1.2, 1.8),
            "share": uniform(rng, 0.1, 0.3),
            "lever": uniform(rng, -6.0, -2.0),
        },
        _resonance,
        0.15,
    ),
}
