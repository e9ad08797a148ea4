"""Kernels that several families of environments share: plant step, reference, sensors."""

from __future__ import annotations

from typing import Any

from pam_envs.envs.core.step import CHOICE, KEY_A, KEY_B, PERIOD
from pam_envs.kernels.build import kernel
from pam_envs.kernels.random import normal
from pam_envs.references.trajectory import SAMPLES, reference_value
from pam_envs.sensing.sensor import read_sensor

FIRST_HYSTERESIS = FIRST_REFERENCE = 0  # placeholders: first rows of hysteresis and reference
plant_advance: Any = None


@kernel
def advance_plant(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance the plant by a control period."""
    plant_advance(
        rows, fixed, counts, tables, FIRST_HYSTERESIS, choices[CHOICE.elements],
        choices[CHOICE.substeps], settings[0][PERIOD], work,
    )  # fmt: skip


@kernel
def trajectory_at(
    rows: Any, fixed: Any, samples: Any, settings: Any, choices: Any, step: int, lane: int,
    channel: int,
) -> float:  # fmt: skip
    """Return the reference of one lane at a control period: given samples, or a drawn family."""
    if choices[CHOICE.reference] == SAMPLES:
        return samples[0][min(step, len(samples[0]) - 1)]  # type: ignore[no-any-return]
    time = step * settings[0][PERIOD]
    return reference_value(rows, FIRST_REFERENCE, lane, time, choices[CHOICE.sines])


@kernel
def sense(
    true: float, fixed: Any, counts: Any, sensor: int, stream: int, draw: int, j: int
) -> float:
    """Return the reading of a sensor in lane ``j``.

    Parameters
    ----------
    true : float
        Value that it measures.
    sensor : int
        First row of its parameters in ``fixed``: noise, resolution, bias.
    stream, draw : int
        Random stream, and number of the draw in it.
    """
    return read_sensor(
        true,
        fixed[sensor][j],
        fixed[sensor + 1][j],
        fixed[sensor + 2][j],
        normal(counts[KEY_A][j], counts[KEY_B][j], stream, draw),
    )
