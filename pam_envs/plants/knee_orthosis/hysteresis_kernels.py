"""Stiffness of the orthosis' muscle: its gain around the kernels of a hysteresis model."""

from __future__ import annotations

from typing import Any

from pam_envs.hysteresis import protocol
from pam_envs.kernels.build import kernel
from pam_envs.plants.knee_orthosis import rows as K

EFFECTIVE = K.PRESSURE
"""Row of the effective pressure; that of the extended plant replaces it."""
hysteresis_scaled: Any = None  # a placeholder


@kernel
def stiffness_of_line(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int,
) -> None:  # fmt: skip
    """Write the stiffness without hysteresis, proportional to the pressure."""
    pressure, stiffness = rows[EFFECTIVE], rows[K.STIFFNESS]
    for j in range(first, last):
        stiffness[j] = fixed[K.MUSCLE_GAIN][j] * fixed[K.MUSCLE_STIFFNESS_RATIO][j] * pressure[j]


@kernel
def stiffness_of_model(
    rows: Any, fixed: Any, counts: Any, table: Any, hysteresis: int, first: int, last: int,
    elements: int,
) -> None:  # fmt: skip
    """Write the stiffness by a hysteresis model of the pressure."""
    stiffness = rows[K.STIFFNESS]
    hysteresis_scaled(
        rows[EFFECTIVE], stiffness, fixed[K.HYSTERESIS_WIDTH], rows, fixed, counts, table, elements,
        hysteresis, K.MODEL, K.STACK_COUNT, K.MEMBER, first, last,
    )  # fmt: skip
    for j in range(first, last):
        stiffness[j] = fixed[K.MUSCLE_GAIN][j] * stiffness[j]


def hysteresis_kernels(kind: str) -> dict[str, Any]:
    """Return the kernels of a kind by the plant's placeholders."""
    identity = protocol.model_of(kind).identity
    return protocol.kernels(kind) | {
        "remember": stiffness_of_line if identity else stiffness_of_model
    }
