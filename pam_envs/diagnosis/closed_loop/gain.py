"""Improvement of the tracking error in closed loop by the extended model.

The same design routine makes a controller from the plant before and one from the extended plant.
Both are run on the rig if it can be simulated, otherwise on the extended plant with residuals of
held-out experiments added. The error is that of the true position.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.closed_loop.plant_inverse import PREVIEW, Controller, Rig, Simulated
from pam_envs.diagnosis.closed_loop.plant_inverse import design as default_design
from pam_envs.plants.core.stepper import PERIOD, PlantStepper
from pam_envs.plants.single_muscle.plant import SingleMuscle

Design = Callable[[Any], Controller]
"""Design routine from a plant, with load and temperature of the runs, to a controller."""

COMPENSABLE: tuple[str, ...] = tuple(cause.name for cause in catalogue() if cause.compensable)
"""Shipped causes that a controller can compensate."""

SETTLING = 2.0  # time at the start of a reference that is not scored [s]
SEGMENT = 2.0  # length of the bootstrap blocks, and of the pieces of a resampled residual [s]
DRAWS = 2000
LEVEL = 0.95
LEAST_STROKE = 1e-3
LEAST_GAP = 0.05  # relative gap to the oracle below which the recovered share is not reported
MM = 1e3
DURATION = 24.0  # duration of each reference [s]
LOW, HIGH = 0.15, 0.85  # range of the references over the stroke
SEED = 20_030_113


@dataclass(frozen=True)
class Residuals:
    """Residuals of the extended plant in held-out experiments."""

    contraction: Array  # (n,): measured less simulated [m]
    period: float  # sampling period [s]

    def resampled(self, seed: int, period: float, samples: int) -> Array:
        """Return randomly drawn pieces of ``SEGMENT`` seconds, concatenated, shape (samples,)."""
        rng = np.random.default_rng(seed)
        every = np.arange(0.0, (len(self.contraction) - 1) * self.period + 1e-9, period)
        trace = np.interp(every, np.arange(len(self.contraction)) * self.period, self.contraction)
        size = min(len(trace), round(SEGMENT / period))
        starts = rng.integers(0, len(trace) - size + 1, -(-samples // size))
        return np.concatenate([trace[s : s + size] for s in starts])[:samples]


class ReplayedRig:
    """A plant with held-out residuals added to reading and position."""

    def __init__(self, plant: SingleMuscle, residuals: Residuals | None) -> None:
        self._stepper = PlantStepper(plant, plant.mass.load)
        self._residuals = residuals
        self.reset(0)

    def reset(self, seed: int | None = None) -> None:
        """Reset the plant to rest and resample the residuals."""
        given = self._residuals
        self._stepper.reset(seed if given is None else None)
        self._count, self._extra = 0, np.zeros(1)
        if given is not None and len(given.contraction) > 0:
            samples = round(2.0 * DURATION / self._stepper.period)
            self._extra = given.resampled(seed or 0, self._stepper.period, samples)

    @property
    def position(self) -> float:
        """True contraction [m]."""
        return self._stepper.position + float(self._extra[self._count % len(self._extra)])

    def step(self, set_point: float) -> tuple[float, float]:
        """Hold a setpoint [Pa] for a period; return contraction [m] and pressure [Pa] read."""
        reading, pressure = self._stepper.step(set_point)
        self._count += 1
        return reading + float(self._extra[self._count % len(self._extra)]), pressure


def smooth_path(
    t: NDArray[Any], times: NDArray[Any], levels: NDArray[Any], ramps: NDArray[Any]
) -> Array:
    """Return a smooth path that reaches each level within a ramp that starts at its time."""
    path = np.full(len(t), levels[0])
    for i in range(1, len(levels)):
        s = np.clip((t - times[i]) / ramps[i], 0.0, 1.0)
        path += (levels[i] - levels[i - 1]) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return path


def fixed_references(top: float, period: float = PERIOD) -> dict[str, Array]:
    """Return the references [m]: sines, a staircase with holds, random ramps and holds.

    Fixed shapes, scaled to the stroke [m]. The steepest ramp covers it in about 0.75 s, so that a
    regulator of usual slew rate can follow it and a slow one cannot.
    """
    t = np.arange(round(DURATION / period) + PREVIEW) * period
    turns = np.array([0.08, 0.21, 0.47, 0.83])
    sizes, phases = np.array([0.4, 0.3, 0.2, 0.1]), np.array([0.0, 1.1, 2.9, 4.6])
    sines = (sizes * np.sin(2.0 * np.pi * turns * t[:, None] + phases)).sum(axis=1)
    stairs = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 0.75, 0.5, 0.25, 0.0, 0.5])
    times = np.concatenate([[0.0], 0.2 + 2.2 * np.arange(10)])
    rng = np.random.default_rng(SEED)
    count = round(DURATION / 1.5) + 1
    levels, paces = rng.uniform(0.0, 1.0, count), rng.uniform(1.0, 1.8, count)
    ramps = np.maximum(0.3, paces * np.abs(np.diff(levels, prepend=levels[0])))
    shares = {
        "sines": 0.5 + 0.5 * sines,
        "staircase": smooth_path(t, times, stairs, np.full(11, 0.5)),
        "ramps": smooth_path(t, 1.5 * np.arange(count), levels, ramps),
    }
    rise = smooth_path(t, np.zeros(2), np.array([0.0, 1.0]), np.full(2, 1.5))
    return {k: top * rise * (LOW + (HIGH - LOW) * v) for k, v in shares.items()}


def reach(rig: Rig, full: float, period: float) -> float:
    """Return the contraction [m] of a rig after two seconds of full pressure."""
    rig.reset(0)
    for _ in range(round(2.0 / period)):
        rig.step(full)
    return rig.position


def run(controller: Controller, rig: Rig, reference: Array, load: float, seed: int) -> Array:
    """Return the errors [m] of the true position (n,) on a reference (n + PREVIEW,) [m]."""
    rig.reset(seed)
    controller.reset()
    reading = pressure = 0.0
    errors = np.empty(len(reference) - PREVIEW)
    for k in range(len(errors)):
        set_point = controller.act(reference[k : k + PREVIEW], reading, pressure, load)
        reading, pressure = rig.step(set_point)
        errors[k] = rig.position - reference[k + 1]
    return errors


def segment_squares(errors: Array, period: float) -> Array:
    """Return mean squares [m2] of the segments after settling, shape (segments,)."""
    size, first = round(SEGMENT / period), round(SETTLING / period)
    whole = (len(errors) - first) // size
    return np.asarray((errors[first : first + whole * size].reshape(whole, size) ** 2).mean(axis=1))


def rms(squares: Array) -> Array:
    """Return the square root of the mean over the last axis."""
    return np.asarray(np.sqrt(squares.mean(axis=-1)))


def spread(values: Array) -> list[float]:
    """Return the confidence interval of level ``LEVEL``."""
    tail = 50.0 * (1.0 - LEVEL)
    low, high = np.percentile(values, [tail, 100.0 - tail])
    return [float(low), float(high)]


def prepared(plant: Any, load: float, kelvin: float | None) -> Any:
    """Return a plant at the load and temperature of the runs, without a single slip."""
    if not isinstance(plant, SingleMuscle):
        return plant
    values = {"mass.load": load, "position.slip": 0.0}
    if kelvin is not None:
        values["muscle.temperature"] = kelvin
    return plant.replace(values)


def closed_loop(
    before: SingleMuscle,
    after: SingleMuscle,
    design: Design | None = None,
    rig: Rig | None = None,
    oracle: SingleMuscle | Simulated | None = None,
    references: Mapping[str, Array] | None = None,
    residuals: Residuals | None = None,
    load: float = 0.0,
    kelvin: float | None = None,
    seed: int = 0,
) -> dict[str, Any] | None:
    """Compare controllers designed on the plant before and on the extended plant.

    ``design`` is :func:`pam_envs.diagnosis.closed_loop.plant_inverse.design` by default. The
    controllers run on ``rig``, by default the extended plant with ``residuals`` of held-out
    experiments added; ``oracle``, the true plant of the rig, gives a third controller. Load [kg]
    and temperature [K] are those of the runs, ``references`` [m] have the shape (n + PREVIEW,).

    Returns ``closed_loop`` of the report with the errors on each reference, or None if the stroke
    under this load is less than ``LEAST_STROKE``.
    """
    make = default_design if design is None else design
    plants = [prepared(p, load, kelvin) for p in (before, after, oracle) if p is not None]
    where = ReplayedRig(plants[1], residuals) if rig is None else rig
    period = float(getattr(where, "period", PERIOD))
    if references is None:
        full = plants[0].regulator.max_pressure
        muscles = [PlantStepper(p, p.mass.load) for p in plants if isinstance(p, SingleMuscle)]
        top = min(reach(r, full, period) for r in (*muscles, where))
        if top < LEAST_STROKE:
            return None
        references = fixed_references(top, period)
    squares = np.array(
        [
            [
                segment_squares(run(controller, where, r, load, seed + i), period)
                for i, r in enumerate(references.values())
            ]
            for controller in map(make, plants)
        ]
    )
    found = scores(squares, list(references), seed)
    found["controller"] = INVERSE if design is None else name_of(design)
    found["where"] = "the rig" if rig is not None else REPLAYED if residuals else NOISY
    return {**found, "text": sentence(found)}


def name_of(design: Callable[..., Any]) -> str:
    """Return the name of a design routine in words."""
    return str(getattr(design, "__name__", type(design).__name__)).replace("_", " ")


INVERSE = "inverse by simulation with a PI loop"
REPLAYED = "the extended plant with held-out residuals added"
NOISY = "the extended plant with its sensor noise"


def scores(
    squares: Array, names: list[str], seed: int, unit: str = "mm", scale: float = 1.0 / MM
) -> dict[str, Any]:
    """Return errors and improvement with confidence intervals from a segment bootstrap.

    ``squares``, squares of SI units, are of before, after and the oracle, shape
    (2 or 3, references, segments); ``scale`` is the size of the unit [SI].
    """
    flat = squares.reshape(len(squares), -1)
    rng = np.random.default_rng(seed)
    drawn = rms(flat[:, rng.integers(0, flat.shape[1], (DRAWS, flat.shape[1]))]) / scale
    old, new, *best = (rms(flat) / scale).tolist()
    gap = old - best[0] if best else 0.0
    each = rms(squares) / scale
    labels = ("before", "after", "oracle")[: len(squares)]
    return {
        "controller": "",
        "where": "",
        "unit": unit,
        "before": {"value": old, "interval": spread(drawn[0])},
        "after": {"value": new, "interval": spread(drawn[1])},
        "oracle": {"value": best[0]} if best else None,
        "better_percent": {
            "value": 100.0 * (1.0 - new / old),
            "interval": spread(100.0 * (1.0 - drawn[1] / drawn[0])),
        },
        "recovered": (old - new) / gap if gap > LEAST_GAP * old else None,
        "references": [
            {"name": name, **dict(zip(labels, each[:, i].tolist(), strict=True))}
            for i, name in enumerate(names)
        ],
    }


def sentence(found: Mapping[str, Any]) -> str:
    """Return the result in words."""
    old, new, unit = found["before"]["value"], found["after"]["value"], found["unit"]
    better, (low, high) = found["better_percent"]["value"], found["better_percent"]["interval"]
    text = (
        "Designed on the extended plant instead of the plant before, the same controller has a "
        f"tracking error of {new:.3g} instead of {old:.3g} {unit} RMS on {found['where']}: "
    )
    if low <= 0.0 <= high:
        text += f"no significant difference ({low:.0f} to {high:.0f} %)."
    else:
        word = "less" if better > 0.0 else "more"
        ends = sorted((abs(low), abs(high)))
        text += f"{abs(better):.0f} % {word} (95 % interval {ends[0]:.0f} to {ends[1]:.0f} %)."
    if found["oracle"] is not None:
        text += f" Designed on the rig itself the error is {found['oracle']['value']:.3g} {unit}"
        share = found["recovered"]
        text += "." if share is None else f"; {100.0 * share:.0f} % of that gap is closed."
    return text
