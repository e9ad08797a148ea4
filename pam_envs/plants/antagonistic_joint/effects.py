"""Effects of a plant with antagonistic pairs: kernels that replace the placeholders.

Every muscle has the effects of its path (``core.muscle_path``), with the same parameters; the
bearing of a single joint sticks and slips; each sensor has the effects of sensors. In the reduced
plant, which moves by its commands, only the pressures and the sensors have effects.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import kernel
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.pair import N_PAIRS, PAIR, friction_kernels, pair_rows
from pam_envs.plants.core.muscle_path import DELAYED, PATH_STATE, begin_path, path_step
from pam_envs.plants.core.sensors import effect_kernels

FULL_ANGLE, FULL_PRESSURE = 0.5236, 6.5e5
"""Full scales of the sensors [rad, Pa]."""


@kernel
def regulate_extended(
    rows: Any, fixed: Any, counts: Any, m: int, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance pressure and effective pressure of muscle ``m`` of a tile through a sub-step."""
    path_step(
        rows, fixed, PAIR.paths + m * PATH_STATE.end, PAIR.path, PAIR.delay + m * DELAYED.end,
        K.REGULATOR_MAX_PRESSURE, PAIR.warm, rows[PAIR.pressure + m], rows[PAIR.set_point + m],
        rows[PAIR.effective + m], work[m], counts[K.STEP], i, substeps, period,
    )  # fmt: skip


@kernel
def begin_paths(rows: Any, fixed: Any, j: int) -> None:
    """Begin the paths of all muscles of lane ``j`` at their pressures."""
    for m in range(2 * N_PAIRS):
        rows[PAIR.effective + m][j] = begin_path(
            rows, fixed, j, PAIR.paths + m * PATH_STATE.end, PAIR.path, PAIR.warm,
            rows[PAIR.pressure + m][j],
        )  # fmt: skip


@kernel
def begin_paths_and_bearing(rows: Any, fixed: Any, j: int) -> None:
    """Begin the paths of both muscles of a single joint, whose bearing holds."""
    begin_paths(rows, fixed, j)
    rows[STUCK][j] = 1.0


STUCK = 0  # placeholder: see mechanics.guide


def pair_kernels(kind: str, layout: Any, pairs: int, effects: int | None) -> dict[str, Any]:
    """Return the kernels that replace the placeholders of a plant with pairs.

    ``effects`` is the first row of the state of the effects; None for a plain plant.
    """
    found = friction_kernels(kind) | {"PAIR": pair_rows(layout, effects), "N_PAIRS": pairs}
    found["N_OPERATORS"] = 2 * pairs
    if effects is None:
        return found
    block, muscles = layout.EFFECT, 2 * pairs
    measured = [found["PAIR"].angle + k for k in range(pairs)]
    measured += [found["PAIR"].pressure + m for m in range(muscles)]
    shown = effect_kernels(
        effects, layout, measured, [block.angle] * pairs + [block.pressure] * muscles,
        [FULL_ANGLE] * pairs + [FULL_PRESSURE] * muscles, angles=pairs,
    )  # fmt: skip
    begin = begin_paths_and_bearing if "bearing" in block._fields else begin_paths
    return found | shown | {"regulate": regulate_extended, "begin_muscles": begin}
