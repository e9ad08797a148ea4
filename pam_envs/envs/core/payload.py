"""The payload of an episode, as kernels: told at the start, changed in the middle, untold.

Three rows of the state that stand side by side hold what is told, when it changes, and by how much
(``told``, ``told + 1``, ``told + 2``); another one (``payload``) is the plant's.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.random import uniform

ROWS = 3
EARLIEST, LATEST = 0.3, 0.7
"""When it changes, as shares of an episode."""


@kernel
def draw_payload(
    rows: Any, key_a: int, key_b: int, stream: int, payloads: Any, number: int, change: float,
    seconds: float, told: int, payload: int, j: int,
) -> None:  # fmt: skip
    """Draw the payload [kg] of lane ``j``, and when and by how much it changes.

    Up or down as likely, but up where there is less than the change.
    """
    mass = payloads[int(uniform(key_a, key_b, stream, 0) * number)]
    rows[told][j] = rows[payload][j] = mass
    when = EARLIEST + (LATEST - EARLIEST) * uniform(key_a, key_b, stream, 1)
    rows[told + 1][j] = seconds * when
    down = uniform(key_a, key_b, stream, 2) < 0.5 and mass >= change
    rows[told + 2][j] = -change if down else change


@kernel
def carry_payload(rows: Any, step: Any, period: float, told: int, payload: int) -> None:
    """Change the payload of a tile at its time."""
    for j in range(LANES):
        changed = step[j] * period >= rows[told + 1][j]
        rows[payload][j] = rows[told][j] + (rows[told + 2][j] if changed else 0.0)
