"""Hidden effects, and draws of their mathematical form and constants."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .laws import balance
from .loop_draws import Operator
from .names import POSITION_NOISE, PRESSURE_NOISE
from .recipes import RECIPES
from .rig import Rig, law_arrays


@dataclass(frozen=True)
class Effect:
    """An effect drawn for a rig.

    Its strength is `base + unit * amplitude ** power` up to `bound`, and 0 at amplitude 0; the base
    is what does not show yet, as of a limit that is never reached.
    """

    name: str
    form: int
    constants: tuple[float, ...]
    unit: float
    power: float
    bound: float
    seed: int  # of walks and events
    loop: Operator | None = None  # the loop that a change of loop brings in
    base: float = 0.0

    def strength(self, amplitude: float) -> float:
        """Return the strength at an amplitude, in the unit of its form."""
        if amplitude <= 0.0:
            return 0.0
        return float(min(self.base + self.unit * amplitude**self.power, self.bound))


@dataclass(frozen=True)
class Form:
    """One form of an effect: its number, a first guess of strength, a bound, constants."""

    form: int
    guess: float
    bound: float = np.inf
    constants: tuple[float, ...] = ()
    exact: bool = False  # the guess is the unit already


Rng = np.random.Generator


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _creep(rng: Rng, rig: Rig) -> Form:
    form = int(rng.integers(2))
    if form:
        return Form(1, 0.03, 0.9, (rng.uniform(0.2, 0.5), rng.uniform(2.5, 3.5)))
    taus = rng.uniform(0.7, 2.5), rng.uniform(7.0, 16.0), rng.uniform(0.35, 0.65)
    return Form(0, 0.03, 1.5, taus)


def _leak(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.01, 3.0, (rng.uniform(0.0, 1.0),))


def _dead_band(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.02, 2.0, (rng.uniform(0.2, 0.5),))


def _dead_time(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.003, 0.5)


def _slew(rng: Rng, rig: Rig) -> Form:
    form = int(rng.integers(2))
    return Form(form, 0.03, 2.0, (rng.uniform(0.6, 1.6) if form else 1.0,))


def _channel(rng: Rng) -> tuple[float, float]:
    """Draw a sensor (0 position, 1 pressure) and the unit of its reading."""
    if rng.random() < 0.6:
        return 0.0, POSITION_NOISE
    return 1.0, PRESSURE_NOISE


def _bias(rng: Rng, rig: Rig) -> Form:
    channel, unit = _channel(rng)
    form = int(rng.integers(2))
    start, width = rng.uniform(5.0, 30.0), rng.uniform(8.0, 30.0)
    if form:
        start, width = rng.uniform(15.0, 60.0), rng.uniform(1.0, 5.0)
    return Form(form, unit, 100 * unit, (channel, _sign(rng), start, width), True)


def _drift(rng: Rng, rig: Rig) -> Form:
    channel, unit = _channel(rng)
    period = rng.uniform(180.0, 420.0)
    phase = rng.uniform(0.0, 2 * np.pi)
    form = int(rng.integers(2))
    return Form(form, unit, 100 * unit, (channel, _sign(rng), period, phase), True)


def _delay(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.003, 0.5)


def _viscous(rng: Rng, rig: Rig) -> Form:
    shape = rng.uniform(0.2, 1.0), rng.uniform(0.5, 0.8), rng.uniform(0.4, 1.6)
    return Form(int(rng.integers(2)), 0.03, 20.0, shape)


def _temperature(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.004, 0.4, (_sign(rng),))


def _softening(rng: Rng, rig: Rig) -> Form:
    heal = rng.uniform(150.0, 600.0)
    if rng.random() < 0.5:
        return Form(0, 0.03, 0.7, (rng.uniform(5.0, 15.0), heal))
    return Form(1, 0.3 * rig.friction_N, 1e5, (rng.uniform(0.1, 0.3), heal))


def _load_width(rng: Rng, rig: Rig) -> Form:
    sign = 1.0 if rng.random() < 0.6 else -1.0
    return Form(int(rng.integers(2)), 0.1, 6.0, (sign, rng.uniform(0.4, 0.7)))


def _load_shift(rng: Rng, rig: Rig) -> Form:
    power = rng.uniform(0.4, 0.6) if rng.random() < 0.4 else rng.uniform(1.6, 2.2)
    return Form(int(rng.integers(2)), 0.001, 0.3, (power, _sign(rng)))


def _shape(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.1, 1.0)


def _drive(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.1, 1.0)


CONTROLLED = ("integrating", "pulsed", "coarse_fine", "back_calculation", "sampled")


def _droop(rng: Rng, rig: Rig) -> Form:
    own = 1.0, rng.uniform(4.0, 20.0), rng.uniform(5.9, 6.4)
    form = int(rng.integers(2))
    if RECIPES[rig.world].valve in CONTROLLED:
        form = 0  # a controlled valve reaches its target until the supply is too low
    return Form(form, 0.01, 0.3, own)


def _stick(rng: Rng, rig: Rig) -> Form:
    own = rng.uniform(0.02, 0.08), rng.uniform(0.5, 0.75), rng.uniform(1.0, 4.0)
    return Form(int(rng.integers(2)), 0.1 * rig.friction_N, 8 * rig.friction_N, own)


def _threshold(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.03, 1.5, (rng.uniform(0.15, 0.5), rng.uniform(0.0, 1.5)))


def _exhaust(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.1, 40.0, (rng.uniform(0.8, 2.0),))


def _pressure_friction(rng: Rng, rig: Rig) -> Form:
    own = _sign(rng), rng.uniform(0.0, 1.0), rig.length_mm * rng.uniform(0.002, 0.008)
    form = int(rng.integers(2))
    if form:
        return Form(1, 0.2, 8.0, own)
    return Form(0, 0.1 * rig.friction_N, 10 * rig.friction_N, own)


def _bend(rng: Rng, rig: Rig) -> Form:
    channel, unit = _channel(rng)
    span = 1.1 * rig.stroke_mm if channel == 0.0 else 6.0
    form = int(rng.integers(2))
    return Form(form, 1.4 * unit, 100 * unit, (channel, _sign(rng), span), True)


def _resonance(rng: Rng, rig: Rig) -> Form:
    channel = 0.0 if rng.random() < 0.5 else 1.0
    own = channel, rng.uniform(3.0, 10.0), rng.uniform(0.015, 0.06)
    return Form(int(channel), 0.05, 5.0, own)


def _slip(rng: Rng, rig: Rig) -> Form:
    own = rng.uniform(8.0, 70.0), rng.uniform(2.0, 4.0), rng.uniform(0.3, 2.0)
    return Form(int(rng.integers(2)), 1.2 * POSITION_NOISE, 10.0, own, True)


def _slack(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.1, 15.0, (rng.uniform(0.3, 0.8),))


def _payload(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.02, 3.0, (_sign(rng),))


def _vibration(rng: Rng, rig: Rig) -> Form:
    own = rng.uniform(4.0, 9.0), rng.uniform(9.0, 15.0)
    return Form(int(rng.integers(2)), 1.0, 1e4, own)


def _plain(rng: Rng, rig: Rig) -> Form:
    return Form(0, 0.02, 1.0)


def _dropouts(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 4.0 * POSITION_NOISE, 20.0)


def _end_stop(rng: Rng, rig: Rig) -> Form:
    q, knots = law_arrays(rig.law, rig.table)
    ends = [balance(rig.law_kind, q, knots, p, 0.0) for p in (0.0, 5.8)]
    top = rig.length_mm * (ends[1] - ends[0])
    spring = rig.stiffness_N_mm * rng.uniform(0.5, 2.0)
    return Form(0, 0.5, 0.8 * top, (top, spring))


def _dither(rng: Rng, rig: Rig) -> Form:
    return Form(int(rng.integers(2)), 0.03, 1.5, (rng.uniform(1.5, 5.0),))


def _pendulum(rng: Rng, rig: Rig) -> Form:
    return Form(0, 0.1, 30.0, (rng.uniform(0.8, 1.8), rng.uniform(0.01, 0.05)))


def _catch(rng: Rng, rig: Rig) -> Form:
    reach = rng.uniform(0.1, 0.5)
    return Form(0, 0.1 * rig.friction_N, 10 * rig.friction_N, (reach,))


FORMS: dict[str, Callable[[Rng, Rig], Form]] = {
    "creep": _creep,
    "leak": _leak,
    "valve_dead_band": _dead_band,
    "dead_time": _dead_time,
    "slew_limit": _slew,
    "sensor_bias": _bias,
    "sensor_drift": _drift,
    "sensor_delay": _delay,
    "viscous_loss": _viscous,
    "temperature": _temperature,
    "first_cycle_softening": _softening,
    "load_dependent_hysteresis": _load_width,
    "load_dependent_compliance": _load_shift,
    "hysteresis_shape": _shape,
    "hysteresis_drive": _drive,
    "supply_droop": _droop,
    "stick_slip": _stick,
    "threshold_pressure": _threshold,
    "exhaust_asymmetry": _exhaust,
    "pressure_dependent_friction": _pressure_friction,
    "sensor_nonlinearity": _bend,
    "resonance": _resonance,
    "slip_step": _slip,
    "wire_slack": _slack,
    "payload_error": _payload,
    "building_vibration": _vibration,
    "supply_crosstalk": lambda rng, rig: Form(0, 0.05, 3.0),
    "position_dropouts": _dropouts,
    "gain_random_walk": _plain,
    "end_stop": _end_stop,
    "regulator_dither": _dither,
    "pendulum_load": _pendulum,
    "cable_catch": _catch,
    "command_steps": lambda rng, rig: Form(0, 0.04, 1.5),
}
