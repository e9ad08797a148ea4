"""One loop over control periods for rollouts, replays and single steps of every plant.

A family declares its loop once (:class:`Loop`): inputs, start, step and outputs. :func:`run` builds
the machine code for it and lays out the arrays.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import state_rows
from pam_envs.kernels.build import (
    COMPILED,
    LANES,
    array_at,
    build,
    interpreted,
    kernel,
    prange,
    scratch,
    threads,
    tile_view,
)

BEGIN, REST, REZERO = 1, 2, 4
"""Flags of a control period: restart; come to rest instead of advancing; zero the sensor."""
STEP, STACK_COUNT = 3, 5
"""Rows of every plant's whole numbers: control period, first count of its hysteresis operators."""

N_OPERATORS = 1
"""Placeholder: hysteresis operators of the plant."""

# placeholders, filled in for each plant
N_ROWS = N_PARAMETERS = N_COUNTS = N_WORK = END = 0
OUTPUT_ROWS: tuple[int, ...] = ()
BIAS_ROWS: tuple[int, ...] = ()
plant_drive: Any = None
plant_begin: Any = None
advance: Any = None

P = TypeVar("P")


@kernel
def start_hysteresis(rows: Any, counts: Any, hysteresis: int, j: int) -> None:
    """Clear the hysteresis of one lane, and all state after it."""
    for k in range(len(rows) - hysteresis):
        rows[hysteresis + k][j] = 0.0
    for m in range(N_OPERATORS):
        counts[STACK_COUNT + m][j] = 1


@kernel
def plant_output(rows: Any, fixed: Any, k: int, j: int) -> float:
    """Return output ``k`` of lane ``j``: a row of the state."""
    return rows[OUTPUT_ROWS[k]][j]  # type: ignore[no-any-return]


@kernel
def biased_output(rows: Any, fixed: Any, k: int, j: int) -> float:
    """Return output ``k`` of lane ``j``: an undisturbed reading with the sensor's bias."""
    bias = fixed[BIAS_ROWS[k]][j] if k < len(BIAS_ROWS) else 0.0
    return rows[OUTPUT_ROWS[k]][j] + bias  # type: ignore[no-any-return]


@kernel
def plant_advance(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, elements: int, substeps: int,
    period: float, work: Any,
) -> None:  # fmt: skip
    """Advance a tile by one control period, of plants whose step reads no table of its own."""
    advance(rows, fixed, counts, table, END, elements, substeps, period, work)


@kernel
def plant_rest(
    rows: Any, fixed: Any, counts: Any, table: Any, extra: Any, elements: int, work: Any
) -> None:
    """Bring a tile to rest under its inputs; do nothing for plants without such a kernel."""


@kernel
def plant_rezero(rows: Any, fixed: Any) -> None:
    """Zero the sensors of a tile; do nothing for plants without such a kernel."""


@kernel
def write_outputs(rows: Any, fixed: Any, outputs: Any, t: int, first: int, lanes: int) -> None:
    """Write the outputs of a tile for sample ``t``."""
    for k in range(len(OUTPUT_ROWS)):
        for j in range(lanes):
            outputs[k][t][first + j] = plant_output(rows, fixed, k, j)


@kernel
def run_plants(
    all_rows: Any, all_fixed: Any, all_counts: Any, table: Any, extra: Any, drives: Any, flags: Any,
    outputs: Any, elements: int, substeps: int, period: float, begun: int, before: int,
) -> None:  # fmt: skip
    """Run tiles of plants through the control periods of ``drives[channel][t][column]``.

    State, parameters and whole numbers have the shape (tiles, rows, lanes), ``outputs`` (outputs,
    T, plants); ``table`` is that of the hysteresis, ``extra`` that of the plant (``Loop.extra``),
    ``begun`` the number of the first control period; with ``before`` above 0 the outputs are those
    at the beginning of each control period, not at its end.
    """
    for tile in prange(len(all_rows)):
        rows = tile_view(all_rows, tile, N_ROWS, LANES)
        fixed = tile_view(all_fixed, tile, N_PARAMETERS, LANES)
        counts = tile_view(all_counts, tile, N_COUNTS, LANES)
        work = scratch(N_WORK, LANES)
        first = tile * LANES
        lanes = min(LANES, len(outputs[0][0]) - first)
        last = len(drives[0][0]) - 1
        for t in range(len(drives[0])):
            for j in range(LANES):
                counts[STEP][j] = begun + t
                plant_drive(rows, fixed, drives, t, min(first + j, last), j)
            if flags[t] & BEGIN:
                plant_begin(rows, fixed, counts, table, extra, drives, t, first, elements, work)
                for j in range(LANES):
                    plant_drive(rows, fixed, drives, t, min(first + j, last), j)
            if flags[t] & REZERO:
                plant_rezero(rows, fixed)
            if before > 0:
                write_outputs(rows, fixed, outputs, t, first, lanes)
            if flags[t] & REST:
                plant_rest(rows, fixed, counts, table, extra, elements, work)
            else:
                plant_advance(rows, fixed, counts, table, extra, elements, substeps, period, work)
            if before == 0:
                write_outputs(rows, fixed, outputs, t, first, lanes)


N_ARRAYS = 10
"""Arrays in the address book of a plant: those of :func:`run_plants`, numbers, period [s]."""
ELEMENTS, SUBSTEPS, BEGUN, BEFORE = range(4)
"""Whole numbers of a plant's address book, the last arguments of :func:`run_plants`."""


@kernel
def run_by_address(book: Any, flag: int) -> None:
    """Run one plant through one control period, given the address book of its arrays."""
    flags, numbers = array_at(book, 6, 1, 1), array_at(book, 8, 1, 1)
    flags[0] = flag
    run_plants(
        array_at(book, 0, 3, 0),
        array_at(book, 1, 3, 0),
        array_at(book, 2, 3, 1),
        array_at(book, 3, 3, 0),
        array_at(book, 4, 2, 0),
        array_at(book, 5, 3, 0),
        flags,
        array_at(book, 7, 3, 0),
        numbers[ELEMENTS],
        numbers[SUBSTEPS],
        array_at(book, 9, 1, 0)[0],
        numbers[BEGUN],
        numbers[BEFORE],
    )
    numbers[BEGUN] = numbers[BEGUN] + 1


@dataclass(frozen=True)
class Loop:
    """Loop of a variant of a plant.

    Attributes
    ----------
    name : str
        Name of the variant and its outputs, also of the compiled code.
    kernels : mapping
        Replacements of the placeholders: ``plant_drive(rows, fixed, drives, t, column, j)`` writes
        the inputs of lane ``j``, ``plant_begin(rows, fixed, counts, table, extra, drives, t, first,
        elements, work)`` begins a tile, ``plant_advance(rows, fixed, counts, table, extra,
        elements, substeps, period, work)`` advances it; and those of the plant's step.
    outputs : sequence of int
        Rows of the state that are outputs.
    rows, parameters, counts, work : int
        Rows of state, parameters, whole numbers and scratch.
    extra : ndarray
        Two-dimensional table [SI] that the step reads in addition to that of the hysteresis.
    """

    name: str
    kernels: Mapping[str, Any]
    outputs: Sequence[int]
    rows: int
    parameters: int
    counts: int
    work: int
    extra: Array

    def state(self, tiles: int, lanes: int) -> tuple[Array, NDArray[np.int64]]:
        """Return zeroed state and whole numbers of some tiles."""
        counts = np.zeros((tiles, self.counts, lanes), np.int64)
        return np.zeros((tiles, self.rows, lanes)), counts

    def names(self, lanes: int) -> dict[str, Any]:
        """Return the values of global names in the call graph of the loop."""
        return {
            "N_ROWS": self.rows,
            "N_PARAMETERS": self.parameters,
            "N_COUNTS": self.counts,
            "N_WORK": self.work,
            "LANES": lanes,
            "OUTPUT_ROWS": tuple(self.outputs),
            **self.kernels,
        }

    def function(self, lanes: int, parallel: bool, compiled: bool) -> Callable[..., Any]:
        """Return the loop ready to call, built once for each variant and number of lanes."""
        key = (self.name, lanes, parallel, compiled)
        if key not in _BUILT:
            names = self.names(lanes)
            if compiled:
                _BUILT[key] = build(run_plants, f"run_{self.name}_{lanes}", parallel, **names)
            else:
                _BUILT[key] = interpreted(run_plants, names)
        return _BUILT[key]


def loop_for(
    name: str, plant: Any, layout: Any, kernels: Mapping[str, Any],
    replacements: Callable[[int | None], Mapping[str, Any]], outputs: Iterable[int], work: int, *,
    extended: bool, readings: Mapping[str, int] | None = None, operators: int = 1,
    parameters: int | None = None, extra: Array | None = None,
) -> Loop:  # fmt: skip
    """Return the loop of a variant of plants, plain or extended.

    Parameters
    ----------
    name, kernels, work, extra
        As of :class:`Loop`; ``layout`` is the plant's module of rows (``core.rows``).
    replacements : callable
        From the first row of the effects' state, None for a plain plant, to the kernels of the
        plant's step.
    outputs : iterable of int
        Rows of a rollout's signals.
    readings : mapping, optional
        Row of the bias of each sensor, by name: the outputs are their readings instead.
    operators, parameters : int
        Number of its hysteresis operators; rows of parameters, by default ``layout.N_PARAMETERS``.
    """
    effects = layout.END + operators * state_rows(plant.hysteresis.kind)
    made = {"END": layout.END, **kernels, **replacements(effects if extended else None)}
    if readings is not None:
        made |= {"BIAS_ROWS": tuple(readings.values()), "plant_output": biased_output}
        outputs = [effects + layout.STATE.sensors + k for k in range(len(readings))]
    what = ("_extended" if extended else "") + ("_readings" if readings is not None else "")
    return Loop(
        name + what,
        made,
        tuple(outputs),
        rows=effects + (layout.STATE.end if extended else 0),
        parameters=layout.N_PARAMETERS if parameters is None else parameters,
        counts=layout.N_COUNTS,
        work=work,
        extra=np.zeros((1, 1)) if extra is None else extra,
    )


_BUILT: dict[tuple[Any, ...], Callable[..., Any]] = {}


def run(
    loop: Loop, plant: Any, columns: ArrayLike, drives: Array, *, plants: int | None = None,
    flags: ArrayLike | None = None, substeps: int | None = None, period: float | None = None,
    before: bool = False, lanes: int | None = None, parallel: bool = False,
    compiled: bool = COMPILED,
) -> Array:  # fmt: skip
    """Run parameter sets of one variant of plants side by side, from their beginning.

    Parameters
    ----------
    plant : Plant
        Gives the hysteresis, and sub-steps and control period [s] unless others are given.
    columns : array_like, shape (n, n_parameters)
        Parameter sets; the last serves all further columns of ``drives``, up to ``plants``.
    drives : ndarray, shape (channels, T, n or 1)
        Inputs [SI], see :func:`drives_of`.
    flags : array_like of int, shape (T,), optional
        Default: begin with the first control period.
    before : bool
        Whether outputs are those at the beginning of each control period.
    lanes : int, optional
        Plants that a tile advances together.
    parallel, compiled : bool
        Whether tiles may be spread over the cores, and kernels run as machine code.

    Returns
    -------
    ndarray, shape (outputs, T, n)
    """
    n = len(np.asarray(columns)) if plants is None else plants
    width = lanes or (LANES if compiled else 1)
    fixed = in_tiles(columns, n, width)
    given = np.zeros(drives.shape[1], np.int64)
    given[:1] = BEGIN
    outputs = np.empty((len(loop.outputs), drives.shape[1], n))
    call(
        loop, plant, [*loop.state(len(fixed), width)], fixed, drives,
        given if flags is None else np.asarray(flags, np.int64), outputs, substeps, period,
        before=before, parallel=parallel, compiled=compiled,
    )  # fmt: skip
    return outputs


def call(
    loop: Loop, plant: Any, state: Sequence[Any], fixed: Array, drives: Array,
    flags: NDArray[np.int64], outputs: Array, substeps: int | None = None,
    period: float | None = None, *, table: Array | None = None, begun: int = 0,
    before: bool = False, parallel: bool = False, compiled: bool = COMPILED,
) -> None:  # fmt: skip
    """Run tiles that exist already; their state and the outputs change in place (:func:`run`).

    ``table`` is that of the hysteresis; default: of ``plant``.
    """
    rows, counts = state
    arrays = [
        rows, fixed, counts, plant.hysteresis_tables()[:1] if table is None else table, loop.extra,
        np.ascontiguousarray(drives), flags, outputs,
    ]  # fmt: skip
    numbers = (
        plant.elements,
        plant.substeps if substeps is None else substeps,
        plant.control_period if period is None else period,
        begun,
        int(before),
    )
    spread = compiled and parallel and len(rows) > 1 and threads() > 1
    function = loop.function(rows.shape[2], spread, compiled)
    if compiled:
        function(*arrays, *numbers)
        return
    lists = [array.tolist() for array in arrays]
    function(*lists, *numbers)
    for array, values in zip((rows, counts, outputs), (lists[0], lists[2], lists[7]), strict=True):
        array[...] = values


def simulate_plants(
    loop_of: Callable[..., Loop], plants: Any, make: Sequence[str], drives: Array,
    signals: Iterable[str], *, single: bool, flags: ArrayLike | None = None,
    compiled: bool = COMPILED,
) -> dict[str, Array]:  # fmt: skip
    """Run one plant, or several of one variant, and return the signals of its loop by name.

    ``single`` leaves out the last axis of shape (T, n); ``make`` are the attributes that all plants
    have in common.
    """
    several = plants_of(plants)
    first = first_of(several, *make)
    loop = loop_of(first, any(plant.extended for plant in several))
    columns = [plant.parameter_rows() for plant in several]
    n = len(several) if len(several) > 1 else drives.shape[2]
    made = run(loop, first, columns, drives, plants=n, flags=flags, compiled=compiled)
    return {name: made[k, :, 0] if single else made[k] for k, name in enumerate(signals)}


def plants_of(plants: Any) -> list[Any]:
    """Return one plant, or several, as a list."""
    return [plants] if hasattr(plants, "parameter_rows") else list(plants)


def first_of(plants: Sequence[P], *words: str) -> P:
    """Return the first of some plants that run side by side.

    ``words`` are attributes that need to be the same in all of them, since they choose the code.
    """
    if not plants:
        raise ValueError("no plants are given; give one or more")
    makes = {tuple(attrgetter(word)(plant) for word in words) for plant in plants}
    if len(makes) != 1:
        raise ValueError(
            f"plants that are simulated together need to be of one variant ({', '.join(words)}), "
            f"got {makes}"
        )
    return plants[0]


def in_tiles(parameters: ArrayLike, plants: int, lanes: int) -> Array:
    """Return parameter sets, shape (n, n_parameters), as (tiles, n_parameters, lanes).

    The last set is repeated up to ``plants`` columns, and to fill the last tile.
    """
    columns: NDArray[Any] = np.asarray(parameters, np.float64)
    tiles = -(-plants // lanes)
    columns = columns[np.minimum(np.arange(tiles * lanes), len(columns) - 1)]
    return np.ascontiguousarray(columns.T.reshape(-1, tiles, lanes).transpose(1, 0, 2))


def drives_of(channels: Sequence[ArrayLike]) -> Array:
    """Return channels side by side, shape (channels, T, n); each is (), (T,) or (T, n)."""
    given = [np.asarray(channel, np.float64) for channel in channels]
    periods = max(len(c) if c.ndim else 1 for c in given)
    columns = max(c.shape[1] if c.ndim == 2 else 1 for c in given)
    shaped = [c[:, None] if c.ndim == 1 else c for c in given]
    return np.array([np.broadcast_to(c, (periods, columns)) for c in shaped])
