"""``PAM/KneeTension-v0`` and ``PAM/KneeStiffness-v0``: the brace of the orthosis, not worn.

A pneumatic muscle works against the zig-zag spring of a knee brace. The action is the set-point of
its pressure; in ``KneeTension`` its tension has to follow a reference ("no load", yeh2010,
section 5.1), in ``KneeStiffness`` its stiffness ``T / (L - L_min)`` (section 3). The stiffness
follows the pressure with hysteresis: inflating and deflating give different ones.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | tension, sensed | N | 0 .. 400 |
| 1 | stiffness, from tension and angle as sensed | N/m | 0 .. 1e4 |
| 2 | angle of the brace, sensed | rad | 1 .. 3.1 |
| 3 | pressure, sensed | Pa | 0 .. 4.5e5 |
| 4 | set_point, of the last period | Pa | 0 .. 4.5e5 |
| 5 | reference, now | N or N/m | that of the output |
| 6.. | reference_1 .., ``preview_stride`` periods apart | | |

Action: pressure_set_point, 0 .. 4.5e5 Pa over [-1, 1].

Reward: ``-|output - reference| / (2 % of the reference's half-range) - 0.2 |change of set-point| /
4.5 bar`` each control period.

Start: at rest under a random pressure (``start="paper"``: at about 55 N). End:
truncated after ``episode_seconds``; terminated when the tension exceeds 600 N.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from pam_envs.envs.core.arguments import (
    common,
    named_arguments,
    plant_of,
    reference_of,
    spread_of,
    task_of,
)
from pam_envs.envs.core.plant_env import PlantEnv
from pam_envs.envs.core.setup import Setup, check_choice, check_number, compose
from pam_envs.envs.core.vector_env import PlantVectorEnv
from pam_envs.envs.knee import brace_kernels as K
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.knee_orthosis import rows as R
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.single_muscle.hysteresis import Kind
from pam_envs.references.trajectory import FAMILIES, SAMPLES, sines_needed
from pam_envs.tasks.gait_assistance import BraceTracking

REFERENCES = (*FAMILIES, "sine")
"""Those of all environments, and the paper's: one sine that begins at its lowest value."""
QUANTITIES = ("tension", "stiffness")
UNITS = ("N", "N/m")
RANGES = ((0.0, 400.0), (0.0, 1e4))
"""Ranges of the signals."""
REFERENCE_RANGES = {
    "tension": {"no_load": (80.0, 205.0), "rig": (80.0, 330.0)},
    "stiffness": {"no_load": (100.0, 7100.0), "rig": (100.0, 7100.0)},
}
"""Between which values references run, by mounting: the paper's, within reach of 4.5 bar."""
PAPER_PRESSURE = 0.69e5
"""Pressure [Pa], reached by inflation, that gives the tension of 55 N before the paper's runs."""
NOT_DRAWN = ("regulator.max_pressure", "lever.arm", "lever.fittings", "fixture.length")
"""Parameters that ``randomize`` may not draw: they scale the action or the readings."""


@lru_cache(maxsize=16)
def _stock(mounting: str, hysteresis: Kind) -> KneeOrthosis:
    if mounting == "rig":
        return KneeOrthosis.rig(hysteresis)
    return KneeOrthosis.no_load(hysteresis)


def _signals(quantity: int, full: float, preview: int, spacing: float, normalize: bool) -> Signals:
    wanted = (UNITS[quantity], RANGES[quantity])
    parts: list[tuple[str, str, tuple[float, float]]] = [
        ("tension", "N", RANGES[K.TENSION]),
        ("stiffness", "N/m", RANGES[K.STIFFNESS]),
        ("angle", "rad", (1.0, 3.1)),
        ("pressure", "Pa", (0.0, full)),
        ("set_point", "Pa", (0.0, full)),
        ("reference", *wanted),
    ]
    parts += [(f"reference_{i + 1}", *wanted) for i in range(preview)]
    return Signals(
        Signal(name, unit, low, high, i, normalize, max(0, i - K.FIXED_SIGNALS) * spacing)
        for i, (name, unit, (low, high)) in enumerate(parts)
    )


@named_arguments
def make_setup(
    quantity: int,
    mounting: str,
    hysteresis: Kind | None = None,
    plant: KneeOrthosis | str | Path | None = None,
    reference: Any = "sine",
    preview: int = 5,
    preview_stride: int = 4,
    episode_seconds: float = 20.0,
    randomize: Any = False,
    normalize: bool = True,
    render_mode: str | None = None,
    frequency: float = 0.1,
    start: str = "random",
    reward: Mapping[str, float] | None = None,
) -> Setup:
    """Return the checked configuration of an environment with the brace alone.

    Parameters
    ----------
    quantity : int
        0 for the tension, 1 for the stiffness.
    mounting : {"no_load", "rig"}
        Of the default plant: free to move, or held at the nominal length.
    hysteresis : {"maxwell_slip", "preisach", "none"}, optional
        The muscle's hysteresis. Default: that of ``plant``, or Maxwell-slip.
    plant : KneeOrthosis or path, optional
        Another plant, off the leg.
    reference : str or array_like
        "sine" (the paper's), "steps", "ramps", "sines", "multisine", "staircase", "mixed", or
        samples, one a control period (the last one holds).
    preview, preview_stride : int
        Future reference samples in the observation, and control periods between them.
    episode_seconds : float
        Duration [s].
    randomize : bool or mapping
        True: every episode draws the assumed parameters within their declared ranges. A mapping
        {"lever.stiffness": (low, high)}: just those.
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As Gymnasium means it.
    frequency : float
        Of the reference "sine" [Hz].
    start : {"random", "paper"}
        Rest under a random pressure, or at about 55 N.
    reward : mapping, optional
        Fields of :class:`pam_envs.tasks.gait_assistance.BraceTracking` to change.

    Raises
    ------
    ValueError
        Naming the argument, its value, the bounds and the remedy.
    """
    made = plant_of(KneeOrthosis, plant, hysteresis, lambda kind: _stock(mounting, kind))
    if made.mounting == "leg":
        raise ValueError(
            "plant: this orthosis is on a leg; give KneeOrthosis.no_load() or KneeOrthosis.rig()"
        )
    family, samples = reference_of(reference, REFERENCES, UNITS[quantity], RANGES[quantity][1])
    family = {len(REFERENCES): SAMPLES, len(FAMILIES): K.PAPER}.get(family, family)
    given = common(preview, preview_stride, episode_seconds, normalize, render_mode)
    check_choice("start", start, ("random", "paper"))
    hertz = check_number("frequency", frequency, 1e-3, 10.0, "Hz")
    task = task_of(BraceTracking, reward)
    full = made.regulator.max_pressure
    low, high = REFERENCE_RANGES[QUANTITIES[quantity]][made.mounting]
    starts = (PAPER_PRESSURE, PAPER_PRESSURE) if start == "paper" else (0.0, 0.9 * full)
    config = (
        task.tracking_weight,
        task.error_scale * 0.5 * (high - low),
        task.effort_weight,
        task.soft_pressure,
        task.highest_tension,
        low,
        high,
        hertz,
        *starts,
    )
    example = "{'lever.stiffness': (25, 35)}"
    spacing = given.stride * made.control_period
    sines = 1 if family == K.PAPER else sines_needed(family)
    return compose(
        made,
        K.kernels_for(made.hysteresis.kind, made.mounting, made.dynamics),
        given,
        signals=_signals(quantity, full, given.preview, spacing, normalize),
        actions=Signals([Signal("pressure_set_point", "Pa", 0.0, full, 0, normalize)]),
        config=config,
        choices=(made.elements, family, sines, quantity),
        own=made.gait_table(),
        samples=samples,
        tables=made.hysteresis_tables(),
        spread=spread_of(made, R.PARAMETERS, NOT_DRAWN, randomize, example, {}),
        drawn=randomize is not False,
        view=f"knee_{QUANTITIES[quantity]}",
    )


class KneeTensionEnv(PlantEnv):
    """The single environment (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup(K.TENSION, "no_load", **arguments))


class KneeTensionVectorEnv(PlantVectorEnv):
    """The batched environment (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup(K.TENSION, "no_load", **arguments), num_envs, info, threads)


class KneeStiffnessEnv(PlantEnv):
    """The single environment (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup(K.STIFFNESS, "rig", **arguments))


class KneeStiffnessVectorEnv(PlantVectorEnv):
    """The batched environment (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup(K.STIFFNESS, "rig", **arguments), num_envs, info, threads)
