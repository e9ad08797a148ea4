"""Friction of the braid's strands: four Maxwell-slip elements in parallel with the muscle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pam_envs.kernels.arithmetic import count_on
from pam_envs.kernels.build import LANES, kernel
from pam_envs.parameters import assumed, effect

BREAKS = (0.1, 0.3, 0.6, 1.0)
"""Strains at which strands break away, over that of the last one."""
STRANDS = len(BREAKS)


@dataclass(frozen=True, kw_only=True)
class StrandEffects:
    """Friction of strands against each other."""

    strand_1: float = effect("N", 0.0, 500.0, "friction of the first strands to break away")
    strand_2: float = effect("N", 0.0, 500.0, "friction of the second strands to break away")
    strand_3: float = effect("N", 0.0, 500.0, "friction of the third strands to break away")
    strand_4: float = effect("N", 0.0, 500.0, "friction of the last strands to break away")
    strand_break: float = assumed(0.02, "1", 0.001, 0.3, "strain at which the last strand slips")


@kernel
def strand_forces(
    rows: Any, fixed: Any, state: int, force: int, break_away: int, strain: Any, friction: Any,
    sticking: Any,
) -> None:  # fmt: skip
    """Add the strands' force [N] and its slope by strain [N] at strains of a tile.

    ``state``, ``force`` and ``break_away`` are the first rows of the slip positions and forces, and
    the row of the strain at which the last strand breaks away.
    """
    for i in range(STRANDS):
        slip, part = rows[state + i], BREAKS[i]
        for j in range(LANES):
            span = part * fixed[break_away][j]
            stiff = fixed[force + i][j] / span
            gap = max(-span, min(span, strain[j] - slip[j]))
            friction[j] = friction[j] + stiff * gap
            sticking[j] = sticking[j] + (stiff if abs(strain[j] - slip[j]) < span else 0.0)


@kernel
def slip_strands(rows: Any, fixed: Any, state: int, break_away: int, strain: Any) -> None:
    """Move the strands' slip positions with the strains of a tile."""
    for i in range(STRANDS):
        slip, part = rows[state + i], BREAKS[i]
        for j in range(LANES):
            span = part * fixed[break_away][j]
            slip[j] = max(strain[j] - span, min(strain[j] + span, slip[j]))


@kernel
def strands_on(fixed: Any, force: int) -> int:
    """Return the number of lanes and strands of a tile with friction."""
    on = 0
    for i in range(STRANDS):
        on = on + count_on(fixed[force + i], 0.0)
    return on
