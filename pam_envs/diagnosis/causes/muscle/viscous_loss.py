"""Viscous loss: a drag that is not in proportion to speed, or grows with the pressure.

Rubber under shear and grease between strands resist motion with a power of the speed below one. The
plant has an additional damping that decreases with speed from its value at rest, so that it acts on
slow motion and leaves fast motion to the damping of the base. A stretched bladder is pressed on its
braid: the damping of a muscle grows with its pressure, and is smaller in relaxation.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="viscous_loss",
    title="viscous loss in the muscle",
    forms=(
        Form(
            "thinning",
            (
                Term("muscle.viscosity", (300.0, 600.0, 1500.0), scale=300.0),
                Term("muscle.viscosity_speed", (0.003, 1e-3, 3e-4), log=True, amount=False),
            ),
        ),
        Form(
            "pressed",
            (
                Term("muscle.viscosity_per_pressure", (1e-3, 3e-3), scale=1e-3),
                Term("muscle.viscosity_relaxing", (1.0,), scale=0.5, amount=False),
            ),
        ),
    ),
    signature="an error with the sign of the velocity that grows with speed and vanishes in a hold",
    neighbours=("stick_slip", "hysteresis_drive", "sensor_delay", "creep", "resonance"),
    experiment=(
        "A sine at 0.2, 0.5, 1 and 2 Hz, and ramps at two rates: the part of the loop due to "
        "viscous loss shrinks as the rate decreases, the part due to friction does not; in a hold "
        "only friction is left."
    ),
    source=(
        "reynolds2003: the damping of a large muscle grows with its pressure, and is smaller in "
        "relaxation; other sizes are assumed."
    ),
    needs=("contraction",),
    sensor="a load cell between muscle and load",
    compensable=True,
    lawlike=True,  # the lag of the motion is the damping over the stiffness of the law
)
