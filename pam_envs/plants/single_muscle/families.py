"""Base plants for muscles of any size, from the law of their family.

    base_plant("mckibben", rest_length=0.12, diameter=0.004, max_pressure=3e5)

Forces, moving mass and damping grow with the cross-section, forces of tube and braid also with the
rated pressure. This is where a calibration starts (``pam-envs calibrate``), or a simulation
of a muscle that has not been measured.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.plants.core.plant import UnstableParameters
from pam_envs.plants.single_muscle.plant import SingleMuscle

SIZE, PRESSURE = 0.01, 6e5
"""Diameter [m] and largest pressure [Pa] of the muscles of Festo that the laws were fitted to."""
BRAID_ANGLE = 0.4
"""Angle of the braid of a McKibben muscle at rest [rad], about 23 degrees."""
DMSP = {
    "muscle.area": 8.132e-4,
    "muscle.area_taper": 2.193,
    "muscle.braid_force": 182.2,
    "muscle.braid_strain": 0.02988,
    "muscle.stiffness": 236.2,
    "muscle.hardening": 6248.0,
}
"""Least squares on data/dmsp10_force_map.csv: within 7.5 N RMS of forces up to 542 N."""
FORCES = ("muscle.braid_force", "muscle.stiffness", "muscle.hardening")
SOURCES = {
    "festo_mas": "identified on positioning2021, Tables 3-5",
    "festo_dmsp": "fitted to the measured map of a DMSP-10-250 (data/dmsp10_force_map.csv)",
    "mckibben": "ideal braided muscle, tondu2000, with the friction of festo_mas",
}
FAMILIES = tuple(SOURCES)
"""Families of muscles: short and long Festo muscles, and braided ones without a stiff tube."""


def base_plant(
    family: str,
    rest_length: float,
    diameter: float,
    *,
    max_pressure: float = PRESSURE,
    load: float = 0.0,
    braid_angle: float | None = None,
) -> SingleMuscle:
    """Return the plant of a muscle that has not been measured.

    Parameters
    ----------
    family : {"festo_mas", "festo_dmsp", "mckibben"}
        Muscle whose static law is scaled.
    rest_length, diameter : float
        Of the muscle at rest [m]; the diameter is that of the braid, or the nominal one of Festo.
    max_pressure : float
        Largest gauge pressure of the regulator [Pa].
    load : float
        Hanging load [kg].
    braid_angle : float, optional
        Angle between threads and axis at rest [rad], which gives the force of a ``"mckibben"``
        muscle; default: 0.4 rad.

    Raises
    ------
    ValueError
        Naming the parameter, its bounds and the remedy.
    """
    if family not in FAMILIES:
        raise ValueError(f"family = {family!r}; choose one of {', '.join(FAMILIES)}")
    stock = SingleMuscle.mas10("maxwell_slip")
    wide, rated = (diameter / SIZE) ** 2, max_pressure / PRESSURE
    law = LAWS[family](stock, diameter, BRAID_ANGLE if braid_angle is None else braid_angle, wide)
    law |= {name: law[name] * rated for name in FORCES}
    operator: Any = stock.hysteresis.operator
    sizes = {
        "muscle.rest_length": rest_length,
        "muscle.diameter": diameter,
        "regulator.max_pressure": max_pressure,
        "regulator.slew_rate": stock.regulator.slew_rate * rated,
        "hysteresis.operator": PlayOperator(
            tuple(rated * t for t in operator.thresholds), operator.weights, operator.linear
        ),
        "hysteresis.width_per_load": 0.0,
        "mass.load": load,
        "mass.moving_mass": stock.mass.moving_mass * wide,
        "mass.damping": stock.mass.damping * wide,
        **({} if braid_angle is None else {"muscle.braid_angle": braid_angle}),
    }
    provenance = {
        **stock.provenance,
        **dict.fromkeys(law, ("derived", f"{SOURCES[family]}, scaled to the muscle's size")),
        **dict.fromkeys(
            (name for name in sizes if name != "hysteresis.operator"),
            ("assumed", "given, or scaled to the muscle's size"),
        ),
    }
    return stable(stock, {**law, **sizes}, provenance)


def stable(
    stock: SingleMuscle, values: Mapping[str, Any], provenance: Mapping[str, tuple[str, str]]
) -> SingleMuscle:
    """Return a plant with as many sub-steps as its motion needs."""
    made = dataclasses.replace(stock, ensemble=(), provenance=dict(provenance))
    for substeps in (stock.substeps, *FINER):
        try:
            return dataclasses.replace(made, substeps=substeps).replace(values)
        except UnstableParameters as error:
            unstable = error
    raise unstable


FINER = (6, 8, 12, 20, 40, 70, 100)
"""Numbers of sub-steps that are tried for a fast motion."""


def _mas(stock: SingleMuscle, diameter: float, angle: float, wide: float) -> dict[str, float]:
    return _scaled({name: stock.value(name) for name in DMSP}, wide)


def _dmsp(stock: SingleMuscle, diameter: float, angle: float, wide: float) -> dict[str, float]:
    return _scaled(DMSP, wide)


def _scaled(law: Mapping[str, float], wide: float) -> dict[str, float]:
    forces = ("muscle.area", *FORCES)
    return {name: value * (wide if name in forces else 1.0) for name, value in law.items()}


def _mckibben(stock: SingleMuscle, diameter: float, angle: float, wide: float) -> dict[str, float]:
    """Return the ideal law ``F = p pi D^2 / 4 (a (1 - e)^2 - b)`` (tondu2000)."""
    a, b = 3.0 / math.tan(angle) ** 2, 1.0 / math.sin(angle) ** 2
    return {
        "muscle.area": 0.25 * math.pi * diameter**2 * (a - b),
        "muscle.area_taper": 2.0 * a / (a - b),
        "muscle.area_curve": -a / (a - b),
        "muscle.braid_force": 0.0,
        "muscle.stiffness": TUBE * wide,
        "muscle.hardening": 0.0,
    }


TUBE = 500.0
"""Assumed stiffness over strain of the tube of a muscle of 10 mm [N]."""
LAWS: dict[str, Callable[[SingleMuscle, float, float, float], dict[str, float]]] = {
    "festo_mas": _mas,
    "festo_dmsp": _dmsp,
    "mckibben": _mckibben,
}
