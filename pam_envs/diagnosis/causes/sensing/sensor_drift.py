"""Sensor drift: a reading changes slowly with time.

Electronics warm up, a clamp or a coating settles, a bridge amplifier follows the room temperature.
The error depends on time alone, not on the muscle: it settles exponentially, or changes between two
moments and then is constant.
"""

from __future__ import annotations

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.starting_values import pressure_ramp_starts, ramp_starts

CAUSE = Cause(
    name="sensor_drift",
    title="a drifting sensor",
    forms=(
        Form(
            "position",
            (
                Term("position.drift", (1e-6,), scale=1e-6),
                Term("position.drift_time", (60.0,), low=10.0, log=True, amount=False),
            ),
        ),
        Form(
            "ramp",
            (
                Term("position.ramp", (1e-4,), scale=1e-4),
                Term("position.ramp_at", (100.0,), scale=20.0, amount=False),
                Term("position.ramp_over", (60.0,), low=15.0, log=True, amount=False),
            ),
            search=ramp_starts,
        ),
        Form(
            "pressure",
            (
                Term("pressure.drift", (10.0,), scale=10.0),
                Term("pressure.drift_time", (1000.0,), low=10.0, log=True, amount=False),
            ),
        ),
        Form(
            "pressure ramp",
            (
                Term("pressure.ramp", (1e3,), scale=1e3),
                Term("pressure.ramp_at", (100.0,), scale=20.0, amount=False),
                Term("pressure.ramp_over", (60.0,), low=15.0, log=True, amount=False),
            ),
            search=pressure_ramp_starts,
        ),
    ),
    signature=(
        "a slow function of the time since the start, the same at rest and under pressure, on one "
        "output only"
    ),
    contains=("sensor_bias", "slip_step"),
    neighbours=(
        "sensor_bias",
        "sensor_nonlinearity",
        "slip_step",
        "creep",
        "leak",
        "temperature",
        "first_cycle_softening",
    ),
    experiment=(
        "Return to rest without pressure at the end: a drift has moved the zero, heat "
        "and softening have not; after a rest creep and softening restart, a drift continues."
    ),
    source=(
        "Assumed; the published readings of a MAS-10-N-100 (Applied Sciences 2021, 11(21), 9855, "
        "Table 3) rise by 0.03 mm a repeat at no load."
    ),
    sensor="a second position sensor of another kind",
    # not compensable: the loop follows the reading
)
