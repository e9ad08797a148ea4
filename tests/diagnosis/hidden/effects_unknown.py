"""Effects outside the catalogue, one set for tuning and one for the final run."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, put, uniform
from .records import WAVES


def _vibration(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The building shakes the load all the time, with a slow beat [N]."""
    put(record, shake=strength, shake_hz=shape["hertz"], shake_beat=shape["beat"])


def _neighbour(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Another muscle fills and vents from the same supply on its own schedule [bar]."""
    put(
        record,
        neighbour=strength,
        neighbour_period=shape["period"],
        neighbour_duty=shape["duty"],
        neighbour_decay=shape["decay"],
    )


def _dropouts(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The position sensor holds its last value now and then, for about so long [s]."""
    put(record, dropout=strength, dropout_cell=shape["cell"], dropout_seed=shape["seed"])


def _gain_wander(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The pull of pressure wanders like a random walk."""
    rng = np.random.default_rng(int(shape["seed"]))
    hertz = np.geomspace(0.01, 0.3, WAVES) * rng.uniform(0.8, 1.25, WAVES)
    size = hertz**-0.8
    put(record, wander=strength)
    record["wave_hz"][0] = hertz
    record["wave_size"][0] = size / np.sqrt(0.5 * np.sum(size**2))
    record["wave_phase"][0] = rng.uniform(0.0, 2 * np.pi, WAVES)


def _end_stop(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A spring stop is met at a high contraction; strength is its force after 1 mm [N]."""
    put(record, stop=strength, stop_at=shape["strain"])


def _dither(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The regulator dithers its own set-point all the time [bar]."""
    put(record, dither=strength, dither_hz=shape["hertz"])


def _pendulum(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The load swings like a pendulum after every move and changes the pull on the wire."""
    omega = 2 * np.pi * shape["hertz"]
    put(record, swing=strength, swing_omega=omega, swing_drive=shape["drive"])


def _buckling(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The bladder snaps into a fold at a high strain and out of it at a low one."""
    put(record, buckle=strength, buckle_up=shape["up"], buckle_down=shape["down"])


def _bumps(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Somebody knocks against the load at odd moments [N]."""
    put(
        record,
        bump=strength,
        bump_cell=shape["cell"],
        bump_length=shape["length"],
        bump_seed=shape["seed"],
    )


def _seed(rng: np.random.Generator) -> float:
    return float(rng.integers(0, 1000))


TUNING = {
    "vibration": Kind(
        lambda rng: {"hertz": uniform(rng, 0.3, 3.0), "beat": uniform(rng, 0.02, 0.08)},
        _vibration,
        1.5,
    ),
    "neighbour_crosstalk": Kind(
        lambda rng: {
            "period": uniform(rng, 3.0, 9.0),
            "duty": uniform(rng, 0.3, 0.7),
            "decay": uniform(rng, 0.2, 0.7),
        },
        _neighbour,
        0.06,
    ),
    "sensor_dropouts": Kind(
        lambda rng: {"cell": uniform(rng, 2.5, 6.0), "seed": _seed(rng)}, _dropouts, 0.05
    ),
    "gain_wander": Kind(lambda rng: {"seed": _seed(rng)}, _gain_wander, 0.004),
}
FINAL = {
    "end_stop": Kind(lambda rng: {"strain": uniform(rng, 0.085, 0.115)}, _end_stop, 0.3),
    "set_point_dither": Kind(lambda rng: {"hertz": uniform(rng, 0.7, 3.5)}, _dither, 0.04),
    "pendulum": Kind(
        lambda rng: {"hertz": uniform(rng, 0.6, 1.2), "drive": uniform(rng, 0.03, 0.06)},
        _pendulum,
        1.0,
    ),
    "buckling": Kind(
        lambda rng: {"up": uniform(rng, 0.10, 0.12), "down": uniform(rng, 0.04, 0.07)},
        _buckling,
        0.006,
    ),
    "bumps": Kind(
        lambda rng: {
            "cell": uniform(rng, 4.0, 9.0),
            "length": uniform(rng, 0.06, 0.25),
            "seed": _seed(rng),
        },
        _bumps,
        5.0,
    ),
}
