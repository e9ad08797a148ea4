"""Modes of the orthosis' measured frequency response, and its plain regulator.

yeh2010 identifies the response from pressure setpoint to tension as ``G_T(s)``, Eq. (10): seven
poles, four zeros. Divided by its static gain it is the response from setpoint to pressure in the
preset "measured". In partial fractions each mode is

    x' = p (x - u),    pressure = sum_i gain_i x_i

so that a step at a held setpoint is exact for any duration, and every mode of a plant at rest is
the setpoint itself.
"""

import cmath
from dataclasses import KW_ONLY, dataclass

from pam_envs.kernels.arithmetic import decay, sine_of_turns
from pam_envs.kernels.build import kernel
from pam_envs.parameters import assumed, published
from pam_envs.pneumatics.flow import usual_conductance
from pam_envs.pneumatics.regulator import RegulatorEffects, usual_dead_time, usual_slew_rate

NUMERATOR = ((1.0, 17.45, 75.79), (1.0, 7.39, 13.41))
DENOMINATOR = ((0.0, 1.0, 12.33), (1.0, 17.97, 78.51), (1.0, 13.78, 47.43), (1.0, 8.11, 17.12))
GAIN = 572.157
"""yeh2010, Eq. (10), factor by factor; tension [N] over pressure [kPa]."""
REAL_MODES = 5
MODES = REAL_MODES + 2
"""Rows of state: five real modes, real and imaginary part of the slow pair."""


@dataclass(frozen=True)
class OrthosisRegulator(RegulatorEffects):
    """Electronic pressure valve (SMC ITV1031): dead time, limited rate, first-order lag.

    A plant with ``dynamics="measured"`` has the paper's frequency response instead.
    """

    max_pressure: float = published(4.5e5, "Pa", 1e4, 1.2e6, "yeh2010, section 5.2: of the muscle")
    dead_time: float = usual_dead_time()
    time_constant: float = assumed(
        0.0425,
        "s",
        0.002,
        2.0,
        "gives the published 2.07 % of the inverse alone, without dead time and rate limit",
        spread=(0.035, 0.1),
    )
    slew_rate: float = usual_slew_rate()
    _: KW_ONLY
    conductance: float = usual_conductance(1e-9, "fills 0.11 l of the orthosis' muscle at 7 bar/s")


def roots(factor: tuple[float, float, float]) -> tuple[complex, ...]:
    """Return the roots of ``a s^2 + b s + c`` (of ``b s + c`` where ``a = 0``)."""
    a, b, c = factor
    if a == 0.0:
        return (complex(-c / b),)
    half = cmath.sqrt(0.25 * b * b - a * c)
    return (-0.5 * b + half) / a, (-0.5 * b - half) / a


def gain_at_rest() -> float:
    """Return ``G_T(0)`` [N/kPa], 0.7398."""
    value = GAIN
    for _, _, c in NUMERATOR:
        value *= c
    for _, _, c in DENOMINATOR:
        value /= c
    return value


def modes() -> list[tuple[complex, complex]]:
    """Return pole [1/s] and gain of each mode of ``G_T(s) / G_T(0)``; of the pair, the upper one.

    The real modes come first. Their gains and twice the real part of the pair's sum to 1.
    """
    zeros = [z for factor in NUMERATOR for z in roots(factor)]
    poles = [p for factor in DENOMINATOR for p in roots(factor)]
    result = []
    for i, pole in enumerate(poles):
        if pole.imag < 0.0:
            continue
        residue = complex(GAIN / gain_at_rest())
        for zero in zeros:
            residue *= pole - zero
        for k, other in enumerate(poles):
            if k != i:
                residue /= pole - other
        result.append((pole, -residue / pole))
    return sorted(result, key=lambda mode: (mode[0].imag > 0.0, mode[0].real))


def mode_rows() -> list[float]:
    """Return the numbers of the modes that the kernel reads.

    Rates and gains of the real ones, then decay [1/s] and frequency [turns/s] of the pair, and the
    real and imaginary part of its gain, doubled.
    """
    found = modes()
    real, (pole, gain) = found[:-1], found[-1]
    rates = [-p.real for p, _ in real]
    gains = [g.real for _, g in real]
    return [
        *rates, *gains, -pole.real, pole.imag / (2.0 * cmath.pi), 2.0 * gain.real, 2.0 * gain.imag,
    ]  # fmt: skip


MODE_ROWS = 2 * REAL_MODES + 4


@kernel
def pair_factor(decay_rate: float, frequency: float, h: float) -> tuple[float, float]:
    """Return real and imaginary part of ``exp(p h)`` of the slow pair."""
    shrink = decay(decay_rate * h)
    turns = frequency * h
    return shrink * sine_of_turns(turns + 0.25), shrink * sine_of_turns(turns)


@kernel
def turned(u: float, real: float, imaginary: float, c: float, s: float) -> tuple[float, float]:
    """Return the pair's state after an interval at the setpoint ``u``; ``c + i s`` is exp(p h)."""
    a = real - u
    return u + a * c - imaginary * s, a * s + imaginary * c
