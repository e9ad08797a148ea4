"""Effects of the catalogue, in the order in which the benchmark draws its cases.

Strengths are in bar, mm, N or s, as the comments say, otherwise relative.
"""

from __future__ import annotations

import numpy as np

from .effect import Kind, Shape, coin, put, sign, uniform, whole
from .kernel_tools import CREEP_STRIDE, STEP
from .records import CREEP_ELEMENTS, SLIDERS

BAR_PER_MM = 0.28  # the noise of the pressure sensor over that of the position sensor


def _creep(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Sum a power law or logarithm of time from a dense scale of paces."""
    times = np.geomspace(shape["first"], 3000.0, CREEP_ELEMENTS)
    share = times ** shape["power"]
    put(record, creep=strength, creep_strain=shape["of_strain"])
    record["creep_share"][0] = share / share[times < 300.0].sum()
    record["creep_pace"][0] = 1.0 - np.exp(-STEP * CREEP_STRIDE / times)


def _either(shape: Shape, strength: float, name: str) -> dict[str, float]:
    """Put a strength in mm into the sensor that was drawn."""
    if shape["position"] > 0.5:
        return {f"{name}_mm": shape["sign"] * strength}
    return {f"{name}_bar": shape["sign"] * strength * BAR_PER_MM}


def _sensor_bias(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Add an offset that appears while the electronics warm up."""
    put(record, **_either(shape, strength, "bias"))


def _sensor_drift(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Let a reading drift along a hyperbola or a slow sigmoid."""
    put(record, drift_time=shape["time"], drift_kind=shape["hyperbola"])
    put(record, **_either(shape, strength, "drift"))


def _sensor_nonlinearity(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Bend a reading over its span like a sine or like an arctangent."""
    put(record, bow_kind=shape["sine"], bow_curve=shape["curve"])
    put(record, **_either(shape, strength, "bow"))


def _viscous_loss(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Eyring's flow over barriers: the drag is an arsinh of the speed; strength at 1 mm/s [N]."""
    pace = shape["pace"]
    put(record, loss=strength / (pace * np.arcsinh(1.0 / pace)), loss_pace=pace)


def _temperature(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Change the pull of pressure by Arrhenius' law; strength per kelvin at 20 deg C."""
    put(record, heat=shape["sign"] * strength * 293.15**2)


def _hysteresis_drive(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Move a share of the friction to sliders that the length drags."""
    place = (np.arange(SLIDERS) + 0.5) / SLIDERS
    density = 1.0 - np.cos(2.0 * np.pi * place ** shape["skew"])
    breaks = shape["reach"] * place
    put(record, strand=1.0 - np.exp(-strength))
    record["strand_breaks"][0] = breaks
    record["strand_stiffness"][0] = record["friction"][0] * density / float(density @ breaks)


def _supply_droop(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Feed a finite reservoir through an orifice, and the muscle from it through the valve.

    Strength is the muscle's volume over the reservoir's. `throat` [s] is the time that the valve,
    fully open, needs for the muscle's volume, over the strength; `recovery` [s] the same for the
    orifice and the reservoir.
    """
    throat = strength * shape["throat"]
    put(record, draw=strength, **{**shape, "throat": throat})


def _stick_slip(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Bend the bristles of a guide, which slip and ease with speed (LuGre); strength in N.

    They bend by so many mm before they slip; at the Stribeck speed [mm/s] half of the excess over
    the kinetic friction is gone.
    """
    put(record, breakaway=strength, **{**shape, "kinetic": strength * shape["kinetic"]})


def _pressure_dependent_friction(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Change friction with pressure along a saturating exponential."""
    put(record, pressure_grip=shape["sign"] * strength, pressure_grip_bend=shape["bend"])


def _resonance(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Ring after steps: waves in a closed tube, or a sensor target on a bracket with a soft foot.

    The tube is tuned to a quarter of a wave, and strength becomes the share of the muscle's air
    that comes through it; its reflection damps the first mode by `damping`. Bracket and foot swing
    in two modes, both of which the target shows, the foot's tilt by a lever.
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
        put(record, target_foot=omega * shape["foot"])
        put(record, target_share=shape["share"], target_lever=shape["lever"])


SENSOR = {"position": coin, "sign": sign}
CATALOGUE = {
    "creep": Kind(_creep, 0.008, {"first": (0.1, 0.5), "power": (0.0, 0.2), "of_strain": coin}),
    # an orifice, choked above about 0.9 bar, also with the valve shut
    "leak": Kind("leak", 0.003),
    # error [bar] that uncovers the ports of a spool: the edge is rounded, and the overlap leaks
    "valve_dead_band": Kind(
        "overlap", 0.03, {"overlap_edge": (0.2, 0.8), "overlap_leak": (0.003, 0.02)}
    ),
    # a chain of short lags [s]
    "dead_time": Kind("chain", 0.004, {"chain_lags": whole(4, 7)}),
    # limited force of the valve's coil: inverse of the error [1/bar]
    "slew_limit": Kind(
        "slew", 0.3, {"slew_kind": coin, "slew_rest": (0.1, 0.25), "slew_lean": (-0.1, 0.1)}, 0.5
    ),
    "sensor_bias": Kind(_sensor_bias, 0.06, SENSOR),
    "sensor_drift": Kind(_sensor_drift, 0.1, {**SENSOR, "time": (80.0, 250.0), "hyperbola": coin}),
    # a cascade of filters or a moving average [s]
    "sensor_delay": Kind("late", 0.006, {"late_kind": coin, "late_lags": whole(2, 5)}),
    "viscous_loss": Kind(
        _viscous_loss,
        0.3,
        {"pace": lambda rng: float(np.exp(uniform(rng, np.log(0.3), np.log(3.0))))},
    ),
    "temperature": Kind(_temperature, 0.003, {"sign": sign}),
    # a rested bladder is stiffer and grips more; that fades with the distance travelled
    "first_cycle_softening": Kind(
        "virgin",
        0.012,
        {"virgin_scale": (0.3, 1.0), "virgin_kind": coin, "virgin_grip": (0.5, 1.5)},
    ),
    # friction grows or shrinks with the load to the power 3/2
    "load_dependent_hysteresis": Kind("load_grip", 0.03, {"load_grip_sign": sign}),
    # the bladder's stiffness changes with a power of the load
    "load_dependent_compliance": Kind(
        "load_soft",
        0.005,
        {
            "load_soft_power": lambda rng: float(
                rng.choice([uniform(rng, 0.5, 0.7), uniform(rng, 1.4, 2.0)])
            ),
            "load_soft_sign": sign,
        },
    ),
    # an odd map of the sum over all sliders: inner loops are bent, fully slipped ones are not
    "hysteresis_shape": Kind("map", 1.3, {"map_kind": coin}, 0.5),
    "hysteresis_drive": Kind(_hysteresis_drive, 0.1, {"skew": (0.6, 1.2), "reach": (0.02, 0.04)}),
    "supply_droop": Kind(
        _supply_droop,
        0.15,
        {
            "supply": (6.1, 6.8),
            "throat": (0.05, 0.15),
            "critical": (0.2, 0.5),
            "recovery": (2.0, 8.0),
        },
        0.6,
    ),
    "stick_slip": Kind(
        _stick_slip,
        2.0,
        {
            "kinetic": (0.4, 0.8),
            "stribeck": (0.5, 4.0),
            "bristle": (0.005, 0.02),
            "oil": (5e-4, 2e-3),
        },
    ),
    # the bladder meets the braid over a soft range of pressure [bar]
    "threshold_pressure": Kind("threshold", 0.02, {"threshold_blur": (0.15, 0.35)}),
    # venting slows down as the absolute pressure falls
    "exhaust_asymmetry": Kind("exhaust", 0.08),
    "pressure_dependent_friction": Kind(
        _pressure_dependent_friction, 0.1, {"sign": sign, "bend": (2.0, 6.0)}
    ),
    "sensor_nonlinearity": Kind(
        _sensor_nonlinearity, 0.1, {**SENSOR, "sine": coin, "curve": (1.5, 4.0)}
    ),
    "resonance": Kind(
        _resonance,
        0.15,
        {
            "hertz": (3.5, 10.0),
            "damping": (0.03, 0.12),
            "line": lambda rng: coin(rng, 0.6),
            "wall": (0.05, 0.25),
            "foot": (1.2, 1.8),
            "share": (0.1, 0.3),
            "lever": (-6.0, -2.0),
        },
    ),
    # a clamp gives way once; the load sinks by so many mm
    "slip_step": Kind(
        "slip", 0.08, {"slip_time": (0.2, 0.8), "slip_blur": (0.1, 0.5), "slip_kind": coin}
    ),
    # the load rests on a support; its wire tightens progressively after a strain
    "wire_slack": Kind("slack", 0.005, {"slack_blur": (0.15, 0.4)}),
    # a tray [N] on a soft rest that a load presses down, which rubs on its guide, and scales with
    # a gain error, given at 30 N over the tray
    "payload_error": Kind(
        "tray", 1.5, {"tray_rest": (4.0, 9.0), "tray_scale": (-0.25, 0.5), "tray_rub": (0.02, 0.08)}
    ),
}
