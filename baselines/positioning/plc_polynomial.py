"""positioning2021's own controller: six cubics in a programmable logic controller (Equations 7 to 12).

Two versions, to be kept apart:

- *as printed*: the published coefficients, digit by digit. Some were cut short in print (0.00399
  became 0.003 in Equation 11), so that at 4.55 kg the pressure is up to 2.6 bar wrong.
- *refitted*: the same cubics through the same seven points of Table 6 in full precision, with the
  one wrong entry of that table (4.55 kg, inflation, 2 mm) replaced by what Table 5 says.
"""

from __future__ import annotations

from baselines.positioning.contraction_tables import (
    one_cubic_inverse,
    published_inverse,
    table_6_inverse,
)
from baselines.positioning.table_inverse import TwoBranch, make_two_branch
from pam_envs.parameters import Signals


def make_plc_as_printed(signals: Signals, action_signals: Signals) -> TwoBranch:
    """Return the controller with the coefficients as printed."""
    return make_two_branch(published_inverse(), signals, action_signals)


def make_plc_refitted(signals: Signals, action_signals: Signals) -> TwoBranch:
    """Return the controller with the cubics refitted at full precision."""
    return make_two_branch(table_6_inverse(), signals, action_signals)


def make_one_cubic(signals: Signals, action_signals: Signals) -> TwoBranch:
    """Return the controller with one cubic a load for both branches: hysteresis ignored."""
    return make_two_branch(one_cubic_inverse(), signals, action_signals)
