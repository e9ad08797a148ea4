"""``PAM/MusclePositioning-v0``: move a hanging load with one pneumatic muscle.

A Festo MAS-10-N-100 lifts a load. The action is the set-point of its pressure regulator, the task
to make the contraction follow a reference. The muscle remembers: the same pressure gives another
contraction when it inflates than when it deflates, up to 3.3 mm apart on a stroke of 15 mm.

Observation (float32; scaled to [-1, 1] over the range, or SI with ``normalize=False``):

| # | signal | unit | range |
|---|--------|------|-------|
| 0 | contraction, sensed | m | -0.01 .. 0.02 |
| 1 | pressure, sensed | Pa | 0 .. 6e5 |
| 2 | set_point, of the last period | Pa | 0 .. 6e5 |
| 3 | load, as told at the start | kg | 0 .. 5 |
| 4 | reference, now | m | -0.01 .. 0.02 |
| 5.. | reference_1 .., ``preview_stride`` periods apart | m | -0.01 .. 0.02 |

Action: pressure_set_point, 0 .. 6e5 Pa over [-1, 1].

Reward: ``-|output - reference| / 1 mm - 0.2 |change of set-point| / 6 bar`` each control period.

Start: at rest under a random pressure, reached after a random higher one (``start="rest"``: at
no pressure, never inflated). End: truncated after ``episode_seconds``; terminated when the
contraction leaves -10 .. 20 mm. Soft limits are reported in ``cost/*``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from pam_envs.envs.positioning import kernels as K
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.single_muscle import rows as R
from pam_envs.plants.single_muscle.hysteresis import Kind
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.references.trajectory import FAMILIES, sines_needed
from pam_envs.tasks.tracking import Tracking

LOADS = (0.0, 2.55, 4.55)
REFERENCE_RANGE = (0.001, 0.013)
"""Contractions [m] between which references are drawn: within reach of every measured load."""
HIGHEST_LOAD = 5.0
NOT_DRAWN = ("mass.load", "regulator.max_pressure", "muscle.diameter", "muscle.braid_angle")
"""Parameters that ``randomize`` may not draw: they scale the action or enter derived numbers."""
CORNER = {
    "mass.moving_mass": min,
    "mass.damping": max,
    "muscle.stiffness": max,
    "muscle.hardening": max,
    "muscle.braid_force": max,
    "muscle.braid_strain": min,
    "muscle.rest_length": min,
}
"""Which end of a range makes the motion faster."""


@lru_cache(maxsize=8)
def _stock(hysteresis: Kind) -> SingleMuscle:
    return SingleMuscle.mas10(hysteresis)


def _loads(load: Any) -> NDArray[np.float64]:
    """Return the loads [kg] to draw from."""
    values = LOADS if load is None else load
    if isinstance(values, (int, float, np.integer, np.floating)):
        values = (values,)
    if (
        not isinstance(values, (Sequence, np.ndarray))
        or isinstance(values, str)
        or len(values) == 0
    ):
        raise ValueError(f"load = {load!r} must be a number of kg, several of them, or None")
    return np.array([check_number("load", v, 0.0, HIGHEST_LOAD, "kg") for v in values])


def _signals(
    plant: SingleMuscle, task: Tracking, preview: int, spacing: float, normalize: bool
) -> Signals:
    position = (task.lowest_contraction, task.highest_contraction)
    pressure = (0.0, plant.regulator.max_pressure)
    parts: list[tuple[str, str, tuple[float, float]]] = [
        ("contraction", "m", position),
        ("pressure", "Pa", pressure),
        ("set_point", "Pa", pressure),
        ("load", "kg", (0.0, HIGHEST_LOAD)),
        ("reference", "m", position),
    ]
    parts += [(f"reference_{i + 1}", "m", position) for i in range(preview)]
    return Signals(
        Signal(name, unit, low, high, i, normalize, max(0, i - 4) * spacing)
        for i, (name, unit, (low, high)) in enumerate(parts)
    )


@named_arguments
def make_setup(
    hysteresis: Kind | None = None,
    plant: SingleMuscle | str | Path | None = None,
    reference: Any = "steps",
    preview: int = 5,
    preview_stride: int = 4,
    episode_seconds: float = 10.0,
    randomize: Any = False,
    normalize: bool = True,
    render_mode: str | None = None,
    load: Any = 2.55,
    load_disturbance: float = 0.0,
    start: str = "random",
    reward: Mapping[str, float] | None = None,
) -> Setup:
    """Return the checked configuration of ``PAM/MusclePositioning-v0``.

    Parameters
    ----------
    hysteresis : {"maxwell_slip", "preisach", "none"}, optional
        The muscle's hysteresis, each identified on the same data. Default: that of ``plant``, or
        Maxwell-slip.
    plant : SingleMuscle or path, optional
        Another plant, as an object or a YAML file. Default: the identified MAS-10-N-100.
    reference : str or array-like
        "steps", "ramps", "sines", "multisine", "staircase", "mixed", or samples [m], one a
        control period (the last one holds).
    preview : int
        Future reference samples in the observation, 0 to 20.
    preview_stride : int
        Control periods between them.
    episode_seconds : float
        Duration [s], 0.02 to 3,600.
    randomize : bool or mapping
        True: every episode draws one of the equally good fits and the assumed parameters within
        their declared ranges. A mapping {"mass.damping": (low, high)}: just those.
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As Gymnasium means it.
    load : float, sequence of float or None
        Load [kg]; several are drawn from, None means 0, 2.55 and 4.55.
    load_disturbance : float
        By how much [kg] the load changes, up or down, at an unannounced time.
    start : {"random", "rest"}
        Random history, or never inflated.
    reward : mapping, optional
        Fields of :class:`pam_envs.tasks.tracking.Tracking` to change.

    Raises
    ------
    ValueError
        Naming the argument, its value, the bounds and the remedy.
    """
    made = plant_of(SingleMuscle, plant, hysteresis, _stock)
    loads = _loads(load)
    family, samples = reference_of(reference, FAMILIES, "m", 0.2)
    given = common(preview, preview_stride, episode_seconds, normalize, render_mode)
    check_choice("start", start, ("random", "rest"))
    change = check_number("load_disturbance", load_disturbance, 0.0, HIGHEST_LOAD, "kg")
    task = task_of(Tracking, reward)
    example = "{'mass.damping': (100, 500)}"
    spread = spread_of(made, R.NAMES, NOT_DRAWN, randomize, example, CORNER)
    config = (
        task.tracking_weight,
        task.error_scale,
        task.effort_weight,
        task.soft_contraction,
        task.soft_pressure,
        task.lowest_contraction,
        task.highest_contraction,
        *REFERENCE_RANGE,
        0.9 if start == "random" else 0.0,
        change,
    )
    full = made.regulator.max_pressure
    return compose(
        made,
        K.kernels_for(made.hysteresis.kind, made.needs_effects(spread)),
        given,
        signals=_signals(made, task, given.preview, given.stride * made.control_period, normalize),
        actions=Signals([Signal("pressure_set_point", "Pa", 0.0, full, 0, normalize)]),
        config=config,
        choices=(made.elements, family, sines_needed(family), len(loads)),
        own=loads[None],
        samples=samples,
        tables=made.hysteresis_tables(),
        spread=spread,
        drawn=randomize is not False,
    )


class MusclePositioningEnv(PlantEnv):
    """The single environment (see the module's page)."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(make_setup(**arguments))


class MusclePositioningVectorEnv(PlantVectorEnv):
    """The batched environment (see the module's page)."""

    def __init__(
        self, num_envs: int = 1, info: bool = True, threads: int | None = None, **arguments: Any
    ) -> None:
        super().__init__(make_setup(**arguments), num_envs, info, threads)
