"""Effects with more than named constants: functions that `effects.toml` names."""

import numpy as np

from .effect import Shape, put
from .kernel_tools import CREEP_STRIDE, STEP
from .records import CREEP_ELEMENTS, SLIDERS, WAVES

BAR_PER_MM = 0.28  # the noise of the pressure sensor over that of the position sensor


def creep(record: np.ndarray, strength: float, shape: Shape) -> None:
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


def sensor_bias(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Add an offset that appears while the electronics warm up."""
    put(record, **_either(shape, strength, "bias"))


def sensor_drift(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Let a reading drift along a hyperbola or a slow sigmoid."""
    put(record, drift_time=shape["time"], drift_kind=shape["hyperbola"])
    put(record, **_either(shape, strength, "drift"))


def sensor_nonlinearity(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Bend a reading over its span like a sine or like an arctangent."""
    put(record, bow_kind=shape["sine"], bow_curve=shape["curve"])
    put(record, **_either(shape, strength, "bow"))


def viscous_loss(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Eyring's flow over barriers: the drag is an arsinh of the speed; strength at 1 mm/s [N]."""
    pace = shape["pace"]
    put(record, loss=strength / (pace * np.arcsinh(1.0 / pace)), loss_pace=pace)


def temperature(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Change the pull of pressure by Arrhenius' law; strength per kelvin at 20 deg C."""
    put(record, heat=shape["sign"] * strength * 293.15**2)


def hysteresis_drive(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Move a share of the friction to sliders that the length drags."""
    place = (np.arange(SLIDERS) + 0.5) / SLIDERS
    density = 1.0 - np.cos(2.0 * np.pi * place ** shape["skew"])
    breaks = shape["reach"] * place
    put(record, strand=1.0 - np.exp(-strength))
    record["strand_breaks"][0] = breaks
    record["strand_stiffness"][0] = record["friction"][0] * density / float(density @ breaks)


def supply_droop(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Feed a finite reservoir through an orifice, and the muscle from it through the valve.

    Strength is the muscle's volume over the reservoir's. `throat` [s] is the time that the valve,
    fully open, needs for the muscle's volume, over the strength; `recovery` [s] the same for the
    orifice and the reservoir.
    """
    throat = strength * shape["throat"]
    put(record, draw=strength, **{**shape, "throat": throat})


def stick_slip(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Bend the bristles of a guide, which slip and ease with speed (LuGre); strength in N.

    They bend by so many mm before they slip; at the Stribeck speed [mm/s] half of the excess over
    the kinetic friction is gone.
    """
    put(record, breakaway=strength, **{**shape, "kinetic": strength * shape["kinetic"]})


def pressure_dependent_friction(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Change friction with pressure along a saturating exponential."""
    put(record, pressure_grip=shape["sign"] * strength, pressure_grip_bend=shape["bend"])


def resonance(record: np.ndarray, strength: float, shape: Shape) -> None:
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


def gain_wander(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Let the pull of pressure wander like a random walk."""
    rng = np.random.default_rng(int(shape["seed"]))
    hertz = np.geomspace(0.01, 0.3, WAVES) * rng.uniform(0.8, 1.25, WAVES)
    size = hertz**-0.8
    put(record, wander=strength)
    record["wave_hz"][0] = hertz
    record["wave_size"][0] = size / np.sqrt(0.5 * np.sum(size**2))
    record["wave_phase"][0] = rng.uniform(0.0, 2 * np.pi, WAVES)


def pendulum(record: np.ndarray, strength: float, shape: Shape) -> None:
    """Swing the load like a pendulum after every motion, which changes the pull on the wire."""
    omega = 2 * np.pi * shape["hertz"]
    put(record, swing=strength, swing_omega=omega, swing_drive=shape["drive"])
