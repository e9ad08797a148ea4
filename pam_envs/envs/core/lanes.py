"""One environment of a batch by one thread, with rows of neighbouring environments side by side.

The arrays have the shape (rows, N), so that neighbouring threads read neighbouring addresses. Step
and reset are separate kernels: each needs fewer registers than both together. Address books hold
the arrays of ``step_by_address`` with these shapes: state, parameters (N or 1 columns), integers,
previews (rows, N); tables, samples, settings and choices; actions (N, actions), observations
(1, N, signals), reports (1, 1 + keys, N), flags (2, N).
"""

from typing import Any

from pam_envs.envs.core.step import (
    EPISODE,
    N_WORK_ROWS,
    STEP,
    env_advance,
    env_apply,
    env_evaluate,
    extend_preview,
    reset_lane,
    take_actions,
    write_common,
    write_lane,
    write_tile,
)
from pam_envs.kernels.build import array_at, kernel, lane_view, scratch


@kernel
def step_lane(book: Any, lane: int) -> None:
    """Step one environment of a batch."""
    rows = lane_view(array_at(book, 0, 2, 0), lane)
    fixed = lane_view(array_at(book, 1, 2, 0), lane)
    counts = lane_view(array_at(book, 2, 2, 1), lane)
    ahead = lane_view(array_at(book, 3, 2, 0), lane)
    tables, samples = array_at(book, 4, 3, 0), array_at(book, 5, 2, 0)
    settings, choices = array_at(book, 6, 2, 0), array_at(book, 7, 1, 1)
    observation, info = array_at(book, 9, 3, 2)[0], array_at(book, 10, 3, 0)[0]
    work = scratch(N_WORK_ROWS, 1)
    take_actions(rows, settings, choices, work, array_at(book, 8, 2, 0), lane)
    env_apply(rows, fixed, counts, settings, choices, work)
    env_advance(rows, fixed, counts, tables, samples, settings, choices, work)
    counts[STEP][0] = counts[STEP][0] + 1
    extend_preview(rows, fixed, counts, ahead, samples, settings, choices)
    write_common(rows, counts, ahead, settings, choices, work)
    env_evaluate(rows, fixed, counts, settings, choices, work)
    write_tile(work, settings, choices, observation, info, array_at(book, 11, 2, 3), lane, 1)


@kernel
def restart_lane(book: Any, lane: int) -> None:
    """Start an episode of one environment of a batch, if one of its flags is set.

    It is the next episode, or after ``flags[0] = 2`` the one that the counter gives.
    """
    flags = array_at(book, 11, 2, 3)
    if flags[0][lane] + flags[1][lane] > 0:
        rows = lane_view(array_at(book, 0, 2, 0), lane)
        fixed = lane_view(array_at(book, 1, 2, 0), lane)
        counts = lane_view(array_at(book, 2, 2, 1), lane)
        ahead = lane_view(array_at(book, 3, 2, 0), lane)
        tables, samples = array_at(book, 4, 3, 0), array_at(book, 5, 2, 0)
        settings, choices = array_at(book, 6, 2, 0), array_at(book, 7, 1, 1)
        observation, info = array_at(book, 9, 3, 2)[0], array_at(book, 10, 3, 0)[0]
        work = scratch(N_WORK_ROWS, 1)
        if flags[0][lane] < 2:
            counts[EPISODE][0] = counts[EPISODE][0] + 1
        reset_lane(rows, fixed, counts, ahead, tables, samples, settings, choices, work, 0)
        write_common(rows, counts, ahead, settings, choices, work)
        env_evaluate(rows, fixed, counts, settings, choices, work)
        write_lane(work, settings, choices, observation, info, lane, 0)
