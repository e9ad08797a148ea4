"""Kernels that the brace alone and the orthosis on a leg share."""

from __future__ import annotations

from typing import Any

from pam_envs.envs.core.step import CHOICE, PERIOD
from pam_envs.kernels.build import kernel
from pam_envs.plants.knee_orthosis.step import advance

FIRST_HYSTERESIS = 0  # a placeholder: first row of the state of the hysteresis


@kernel
def advance_knee(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance the plant by a control period."""
    gait = settings[choices[CHOICE.at_own] :]
    advance(
        rows, fixed, counts, tables, gait, FIRST_HYSTERESIS, choices[CHOICE.elements],
        choices[CHOICE.substeps], settings[0][PERIOD], work,
    )  # fmt: skip
