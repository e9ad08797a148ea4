"""``PAM/MusclePositioning-v0``: position a hanging load with one pneumatic muscle.

A Festo MAS-10-N-100 lifts a load. The action is the setpoint of its pressure regulator, which has a
dead time, a rate limit and a lag; the task is to make the contraction follow a reference. The
muscle has hysteresis, friction driven by its length: at the same pressure, the contractions during
inflation and deflation differ by up to 3.3 mm on a stroke of 15 mm.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | contraction, sensed | m | -0.01 .. 0.02 |
| 1 | pressure, sensed | Pa | 0 .. 6e5 |
| 2 | set_point, of the last period | Pa | 0 .. 6e5 |
| 3 | load, as declared at the start | kg | 0 .. 5 |
| 4 | reference, now | m | -0.01 .. 0.02 |
| 5.. | reference_1 .., ``preview_stride`` periods apart | m | -0.01 .. 0.02 |

Action: pressure_set_point, 0 .. 6e5 Pa over [-1, 1].

Reward: ``-|output - reference| / 1 mm - 0.2 |change of setpoint| / 6 bar`` each control period.

Start: at rest under a random pressure, reached from a random higher one (``start="rest"``: at zero
pressure, never inflated). End: truncated after ``episode_seconds``; terminated when the contraction
leaves -10 .. 20 mm. Soft limits are reported in ``cost/*``.

Arguments: :func:`make_setup`, and those of every environment
(:class:`~pam_envs.envs.core.arguments.Common`). Versions: v0, the first.
"""

from functools import lru_cache, partial
from typing import Any

from pam_envs.envs.core.arguments import Common, Randomization, environment_arguments, environments
from pam_envs.envs.core.setup import Setup, check_choice, check_number, compose, masses_of
from pam_envs.envs.positioning.kernels import kernels_for
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.references.trajectory import FAMILIES, sines_needed
from pam_envs.tasks.tracking import Tracking

LOADS = (0.0, 2.55, 4.55)
REFERENCE_RANGE = (0.001, 0.013)
"""Range of references [m]: within reach at every measured load."""
HIGHEST_LOAD = 5.0
"""Highest load [kg] of the shipped muscle; that of another plant is the one that it declares."""
RANDOMIZATION = Randomization(
    R.NAMES,
    ("mass.load", "regulator.max_pressure", "muscle.diameter", "muscle.braid_angle"),
    "{'mass.damping': (100, 500)}",
    lowest=("mass.moving_mass", "muscle.braid_strain", "muscle.rest_length"),
    highest=("mass.damping", "muscle.stiffness", "muscle.hardening", "muscle.braid_force"),
)


default_plant = lru_cache(maxsize=8)(SingleMuscle.mas10)


@environment_arguments(reference="steps", preview=5, preview_stride=4, episode_seconds=10.0)
def make_setup(
    given: Common, load: Any = 2.55, load_disturbance: float = 0.0, start: str = "random"
) -> Setup:
    """Return the checked configuration of ``PAM/MusclePositioning-v0``.

    Parameters
    ----------
    given : Common
        Plant: a ``SingleMuscle``, by default the identified MAS-10-N-100, with each hysteresis
        model identified on the same data. Reference: "steps", "ramps", "sines", "multisine",
        "staircase", "mixed", or samples [m]. Reward:
        :class:`~pam_envs.tasks.tracking.Tracking`.
    load : float, sequence of float or None
        Load [kg]; of several, each episode draws one; None means 0, 2.55 and 4.55.
    load_disturbance : float
        Step of the load [kg], up or down, at an unannounced time.
    start : {"random", "rest"}
        Random pressure history, or never inflated.
    """
    made = given.plant_of(SingleMuscle, default_plant)
    most = max(HIGHEST_LOAD, made.mass.load)
    loads = masses_of("load", load, most, LOADS)
    family, samples = given.reference_of(FAMILIES, "m", 0.2)
    check_choice("start", start, ("random", "rest"))
    task, full = given.task_of(Tracking), made.regulator.max_pressure
    config = {
        **vars(task),
        "reference_low": REFERENCE_RANGE[0],
        "reference_high": REFERENCE_RANGE[1],
        "start_share": 0.9 if start == "random" else 0.0,
        "load_change": check_number("load_disturbance", load_disturbance, 0.0, most, "kg"),
    }
    position = ("m", task.lowest_contraction, task.highest_contraction)
    pressure = ("Pa", 0.0, full)
    return compose(
        made,
        partial(kernels_for, made.hysteresis.kind),
        given,
        RANDOMIZATION,
        observation=[
            ("contraction", *position),
            ("pressure", *pressure),
            ("set_point", *pressure),
            ("load", "kg", 0.0, most),
        ],
        references=[("reference", *position)],
        action=[("pressure_set_point", *pressure)],
        config=config,
        choices={"loads": loads.size},
        reference=family,
        sines=sines_needed(family),
        own=loads,
        samples=samples,
        view="pam_envs.envs.positioning.view:VIEW",
    )


MusclePositioningEnv, MusclePositioningVectorEnv = environments("MusclePositioning", make_setup)
