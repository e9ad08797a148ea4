"""Effects in the air: valve, line, supply, leak."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, put, uniform


def _plain(_: np.random.Generator) -> Shape:
    return {}


def _leak(record: np.ndarray, strength: float, _: Shape) -> None:
    """Air escapes through an orifice, choked above about 0.9 bar, also with the valve shut."""
    put(record, leak=strength)


def _valve_dead_band(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A comparator opens the valve on a large error and closes it on a smaller one."""
    put(record, open_at=strength, close_at=strength * shape["closes"])


def _dead_time(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The command passes a chain of short lags."""
    put(record, chain=strength, chain_lags=shape["lags"])


def _slew_limit(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The flow bends smoothly towards a limit; strength is the inverse of its error [1/bar]."""
    put(record, slew=strength, slew_power=shape["power"])


def _supply_droop(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A small reservoir is drawn down, and fills through a throat near its pressure."""
    put(
        record,
        supply=shape["supply"],
        draw=strength,
        throat=strength * shape["throat"],
        recovery=shape["recovery"],
    )


def _exhaust_asymmetry(record: np.ndarray, strength: float, _: Shape) -> None:
    """Venting slows down as the absolute pressure falls."""
    put(record, exhaust=strength)


def _resonance(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A column of air in the line, or a sensor target on a soft bracket, rings after steps."""
    omega = 2.0 * np.pi * shape["hertz"]
    if shape["line"] > 0.5:
        put(record, line=0.6 * strength, line_omega=omega, line_zeta=shape["damping"])
    else:
        put(record, target=strength, target_omega=omega, target_zeta=shape["damping"])


PNEUMATIC = {
    "leak": Kind(_plain, _leak, 0.003),
    "valve_dead_band": Kind(lambda rng: {"closes": uniform(rng, 0.3, 0.6)}, _valve_dead_band, 0.03),
    "dead_time": Kind(lambda rng: {"lags": float(rng.integers(4, 7))}, _dead_time, 0.004),
    "slew_limit": Kind(lambda rng: {"power": uniform(rng, 2.0, 4.0)}, _slew_limit, 0.3, 0.5),
    "supply_droop": Kind(
        lambda rng: {
            "supply": uniform(rng, 6.2, 7.0),
            "throat": uniform(rng, 0.05, 0.15),
            "recovery": uniform(rng, 2.0, 8.0),
        },
        _supply_droop,
        0.15,
        0.4,
    ),
    "exhaust_asymmetry": Kind(_plain, _exhaust_asymmetry, 0.08),
    "resonance": Kind(
        lambda rng: {
            "hertz": uniform(rng, 4.0, 12.0),
            "damping": uniform(rng, 0.03, 0.12),
            "line": float(rng.random() < 0.6),
        },
        _resonance,
        0.15,
    ),
}
