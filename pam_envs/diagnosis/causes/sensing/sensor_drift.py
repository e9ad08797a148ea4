"""Sensor drift: a reading changes slowly with time.

Electronics warm up, a clamp or a coating settles, a bridge amplifier follows the room temperature.
The error depends on time alone, not on the muscle: it settles exponentially, or changes between two
moments and then is constant, or is periodic, as by the heating of a room, beside a steady drift. A
change within 40 s is a bias.
"""

from collections.abc import Callable

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.causes.sensing.sensor_bias import LONGEST
from pam_envs.diagnosis.fit.starting_values import Starts, changes_of

CYCLES = (200.0, 350.0)
"""Starting values of the period [s]."""
SLOW = (50.0, 150.0)
"""Starting values of the duration of a slow change [s]."""


def _settling(sensor: str, size: float, time: float) -> Form:
    end = Term(f"{sensor}.drift_time", (time,), low=LONGEST, log=True, amount=False)
    return Form(sensor, (Term(f"{sensor}.drift", (size,), scale=size), end))


def _ramp(name: str, sensor: str, size: float, search: Callable[..., Starts]) -> Form:
    start = Term(f"{sensor}.ramp_at", (100.0,), scale=20.0, amount=False)
    duration = Term(f"{sensor}.ramp_over", (60.0,), low=LONGEST, log=True, amount=False)
    return Form(name, (Term(f"{sensor}.ramp", (size,), scale=size), start, duration), search)


def _cycle(name: str, sensor: str, size: float) -> Form:
    parts = (Term(f"{sensor}.cycle_{part}", (size,), scale=size) for part in ("sine", "cosine"))
    steady = Term(f"{sensor}.drift", (0.01 * size,), scale=0.01 * size)
    return Form(
        name,
        (
            *parts,
            steady,
            Term(f"{sensor}.cycle_time", CYCLES, low=120.0, high=1500.0, log=True, amount=False),
        ),
    )


CAUSE = Cause(
    name="sensor_drift",
    title="a drifting sensor",
    forms=(
        _settling("position", 1e-6, 60.0),
        _ramp("ramp", "position", 1e-4, changes_of(0, SLOW)),
        _settling("pressure", 10.0, 1000.0),
        _ramp("pressure ramp", "pressure", 1e3, changes_of(1, SLOW)),
        _cycle("cycle", "position", 1e-4),
        _cycle("pressure cycle", "pressure", 1e3),
    ),
    signature="a slow function of time, equal at rest and under pressure, on one output only",
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
    source="Assumed; readings of positioning2021, Table 3, rise by 0.03 mm per repeat unloaded.",
    sensor="a second position sensor of another kind",
    # not compensable: the loop follows the reading
)
