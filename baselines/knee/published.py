"""Printed tension plant and controller of the orthosis paper, and the plant behind the controller.

yeh2010, Eqs. 10 and 11, and section 4.2. Both transfer functions are between kPa and N, about 2
bar, 22 cm and 158 N.

The controller (11) is not a design on the plant (10): loop transfer recovery places zeros of the
controller on the poles of the plant, and those of (11) are elsewhere. Conversely, its zeros are the
poles of another fit of the same muscle, here called the *inferred plant*. Four unknowns of that
plant and its design (gain, one zero, bandwidth and control weight) reproduce the nine remaining
coefficients (:func:`refit_controller`).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from baselines.linear.bumpless import BumplessGains
from baselines.linear.ltr import LtrDesign, design_ltr
from baselines.linear.systems import StateSpace, from_polynomials, from_roots, state_space
from pam_envs.arrays import Array

NOMINAL_PRESSURE = 2e5
"""Operating pressure [Pa] (yeh2010, section 4.1)."""

CONTROLLER_NUMERATOR = (
    6.418e4, 6.679e6, 2.892e8, 6.714e9, 8.96e10, 6.816e11, 2.713e12, 4.343e12,
)  # fmt: skip
CONTROLLER_DENOMINATOR = (
    1.0, 215.7, 2.038e4, 1.138e6, 4.213e7, 1.054e9, 1.623e10, 1.304e11, 3.948e11, 0.0,
)  # fmt: skip
"""Equation (11), highest power first [kPa/N]."""

BUMPLESS_STATE_GAIN = (
    -4.7554e-6, -1.8426e-4, -0.0028, -0.0221, -0.0977, -0.2285, -0.2198,
)  # fmt: skip
BUMPLESS_DIRECT_GAIN = -1.4758
"""Printed ``K`` and ``L`` of the bumpless compensator, section 4.2."""

CANCELLED_POLES = (-19.94664586, -15.06844573, -7.00013042)
"""Real poles [rad/s] of (11), taken as zeros of the inferred plant."""


def printed_plant_polynomials() -> tuple[Array, Array]:
    """Return numerator and denominator of (10), highest power first [N/kPa]."""
    top = 572.157 * np.polymul([1.0, 17.45, 75.79], [1.0, 7.39, 13.41])
    low = np.array([1.0, 12.33])
    for factor in ([1.0, 17.97, 78.51], [1.0, 13.78, 47.43], [1.0, 8.11, 17.12]):
        low = np.polymul(low, factor)
    return np.asarray(top, float), np.asarray(low, float)


def printed_plant() -> StateSpace:
    """Return (10): from pressure [kPa] to tension [N]."""
    return from_polynomials(*printed_plant_polynomials())


def printed_controller() -> StateSpace:
    """Return (11): from reference less tension [N] to pressure [kPa]."""
    return from_polynomials(CONTROLLER_NUMERATOR, CONTROLLER_DENOMINATOR)


def printed_bumpless() -> tuple[StateSpace, BumplessGains]:
    """Return (10) in companion form, and the printed compensator's gains in its coordinates."""
    top, low = printed_plant_polynomials()
    n = len(low) - 1
    a = np.vstack([-low[1:], np.eye(n - 1, n)])
    c = np.concatenate([np.zeros(n - len(top)), top])
    gains = BumplessGains(np.array(BUMPLESS_STATE_GAIN), BUMPLESS_DIRECT_GAIN)
    return state_space(a, np.eye(n)[0], c), gains


@dataclass(frozen=True)
class Refit:
    """Design of the inferred plant, its fourth zero [rad/s], and the largest relative error."""

    design: LtrDesign
    fourth_zero: float
    largest_error: float


def refit_controller(bandwidth: float | None = None) -> Refit:
    """Return the plant and the design that reproduce the printed controller.

    ``bandwidth`` is ``1/sqrt(mu)`` [rad/s], free if not given.
    """
    start = [0.0, 0.0, 0.0] if bandwidth else [0.0, 0.0, 0.0, 0.0]

    def residual(q: Array) -> Array:
        return np.log(_coefficients(_design(q, bandwidth)) / _printed_coefficients())

    found = least_squares(residual, start, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return Refit(
        _design(found.x, bandwidth),
        _fourth_zero(found.x),
        float(np.max(np.abs(np.expm1(found.fun)))),
    )


def _fourth_zero(unknowns: Array) -> float:
    return -70.0 * float(np.exp(unknowns[1]))


def _design(unknowns: Array, bandwidth: float | None) -> LtrDesign:
    """Return the design for logarithms of gain, zero, control weight and bandwidth over guesses."""
    poles = np.roots(CONTROLLER_NUMERATOR)
    zeros = [*CANCELLED_POLES, _fourth_zero(unknowns)]
    gain = 0.79 * float(np.exp(unknowns[0]))
    wide = bandwidth or 62.0 * float(np.exp(unknowns[3]))
    plant = from_roots(zeros, poles, gain)
    return design_ltr(plant, wide, 1e-6 * float(np.exp(unknowns[2])))


def _coefficients(design: LtrDesign) -> Array:
    """Return the leading coefficient of the numerator and eight of the denominator."""
    controller = design.controller
    lead = (controller.C @ controller.A @ controller.B)[0]  # relative degree 2: C B = 0
    poles = controller.poles()
    moving = poles[np.argsort(np.abs(poles))][1:]
    return np.concatenate([lead, np.poly(moving).real[1:]])


def _printed_coefficients() -> Array:
    return np.array([CONTROLLER_NUMERATOR[0], *CONTROLLER_DENOMINATOR[1:-1]])
