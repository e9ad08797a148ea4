"""Creep: the muscle continues to move after the pressure has settled.

Rubber and braid are viscoelastic, so that part of the response follows over seconds and minutes,
nearly along the logarithm of time, and is recovered as slowly. Four Kelvin-Voigt elements with
fixed time constants from 0.4 to 90 s approximate any such law. Either the effective pressure
creeps, and with it the force, or the length, as in a fitting or a coating.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

_ELEMENTS = (1, 2, 3, 4)

CAUSE = Cause(
    name="creep",
    title="creep of the muscle",
    forms=(
        Form(
            "pressure",
            tuple(Term(f"hysteresis.creep_{k}", (0.01,), low=-0.02, scale=0.01) for k in _ELEMENTS),
        ),
        Form(
            "length",
            tuple(Term(f"muscle.creep_{k}", (0.01,), low=-0.02, scale=0.01) for k in _ELEMENTS),
        ),
    ),
    signature="in holds at constant pressure the contraction continues with the logarithm of time",
    neighbours=(
        "leak",
        "sensor_bias",
        "sensor_drift",
        "slip_step",
        "viscous_loss",
        "temperature",
        "first_cycle_softening",
        "exhaust_asymmetry",
    ),
    experiment=(
        "Hold one pressure for a minute, reached from below and from above: creep changes its sign "
        "with the direction and restarts with every step; a leak, a drift and heat do not."
    ),
    source=(
        "A public record of a DMSP-10-250: 20 % of the stroke within 4 s of a step to 2.1 bar; a "
        "jig at a fixed angle: 26 % of the force in 48 s (10 mm), 20 % in 19 s (20 mm)."
    ),
    needs=("contraction",),
    sensor="a load cell at a blocked length, beside the pressure",
    compensable=True,
)
