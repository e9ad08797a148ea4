"""Slew limit: the flow of the valve limits the rate of the pressure.

A fully open valve passes a limited flow, so that large steps follow a straight ramp before they
round off. Small steps do not reach the limit and follow the lag alone. The flow through the
orifices of supply and exhaust limits the rate to one that depends on the pressure. Rates of
filling and exhaust that differ by more than 2.5 times are an asymmetry of the exhaust.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="slew_limit",
    title="the limited rate of the regulator",
    forms=(
        Form(
            "limit",
            (
                Term("regulator.slew_rate", (3e5, 1e6, 3e6, 8e6), low=5e4, high=1e8, log=True),
                Term("regulator.slew_bend", (0.5,), scale=0.5, amount=False),
                Term("regulator.slew_ratio", (1.0,), low=0.4, high=2.5, log=True, amount=False),
            ),
        ),
        Form(
            "orifices",
            (
                Term("regulator.supply_pressure", (7e5,), low=5e5, high=1.5e6, log=True),
                Term("regulator.supply_time", (0.1, 0.4), log=True, amount=False),
                Term("regulator.exhaust_rate", (8.0, 3.0), low=0.2, high=99.0, log=True),
            ),
        ),
    ),
    signature="a triangle after each large step: the time to 63 % grows with the size of the step",
    neighbours=("dead_time", "supply_droop", "exhaust_asymmetry"),
    experiment=(
        "Steps of three sizes, up and down: a limited rate delays in proportion to the step, every "
        "time; a drooping supply is slower near the top and after heavy use, an exhaust only "
        "downwards."
    ),
    source="A public record of a DMSP-10-250: 6.8 bar/s in a raw step; ISO 6358 for the flow.",
    sensor="a fast pressure sensor at the muscle",
    compensable=True,
    common=True,
    by_nature=True,
)
