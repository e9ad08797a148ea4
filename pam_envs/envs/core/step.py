"""One step of any environment: actions, plant, references, observation, reward, end, reset.

The same kernels serve one environment (a tile of one lane) and a batch (tiles of 32 lanes). A
family adds kernels and sizes, which replace the placeholders below when the kernels are built (see
:mod:`pam_envs.envs.core.families`).

Arguments of the kernels, of every family:

* ``rows``, shape (n, lanes): the state. The setpoints are one block of rows, those of the previous
  period another.
* ``fixed``, shape (n, lanes): the parameters.
* ``counts``, shape (n, lanes): integers. KEY_A, ... MEMBER, the family's own, and last
  the two words of the seed.
* ``ahead``, shape (n, lanes): ring buffer of references up to the preview horizon.
* ``tables``: hysteresis models of the members; ``samples``, shape (channels, n): references given
  as samples.
* ``settings``, shape (n, m): row 0 is the configuration. From the rows ``choices[CHOICE.at_...]``
  on: ``scale, offset, low, high`` of each action, ``a, b, low, high`` of each signal, ``row, low,
  high`` of each drawn parameter, the parameters of each member, and the family's own.
* ``choices``, shape (n,): whole numbers of the configuration.
* ``work``, shape (n, lanes): the plant's scratch, ``info`` (time, reference, output, terms of the
  reward, ..., saturated), the flag of a broken limit, the observation in SI. Time, copies of the
  state and references are written before ``env_evaluate``, which writes the rest.
"""

from typing import Any

from pam_envs.envs.core.layout import indices
from pam_envs.kernels.build import LANES, array_at, kernel, prange, routine, scratch, tile_view
from pam_envs.kernels.random import SEED_WORDS, absorb, episode_key, uniform

KEY_A, KEY_B, EPISODE, STEP, MEMBER = range(5)
"""Integer rows that come first in every family."""
N_SEED = 2
"""Integer rows that come last in every family: the key words of the seed."""

PERIOD, EPISODE_SECONDS = range(2)
"""Numbers [s] that every configuration begins with."""
FIRST_CONFIG = 2
"""First number of the configuration that is the family's own."""

CHOICE = indices(
    (
        *("substeps", "actions", "signals", "fixed", "preview", "stride", "spread", "members"),
        *("elements", "reference", "sines"),
        *("at_actions", "at_scales", "at_spread", "at_members", "at_own"),
    )
)
"""Index of each whole number that every configuration begins with: ``fixed`` counts the signals
before the references, ``reference`` is the number of the reference's family, ``sines`` how many
sines its evaluation sums, ``at_...`` the first row of a part of the settings."""
FIRST_CHOICE = len(CHOICE)
"""First whole number of the configuration that is the family's own."""
MOST_PREVIEW = 20

TIME, REFERENCE, OUTPUT, REWARDS = range(4)
"""Entries of ``info`` that come first in every family; ``saturated`` comes last."""

RANDOM = 4
"""Random stream of member and parameters; families use other numbers."""

N_ROWS = N_PARAMETERS = N_COUNTS = N_WORK_ROWS = 0  # placeholders, replaced for each family
FIRST_INFO = N_INFO = N_REWARDS = CHANNELS = FIRST_SET_POINT = FIRST_OLD_SET_POINT = 0
env_apply: Any = None
env_advance: Any = None
env_reference: Any = None
env_evaluate: Any = None
env_begin: Any = None
COPIED: tuple[tuple[int, int], ...] = ()  # work row and state row of each copy


@kernel
def do_nothing(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Apply nothing: the default ``env_apply``."""


@kernel
def take_actions(
    rows: Any, settings: Any, choices: Any, work: Any, actions: Any, start: int
) -> None:
    """Turn actions into setpoints."""
    saturated, last = work[FIRST_INFO + N_INFO - 1], len(actions) - 1
    for k in range(choices[CHOICE.actions]):
        scale = settings[choices[CHOICE.at_actions] + k]
        set_point, older = rows[FIRST_SET_POINT + k], rows[FIRST_OLD_SET_POINT + k]
        for j in range(LANES):
            desired = float(actions[min(start + j, last)][k])
            held = max(scale[2], min(scale[3], desired))
            clipped = 0.0 if held == desired else 1.0
            saturated[j] = clipped if k == 0 else max(saturated[j], clipped)
            older[j] = set_point[j]
            set_point[j] = scale[0] * held + scale[1]


@kernel
def extend_preview(
    rows: Any, fixed: Any, counts: Any, ahead: Any, samples: Any, settings: Any, choices: Any
) -> None:
    """Add the references at the preview horizon to the ring buffers."""
    step, ring = counts[STEP], len(ahead) // CHANNELS
    far = choices[CHOICE.preview] * choices[CHOICE.stride]
    for channel in range(CHANNELS):
        first = channel * ring
        for j in range(LANES):
            k = step[j] + far
            ahead[first + (k & (ring - 1))][j] = env_reference(
                rows, fixed, counts, samples, settings, choices, k, j, channel
            )


@kernel
def write_common(
    rows: Any, counts: Any, ahead: Any, settings: Any, choices: Any, work: Any
) -> None:
    """Write time, copies of the state, and each channel's reference with its preview."""
    step, ring, stride = counts[STEP], len(ahead) // CHANNELS, choices[CHOICE.stride]
    for j in range(LANES):
        work[FIRST_INFO][j] = step[j] * settings[0][PERIOD]
    for k in range(len(COPIED)):
        to, source = work[COPIED[k][0]], rows[COPIED[k][1]]
        for j in range(LANES):
            to[j] = source[j]
    first, count = FIRST_INFO + N_INFO + 1 + choices[CHOICE.fixed], choices[CHOICE.preview] + 1
    for channel in range(CHANNELS):
        for i in range(count):
            sample = work[first + channel * count + i]
            for j in range(LANES):
                sample[j] = ahead[channel * ring + ((step[j] + i * stride) & (ring - 1))][j]


@routine
def reset_lane(
    rows: Any, fixed: Any, counts: Any, ahead: Any, tables: Any, samples: Any, settings: Any,
    choices: Any, work: Any, j: int,
) -> None:  # fmt: skip
    """Start the episode of lane ``j`` that its counter gives."""
    seed = N_COUNTS - N_SEED
    key_a = episode_key(counts[seed][j], counts[EPISODE][j])
    key_b = episode_key(counts[seed + 1][j], counts[EPISODE][j])
    member = int(uniform(key_a, key_b, RANDOM, 0) * choices[CHOICE.members])
    counts[KEY_A][j], counts[KEY_B][j], counts[STEP][j], counts[MEMBER][j] = key_a, key_b, 0, member
    for k in range(N_PARAMETERS):
        fixed[k][j] = settings[choices[CHOICE.at_members] + member][k]
    for k in range(choices[CHOICE.spread]):
        drawn = settings[choices[CHOICE.at_spread] + k]
        u = uniform(key_a, key_b, RANDOM, 1 + k)
        fixed[int(drawn[0])][j] = drawn[1] + (drawn[2] - drawn[1]) * u
    work[FIRST_INFO + N_INFO - 1][j] = 0.0
    env_begin(rows, fixed, counts, tables, samples, settings, choices, work, j)
    ring = len(ahead) // CHANNELS
    for channel in range(CHANNELS):
        for k in range(choices[CHOICE.preview] * choices[CHOICE.stride] + 1):
            ahead[channel * ring + k][j] = env_reference(
                rows, fixed, counts, samples, settings, choices, k, j, channel
            )


@routine
def copy_lane(rows: Any, fixed: Any, counts: Any, ahead: Any, source: int, to: int) -> None:
    """Make one lane of a tile a copy of another."""
    for k in range(len(rows)):
        rows[k][to] = rows[k][source]
    for k in range(len(fixed)):
        fixed[k][to] = fixed[k][source]
    for k in range(len(counts)):
        counts[k][to] = counts[k][source]
    for k in range(len(ahead)):
        ahead[k][to] = ahead[k][source]


@routine
def write_lane(
    work: Any, settings: Any, choices: Any, observation: Any, info: Any, row: int, j: int
) -> None:
    """Copy lane ``j`` of ``work`` to row ``row`` of the outputs."""
    for i in range(choices[CHOICE.signals]):
        scale = settings[choices[CHOICE.at_scales] + i]
        value = scale[0] * work[FIRST_INFO + N_INFO + 1 + i][j] + scale[1]
        observation[row][i] = max(scale[2], min(scale[3], value))
    for k in range(1, len(info)):
        info[k][row] = work[FIRST_INFO + k - 1][j]


@kernel
def write_tile(
    work: Any, settings: Any, choices: Any, observation: Any, info: Any, flags: Any, start: int,
    lanes: int,
) -> int:  # fmt: skip
    """Copy a tile to the outputs; return how many of its episodes are over."""
    over = 0
    config, reward, time, ended = settings[0], info[0], work[FIRST_INFO], work[FIRST_INFO + N_INFO]
    last = config[EPISODE_SECONDS] - 0.5 * config[PERIOD]
    for j in range(lanes):
        terminated = 1 if ended[j] > 0.0 else 0
        truncated = 1 if time[j] >= last else 0
        flags[0][start + j] = terminated
        flags[1][start + j] = truncated
        over = over + terminated + truncated
        total = work[FIRST_INFO + REWARDS][j]
        for k in range(1, N_REWARDS):
            total = total + work[FIRST_INFO + REWARDS + k][j]
        reward[start + j] = total
    for i in range(choices[CHOICE.signals]):
        value, scale = work[FIRST_INFO + N_INFO + 1 + i], settings[choices[CHOICE.at_scales] + i]
        a, b, low, high = scale[0], scale[1], scale[2], scale[3]
        for j in range(lanes):
            observation[start + j][i] = max(low, min(high, a * value[j] + b))
    for k in range(1, len(info)):
        report, value = info[k], work[FIRST_INFO + k - 1]
        for j in range(lanes):
            report[start + j] = value[j]
    return over


@kernel
def step_tiles(
    all_rows: Any, all_fixed: Any, all_counts: Any, all_ahead: Any, tables: Any, samples: Any,
    settings: Any, choices: Any, actions: Any, observations: Any, infos: Any, flags: Any,
    number: int, mode: int,
) -> None:  # fmt: skip
    """Step or reset a batch, tile by tile.

    ``mode`` 0: step. 1: step, and reset environments whose episode ended. 2: reset the environments
    whose ``flags[0]`` is set. ``observations[0]`` and ``infos[0]`` are the present ones, ``[1]``
    the last ones of episodes that ended in this step; ``infos[...][0]`` is the reward.
    """
    observation, info = observations[0], infos[0]
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, min(tile, len(all_fixed) - 1), N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        ahead = all_ahead[tile]
        work = scratch(N_WORK_ROWS, LANES)
        start = tile * LANES
        lanes = min(LANES, number - start)
        if mode < 2:
            take_actions(rows, settings, choices, work, actions, start)
            env_apply(rows, fixed, counts, settings, choices, work)
            env_advance(rows, fixed, counts, tables, samples, settings, choices, work)
            for j in range(LANES):
                counts[STEP][j] = counts[STEP][j] + 1
            extend_preview(rows, fixed, counts, ahead, samples, settings, choices)
        else:
            for j in range(lanes):
                if flags[0][start + j] > 0:
                    reset_lane(
                        rows, fixed, counts, ahead, tables, samples, settings, choices, work, j
                    )
            for j in range(lanes, LANES):  # unused lanes of the last tile
                copy_lane(rows, fixed, counts, ahead, lanes - 1, j)
        for again in range(2):
            write_common(rows, counts, ahead, settings, choices, work)
            env_evaluate(rows, fixed, counts, settings, choices, work)
            if mode == 2 or again == 1:
                for j in range(lanes):
                    if flags[0][start + j] + flags[1][start + j] > 0:
                        write_lane(work, settings, choices, observation, info, start + j, j)
                break
            over = write_tile(work, settings, choices, observation, info, flags, start, lanes)
            if mode == 0 or over == 0:
                break
            for j in range(lanes):
                if flags[0][start + j] + flags[1][start + j] > 0:
                    write_lane(work, settings, choices, observations[1], infos[1], start + j, j)
                    infos[1][0][start + j] = info[0][start + j]
                    counts[EPISODE][j] = counts[EPISODE][j] + 1
                    reset_lane(
                        rows, fixed, counts, ahead, tables, samples, settings, choices, work, j
                    )


N_ARRAYS = 12
"""Arrays in the address book of an environment."""


@kernel
def step_by_address(book: Any, mode: int) -> None:
    """Step or reset one environment, given the address book of its arrays."""
    step_tiles(
        array_at(book, 0, 3, 0),
        array_at(book, 1, 3, 0),
        array_at(book, 2, 3, 1),
        array_at(book, 3, 3, 0),
        array_at(book, 4, 3, 0),
        array_at(book, 5, 2, 0),
        array_at(book, 6, 2, 0),
        array_at(book, 7, 1, 1),
        array_at(book, 8, 2, 0),
        array_at(book, 9, 3, 2),
        array_at(book, 10, 3, 0),
        array_at(book, 11, 2, 3),
        1,
        mode,
    )


@kernel
def seed_by_address(book: Any, seed: int) -> None:
    """Give one environment a seed of at most 63 bits, and episode 0."""
    counts = array_at(book, 2, 3, 1)[0]
    a, b = absorb(SEED_WORDS[0], SEED_WORDS[1], seed & 0xFFFFFFFF)
    if seed >> 32:
        a, b = absorb(a, b, seed >> 32)
    counts[N_COUNTS - N_SEED][0], counts[N_COUNTS - N_SEED + 1][0] = a, b
    counts[EPISODE][0] = 0
