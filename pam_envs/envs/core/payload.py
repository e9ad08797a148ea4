"""Payload of an episode: declared at the start, changed without notice in the middle.

Three consecutive rows of the state hold the declared payload, the time of the change and its size
(``declared``, ``declared + 1``, ``declared + 2``); row ``payload`` is the plant's.
"""

from __future__ import annotations

from typing import Any

from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.random import uniform

ROWS = 3
EARLIEST, LATEST = 0.3, 0.7
"""Range of the time of the change, as shares of an episode."""


@kernel
def draw_payload(
    rows: Any, key_a: int, key_b: int, stream: int, payloads: Any, number: int, change: float,
    seconds: float, declared: int, payload: int, j: int,
) -> None:  # fmt: skip
    """Draw the payload [kg] of lane ``j``, and time and size of its change.

    Up or down with equal probability, but up if the payload is smaller than the change.
    """
    mass = payloads[int(uniform(key_a, key_b, stream, 0) * number)]
    rows[declared][j] = rows[payload][j] = mass
    when = EARLIEST + (LATEST - EARLIEST) * uniform(key_a, key_b, stream, 1)
    rows[declared + 1][j] = seconds * when
    down = uniform(key_a, key_b, stream, 2) < 0.5 and mass >= change
    rows[declared + 2][j] = -change if down else change


@kernel
def change_payload(rows: Any, step: Any, period: float, declared: int, payload: int) -> None:
    """Change the payload of a tile at its time."""
    for j in range(LANES):
        changed = step[j] * period >= rows[declared + 1][j]
        rows[payload][j] = rows[declared][j] + (rows[declared + 2][j] if changed else 0.0)
