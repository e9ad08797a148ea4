"""One step of ``PAM/MusclePositioning-v0``: plant, sensors, reference, reward, end, reset.

The same functions serve one environment (a tile of one lane) and a batch (tiles of 32 lanes).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from pam_envs.kernels import (
    LANES,
    array_at,
    build,
    episode_key,
    interpreted,
    kernel,
    normal,
    prange,
    routine,
    scratch,
    tile_view,
    uniform,
)
from pam_envs.muscle.effective_area import volume
from pam_envs.plants import single_muscle_rows as R
from pam_envs.plants.single_muscle_effects import replacements
from pam_envs.plants.single_muscle_kernels import (
    MEMORIES,
    MEMORY_ROWS,
    N_WORK,
    advance,
    begin_effects,
    rest_contraction,
    seen_position,
    seen_pressure,
    true_position,
)
from pam_envs.plants.single_muscle_rows import N_PARAMETERS
from pam_envs.references.trajectory import ROWS as REFERENCE_ROWS
from pam_envs.references.trajectory import SAMPLES, draw_reference, reference_value
from pam_envs.sensing.sensor import read_sensor
from pam_envs.tasks.tracking import effort_reward, excess, tracking_reward

REFERENCE = R.END
SEED_A, SEED_B = R.N_COUNTS, R.N_COUNTS + 1
"""Integer rows with the key words of the seed."""
N_COUNTS = R.N_COUNTS + 2
MEMORY = R.END + REFERENCE_ROWS
"""First row of the memory's state."""

INFO = (
    "time",
    "reference",
    "output",
    "reward/tracking",
    "reward/effort",
    "cost/contraction",
    "cost/pressure",
    "margin/contraction",
    "margin/pressure",
    "effort/pressure_travel",
    "effort/air",
    "state/contraction",
    "state/velocity",
    "state/pressure",
    "state/drive",
    "state/load",
    "sensor/contraction",
    "sensor/pressure",
    "saturated",
)
(
    TIME,
    REF,
    OUTPUT,
    R_TRACKING,
    R_EFFORT,
    C_CONTRACTION,
    C_PRESSURE,
    M_CONTRACTION,
    M_PRESSURE,
    E_TRAVEL,
    E_AIR,
    S_CONTRACTION,
    S_VELOCITY,
    S_PRESSURE,
    S_DRIVE,
    S_LOAD,
    SENSOR_X,
    SENSOR_P,
    SATURATED,
) = range(N_WORK, N_WORK + len(INFO))
SIGNALS = N_WORK + len(INFO)
"""First work row of the observation, in SI: contraction, pressure, set-point, load, references."""
FIXED_SIGNALS = 4
MOST_PREVIEW = 20
N_WORK_ROWS = SIGNALS + FIXED_SIGNALS + 1 + MOST_PREVIEW

# numbers of the configuration
CONFIG = (
    "period",
    "episode_seconds",
    "preview_seconds",
    "tracking_weight",
    "error_scale",
    "effort_weight",
    "soft_contraction",
    "soft_pressure",
    "lowest_contraction",
    "highest_contraction",
    "reference_low",
    "reference_high",
    "start_share",
    "load_change",
    "action_scale",
    "action_offset",
    "action_low",
    "action_high",
)
(
    PERIOD,
    EPISODE_SECONDS,
    PREVIEW_SECONDS,
    TRACKING_WEIGHT,
    ERROR_SCALE,
    EFFORT_WEIGHT,
    SOFT_CONTRACTION,
    SOFT_PRESSURE,
    LOWEST,
    HIGHEST,
    REFERENCE_LOW,
    REFERENCE_HIGH,
    START_SHARE,
    LOAD_CHANGE,
    ACTION_SCALE,
    ACTION_OFFSET,
    ACTION_LOW,
    ACTION_HIGH,
) = range(len(CONFIG))
CHOICES = (
    "substeps",
    "elements",
    "preview",
    "stride",
    "family",
    "sines",
    "loads",
    "spread",
    "members",
)
SUBSTEPS, N_ELEMENTS, PREVIEW, STRIDE, FAMILY, SINES, N_LOADS, N_SPREAD, N_MEMBERS = range(
    len(CHOICES)
)
"""Whole numbers of the configuration; ``members`` is 0 where nothing is drawn."""

CONFIG_ROW, LOADS, SCALES = 0, 1, 2
SPREAD = SCALES + FIXED_SIGNALS + 1 + MOST_PREVIEW
MEMBERS = SPREAD + len(R.PARAMETERS)
"""Rows of the settings: configuration, loads to draw from [kg], ``a, b, low, high`` of each signal,
``row, low, high`` of each parameter that is drawn, and the parameters of each member."""

ATMOSPHERE = 101325.0
AIR = 1.0 / (287.05 * 293.15)
"""Density over pressure of air at 20 degrees C [kg/(m3 Pa)]."""

NOISE_X, NOISE_P, START, RANDOM = 1, 2, 3, 4
"""Random streams."""

remember: Any = None  # placeholders, filled in for each memory and number of lanes
N_ROWS = 0


@kernel
def air_in_muscle(rows: Any, fixed: Any, j: int) -> float:
    """Return the mass of air [kg] in the muscle of lane ``j``."""
    length = fixed[R.REST_LENGTH][j]
    space = volume(rows[R.CONTRACTION][j] / length, length, fixed[R.TALL][j], fixed[R.COSINE][j])
    return AIR * (rows[R.PRESSURE][j] + ATMOSPHERE) * space


@kernel
def reference_at(rows: Any, samples: Any, config: Any, choices: Any, step: int, lane: int) -> float:
    """Return the reference [m] of one lane at a control period."""
    if choices[FAMILY] == SAMPLES:
        return samples[min(step, len(samples) - 1)]  # type: ignore[no-any-return]
    return reference_value(rows, REFERENCE, lane, step * config[PERIOD], choices[SINES])


@kernel
def look_ahead(rows: Any, counts: Any, ahead: Any, samples: Any, config: Any, choices: Any) -> None:
    """Add the newest previewed reference to the ring of those to come."""
    step, mask, far = counts[R.STEP], len(ahead) - 1, choices[PREVIEW] * choices[STRIDE]
    if choices[FAMILY] == SAMPLES:
        for j in range(LANES):
            k = step[j] + far
            ahead[k & mask][j] = samples[min(k, len(samples) - 1)]
    else:
        for j in range(LANES):
            k = step[j] + far
            t = k * config[PERIOD]
            ahead[k & mask][j] = reference_value(rows, REFERENCE, j, t, choices[SINES])


@kernel
def evaluate(
    rows: Any,
    fixed: Any,
    counts: Any,
    ahead: Any,
    config: Any,
    choices: Any,
    work: Any,
) -> None:
    """Write what can be observed and reported of a tile into ``work``."""
    step, key_a, key_b = counts[R.STEP], counts[R.KEY_A], counts[R.KEY_B]
    velocity, pressure = rows[R.VELOCITY], rows[R.PRESSURE]
    set_point, older = rows[R.SET_POINT], rows[R.OLD_SET_POINT]
    period, stride = config[PERIOD], choices[STRIDE]
    for j in range(LANES):
        work[TIME][j] = step[j] * period
        contraction = true_position(rows, j)
        work[OUTPUT][j] = contraction
        work[S_CONTRACTION][j] = contraction
        work[S_VELOCITY][j] = velocity[j]
        work[S_PRESSURE][j] = pressure[j]
        work[S_DRIVE][j] = rows[R.DRIVE][j]
        work[S_LOAD][j] = rows[R.LOAD][j]
        work[SENSOR_X][j] = read_sensor(
            seen_position(rows, j),
            fixed[R.POSITION_NOISE][j],
            fixed[R.POSITION_RESOLUTION][j],
            fixed[R.POSITION_BIAS][j],
            normal(key_a[j], key_b[j], NOISE_X, step[j]),
        )
        work[SENSOR_P][j] = read_sensor(
            seen_pressure(rows, j),
            fixed[R.PRESSURE_NOISE][j],
            fixed[R.PRESSURE_RESOLUTION][j],
            fixed[R.PRESSURE_BIAS][j],
            normal(key_a[j], key_b[j], NOISE_P, step[j]),
        )
        work[SIGNALS][j] = work[SENSOR_X][j]
        work[SIGNALS + 1][j] = work[SENSOR_P][j]
        work[SIGNALS + 2][j] = set_point[j]
        work[SIGNALS + 3][j] = rows[R.TOLD_LOAD][j]
    mask = len(ahead) - 1
    for i in range(choices[PREVIEW] + 1):
        sample = work[SIGNALS + FIXED_SIGNALS + i]
        for j in range(LANES):
            sample[j] = ahead[(step[j] + i * stride) & mask][j]
    now = work[SIGNALS + FIXED_SIGNALS]
    for j in range(LANES):
        output = work[OUTPUT][j]
        work[REF][j] = now[j]
        work[R_TRACKING][j] = tracking_reward(
            output - now[j], config[ERROR_SCALE], config[TRACKING_WEIGHT]
        )
        work[R_EFFORT][j] = effort_reward(
            set_point[j] - older[j], fixed[R.MAX_PRESSURE][j], config[EFFORT_WEIGHT]
        )
        work[C_CONTRACTION][j] = excess(output, config[SOFT_CONTRACTION])
        work[C_PRESSURE][j] = excess(pressure[j], config[SOFT_PRESSURE])
        work[M_CONTRACTION][j] = min(config[HIGHEST] - output, output - config[LOWEST])
        work[M_PRESSURE][j] = config[SOFT_PRESSURE] - pressure[j]
        air = air_in_muscle(rows, fixed, j)
        work[E_TRAVEL][j] = abs(pressure[j] - rows[R.OLD_PRESSURE][j])
        work[E_AIR][j] = max(0.0, air - rows[R.OLD_AIR][j])
        rows[R.OLD_PRESSURE][j] = pressure[j]
        rows[R.OLD_AIR][j] = air


@routine
def reset_lane(
    rows: Any,
    fixed: Any,
    counts: Any,
    ahead: Any,
    table: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    work: Any,
    j: int,
) -> None:
    """Start the episode of lane ``j`` that its episode counter names."""
    key_a = episode_key(counts[SEED_A][j], counts[R.EPISODE][j])
    key_b = episode_key(counts[SEED_B][j], counts[R.EPISODE][j])
    counts[R.KEY_A][j], counts[R.KEY_B][j], counts[R.STEP][j] = key_a, key_b, 0
    config = settings[CONFIG_ROW]
    member = int(uniform(key_a, key_b, RANDOM, 0) * choices[N_MEMBERS])
    counts[R.MEMBER][j] = member
    for k in range(R.N_PARAMETERS):
        fixed[k][j] = settings[MEMBERS + member][k]
    for k in range(choices[N_SPREAD]):
        drawn = settings[SPREAD + k]
        u = uniform(key_a, key_b, RANDOM, 1 + k)
        fixed[int(drawn[0])][j] = drawn[1] + (drawn[2] - drawn[1]) * u
    load = settings[LOADS][int(uniform(key_a, key_b, START, 0) * choices[N_LOADS])]
    rows[R.TOLD_LOAD][j] = load
    rows[R.LOAD][j] = load
    rows[R.CHANGE_TIME][j] = config[EPISODE_SECONDS] * (0.3 + 0.4 * uniform(key_a, key_b, START, 1))
    rows[R.CHANGE][j] = config[LOAD_CHANGE]
    if uniform(key_a, key_b, START, 2) < 0.5:
        rows[R.CHANGE][j] = max(-load, -config[LOAD_CHANGE])
    _start_memory(rows, counts, j)
    peak = config[START_SHARE] * fixed[R.MAX_PRESSURE][j] * uniform(key_a, key_b, START, 3)
    begin = peak * uniform(key_a, key_b, START, 4)
    rows[R.REST][j] = rest_contraction(fixed, j, 0.0, load)
    for pressure in (0.0, peak, begin):
        rows[R.PRESSURE][j] = pressure
        remember(rows, fixed, counts, table, MEMORY, j, j + 1, choices[N_ELEMENTS], work)
    for k in range(R.N_HISTORY):
        rows[R.HISTORY + k][j] = begin
    rows[R.SET_POINT][j] = begin
    rows[R.OLD_SET_POINT][j] = begin
    rows[R.CONTRACTION][j] = rest_contraction(fixed, j, rows[R.DRIVE][j], load)
    rows[R.VELOCITY][j] = 0.0
    rows[R.OLD_PRESSURE][j] = begin
    rows[R.OLD_AIR][j] = air_in_muscle(rows, fixed, j)
    begin_effects(rows, fixed, j)
    work[SATURATED][j] = 0.0
    if choices[FAMILY] != SAMPLES:
        draw_reference(
            rows,
            REFERENCE,
            j,
            key_a,
            key_b,
            choices[FAMILY],
            config[REFERENCE_LOW],
            config[REFERENCE_HIGH],
        )
    for k in range(choices[PREVIEW] * choices[STRIDE] + 1):
        ahead[k][j] = reference_at(rows, samples, config, choices, k, j)


@routine
def _start_memory(rows: Any, counts: Any, j: int) -> None:
    """Forget everything: the muscle as it rests before its first pressure."""
    for k in range(len(rows) - MEMORY):
        rows[MEMORY + k][j] = 0.0
    counts[R.STACK_COUNT][j] = 1


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
    work: Any, settings: Any, observation: Any, info: Any, signals: int, row: int, j: int
) -> None:
    """Copy lane ``j`` of ``work`` to row ``row`` of the outputs."""
    for i in range(signals):
        scale = settings[SCALES + i]
        value = scale[0] * work[SIGNALS + i][j] + scale[1]
        observation[row][i] = max(scale[2], min(scale[3], value))
    for k in range(1, len(info)):
        info[k][row] = work[N_WORK + k - 1][j]


@kernel
def take_actions(rows: Any, counts: Any, config: Any, work: Any, actions: Any, start: int) -> None:
    """Turn actions into set-points, and let the load change at its time."""
    step, load, set_point = counts[R.STEP], rows[R.LOAD], rows[R.SET_POINT]
    older = rows[R.OLD_SET_POINT]
    told, when, change = rows[R.TOLD_LOAD], rows[R.CHANGE_TIME], rows[R.CHANGE]
    saturated, last = work[SATURATED], len(actions) - 1
    for j in range(LANES):
        wanted = float(actions[min(start + j, last)][0])
        held = max(config[ACTION_LOW], min(config[ACTION_HIGH], wanted))
        saturated[j] = 0.0 if held == wanted else 1.0
        older[j] = set_point[j]
        set_point[j] = config[ACTION_SCALE] * held + config[ACTION_OFFSET]
        load[j] = told[j] + (change[j] if step[j] * config[PERIOD] >= when[j] else 0.0)


@kernel
def write_tile(
    work: Any,
    settings: Any,
    signals: int,
    observation: Any,
    info: Any,
    flags: Any,
    start: int,
    lanes: int,
) -> int:
    """Copy a tile to the outputs; return how many of its episodes are over."""
    over = 0
    config, reward = settings[CONFIG_ROW], info[0]
    for j in range(lanes):
        terminated = 1 if work[M_CONTRACTION][j] < 0.0 else 0
        truncated = 1 if work[TIME][j] >= config[EPISODE_SECONDS] - 0.5 * config[PERIOD] else 0
        flags[0][start + j] = terminated
        flags[1][start + j] = truncated
        over = over + terminated + truncated
        reward[start + j] = work[R_TRACKING][j] + work[R_EFFORT][j]
    for i in range(signals):
        value, scale = work[SIGNALS + i], settings[SCALES + i]
        a, b, low, high = scale[0], scale[1], scale[2], scale[3]
        for j in range(lanes):
            observation[start + j][i] = max(low, min(high, a * value[j] + b))
    for k in range(1, len(info)):
        report, value = info[k], work[N_WORK + k - 1]
        for j in range(lanes):
            report[start + j] = value[j]
    return over


@kernel
def step_tiles(
    all_rows: Any,
    all_fixed: Any,
    all_counts: Any,
    all_ahead: Any,
    table: Any,
    samples: Any,
    settings: Any,
    choices: Any,
    actions: Any,
    observations: Any,
    infos: Any,
    flags: Any,
    number: int,
    mode: int,
) -> None:
    """Step or reset a batch, tile by tile.

    ``mode`` 0 steps; 1 steps and starts the next episode of what has ended; 2 starts the episodes
    of the environments whose ``flags[0]`` is set, and does not step. ``observations[0]`` and
    ``infos[0]`` are the present ones, ``[1]`` those at the end of an episode that has been
    followed by the next. ``infos[...][0]`` is the reward.
    """
    signals = FIXED_SIGNALS + 1 + choices[PREVIEW]
    config, observation, info = settings[CONFIG_ROW], observations[0], infos[0]
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, min(tile, len(all_fixed) - 1), N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        ahead = all_ahead[tile]
        work = scratch(N_WORK_ROWS, LANES)
        start = tile * LANES
        lanes = min(LANES, number - start)
        if mode < 2:
            take_actions(rows, counts, config, work, actions, start)
            advance(
                rows,
                fixed,
                counts,
                table,
                MEMORY,
                choices[N_ELEMENTS],
                choices[SUBSTEPS],
                config[PERIOD],
                work,
            )
            for j in range(LANES):
                counts[R.STEP][j] = counts[R.STEP][j] + 1
            look_ahead(rows, counts, ahead, samples, config, choices)
        else:
            for j in range(lanes):
                if flags[0][start + j] > 0:
                    reset_lane(
                        rows, fixed, counts, ahead, table, samples, settings, choices, work, j
                    )
            for j in range(lanes, LANES):  # the rest of the last tile computes along, unseen
                copy_lane(rows, fixed, counts, ahead, lanes - 1, j)
        for again in range(2):
            evaluate(rows, fixed, counts, ahead, config, choices, work)
            if mode == 2 or again == 1:
                for j in range(lanes):
                    if flags[0][start + j] + flags[1][start + j] > 0:
                        write_lane(work, settings, observation, info, signals, start + j, j)
                break
            over = write_tile(work, settings, signals, observation, info, flags, start, lanes)
            if mode == 0 or over == 0:
                break
            for j in range(lanes):
                if flags[0][start + j] + flags[1][start + j] > 0:
                    write_lane(work, settings, observations[1], infos[1], signals, start + j, j)
                    infos[1][0][start + j] = info[0][start + j]
                    counts[R.EPISODE][j] = counts[R.EPISODE][j] + 1
                    reset_lane(
                        rows, fixed, counts, ahead, table, samples, settings, choices, work, j
                    )


@kernel
def step_by_address(book: Any, mode: int) -> None:
    """Step or reset one environment whose arrays stand in an address book."""
    step_tiles(
        array_at(book, 0, 3, 0),
        array_at(book, 1, 3, 0),
        array_at(book, 2, 3, 1),
        array_at(book, 3, 3, 0),
        array_at(book, 4, 3, 0),
        array_at(book, 5, 1, 0),
        array_at(book, 6, 2, 0),
        array_at(book, 7, 1, 1),
        array_at(book, 8, 2, 0),
        array_at(book, 9, 3, 2),
        array_at(book, 10, 3, 0),
        array_at(book, 11, 2, 3),
        1,
        mode,
    )


class Kernels:
    """The functions for one kind of memory, plain or with effects, built when first asked for."""

    def __init__(self, kind: str, extended: bool = False) -> None:
        self.kind, self.extended = kind, extended
        self.n_rows = MEMORY + MEMORY_ROWS[kind] + (R.N_EFFECTS if extended else 0)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the kind: compiled code is not copied."""
        return kernels_for, (self.kind, self.extended)

    def _names(self, lanes: int) -> dict[str, Any]:
        names = {"remember": MEMORIES[self.kind], "N_ROWS": self.n_rows, "LANES": lanes}
        if self.extended:
            names |= replacements(self.kind, MEMORY + MEMORY_ROWS[self.kind])
        return names

    @property
    def _suffix(self) -> str:
        return self.kind + ("_extended" if self.extended else "")

    def _build(self, name: str, lanes: int, parallel: bool = False) -> Callable[..., Any]:
        return build(step_tiles, f"{name}_{self._suffix}", parallel, **self._names(lanes))

    @cached_property
    def interpreted(self) -> Callable[..., Any]:
        """One environment, in plain Python."""
        return interpreted(step_tiles, self._names(1))

    @cached_property
    def single(self) -> Callable[..., Any]:
        """One environment, by an address book of the arrays."""
        return build(step_by_address, f"single_{self._suffix}", **self._names(1))

    @cached_property
    def batch(self) -> Callable[..., Any]:
        """Tiles on one core."""
        return self._build("batch", LANES)

    @cached_property
    def parallel(self) -> Callable[..., Any]:
        """Tiles over all cores."""
        return self._build("parallel", LANES, parallel=True)


KERNELS = {
    (kind, extended): Kernels(kind, extended) for kind in MEMORIES for extended in (False, True)
}


def kernels_for(kind: str, extended: bool = False) -> Kernels:
    """Return the kernels for a kind of memory, plain or with effects."""
    return KERNELS[kind, extended]
