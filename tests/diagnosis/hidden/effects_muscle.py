"""Effects in the muscle: creep, losses, heat, first cycles, bladder."""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, coin, put, sign, uniform
from .kernel_tools import CREEP_STRIDE, STEP
from .records import CREEP_ELEMENTS


def _creep(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A hysteresis of power law or logarithm in time, summed from a dense scale of paces."""
    times = np.geomspace(shape["first"], 3000.0, CREEP_ELEMENTS)
    share = times ** shape["power"]
    put(record, creep=strength, creep_strain=shape["of_strain"])
    record["creep_share"][0] = share / share[times < 300.0].sum()
    record["creep_pace"][0] = 1.0 - np.exp(-STEP * CREEP_STRIDE / times)


def _viscous_loss(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Eyring's flow over barriers: the drag is an arsinh of the speed; strength at 1 mm/s [N]."""
    pace = shape["pace"]
    put(record, loss=strength / (pace * np.arcsinh(1.0 / pace)), loss_pace=pace)


def _temperature(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The pull of pressure follows Arrhenius; strength is the share per kelvin at 20 deg C."""
    put(record, heat=shape["sign"] * strength * 293.15**2)


def _first_cycle_softening(record: np.ndarray, strength: float, shape: Shape) -> None:
    """A virgin bladder is stiffer and grips more; that fades with the distance travelled."""
    put(
        record,
        virgin=strength,
        virgin_scale=shape["travel"],
        virgin_kind=shape["root"],
        virgin_grip=shape["grip"],
    )


def _load_dependent_compliance(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The bladder's stiffness changes with a power of the load."""
    put(
        record,
        load_soft=strength,
        load_soft_power=shape["power"],
        load_soft_sign=shape["sign"],
    )


def _threshold_pressure(record: np.ndarray, strength: float, shape: Shape) -> None:
    """The bladder meets the braid over a soft range of pressure [bar]."""
    put(record, threshold=strength, threshold_blur=shape["blur"])


MUSCLE = {
    "creep": Kind(
        lambda rng: {
            "first": uniform(rng, 0.1, 0.5),
            "power": uniform(rng, 0.0, 0.2),
            "of_strain": coin(rng),
        },
        _creep,
        0.008,
    ),
    "viscous_loss": Kind(
        lambda rng: {"pace": float(np.exp(uniform(rng, np.log(0.3), np.log(3.0))))},
        _viscous_loss,
        0.3,
    ),
    "temperature": Kind(lambda rng: {"sign": sign(rng)}, _temperature, 0.003),
    "first_cycle_softening": Kind(
        lambda rng: {
            "travel": uniform(rng, 0.3, 1.0),
            "root": coin(rng),
            "grip": uniform(rng, 0.5, 1.5),
        },
        _first_cycle_softening,
        0.012,
    ),
    "load_dependent_compliance": Kind(
        lambda rng: {
            "power": float(rng.choice([uniform(rng, 0.5, 0.7), uniform(rng, 1.4, 2.0)])),
            "sign": sign(rng),
        },
        _load_dependent_compliance,
        0.005,
    ),
    "threshold_pressure": Kind(
        lambda rng: {"blur": uniform(rng, 0.15, 0.35)}, _threshold_pressure, 0.02
    ),
}
