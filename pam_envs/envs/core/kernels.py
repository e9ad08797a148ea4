"""Kernels that families of environments share: plant step, reference, sensors, payload, report.

``info`` and ``at`` are a family's named tuples of work rows and of numbers in the configuration.
"""

from typing import Any

from pam_envs.envs.core.step import CHOICE, EPISODE_SECONDS, KEY_A, KEY_B, PERIOD
from pam_envs.kernels.arithmetic import quantise
from pam_envs.kernels.build import LANES, kernel
from pam_envs.kernels.random import normal, uniform
from pam_envs.references.trajectory import SAMPLES, reference_value
from pam_envs.tasks.rewards import error_reward, excess

FIRST_HYSTERESIS = FIRST_REFERENCE = 0  # placeholders: first rows of hysteresis and reference
plant_advance: Any = None

PAYLOAD_ROWS = 3
"""Rows of the state: declared payload, time of its change, size of the change."""
EARLIEST, LATEST = 0.3, 0.7
"""Range of the time of the change, as shares of an episode."""


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
    rows: Any, fixed: Any, counts: Any, samples: Any, settings: Any, choices: Any, step: int,
    lane: int, channel: int,
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

    ``sensor`` is the first row of its noise, resolution and bias, ``stream`` its random stream.
    """
    drawn = normal(counts[KEY_A][j], counts[KEY_B][j], stream, draw)
    return quantise(true + fixed[sensor + 2][j] + fixed[sensor][j] * drawn, fixed[sensor + 1][j])


@kernel
def draw_payload(
    rows: Any, counts: Any, settings: Any, choices: Any, stream: int, number: int, change: float,
    declared: int, payload: int, j: int,
) -> None:  # fmt: skip
    """Draw a payload [kg] of the family's settings for lane ``j``, and time and size of its change.

    Up or down with equal probability, but up if the payload is smaller than the change.
    """
    key_a, key_b = counts[KEY_A][j], counts[KEY_B][j]
    mass = settings[choices[CHOICE.at_own]][int(uniform(key_a, key_b, stream, 0) * number)]
    rows[declared][j] = rows[payload][j] = mass
    when = EARLIEST + (LATEST - EARLIEST) * uniform(key_a, key_b, stream, 1)
    rows[declared + 1][j] = settings[0][EPISODE_SECONDS] * when
    down = uniform(key_a, key_b, stream, 2) < 0.5 and mass >= change
    rows[declared + 2][j] = -change if down else change


@kernel
def change_payload(rows: Any, step: Any, period: float, declared: int, payload: int) -> None:
    """Change the payload of a tile at its time."""
    for j in range(LANES):
        changed = step[j] * period >= rows[declared + 1][j]
        rows[payload][j] = rows[declared][j] + (rows[declared + 2][j] if changed else 0.0)


@kernel
def change_of(rows: Any, row: int, old: int, j: int) -> float:
    """Return the change of a row of lane ``j`` since the last call, which row ``old`` stores."""
    change = rows[row][j] - rows[old][j]
    rows[old][j] = rows[row][j]
    return change  # type: ignore[no-any-return]


@kernel
def report_tracking(
    work: Any, config: Any, info: Any, at: Any, reference: float, output: float, j: int
) -> None:
    """Write reference, output and the reward for their difference."""
    work[info.reference][j], work[info.output][j] = reference, output
    work[info.reward_tracking][j] = error_reward(
        output - reference, config[at.error_scale], config[at.tracking_weight]
    )


@kernel
def report_pressure(
    work: Any, config: Any, info: Any, at: Any, pressure: float, change: float, full: float, j: int
) -> None:
    """Write cost and margin of the highest pressure, and the reward for a change of setpoints."""
    work[info.cost_pressure][j] = excess(pressure, config[at.soft_pressure])
    work[info.margin_pressure][j] = config[at.soft_pressure] - pressure
    work[info.reward_effort][j] = error_reward(change, full, config[at.effort_weight])


@kernel
def report_end(work: Any, config: Any, info: Any, at: Any, flag: int, broken: bool, j: int) -> None:
    """Write the flag of a broken limit, and the reward for the end of the episode there.

    This period and all that remain count ``-worst_period``, the lowest possible reward, so that a
    policy never gains by ending an episode, at any discount factor up to 1.
    """
    left = max(0.0, config[EPISODE_SECONDS] - work[info.time][j]) / config[PERIOD] + 1.0
    work[flag][j] = 1.0 if broken else 0.0
    work[info.reward_ended][j] = -config[at.worst_period] * left if broken else 0.0
