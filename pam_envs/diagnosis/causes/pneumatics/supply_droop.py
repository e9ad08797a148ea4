"""Supply droop: the reservoir empties faster than it is filled.

The pressure of a small reservoir or a long feed falls as air is used and recovers slowly. High
commands are then missed or reached late, increasingly so after heavy use; below the supply pressure
there is no effect. In the plant filling passes a throat from a supply that falls with the filled
amount and recovers through an orifice. A regulator whose output depends on its supply lowers every
setpoint instead, in proportion to the drop.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.fit.starting_values import grid

_SUPPLIES, _DROOPS = (5.6e5, 6.1e5, 6.4e5, 6.8e5, 7.2e5), (0.1, 0.4)
_TIMES, _RECOVERIES = (0.02, 0.06, 0.2), (2.0, 6.0)
_EFFECTS, _LOSSES, _RETURNS = (0.1,), (0.03, 0.3), (30.0, 100.0, 300.0)
"""Effect of the drop on a setpoint; the drop is small beside a supply without a limit, so that it
recovers in a fraction of the time in which the empty reservoir would be filled."""

CAUSE = Cause(
    name="supply_droop",
    title="the droop of the supply",
    forms=(
        Form(
            "reservoir",
            (
                Term("regulator.supply_pressure", (6.5e5,), low=3e5, high=2e6, log=True),
                Term("regulator.supply_droop", (0.2,), scale=0.05, amount=False),
                Term("regulator.supply_time", (0.05,), log=True, amount=False),
                Term("regulator.supply_recovery", (4.0,), log=True, amount=False),
            ),
            search=grid(_SUPPLIES, _DROOPS, _TIMES, _RECOVERIES),
        ),
        Form(
            "regulator",
            (
                Term("regulator.supply_effect", (0.1,), scale=0.05),
                Term("regulator.supply_droop", (0.1,), scale=0.05, amount=False),
                Term("regulator.supply_recovery", (100.0,), log=True, amount=False),
            ),
            search=grid(_EFFECTS, _LOSSES, _RETURNS),
        ),
    ),
    signature=(
        "peaks of the pressure are clipped or late, or high pressures too low, more so after heavy "
        "use; deflation fits"
    ),
    neighbours=("slew_limit", "exhaust_asymmetry"),
    experiment=(
        "Fill to the top again and again, then once after a rest: a droop grows with the number of "
        "fillings and vanishes after the rest, a limited rate is the same every time."
    ),
    source="A public record of a DMSP-10-250: peaks fall from 5.65 to 5.11 bar in four cycles.",
    sensor="a pressure sensor before the valve",
    compensable=True,
)
