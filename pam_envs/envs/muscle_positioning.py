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

import dataclasses
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs import positioning_kernels as K
from pam_envs.envs.plant_env import PlantEnv
from pam_envs.envs.setup import (
    Setup,
    check_choice,
    check_number,
    check_whole,
    scales_of,
)
from pam_envs.envs.vector_env import PlantVectorEnv
from pam_envs.parameters import Signal, Signals, check, declarations
from pam_envs.plants import single_muscle_rows as R
from pam_envs.plants.memory import KINDS, Kind
from pam_envs.plants.single_muscle import SingleMuscle
from pam_envs.references.trajectory import FAMILIES, SAMPLES, sines_needed
from pam_envs.tasks.tracking import Tracking

LOADS = (0.0, 2.55, 4.55)
REFERENCE_RANGE = (0.001, 0.013)
"""Contractions [m] between which references are drawn: within reach of every measured load."""
HIGHEST_LOAD = 5.0
_NOT_DRAWN = ("mass.load", "regulator.max_pressure", "muscle.diameter", "muscle.braid_angle")
DRAWN = tuple(name for name in R.PARAMETERS if name not in _NOT_DRAWN)
"""Parameters that ``randomize`` may draw: the others scale the action or enter derived numbers."""


@lru_cache(maxsize=8)
def _stock(hysteresis: Kind) -> SingleMuscle:
    return SingleMuscle.mas10(hysteresis)


def _plant(plant: Any, hysteresis: Any) -> SingleMuscle:
    """Return the plant that the arguments name."""
    if hysteresis is not None:
        check_choice("hysteresis", hysteresis, KINDS)
    if plant is None:
        return _stock(hysteresis or "maxwell_slip")
    if isinstance(plant, (str, Path)):
        plant = SingleMuscle.from_yaml(plant)
    if not isinstance(plant, SingleMuscle):
        raise ValueError(
            f"plant = {str(plant)[:60]!r} must be a SingleMuscle, the path of a plant file, or None"
        )
    if hysteresis == "none":
        return plant.replace({"memory.operator": None})
    if hysteresis is not None and hysteresis != plant.memory.kind:
        raise ValueError(
            f"hysteresis = {hysteresis!r} but the plant's memory is {plant.memory.kind!r}; "
            "leave hysteresis out, or give a plant identified with that memory"
        )
    return plant


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


def _reference(reference: Any) -> tuple[int, NDArray[np.float64]]:
    """Return the family number, and the samples where the reference is given as such."""
    if isinstance(reference, str):
        check_choice("reference", reference, FAMILIES)
        return FAMILIES.index(reference), np.zeros(1)
    try:
        samples = np.array(reference, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"reference = {str(reference)[:60]!r} must be one of {', '.join(FAMILIES)} or samples"
        ) from error
    if samples.ndim != 1 or not len(samples) or not np.isfinite(samples).all():
        raise ValueError(
            f"reference has shape {samples.shape}; give a finite sample [m] for each control period"
        )
    if np.abs(samples).max() > 0.2:
        raise ValueError(
            f"reference reaches {np.abs(samples).max():g} m; samples are in metres, at most 0.2"
        )
    return SAMPLES, samples


def _spread(plant: SingleMuscle, randomize: Any) -> NDArray[np.float64]:
    """Return (row, low, high) of each parameter that is drawn anew every episode."""
    if randomize is False:
        return np.zeros((0, 3))
    if randomize is True:
        ranges: dict[str, Any] = {}
        for name in R.PARAMETERS:
            component, _, field = name.partition(".")
            declared = declarations(getattr(plant, component))[field]
            if declared.spread is not None and name != "mass.load":
                ranges[name] = declared.spread
    elif isinstance(randomize, Mapping):
        ranges = dict(randomize)
    else:
        raise ValueError(
            f"randomize = {randomize!r} must be True, False or a mapping from parameter to "
            "(low, high), for example {'mass.damping': (100, 500)}"
        )
    table = []
    for name, span in ranges.items():
        if name not in DRAWN:
            raise ValueError(
                f"randomize: {name!r} is not a parameter that can be drawn; there are: "
                + ", ".join(DRAWN)
            )
        if not isinstance(span, (Sequence, np.ndarray)) or len(span) != 2 or isinstance(span, str):
            raise ValueError(f"randomize: {name} needs (low, high), got {span!r}")
        low, high = (check_number(f"randomize: {name}", v, -1e12, 1e12, "") for v in span)
        if low > high:
            raise ValueError(
                f"randomize: {name} has low = {low:g} above high = {high:g}; swap them"
            )
        for end in (low, high):
            plant.replace({name: end})  # refuses what is out of bounds or cannot be simulated
        table.append((R.PARAMETERS.index(name), low, high))
    _check_corners(plant, ranges)
    return np.array(table, float).reshape(-1, 3)


def _check_corners(plant: SingleMuscle, ranges: Mapping[str, Any]) -> None:
    """Refuse ranges whose fastest corner the sub-steps cannot follow."""
    worst: dict[str, float] = {}
    for name, pick in (
        ("mass.moving_mass", min),
        ("mass.damping", max),
        ("muscle.stiffness", max),
        ("muscle.hardening", max),
        ("muscle.braid_force", max),
        ("muscle.braid_strain", min),
        ("muscle.rest_length", min),
    ):
        if name in ranges:
            worst[name] = pick(ranges[name])
    for member in plant.members():
        member.replace(worst)


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
        The muscle's memory, each identified on the same data. Default: that of ``plant``, or
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
    made = _plant(plant, hysteresis)
    loads = _loads(load)
    family, samples = _reference(reference)
    check_choice("render_mode", render_mode, (None, "rgb_array", "human"))
    check_choice("start", start, ("random", "rest"))
    check_choice("normalize", normalize, (True, False))
    preview = check_whole("preview", preview, 0, K.MOST_PREVIEW)
    stride = check_whole("preview_stride", preview_stride, 1, 1000)
    seconds = check_number("episode_seconds", episode_seconds, 0.02, 3600.0, "s")
    change = check_number("load_disturbance", load_disturbance, 0.0, HIGHEST_LOAD, "kg")
    task = _task(reward)
    spread = _spread(made, randomize)
    signals = _signals(made, task, preview, stride * made.control_period, normalize)
    full = made.regulator.max_pressure
    actions = Signals([Signal("pressure_set_point", "Pa", 0.0, full, 0, normalize)])
    a, b = actions[0].scale
    low, high = (-1.0, 1.0) if normalize else (0.0, full)
    config = np.array(
        [
            made.control_period,
            seconds,
            stride * made.control_period,
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
            1.0 / a,
            -b / a,
            low,
            high,
        ]
    )
    kernels = K.kernels_for(made.memory.kind, made.extended)
    members = made.members() if randomize is not False else (made,)
    counts = (len(loads), len(spread), len(members))
    choices = (made.substeps, made.elements, preview, stride, family, sines_needed(family))
    return Setup(
        plant=made,
        signals=signals,
        action_signals=actions,
        kernels=kernels,
        rows=kernels.n_rows,
        fixed=R.N_PARAMETERS,
        drawn=randomize is not False,
        counts=K.N_COUNTS,
        ring=1 << (preview * stride).bit_length(),
        seed_rows=(K.SEED_A, K.SEED_B, R.EPISODE),
        info_keys=K.INFO,
        shared=(
            made.everett_tables()[: len(members)],
            samples,
            _settings(config, loads, scales_of(signals), spread, members),
            np.array([*choices, *counts], np.int64),
        ),
        control_period=made.control_period,
        episode_seconds=seconds,
        render_mode=render_mode,
    )


def _settings(
    config: NDArray[np.float64],
    loads: NDArray[np.float64],
    scales: NDArray[np.float64],
    spread: NDArray[np.float64],
    members: tuple[SingleMuscle, ...],
) -> NDArray[np.float64]:
    """Return all numbers that the environments share, laid out as the kernels read them."""
    columns = np.array([m.parameter_rows() for m in members])
    table = np.zeros((K.MEMBERS + len(members), max(columns.shape[1], len(loads), len(config))))
    table[K.CONFIG_ROW, : len(config)] = config
    table[K.LOADS, : len(loads)] = loads
    table[K.SCALES : K.SCALES + len(scales), :4] = scales
    table[K.SPREAD : K.SPREAD + len(spread), :3] = spread
    table[K.MEMBERS :, : columns.shape[1]] = columns
    return table


def _task(reward: Any) -> Tracking:
    known = tuple(declarations(Tracking))
    if reward is None:
        return Tracking()
    if not isinstance(reward, Mapping) or set(reward) - set(known):
        raise ValueError(
            f"reward = {reward!r} must be a mapping with keys among {', '.join(known)}"
        )
    task = dataclasses.replace(Tracking(), **reward)
    check(task, "reward")
    return task


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
