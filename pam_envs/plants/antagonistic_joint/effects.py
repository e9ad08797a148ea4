"""Effects of a plant with antagonistic pairs: kernels that replace the placeholders.

Every muscle has the effects of its path (``core.muscle_path``), with the same parameters; the
bearing of a single joint sticks and slips; each sensor has the effects of sensors. In the reduced
plant, which moves by its commands, only the pressures and the sensors have effects.
"""

from typing import Any

from pam_envs.constants import DENSITY_PER_PRESSURE
from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.yielding import deflected_with_tail
from pam_envs.muscle.effects import LengthYieldEffects, yield_spring
from pam_envs.muscle.law_correction import correction_force, correction_slope
from pam_envs.parameters import declarations
from pam_envs.plants.antagonistic_joint import rows as K
from pam_envs.plants.antagonistic_joint.pair import (
    N_PAIRS,
    PAIR,
    friction_kernels,
    lever_of,
    pair_rows,
    volume_of,
)
from pam_envs.plants.core.muscle_path import (
    DELAYED,
    PATH_STATE,
    begin_path,
    path_squeeze,
    path_step,
)
from pam_envs.plants.core.sensors import effect_kernels
from pam_envs.pneumatics.enclosed_air import REACHED, air_stiffness, enclose, flows_on
from pam_envs.pneumatics.regulator import AIR_STATE

RATIO = list(declarations(LengthYieldEffects)).index("yield_ratio")
SOFTEST = 1e-6
"""Least stiffness of the friction [N] to which that of yielding friction is related."""
friction_of: Any = None  # placeholder: see pair
FULL_ANGLE, FULL_PRESSURE = 0.5236, 6.5e5
"""Full scales of the sensors [rad, Pa]."""


@kernel
def path_of(m: int) -> int:
    """Return the first row of the state of a muscle's path."""
    return PAIR.paths + m * PATH_STATE.end  # type: ignore[no-any-return]


@kernel
def regulate_extended(
    rows: Any, fixed: Any, counts: Any, m: int, i: int, substeps: int, period: float, work: Any
) -> None:
    """Advance pressure and effective pressure of muscle ``m`` of a tile through a sub-step."""
    path_step(
        rows, fixed, path_of(m), PAIR.path, PAIR.delay + m * DELAYED.end,
        K.REGULATOR_MAX_PRESSURE, PAIR.warm, rows[PAIR.pressure + m], rows[PAIR.set_point + m],
        rows[PAIR.effective + m], work[m], counts[K.STEP], i, substeps, period,
    )  # fmt: skip


@kernel
def enclose_air(
    rows: Any, fixed: Any, j: int, m: int, contraction: float, rate: float, ahead: float
) -> None:
    """Write the volume of muscle ``m`` of lane ``j``, and its change with the angle [m3/rad].

    ``rate`` is ``dL/dphi`` [m], ``ahead`` the turn [rad] that is predicted.
    """
    fall = fixed[K.MUSCLE_TAPER][j] / fixed[K.MUSCLE_STRETCH][j] * contraction
    area = fixed[K.MUSCLE_AREA][j] * (1.0 - fall)
    enclose(
        rows, j, path_of(m) + PATH_STATE.air, volume_of(fixed, j, contraction), -area * rate, ahead
    )


@kernel
def settle_air(rows: Any, fixed: Any, h: float, work: Any) -> None:
    """Move the enclosed air of all muscles of a tile with the motion, where air flows."""
    if flows_on(fixed, PAIR.path) == 0:
        return
    straight = rows[PAIR.straight]
    for m in range(2 * N_PAIRS):
        at, rate, velocity = rows[PAIR.at + m], work[2 * N_PAIRS + m], rows[PAIR.velocity + m // 2]
        for j in range(LANES):
            ahead = 0.5 * h * velocity[j]
            enclose_air(rows, fixed, j, m, at[j] + straight[j], rate[j], ahead)
        path_squeeze(
            rows, fixed, path_of(m), PAIR.path, rows[PAIR.pressure + m], rows[PAIR.effective + m],
            REACHED,
        )  # fmt: skip


@kernel
def begin_enclosed(rows: Any, fixed: Any, j: int) -> None:
    """Begin the enclosed air of all muscles of lane ``j`` at its angles."""
    for m in range(2 * N_PAIRS):
        x, rate, _ = lever_of(fixed, j, rows[PAIR.angle + m // 2][j], 1.0 - 2.0 * (m % 2))
        enclose_air(rows, fixed, j, m, x, rate, 0.0)


@kernel
def yield_of(rows: Any, fixed: Any, j: int, m: int) -> tuple[float, float]:
    """Return the deflection of the yielding friction of muscle ``m``, and its slope, in lane ``j``.

    At the contraction of the muscle, from where the friction was last.
    """
    _, limit = yield_spring(fixed, j, PAIR.soft, rows[PAIR.effective + m][j])
    moved = rows[PAIR.at + m][j] - rows[PAIR.yielded + m][j]
    ratio, tail = fixed[PAIR.soft + RATIO][j], fixed[PAIR.uneven + 1][j]
    return deflected_with_tail(rows[PAIR.deflection + m][j], moved, limit, ratio, tail)  # type: ignore[no-any-return]


@kernel
def stiffness_ratio(rows: Any, fixed: Any, j: int, m: int) -> float:
    """Return the stiffness of the yielding friction over that of the other friction."""
    drive = rows[PAIR.effective + m][j]
    stiff, _ = yield_spring(fixed, j, PAIR.soft, drive)
    return stiff / max(SOFTEST, friction_of(fixed, j, drive))  # type: ignore[no-any-return]


@kernel
def peek_yield(rows: Any, fixed: Any, m: int, operators: int, first: int, last: int) -> None:
    """Add the lags of the yielding friction of muscles from ``m`` on; it does not move."""
    for k in range(m, m + operators):
        for j in range(first, last):
            deflection, slope = yield_of(rows, fixed, j, k)
            share = stiffness_ratio(rows, fixed, j, k)
            rows[PAIR.lag + k][j] = rows[PAIR.lag + k][j] + share * deflection
            rows[PAIR.stick + k][j] = rows[PAIR.stick + k][j] + share * slope


@kernel
def move_yield(rows: Any, fixed: Any, m: int, operators: int, first: int, last: int) -> None:
    """Move the yielding friction of muscles from ``m`` on to their contractions; add its lags."""
    for k in range(m, m + operators):
        for j in range(first, last):
            deflection, _ = yield_of(rows, fixed, j, k)
            rows[PAIR.deflection + k][j], rows[PAIR.yielded + k][j] = (
                deflection,
                rows[PAIR.at + k][j],
            )
            share = stiffness_ratio(rows, fixed, j, k)
            rows[PAIR.lag + k][j] = rows[PAIR.lag + k][j] + share * deflection


@kernel
def corrected_force(fixed: Any, j: int, pressure: float, contraction: float) -> float:
    """Return the force [N] of the law's correction at an effective pressure [Pa]."""
    return correction_force(fixed, j, PAIR.law, pressure, contraction)  # type: ignore[no-any-return]


@kernel
def corrected_stiffness(fixed: Any, j: int, pressure: float, contraction: float) -> float:
    """Return minus the derivative of :func:`corrected_force` by contraction [N]."""
    return correction_slope(fixed, j, PAIR.law, pressure, contraction)  # type: ignore[no-any-return]


@kernel
def uneven_rub(fixed: Any, j: int, side: float) -> float:
    """Return the friction of a specimen over that of the hysteresis."""
    return 1.0 + side * fixed[PAIR.uneven][j]


@kernel
def leaked_air(rows: Any, fixed: Any, j: int) -> float:
    """Return the air [kg] that leaked from all muscles of lane ``j`` in this control period."""
    leaked = 0.0
    for m in range(2 * N_PAIRS):
        lost = rows[path_of(m) + PATH_STATE.air + AIR_STATE.lost][j]
        leaked = leaked + lost * volume_of(fixed, j, rows[PAIR.contraction + m][j])
    return DENSITY_PER_PRESSURE * leaked


@kernel
def enclosed_stiffness(rows: Any, j: int, m: int) -> float:
    """Return the stiffness [N m/rad] of the air in muscle ``m`` of lane ``j``."""
    return air_stiffness(rows, j, path_of(m) + PATH_STATE.air)


@kernel
def begin_paths(rows: Any, fixed: Any, j: int) -> None:
    """Begin the paths of all muscles of lane ``j`` at their pressures."""
    for m in range(2 * N_PAIRS):
        rows[PAIR.effective + m][j] = begin_path(
            rows, fixed, j, path_of(m), PAIR.path, PAIR.warm, rows[PAIR.pressure + m][j]
        )


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
    air = {"settle_air": settle_air, "begin_enclosed": begin_enclosed}
    air |= {"enclosed_stiffness": enclosed_stiffness, "leaked_air": leaked_air}
    air |= {"more_force": corrected_force, "more_stiffness": corrected_stiffness}
    air |= {"peek_yield": peek_yield, "move_yield": move_yield, "rub_of": uneven_rub}
    return found | shown | air | {"regulate": regulate_extended, "begin_muscles": begin}
