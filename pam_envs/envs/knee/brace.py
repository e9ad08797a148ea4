"""``PAM/KneeTension-v0`` and ``PAM/KneeStiffness-v0``: the brace of the orthosis without a wearer.

A pneumatic muscle works against the zig-zag spring of a knee brace. The action is the setpoint of
its pressure. In ``KneeTension`` its tension has to follow a reference ("no load", yeh2010,
section 5.1), in ``KneeStiffness`` its stiffness ``T / (L - L_min)`` (section 3). The stiffness
follows the pressure with hysteresis: it differs between inflation and deflation.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | tension, sensed | N | 0 .. 400 |
| 1 | stiffness, from the sensed tension and angle | N/m | 0 .. 1e4 |
| 2 | angle of the brace, sensed | rad | 1 .. 3.1 |
| 3 | pressure, sensed | Pa | 0 .. 4.5e5 |
| 4 | set_point, of the last period | Pa | 0 .. 4.5e5 |
| 5 | reference, now | N or N/m | that of the output |
| 6.. | reference_1 .., ``preview_stride`` periods apart | N or N/m | that of the output |

Action: pressure_set_point, 0 .. 4.5e5 Pa over [-1, 1].

Reward: ``-|output - reference| / (2 % of the reference's half-range) - 0.2 |change of setpoint| /
4.5 bar`` each control period.

Start: at rest under a random pressure (``start="paper"``: at about 55 N). End:
truncated after ``episode_seconds``; terminated when the tension exceeds 600 N.

Arguments: :func:`make_setup`, and those of every environment
(:class:`~pam_envs.envs.core.arguments.Common`). Versions: v0, the first.
"""

from functools import lru_cache, partial

from pam_envs.envs.core.arguments import Common, Randomization, environment_arguments, environments
from pam_envs.envs.core.setup import Setup, check_choice, check_number, compose
from pam_envs.envs.knee import brace_kernels as L
from pam_envs.plants.knee_orthosis import rows as R
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.references.trajectory import FAMILIES, sines_needed
from pam_envs.tasks.gait_assistance import BraceTracking

UNITS = ("N", "N/m")
RANGES = ((0.0, 400.0), (0.0, 1e4))
"""Ranges of the signals, by quantity."""
REFERENCE_RANGES = {
    "tension": {"no_load": (80.0, 205.0), "rig": (80.0, 330.0)},
    "stiffness": {"no_load": (100.0, 7100.0), "rig": (100.0, 7100.0)},
}
"""Ranges of references, by mounting: those of yeh2010, within reach of 4.5 bar."""
PAPER_PRESSURE = 0.69e5
"""Pressure [Pa], reached by inflation, at which the tension is 55 N as in yeh2010."""
RANDOMIZATION = Randomization(
    R.NAMES,
    ("regulator.max_pressure", "lever.arm", "lever.fittings", "fixture.length"),
    "{'lever.stiffness': (25, 35)}",
)


default_plants = {
    "rig": lru_cache(maxsize=8)(KneeOrthosis.rig),
    "no_load": lru_cache(maxsize=8)(KneeOrthosis.no_load),
}


@environment_arguments(reference="sine", preview=5, preview_stride=4, episode_seconds=20.0)
def make_setup(
    given: Common, quantity: int, mounting: str, frequency: float = 0.1, start: str = "random"
) -> Setup:
    """Return the checked configuration of an environment with the brace alone.

    Parameters
    ----------
    given : Common
        Plant: a ``KneeOrthosis`` off the leg. Reference: "sine" (that of yeh2010), "steps",
        "ramps", "sines", "multisine", "staircase", "mixed", or samples. Reward:
        :class:`~pam_envs.tasks.gait_assistance.BraceTracking`.
    quantity : int
        0 for the tension, 1 for the stiffness.
    mounting : {"no_load", "rig"}
        Of the default plant: free to move, or held at the nominal length.
    frequency : float
        Frequency of the reference "sine" [Hz].
    start : {"random", "paper"}
        At rest under a random pressure, or at about 55 N.
    """
    made = given.plant_of(KneeOrthosis, default_plants[mounting], usual="pressure")
    if made.mounting == "leg":
        raise ValueError(
            "plant: this orthosis is on a leg; give KneeOrthosis.no_load() or KneeOrthosis.rig()"
        )
    unit, largest = UNITS[quantity], RANGES[quantity][1]
    family, samples = given.reference_of(FAMILIES, unit, largest, own=("sine",))
    check_choice("start", start, ("random", "paper"))
    task, full = given.task_of(BraceTracking), made.regulator.max_pressure
    low, high = REFERENCE_RANGES[L.QUANTITIES[quantity]][made.mounting]
    config = {
        **vars(task),
        "error_scale": task.error_scale * 0.5 * (high - low),
        "reference_low": low,
        "reference_high": high,
        "frequency": check_number("frequency", frequency, 1e-3, 10.0, "Hz"),
        "start_low": PAPER_PRESSURE if start == "paper" else 0.0,
        "start_high": PAPER_PRESSURE if start == "paper" else 0.9 * full,
    }
    return compose(
        made,
        partial(L.kernels_for, made.hysteresis.kind, made.mounting, made.dynamics),
        given,
        RANDOMIZATION,
        observation=[
            ("tension", "N", *RANGES[L.TENSION]),
            ("stiffness", "N/m", *RANGES[L.STIFFNESS]),
            ("angle", "rad", 1.0, 3.1),
            ("pressure", "Pa", 0.0, full),
            ("set_point", "Pa", 0.0, full),
        ],
        references=[("reference", unit, *RANGES[quantity])],
        action=[("pressure_set_point", "Pa", 0.0, full)],
        config=config,
        choices={"quantity": quantity},
        reference=family,
        sines=1 if family == L.PAPER else sines_needed(family),
        own=made.gait_table(),
        samples=samples,
        view=f"pam_envs.envs.knee.view:{L.QUANTITIES[quantity].upper()}_VIEW",
    )


KneeTensionEnv, KneeTensionVectorEnv = environments("KneeTension", make_setup, L.TENSION, "no_load")
KneeStiffnessEnv, KneeStiffnessVectorEnv = environments(
    "KneeStiffness", make_setup, L.STIFFNESS, "rig"
)
