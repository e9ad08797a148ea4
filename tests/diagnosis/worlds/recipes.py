"""The worlds: which law, loop and regulator each has, and how its regulator is drawn."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .names import WORLDS
from .valve import KEYS, VALVES

Draw = Callable[[np.random.Generator], dict[str, float]]


def _lag(rng: np.random.Generator) -> dict[str, float]:
    return {"lag_s": rng.uniform(0.04, 0.12)}


def _overdamped(rng: np.random.Generator) -> dict[str, float]:
    return {"frequency_rad_s": rng.uniform(18.0, 35.0), "damping": rng.uniform(1.0, 1.5)}


def _underdamped(rng: np.random.Generator) -> dict[str, float]:
    return {"frequency_rad_s": rng.uniform(14.0, 28.0), "damping": rng.uniform(0.42, 0.7)}


def _limits(rng: np.random.Generator, low: float, high: float) -> dict[str, float]:
    rate = rng.uniform(low, high)
    vent = rate * rng.uniform(0.8, 1.2)
    return {"fill_limit_s_bar": 1.0 / rate, "vent_limit_s_bar": 1.0 / vent}


def _lag_limited(rng: np.random.Generator) -> dict[str, float]:
    return {"lag_s": rng.uniform(0.03, 0.08)} | _limits(rng, 4.0, 8.0)


def _delayed(rng: np.random.Generator) -> dict[str, float]:
    return _lag(rng) | {"dead_time_s": rng.uniform(0.02, 0.06)}


def _orifice(rng: np.random.Generator) -> dict[str, float]:
    fill = rng.uniform(9.0, 18.0)
    return {
        "fill_bar_s": fill,
        "vent_bar_s": fill * rng.uniform(0.9, 1.6),
        "opening_bar": rng.uniform(0.35, 0.7),
        "spool_s": rng.uniform(0.006, 0.015),
    }


def _orifice_delayed(rng: np.random.Generator) -> dict[str, float]:
    delay = rng.uniform(0.01, 0.025) if rng.random() < 0.5 else 0.0
    return _orifice(rng) | {"dead_time_s": delay}


def _overdamped_delayed(rng: np.random.Generator) -> dict[str, float]:
    return _overdamped(rng) | {"dead_time_s": rng.uniform(0.012, 0.03)}


def _everything(rng: np.random.Generator) -> dict[str, float]:
    return _delayed(rng) | _limits(rng, 5.0, 10.0)


def _slow_tail(rng: np.random.Generator) -> dict[str, float]:
    return _lag(rng) | {"slow_share": rng.uniform(0.03, 0.09), "slow_s": rng.uniform(0.5, 1.0)}


def _integrating(rng: np.random.Generator) -> dict[str, float]:
    lag = rng.uniform(0.05, 0.09)
    return {
        "lag_s": lag,
        "integral_s2": rng.uniform(0.06, 0.15) / lag**2,
        "clamp_bar_s": rng.uniform(0.3, 0.8),
        "spool_s": rng.uniform(0.004, 0.01),
    }


def _pulsed(rng: np.random.Generator) -> dict[str, float]:
    fill = rng.uniform(18.0, 32.0)
    return {
        "fill_bar_s": fill,
        "vent_bar_s": fill * rng.uniform(1.3, 1.9),
        "opening_bar": rng.uniform(0.35, 0.7),
        "short_pulse": rng.uniform(0.005, 0.02),
    }


def _tube(rng: np.random.Generator) -> dict[str, float]:
    lag = rng.uniform(0.04, 0.09)
    return {
        "lag_s": lag,
        "vent_lag_s": lag * rng.uniform(1.04, 1.2),
        "dead_time_s": rng.uniform(0.012, 0.035),
        "vent_delay_s": rng.uniform(0.003, 0.012),
    }


def _bulging(rng: np.random.Generator) -> dict[str, float]:
    bulge, tilt = rng.choice([-1.0, 1.0], 2) * rng.uniform([0.008, 0.004], [0.03, 0.015])
    return _lag(rng) | {"bulge_bar": bulge, "tilt_bar": tilt}


def _cascade(rng: np.random.Generator) -> dict[str, float]:
    delay = rng.uniform(0.01, 0.025) if rng.random() < 0.5 else 0.0
    return {
        "lag_s": rng.uniform(0.03, 0.06),
        "pilot_s": rng.uniform(0.08, 0.15),
        "dead_time_s": delay,
    }


def _coarse_fine(rng: np.random.Generator) -> dict[str, float]:
    fill = rng.uniform(9.0, 15.0)
    return {
        "lag_s": rng.uniform(0.03, 0.06),
        "fill_bar_s": fill,
        "vent_bar_s": fill * rng.uniform(1.15, 1.6),
        "coarse_bar": rng.uniform(0.3, 0.5),
        "spool_s": rng.uniform(0.004, 0.008),
    }


def _back_calculation(rng: np.random.Generator) -> dict[str, float]:
    lag, share, rate = rng.uniform(0.05, 0.07), rng.uniform(0.12, 0.2), rng.uniform(11.0, 16.0)
    return {
        "lag_s": lag,
        "integral_s2": share / lag**2,
        "windup_s": lag / share * rng.uniform(0.7, 0.8),
        "fill_limit_s_bar": 1.0 / rate,
        "vent_limit_s_bar": 1.0 / rate,
    }


def _throttle(rng: np.random.Generator) -> dict[str, float]:
    return {
        "lag_s": rng.uniform(0.03, 0.05),
        "pilot_s": rng.uniform(0.03, 0.06),
        "throttle_s2_bar": rng.uniform(0.006, 0.015),
        "dead_time_s": rng.uniform(0.015, 0.035),
    }


def _flapper(rng: np.random.Generator) -> dict[str, float]:
    pilot = rng.uniform(0.06, 0.1)
    return {
        "lag_s": rng.uniform(0.02, 0.035),
        "pilot_s": pilot,
        "vent_pilot_s": pilot * rng.uniform(1.15, 1.5),
    }


def _sampled(rng: np.random.Generator) -> dict[str, float]:
    return {
        "lag_s": rng.uniform(0.05, 0.1),
        "sample_s": float(rng.choice([0.004, 0.006, 0.008])),
        "quantum_bar_s": rng.uniform(0.03, 0.09),
    }


def _gap_gain(rng: np.random.Generator) -> dict[str, float]:
    return {
        "lag_s": rng.uniform(0.03, 0.05),
        "low_gain": rng.uniform(0.35, 0.6),
        "gap_bar": rng.uniform(0.15, 0.3),
        "dead_time_s": rng.uniform(0.015, 0.04),
    }


@dataclass(frozen=True)
class Recipe:
    """Kinds of law, loop and regulator of a world."""

    law: str
    loop: str
    drive: str  # "pressure" or "length"
    valve: str
    draw_valve: Draw
    growth: tuple[float, float] = (0.0, 0.0)  # of slip force with pressure, per 3 bar
    width: float = 1.0  # scale of the loop, so that those that open slowly are as wide
    squeeze: tuple[float, float] = (0.0, 0.0)  # [bar] of slip force that grows as a square root

    def valve_vector(self, rng: np.random.Generator) -> tuple[float, ...]:
        """Draw the constants of the regulator, in the order of `KEYS`."""
        values = dict.fromkeys(KEYS, 0.0) | {"supply_bar": rng.uniform(6.6, 7.6)}
        values |= {"lag_s": 0.06, "slow_s": 1.0, "opening_bar": 0.5, "spool_s": 0.01}
        values |= {"vent_lag_s": 0.06, "pilot_s": 0.1}
        values |= self.draw_valve(rng)
        values["gain"] = rng.uniform(0.98, 1.02)
        values["offset_bar"] = rng.uniform(-0.03, 0.03)
        return tuple(float(values[key]) for key in KEYS)

    @property
    def valve_kind(self) -> int:
        """Number of the regulator's kind."""
        return VALVES.index(self.valve)


RECIPES: dict[str, Recipe] = dict(
    zip(
        WORLDS,
        (
            Recipe("exponential", "geometric_stops", "pressure", "lag", _lag),
            Recipe("polynomial", "bouc_wen", "pressure", "second_order", _overdamped),
            Recipe("sine", "maxwell_slip", "length", "lag", _lag_limited, (0.3, 0.55), 1.55),
            Recipe("map", "preisach", "pressure", "lag", _delayed),
            Recipe("bundle", "dahl", "length", "orifice", _orifice, (0.1, 0.35), 1.15),
            Recipe("braid", "lugre", "length", "orifice", _orifice_delayed, (0.0, 0.3), 0.85),
            Recipe("tangent", "wide_stops", "pressure", "second_order", _underdamped),
            Recipe(
                "sarosi",
                "bouc_wen_length",
                "length",
                "second_order",
                _overdamped_delayed,
                (0.0, 0.3),
            ),
            Recipe("logistic", "skewed_play", "pressure", "lag", _everything),
            Recipe("rational", "end_slip", "length", "slow_tail", _slow_tail, (0.15, 0.4), 1.75),
            Recipe("locking", "iwan", "length", "integrating", _integrating, (0.2, 0.5), width=1.5),
            Recipe("rubber", "coulomb", "length", "pulsed", _pulsed, width=0.9, squeeze=(0.3, 0.8)),
            Recipe("capped", "tanh_play", "pressure", "tube", _tube, width=1.15),
            Recipe("drawn", "dead_zone_play", "pressure", "offset", _bulging, width=1.15),
            Recipe("hyperbolic", "rate_weak", "length", "cascade", _cascade, (0.0, 0.3)),
            Recipe("table", "slip_lag", "length", "coarse_fine", _coarse_fine, (0.0, 0.3), 1.2),
            Recipe("ogden", "duhem", "pressure", "back_calculation", _back_calculation, width=1.1),
            Recipe("chain", "elastoplastic", "length", "throttle", _throttle, (0.1, 0.4)),
            Recipe("barrel", "ridge_play", "pressure", "flapper", _flapper),
            Recipe("spring", "relaxing", "length", "sampled", _sampled, (0.0, 0.25), 1.2),
            Recipe("three_element", "back_stress", "pressure", "gap_gain", _gap_gain, width=1.1),
        ),
        strict=True,
    )
)
