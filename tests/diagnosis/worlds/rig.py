"""Rigs: constants of a muscle, its regulator, sensors and start, drawn once."""

from dataclasses import dataclass

import numpy as np

from .laws import LAWS, MAP_SHAPE, balance, draw_law, force
from .loop_draws import DRAWS, Operator
from .names import POSITION_NOISE, PRESSURE_NOISE, WORLDS
from .recipes import RECIPES
from .valve import KEYS

REFERENCE_LOAD = 25.0  # [N]


@dataclass(frozen=True)
class Nuisance:
    """Differences between rigs that are no cause: clock, start, zeros, noise."""

    clock_offset_s: float = 0.0  # readings are taken so much later than their row says
    start_pressure_bar: float = 0.0  # left over at the first row
    start_strain: float = 0.0  # still settling at the first row
    start_settling_s: float = 2.0
    loop_memory: float = 0.0  # of an earlier descent, 0 to 1
    zero_mm: float = 0.0
    zero_bar: float = 0.0


@dataclass(frozen=True)
class Noise:
    """Noise of the sensors."""

    position_mm: float
    pressure_bar: float
    coloured_share: float  # of the variance, with a correlation time of 1 s
    step_mm: float  # quantum, 0 for none
    step_bar: float


@dataclass(frozen=True)
class Rig:
    """One rig of a world."""

    world: str
    length_mm: float
    diameter_mm: float
    law: tuple[float, ...]
    table: tuple[float, ...]
    loop: Operator
    partner: Operator  # loop of the same muscle in the other drive
    half_width_bar: float
    friction_N: float  # force that shifts the loop by its half width
    growth: float  # of slip force with pressure, per 3 bar
    valve: tuple[float, ...]
    carriage_kg: float
    damping_N_s_mm: float
    stiffness_N_mm: float  # upper bound, for the integrator
    stroke_mm: float  # at 6 bar under 25 N, without loop
    nuisance: Nuisance
    noise: Noise
    squeeze_bar: float = 0.0  # on the strands at 0 bar; if not 0, slip force grows as a root

    @property
    def clock_offset_s(self) -> float:
        """Time by which readings are taken later than their row says [s]."""
        return self.nuisance.clock_offset_s

    @property
    def length_driven(self) -> bool:
        """Whether the normal loop is driven by length."""
        return RECIPES[self.world].drive == "length"

    @property
    def law_kind(self) -> int:
        """Number of the static law."""
        return LAWS.index(RECIPES[self.world].law)

    def valve_value(self, key: str) -> float:
        """Return one constant of the regulator."""
        return self.valve[KEYS.index(key)]


def law_arrays(law: tuple[float, ...], table: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the constants of a law and its map as arrays."""
    knots = np.array(table).reshape(MAP_SHAPE) if table else np.zeros(MAP_SHAPE)
    return np.array(law), knots


def draw_nuisance(rng: np.random.Generator) -> Nuisance:
    """Draw what differs between rigs of the same world."""
    offset = 0.02 * rng.uniform(-2.0, 2.0)
    moving, kind = rng.random() < 0.5, rng.integers(3)
    pressure, strain = rng.uniform(0.1, 0.5), rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.04)
    settling, memory = rng.uniform(0.8, 6.0), rng.uniform(0.2, 1.0)
    zeros, zero_mm, zero_bar = rng.random(2) < 0.5, rng.normal() * 0.25, rng.normal() * 0.03
    return Nuisance(
        clock_offset_s=offset,
        start_pressure_bar=pressure if moving and kind != 1 else 0.0,
        start_strain=strain if moving and kind != 0 else 0.0,  # times the stroke, see draw_rig
        start_settling_s=settling,
        loop_memory=memory if moving and kind == 2 else 0.0,
        zero_mm=zero_mm if zeros[0] else 0.0,
        zero_bar=zero_bar if zeros[1] else 0.0,
    )


def draw_noise(rng: np.random.Generator) -> Noise:
    """Draw the noise of a rig's sensors."""
    factors, coloured = rng.uniform(0.85, 1.15, 2), rng.uniform(0.0, 0.35)
    steps, quanta = rng.random(2) < 0.4, rng.uniform([0.01, 0.003], [0.05, 0.012])
    return Noise(
        POSITION_NOISE * factors[0],
        PRESSURE_NOISE * factors[1],
        coloured,
        quanta[0] if steps[0] else 0.0,
        quanta[1] if steps[1] else 0.0,
    )


def _steepest(kind: int, q: np.ndarray, knots: np.ndarray, length: float) -> float:
    """Return the largest stiffness [N/mm] of a law in its working range."""
    work = np.zeros((2, 4))
    largest = 1.0
    for pressure in (0.0, 2.0, 4.0, 6.0):
        for load in (0.0, 60.0):
            at = balance(kind, q, knots, pressure, load)
            for strain in np.linspace(-0.02, max(at, 0.0), 7):
                step = force(kind, q, knots, pressure, strain, load, work)
                step -= force(kind, q, knots, pressure, strain + 1e-4, load, work)
                largest = max(largest, step / 1e-4 / length)
    return largest


def draw_rig(world: str, rng: np.random.Generator, nuisance: bool = True) -> Rig:
    """Draw a rig of a world; without `nuisance` its clock, start and zeros are ideal."""
    recipe = RECIPES[world]
    kind = LAWS.index(recipe.law)
    drawn_seed = int(rng.integers(2**62))
    place = WORLDS.index(world)
    common, own = (np.random.default_rng([drawn_seed, place, part]) for part in (0, 1))
    while True:
        length = own.uniform(100.0, 250.0)
        diameter = 10.0 if own.random() < 0.6 else own.uniform(8.0, 20.0)
        area = (diameter / 10.0) ** 1.6
        law, table = draw_law(recipe.law, own, area)
        q, knots = law_arrays(law, table)
        rest = balance(kind, q, knots, 0.0, REFERENCE_LOAD)
        top = balance(kind, q, knots, 6.0, REFERENCE_LOAD)
        if 0.09 < top - rest < 0.24:
            break
    middle = balance(kind, q, knots, 3.0, REFERENCE_LOAD)
    work = np.zeros((2, 4))
    per_bar = force(kind, q, knots, 3.3, middle, REFERENCE_LOAD, work)
    per_bar = (per_bar - force(kind, q, knots, 2.7, middle, REFERENCE_LOAD, work)) / 0.6
    half = own.uniform(0.25, 0.42) * recipe.width
    other = "geometric_stops" if recipe.drive == "length" else "maxwell_slip"
    span = 0.0 if recipe.drive == "pressure" else length
    loop = DRAWS[recipe.loop](own, half, span)
    partner = DRAWS[other](own, half, length - span)
    carriage = own.uniform(0.3, 0.8)
    stiffness = _steepest(kind, q, knots, length)
    drawn = draw_nuisance(common)
    stroke = (top - rest) * length
    chosen = Nuisance()
    if nuisance:
        settled = drawn.start_strain * (top - rest)
        chosen = Nuisance(**(vars(drawn) | {"start_strain": settled}))
    return Rig(
        world=world,
        length_mm=length,
        diameter_mm=diameter,
        law=law,
        table=table,
        loop=loop,
        partner=partner,
        half_width_bar=half,
        friction_N=half * per_bar,
        growth=own.uniform(*recipe.growth),
        valve=recipe.valve_vector(own),
        carriage_kg=carriage,
        damping_N_s_mm=area * own.uniform(0.25, 0.6),
        stiffness_N_mm=1.3 * stiffness + half * per_bar / (0.002 * length),
        stroke_mm=stroke,
        nuisance=chosen,
        noise=draw_noise(common),
        squeeze_bar=own.uniform(*recipe.squeeze),
    )


UNLIKE = 0.03
"""Relative difference above which exhaust and filling count as different."""


def truth_of(rig: Rig) -> dict[str, bool]:
    """Return which of five causes the normal physics of a rig contains.

    A choked orifice and a turbulent restriction limit the rate of large steps, so they count as
    a rate limit. The exhaust differs where orifice, rate limit or lag differ by more than 3 % from
    those of filling. A pressure that is not proportional to the setpoint counts as a nonlinear
    reading.
    """
    value = rig.valve_value
    pairs = (
        (value("fill_bar_s"), value("vent_bar_s")),
        (value("fill_limit_s_bar"), value("vent_limit_s_bar")),
        (value("lag_s"), value("vent_lag_s")) if value("vent_delay_s") > 0.0 else (0.0, 0.0),
        (value("pilot_s"), value("vent_pilot_s")) if value("vent_pilot_s") > 0.0 else (0.0, 0.0),
    )
    limiting = ("fill_limit_s_bar", "fill_bar_s", "throttle_s2_bar")
    return {
        "slew_limit": any(value(key) > 0.0 for key in limiting),
        "dead_time": value("dead_time_s") >= 0.01,
        "hysteresis_drive": rig.length_driven,
        "exhaust_asymmetry": any(abs(b - a) > UNLIKE * a for a, b in pairs),
        "sensor_nonlinearity": any(value(key) != 0.0 for key in ("bulge_bar", "tilt_bar")),
    }
