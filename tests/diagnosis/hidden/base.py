"""Clean rig: pneumatic muscle with a hanging load under a pressure regulator.

The law is a braid geometry blended with a dome over the strain, times the pressure after friction,
less a bladder of exponential, neo-Hookean and saturating parts. Friction is a chain of 24 sliders
that pressure drags, their breaks spread smoothly.
"""

from dataclasses import dataclass

import numpy as np

from .kernel_tools import STEP
from .records import PARAMETERS, SLIDERS, blank

CONTRACTION_NOISE_MM = 0.045
PRESSURE_NOISE_BAR = 0.0126


@dataclass(frozen=True)
class Base:
    """Constants of a clean rig."""

    length_mm: float  # at rest
    diameter_mm: float
    gain: float  # of the regulator
    lag: float  # of the regulator [s]
    force: float  # pull of 1 bar at rest [N]
    angle: float  # of the braid at rest [rad]
    span: float  # strain at which dome and bladder are measured
    blend: float  # share of the dome
    dome: float  # curvature of the dome
    rubber: float  # of the bladder, a force over `force`, as the next four
    bend: float
    bulk: float
    grip: float
    grip_span: float
    mass: float  # moving mass besides the load, balanced: inertia without weight [kg]
    damping: float  # [N s/m]
    loop: float  # full width of the large pressure loop [bar]
    largest: float  # end of the density of the breaks [bar]
    spread: tuple[float, float]  # exponents of the density of the breaks
    coloured: float  # share of the noise variance with a correlation of 1 s
    grain_mm: float  # quantisation of the readings, 0 for none
    grain_bar: float

    def sliders(self) -> tuple[np.ndarray, np.ndarray]:
        """Return stiffness [-] and breaks [bar] of the sliders, shape (24,) each."""
        place = (np.arange(SLIDERS) + 0.5) / SLIDERS
        density = place ** self.spread[0] * (1.0 - place) ** self.spread[1]
        share = density * 0.5 * self.loop / (self.largest * float(density @ place))
        return share, self.largest * place

    def parameters(self) -> np.ndarray:
        """Return the constants for the compiled loop, shape (1,)."""
        record = blank(PARAMETERS)
        for name in _SHARED:
            record[name] = getattr(self, name)
        record["length"] = 1e-3 * self.length_mm
        record["approach"] = 1.0 - np.exp(-STEP / self.lag)
        record["braid"] = 3.0 * np.cos(self.angle) ** 2
        record["stiffness"][0], record["breaks"][0] = self.sliders()
        record["friction"] = 0.5 * self.loop
        return record


_SHARED = (
    *("gain", "force", "blend", "dome", "span", "rubber", "bend", "bulk", "grip", "grip_span"),
    *("mass", "damping"),
)


def _regulator(rng: np.random.Generator, decoy: bool) -> dict[str, float]:
    if decoy:
        lag = rng.choice([rng.uniform(0.020, 0.030), rng.uniform(0.14, 0.25)])
        return {"lag": float(lag), "gain": float(rng.choice([0.9, 1.1]) + rng.uniform(-0.03, 0.03))}
    return {"lag": float(rng.uniform(0.035, 0.120)), "gain": float(rng.uniform(0.97, 1.03))}


def _muscle(rng: np.random.Generator, decoy: bool) -> dict[str, float]:
    length = rng.uniform(100.0, 250.0)
    strongest = 243.0 + 295.0 * (1.0 - np.exp(-length / 293.0))
    odd = rng.choice([rng.uniform(0.65, 0.75), rng.uniform(1.25, 1.4)])
    scale = odd if decoy else rng.uniform(0.88, 1.12)
    rubber = rng.uniform(2.0, 2.6) * (rng.uniform(0.75, 1.25) if decoy else 1.0)
    return {
        "length_mm": float(round(length)),
        "diameter_mm": 10.0,
        "force": float(scale * strongest / 6.2),
        "angle": float(np.radians(rng.uniform(25.0, 29.0))),
        "span": float(rng.uniform(0.155, 0.18)),
        "blend": float(rng.uniform(0.03, 0.10)),
        "dome": float(rng.uniform(0.6, 1.0)),
        "rubber": float(rubber),
        "bend": float(rng.uniform(3.5, 5.5)),
        "bulk": float(rng.uniform(0.3, 0.9)),
        "grip": float(rng.uniform(-0.03, 0.03)),
        "grip_span": float(rng.uniform(0.5, 0.9)),
    }


def _motion(rng: np.random.Generator, decoy: bool) -> dict[str, float]:
    if decoy:
        mass = rng.choice([rng.uniform(0.08, 0.12), rng.uniform(0.6, 0.9)])
        damping = rng.choice([rng.uniform(60.0, 90.0), rng.uniform(260.0, 400.0)])
        return {"mass": float(mass), "damping": float(damping)}
    return {"mass": float(rng.uniform(0.15, 0.5)), "damping": float(rng.uniform(100.0, 220.0))}


def _friction(rng: np.random.Generator, decoy: bool) -> dict:
    odd = rng.choice([rng.uniform(0.15, 0.3), rng.uniform(0.9, 1.1)])
    loop = odd if decoy else rng.uniform(0.4, 0.85)
    return {
        "loop": float(loop),
        "largest": float(rng.uniform(max(0.5, 1.2 * loop), max(1.05, 1.25 * loop))),
        "spread": (float(rng.uniform(0.3, 0.9)), float(rng.uniform(0.4, 1.0))),
    }


def _sensors(rng: np.random.Generator) -> dict[str, float]:
    grained = bool(rng.random() < 0.25)
    return {
        "coloured": float(rng.uniform(0.2, 0.6)),
        "grain_mm": 0.01 if grained else 0.0,
        "grain_bar": 0.002 if grained else 0.0,
    }


def draw_base(rng: np.random.Generator, decoy: bool = False) -> Base:
    """Draw a clean rig; a decoy has constants far from usual, and still no effect."""
    return Base(
        **_regulator(rng, decoy),
        **_muscle(rng, decoy),
        **_motion(rng, decoy),
        **_friction(rng, decoy),
        **_sensors(rng),
    )
