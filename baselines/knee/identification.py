"""Frequency-response tests of a nominal knee orthosis (yeh2010, section 4.1).

The setpoint oscillates about 2 bar, one sine per run, and tension or angle is measured. The
mounting of the orthosis in the test is part of the identified plant:

- tension of the brace alone: free to move, as in the paper;
- tension in a rig or on a leg: at the nominal length, as held by a leg that bears weight;
- angle on a leg: with the inertia, damping and hold of a hanging leg.

The regulator has its lag alone: a rational function is no model of dead time and rate limit.

All of the paper's tests are without a leg: its angle controller would face 25 times the inertia of
its design.
"""

import dataclasses
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.identification.frequency import RationalFit, fit_rational
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.knee_orthosis.rollout import simulate_knee

Output = Literal["tension", "angle"]

CENTRE = 2e5
"""Mean pressure [Pa] of the sines."""
AMPLITUDE = 0.5e5
"""Amplitude [Pa]; a smaller one is attenuated by the muscle's friction."""
FREQUENCIES = np.geomspace(0.5, 60.0, 24)
"""[rad/s]."""
SETTLING, MEASURED = 4.0, 26.0
"""Settling and measurement time [s], rounded to whole periods of each sine."""
ORDERS: dict[tuple[str, str, str], tuple[int, int]] = {
    ("no_load", "tension", "lag"): (3, 2),
    ("rig", "tension", "lag"): (1, 1),
    ("no_load", "angle", "lag"): (3, 3),
    ("no_load", "tension", "measured"): (3, 3),
    ("rig", "tension", "measured"): (5, 3),
    ("no_load", "angle", "measured"): (6, 5),
}
"""Order and relative degree of the fit, by mounting in the test, output and dynamics."""


def tested(plant: KneeOrthosis, output: Output) -> KneeOrthosis:
    """Return the orthosis as mounted in the test of an output; see the module."""
    quiet = plant.without_noise().with_lag_alone()
    if output == "tension":
        free = plant.mounting == "no_load"
        return dataclasses.replace(quiet, mounting="no_load" if free else "rig")
    if plant.mounting != "leg":
        return dataclasses.replace(quiet, mounting="no_load")
    leg, lever = plant.leg, plant.lever
    held = leg.stiffness + leg.hold_stiffness + leg.mass * leg.centre * GRAVITY
    angle = float(lever.angle(plant.fixture.length))
    stiffness = lever.stiffness + held
    hanging = quiet.replace(
        {
            "lever.inertia": leg.inertia,  # the inertia of the brace is 4 % of it
            "lever.damping": lever.damping + leg.damping + leg.hold_damping,
            "lever.stiffness": stiffness,
            "lever.relaxed_angle": angle
            + lever.stiffness * (lever.relaxed_angle - angle) / stiffness,
        }
    )
    return dataclasses.replace(hanging, mounting="no_load")


def frequency_response(
    plant: KneeOrthosis, output: Output, frequencies: Array = FREQUENCIES
) -> NDArray[np.complex128]:
    """Return the response from pressure setpoint [kPa] to an output, one sine per run.

    Parameters
    ----------
    plant : KneeOrthosis
        As mounted in the test.
    output : {"tension", "angle"}
        [N] or [rad].
    frequencies : ndarray, shape (m,)
        Angular frequencies [rad/s].

    Returns
    -------
    ndarray of complex, shape (m,)
        Response of the first harmonic, without the hold of the control period.
    """
    h = plant.control_period
    time = h * np.arange(round((SETTLING + MEASURED) / h), dtype=float)
    swing = AMPLITUDE * np.sin(np.multiply.outer(time, frequencies))
    record = simulate_knee(plant, CENTRE + swing, pressure=CENTRE)[output]
    found = [
        _harmonic(time + h, record[:, k], w) / _harmonic(time, swing[:, k], w)
        for k, w in enumerate(frequencies)
    ]
    hold = (1.0 - np.exp(-1j * frequencies * h)) / (1j * frequencies * h)
    return np.asarray(1e3 * np.array(found) / hold)


def _harmonic(time: Array, signal: Array, w: float) -> complex:
    """Return the first harmonic over the whole periods measured."""
    period = 2.0 * np.pi / w
    start = time[-1] - np.floor((time[-1] - time[0] - SETTLING) / period) * period
    kept = time > start
    columns = np.exp(1j * w * time[kept])
    basis = np.stack([columns.real, columns.imag, np.ones(kept.sum()), time[kept]], axis=1)
    a, b, _, _ = np.linalg.lstsq(basis, signal[kept], rcond=None)[0]
    return complex(a, -b)


_FITS: dict[tuple[str, str], RationalFit] = {}


def identify(plant: KneeOrthosis, output: Output) -> RationalFit:
    """Return the transfer function from setpoint [kPa] to tension [N] or angle [rad].

    Cached by plant.
    """
    test = tested(plant, output)
    key = (test.digest(), output)
    if key not in _FITS:
        order, degree = ORDERS[test.mounting, output, test.dynamics]
        _FITS[key] = fit_rational(FREQUENCIES, frequency_response(test, output), order, degree)
    return _FITS[key]
