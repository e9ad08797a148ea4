"""Pneumatic line between regulator and muscle: a resonance in the pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pam_envs.kernels.arithmetic import TURN
from pam_envs.kernels.build import kernel
from pam_envs.kernels.motion import resonator_step
from pam_envs.parameters import assumed, effect, parameter_rows


@dataclass(frozen=True, kw_only=True)
class LineEffects:
    """Resonance of the line behind a regulator."""

    ring_share: float = effect("1", 0.0, 1.0, "share of the pressure behind a line that rings")
    ring_flow: float = effect("1", -2.0, 2.0, "ringing that goes with the flow")
    ring_frequency: float = assumed(7.0, "Hz", 0.5, 20.0, "of the line")
    ring_damping: float = assumed(0.1, "1", 0.005, 2.0, "damping ratio of the line")


LINE = parameter_rows(LineEffects)
"""Rows of a line's effects, from its first."""


@kernel
def line_step(
    rows: Any, fixed: Any, j: int, state: int, effects: int, was: float, now: float, h: float
) -> float:
    """Return the pressure [Pa] behind the line whose input went from ``was`` to ``now``."""
    turns, ratio = fixed[effects + LINE.ring_frequency][j], fixed[effects + LINE.ring_damping][j]
    swung, rate = resonator_step(rows, j, state, was, now, turns, ratio, h)
    part = fixed[effects + LINE.ring_share][j]
    flow = fixed[effects + LINE.ring_flow][j] * rate / (TURN * turns)
    return max(0.0, (1.0 - part) * now + part * swung + flow)
