"""Sensors: bias, white noise and quantisation; and delay, bow, drift, ramp and slip as effects.

No noise of the orthoses' sensors is published; the defaults are of the order seen on public rigs.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from pam_envs.kernels.arithmetic import count_on, decay, sine_of_turns
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.kernels.motion import N_HISTORY, fill_ring, note, noted
from pam_envs.parameters import assumed, effect, parameter_rows

_SEEN = "not published; of the order seen on public rigs"
_NONE = "zeroed at rest"
SLIDE = 0.2
"""Time [s] that a slipping clamp takes."""


@dataclass(frozen=True, kw_only=True)
class SensorEffects:
    """Effects of any sensor, neutral unless a recording shows them.

    A reading is ``x + (bow + wave (2 u - 1)) x (u - 1) + drift + cycle + ramp + slip``,
    ``u = x / full``, of the quantity ``x`` that the sensor measured ``delay`` seconds ago.
    ``quantity`` is its unit and the largest drift, cycle, ramp and slip.
    """

    quantity: ClassVar[tuple[str, float]] = ("1", 1.0)
    effects: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("drift", "drift_time"),
        ("cycle_sine", "cycle_cosine", "cycle_time"),
        ("ramp", "ramp_at", "ramp_over"),
        ("delay",),
        ("bow",),
        ("wave",),
        ("slip", "slip_at"),
    )

    drift: float = effect("{}/s", -1.0, 1.0, "at the start")
    drift_time: float = assumed(1e4, "s", 1.0, 1e4, "time in which the drift settles")
    cycle_sine: float = effect("{}", -1.0, 1.0, "sine amplitude of a periodic drift, as by heating")
    cycle_cosine: float = effect("{}", -1.0, 1.0, "cosine amplitude of that drift, 0 at the start")
    cycle_time: float = assumed(300.0, "s", 10.0, 1e5, "period of that drift")
    ramp: float = effect("{}", -1.0, 1.0, "drift that ends")
    ramp_at: float = assumed(0.0, "s", 0.0, 1e6, "its middle")
    ramp_over: float = assumed(60.0, "s", 1.0, 1e6, "its duration")
    delay: float = effect("s", 0.0, 0.14, "of the reading")
    bow: float = effect("1", -0.5, 0.5, "parabola over full scale")
    wave: float = effect("1", -0.5, 0.5, "S-shaped deviation over full scale")
    slip: float = effect("{}", -1.0, 1.0, "step of a clamp")
    slip_at: float = assumed(0.0, "s", 0.0, 1e6, "time of the slip")


@dataclass(frozen=True)
class PositionSensor(SensorEffects):
    """Displacement sensor on the free end; the full scale is a contraction of 15 %."""

    quantity: ClassVar[tuple[str, float]] = ("m", 0.02)

    noise: float = assumed(3e-5, "m", 0.0, 1e-2, "0.03 mm RMS; 0.02-0.05 mm seen", neutral=0.0)
    resolution: float = assumed(1e-5, "m", 0.0, 1e-3, "0.049 mm on one public rig", neutral=0.0)
    bias: float = effect("m", -0.05, 0.05, "zeroed at rest")


@dataclass(frozen=True)
class PressureSensor(SensorEffects):
    """Gauge pressure sensor at the muscle; the full scale is the regulator's."""

    quantity: ClassVar[tuple[str, float]] = ("Pa", 1e5)

    noise: float = assumed(800.0, "Pa", 0.0, 1e5, "RMS; 0.4-8 kPa on public rigs", neutral=0.0)
    resolution: float = assumed(450.0, "Pa", 0.0, 1e5, "0.45 kPa on one public rig", neutral=0.0)
    bias: float = effect("Pa", -1e5, 1e5, "zeroed at rest")


@dataclass(frozen=True)
class JointEncoder(SensorEffects):
    """Angle at a joint."""

    quantity: ClassVar[tuple[str, float]] = ("rad", 0.2)

    noise: float = assumed(5e-4, "rad", 0.0, 0.2, "0.03 degrees RMS, order seen", neutral=0.0)
    resolution: float = assumed(1.534e-3, "rad", 0.0, 0.1, "encoder of 4096 steps", neutral=0.0)
    bias: float = effect("rad", -0.5, 0.5, "zeroed when straight")


@dataclass(frozen=True)
class TensionSensor(SensorEffects):
    """Load cell in series with the muscle (Omega LC201-300)."""

    quantity: ClassVar[tuple[str, float]] = ("N", 50.0)

    noise: float = assumed(0.9, "N", 0.0, 100.0, _SEEN, neutral=0.0)
    resolution: float = assumed(0.68, "N", 0.0, 50.0, _SEEN, neutral=0.0)
    bias: float = effect("N", -200.0, 200.0, _NONE)


@dataclass(frozen=True)
class AngleSensor(SensorEffects):
    """Potentiometer at a joint."""

    quantity: ClassVar[tuple[str, float]] = ("rad", 0.2)

    noise: float = assumed(0.0017, "rad", 0.0, 0.2, _SEEN, neutral=0.0)
    resolution: float = assumed(0.0008, "rad", 0.0, 0.1, _SEEN, neutral=0.0)
    bias: float = effect("rad", -0.5, 0.5, _NONE)


@dataclass(frozen=True)
class GaugeSensor(SensorEffects):
    """Pressure at the muscle."""

    quantity: ClassVar[tuple[str, float]] = ("Pa", 1e5)

    noise: float = assumed(380.0, "Pa", 0.0, 1e5, _SEEN, neutral=0.0)
    resolution: float = assumed(770.0, "Pa", 0.0, 1e5, _SEEN, neutral=0.0)
    bias: float = effect("Pa", -1e5, 1e5, _NONE)


@dataclass(frozen=True)
class HeelSensor(SensorEffects):
    """Mean of the load cells at the heel."""

    quantity: ClassVar[tuple[str, float]] = ("kg", 10.0)

    noise: float = assumed(0.2, "kg", 0.0, 20.0, _SEEN, neutral=0.0)
    resolution: float = effect("kg", 0.0, 5.0, _SEEN)
    bias: float = effect("kg", -10.0, 10.0, _NONE)


@dataclass(frozen=True)
class GroundSensor(SensorEffects):
    """Vertical ground force, the sum of the shoe's load cells."""

    quantity: ClassVar[tuple[str, float]] = ("N", 200.0)

    noise: float = assumed(5.0, "N", 0.0, 200.0, _SEEN, neutral=0.0)
    resolution: float = effect("N", 0.0, 50.0, _SEEN)
    bias: float = effect("N", -200.0, 200.0, _NONE)


@dataclass(frozen=True)
class CopSensor(SensorEffects):
    """Centre of pressure ahead of the ankle, from the shoe's load cells."""

    quantity: ClassVar[tuple[str, float]] = ("m", 0.1)

    noise: float = assumed(0.002, "m", 0.0, 0.1, _SEEN, neutral=0.0)
    resolution: float = effect("m", 0.0, 0.05, _SEEN)
    bias: float = effect("m", -0.1, 0.1, _NONE)


SENSOR = parameter_rows(SensorEffects)
"""Rows of a sensor's effects, from its first."""


@kernel
def bowed(x: float, bow: float, wave: float, full: float) -> float:
    """Return the reading of a quantity on a curved scale, exact at 0 and at full scale."""
    u = x / full
    return x + (bow + wave * (2.0 * u - 1.0)) * x * (u - 1.0)


@kernel
def drift_of(time: float, rate: float, span: float) -> float:
    """Return a drift that begins at a rate and settles within a span [s]."""
    return rate * span * (1.0 - decay(min(40.0, time / span)))


@kernel
def cycle_of(time: float, sine: float, cosine: float, period: float) -> float:
    """Return a periodic drift, zero at the start."""
    turns = time / period
    return sine * sine_of_turns(turns) + cosine * (sine_of_turns(turns + 0.25) - 1.0)


@kernel
def ramp_of(time: float, middle: float, over: float) -> float:
    """Return a smooth rise from 0 to 1 about a middle [s]."""
    s = max(0.0, min(1.0, (time - middle) / over + 0.5))
    return s * s * (3.0 - 2.0 * s)


@kernel
def delayed_reading(
    rows: Any, fixed: Any, j: int, ring: int, effects: int, step: int, period: float
) -> float:
    """Return the quantity that the sensor of one lane measured its delay ago."""
    age = fixed[effects + SENSOR.delay][j] / period
    whole = min(int(age), N_HISTORY - 2)
    newer = noted(rows, ring, j, step, whole)
    older = noted(rows, ring, j, step, whole + 1)
    return newer + (age - whole) * (older - newer)


@kernel
def ramp_and_slip(fixed: Any, j: int, effects: int, time: float) -> tuple[float, float]:
    """Return ramp and slip of the reading of one lane at a time [s]."""
    slipped = max(0.0, min(1.0, (time - fixed[effects + SENSOR.slip_at][j]) / SLIDE + 0.5))
    ramp = fixed[effects + SENSOR.ramp][j] * ramp_of(
        time, fixed[effects + SENSOR.ramp_at][j], fixed[effects + SENSOR.ramp_over][j]
    )
    return ramp, fixed[effects + SENSOR.slip][j] * slipped


@routine
def sense(
    rows: Any, fixed: Any, reading: int, ring: int, effects: int, value: Any, full: Any, step: Any,
    period: float,
) -> None:  # fmt: skip
    """Write the readings of a tile, without bias, noise and quantisation.

    ``ring`` is the first of ``N_HISTORY`` rows of the measured quantity, ``effects`` the first row
    of the sensor's effects (``SENSOR``). ``value`` is the quantity, ``full`` the full scale and
    ``step`` the number of control periods before this one, rows; ``period`` is in seconds.
    """
    shown = rows[reading]
    for j in range(LANES):
        note(rows, ring, j, step[j] + 1, value[j])
        shown[j] = value[j]
    if count_on(fixed[effects + SENSOR.delay], 0.0) > 0:
        for j in range(LANES):
            shown[j] = delayed_reading(rows, fixed, j, ring, effects, step[j] + 1, period)
    bows = count_on(fixed[effects + SENSOR.bow], 0.0)
    if bows + count_on(fixed[effects + SENSOR.wave], 0.0) > 0:
        for j in range(LANES):
            bow, wave = fixed[effects + SENSOR.bow][j], fixed[effects + SENSOR.wave][j]
            shown[j] = bowed(shown[j], bow, wave, full[j])
    if count_on(fixed[effects + SENSOR.drift], 0.0) > 0:
        for j in range(LANES):
            shown[j] = shown[j] + drift_of(
                (step[j] + 1) * period,
                fixed[effects + SENSOR.drift][j],
                fixed[effects + SENSOR.drift_time][j],
            )
    cycles = count_on(fixed[effects + SENSOR.cycle_sine], 0.0)
    if cycles + count_on(fixed[effects + SENSOR.cycle_cosine], 0.0) > 0:
        for j in range(LANES):
            shown[j] = shown[j] + cycle_of(
                (step[j] + 1) * period,
                fixed[effects + SENSOR.cycle_sine][j],
                fixed[effects + SENSOR.cycle_cosine][j],
                fixed[effects + SENSOR.cycle_time][j],
            )
    moves = count_on(fixed[effects + SENSOR.ramp], 0.0) + count_on(
        fixed[effects + SENSOR.slip], 0.0
    )
    if moves > 0:
        for j in range(LANES):
            ramp, slip = ramp_and_slip(fixed, j, effects, (step[j] + 1) * period)
            shown[j] = shown[j] + ramp + slip


@kernel
def begin_sensor(
    rows: Any, fixed: Any, j: int, reading: int, ring: int, effects: int, value: float, full: float
) -> None:
    """Begin the sensor of one lane at a quantity that has been constant (see :func:`sense`)."""
    fill_ring(rows, ring, j, value)
    ramp, slip = ramp_and_slip(fixed, j, effects, 0.0)
    bow, wave = fixed[effects + SENSOR.bow][j], fixed[effects + SENSOR.wave][j]
    rows[reading][j] = bowed(value, bow, wave, full) + ramp + slip
