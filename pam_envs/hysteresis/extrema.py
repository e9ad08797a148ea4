"""Stack of dominant extrema, the state of a Preisach operator, and the recursive inverse.

The operator stores the alternating extrema of its input that no later, larger excursion has wiped
out, each with the output reached there. In the rows of a lane

- ``stack[0]`` is the start of the history: ``low``, where every relay is down; or, in a virgin
  history, the largest excursion so far of either sign (0 at the start, in a range ``-h..h``);
- ``stack[count - 2]`` is the last turn and ``stack[count - 1]`` the present input;
- ``sums[k]`` is the output at ``stack[k]``, so that one term of the Everett map gives the next.

An output is always computed from a stored turn, never accumulated: intermediate stops and returns
to a turn change no bit.
"""

import math
from typing import Any

from pam_envs.arrays import Array
from pam_envs.hysteresis.everett import everett
from pam_envs.kernels.arithmetic import clip
from pam_envs.kernels.build import LANES, entry, kernel, scratch

DEPTH = 24
"""Depth of the stack in the rows of a plant."""
LOW, INVERSE_CELL, HIGH, BOTTOM, START_OUTPUT = range(1, 6)
"""Rows of an operator's numbers, counted from the slope; the last two are the first point."""


# Branches live in kernels of scalars, and the kernels that hold rows run straight through: the
# compiler then needs no reference counts on the rows, which makes a step three times as fast.


@kernel
def _held(x: float, low: float, high: float) -> float:
    """Return ``x`` within its range, and ``low`` for a value that is not a number."""
    if not x > low:
        return low
    return min(x, high)


@kernel
def _rises(x: float, last: float, goes_up: bool) -> bool:
    """Return the direction of ``x``; without motion, that of the present branch."""
    return goes_up if x == last else x > last


@kernel
def _branch(n: int, rising: bool, goes_up: bool) -> int:
    """Return the count of turns, less the present input if the same branch continues."""
    if n > 1 and rising == goes_up:
        return n - 1
    return n


@kernel
def _passes(x: float, bound: float, rising: bool) -> bool:
    return x >= bound if rising else x <= bound


@kernel
def _base(n: int, value: float, start_value: float, start: float, low: float) -> int:
    """Return 0 if the history begins anew: at ``low``, or beyond the largest virgin excursion."""
    if n == 1 and (value == start_value or (start != low and abs(value) >= abs(start_value))):
        return 0
    return n


@kernel
def _room(n: int, depth: int) -> int:
    return n - 1 if n == depth else n


@kernel
def _origin(
    n: int, x: float, turn: float, output: float, start: float, low: float
) -> tuple[float, float, float]:
    """Return the turn that an output is counted from, the output there, and the map's factor.

    A virgin curve is half the branch from the opposite input, counted from 0.
    """
    if n > 0 or start == low:
        return turn, output, 1.0
    return -x, 0.0, 0.5


@kernel
def _find_turn(
    x: float, stack: Any, sums: Any, count: Any, lane: int, low: float
) -> tuple[int, float, float, float]:
    """Return the number of points that remain, and the turn, output and factor to count from."""
    n = count[lane]
    last, start = stack[n - 1][lane], stack[0][lane]
    goes_up = last > stack[max(n - 2, 0)][lane]
    rising = _rises(x, last, goes_up)
    n = _branch(n, rising, goes_up)
    while n > 1 and _passes(x, stack[n - 2][lane], rising):
        n -= 2  # a loop is closed and wiped out
    n = _room(_base(n, x, start, start, low), len(stack))
    k = max(n - 1, 0)
    turn, output, part = _origin(n, x, stack[k][lane], sums[k][lane], start, low)
    return n, turn, output, part


@kernel
def preisach_step(
    x: float, stack: Any, sums: Any, count: Any, lane: int, table: Any, low: float,
    inverse_cell: float,
) -> float:  # fmt: skip
    """Advance the hysteresis of one lane to the input ``x`` and return the output.

    Parameters
    ----------
    x : float
        Input [unit of the table]. Beyond the table's range it counts as the nearest end;
        not-a-number counts as low.
    stack, sums : rows of float, shape (depth, lanes)
        Extrema and the outputs there; changed in place. ``depth`` is at least 3.
    count : row of int, shape (lanes,)
        Number of points in use of each ``lane``; changed in place.
    table : rows of float, shape (n, n)
        Antisymmetric Everett map.
    low, inverse_cell : float
        Input of the table's first row, and cells per unit of input, ``(n - 1) / (high - low)``.

    Notes
    -----
    When the stack is full, a further turn is not stored: the smallest loop, that between the last
    turn and the present input, is dropped, and the input moves back and forth on the branch
    that led to that turn. The output has no jump, and all larger loops are kept exactly.
    """
    x = _held(x, low, low + (len(table) - 1) / inverse_cell)
    n, turn, output, part = _find_turn(x, stack, sums, count, lane, low)
    change = everett((x - low) * inverse_cell, (turn - low) * inverse_cell, table)
    y = output + part * change
    stack[n][lane] = x
    sums[n][lane] = y
    count[lane] = n + 1
    return y


@kernel
def _halved(i: int, k: int, upper: bool) -> tuple[int, int]:
    middle = (i + k) // 2
    return (middle, k) if upper else (i, middle)


@kernel
def _part(rest: float, rise: float) -> float:
    return clip(rest / rise, 0.0, 1.0) if rise > 0.0 else 0.0


@kernel
def _on_branch(change: float, b: float, table: Any) -> float:
    """Return ``a`` in cells with ``everett(a, b) = change``: linear in ``a`` within a cell."""
    i, k = 0, len(table) - 1
    while k - i > 1:
        middle = (i + k) // 2
        i, k = _halved(i, k, everett(middle * 1.0, b, table) <= change)
    first = everett(i * 1.0, b, table)
    rise = everett(k * 1.0, b, table) - first
    return i + _part(change - first, rise)


@kernel
def _virgin_input(y: float, table: Any) -> float:
    """Return ``a`` in cells with ``everett(a, n - 1 - a) / 2 = y``: quadratic within a cell."""
    top = len(table) - 1
    i, k = 0, top
    while k - i > 1:
        middle = (i + k) // 2
        i, k = _halved(i, k, table[middle][top - middle] <= 2.0 * y)
    first, last = table[i][top - i], table[k][top - k]
    corner = table[i][top - k] + table[k][top - i]
    # first + s (last - first) + s (1 - s) bend = 2 y
    bend = corner - first - last
    slope, rest = last - first + bend, 2.0 * y - first
    root = math.sqrt(max(0.0, slope * slope - 4.0 * bend * rest))
    return i + _part(2.0 * rest, slope + root)


@kernel
def _input(n: int, y: float, change: float, b: float, virgin: bool, table: Any) -> float:
    if n == 0 and virgin:
        return _virgin_input(y, table)
    return _on_branch(change, b, table)


@kernel
def _either(first: bool, a: float, b: float) -> float:
    return a if first else b


@kernel
def preisach_inverse(
    y: float, stack: Any, sums: Any, count: Any, lane: int, table: Any, low: float,
    inverse_cell: float,
) -> float:  # fmt: skip
    """Return the input that takes the output of one lane to ``y``; the state is not changed.

    The recursion ``E(u_next, u_turn) = y - y_turn`` from the last turn that ``y`` leaves: exact,
    unlike a series over an inverted Everett map, which holds only for relay densities of ``alpha -
    beta`` alone. An output out of reach gives the end of the range. Parameters are those of
    :func:`preisach_step`.
    """
    n = count[lane]
    last, start = sums[n - 1][lane], stack[0][lane]
    goes_up = stack[n - 1][lane] > stack[max(n - 2, 0)][lane]
    rising = _rises(y, last, goes_up)
    present = stack[n - 1][lane]
    n = _branch(n, rising, goes_up)
    while n > 1 and _passes(y, sums[n - 2][lane], rising):
        n -= 2
    n = _room(_base(n, y, sums[0][lane], start, low), len(stack))
    k = max(n - 1, 0)
    b = (stack[k][lane] - low) * inverse_cell
    found = _input(n, y, y - sums[k][lane], b, start != low, table)
    return _either(y == last, present, low + found / inverse_cell)


@entry
def advance_rows(
    x: Array, stack: Any, sums: Any, count: Any, table: Any, low: float, inverse_cell: float,
    y: Array,
) -> None:  # fmt: skip
    """Write into ``y`` the outputs of every lane for its inputs in turn, ``x[t][lane]``."""
    for t in range(len(x)):
        for lane in range(len(x[t])):
            y[t][lane] = preisach_step(
                x[t][lane], stack, sums, count, lane, table, low, inverse_cell
            )


@entry
def invert_rows(
    y: Array, stack: Any, sums: Any, count: Any, table: Any, low: float, inverse_cell: float,
    x: Array,
) -> None:  # fmt: skip
    """Write into ``x`` the inputs that give ``y[t][lane]`` in turn, and advance the states."""
    for t in range(len(y)):
        for lane in range(len(y[t])):
            found = preisach_inverse(y[t][lane], stack, sums, count, lane, table, low, inverse_cell)
            x[t][lane] = found
            preisach_step(found, stack, sums, count, lane, table, low, inverse_cell)


# --- tiles of lanes -----------------------------------------------------------------------------
# Most inputs continue along the present branch and stay in the present cell of the map. So the
# branch and the corners of its cell are kept in rows of their own, stack and map are read only
# where an input leaves them, and the outputs of all lanes are evaluated in one loop without
# branches or gathered values. The bits are those of preisach_step.

(
    PRESENT, OUTPUT, TURN, TURN_OUTPUT, PART, BOUND, CELL, CORNER, RISE, SHARE, OFFSET, BEND,
) = range(2 * DEPTH, 2 * DEPTH + 12)  # fmt: skip
"""State rows after stack and sums: present input and output, turn and output that the branch is
counted from, factor on the map, and the input at which the next loop closes; then the map's cell
of the present input, its lowest corner, the differences along the input, the position of the turn
across the cell, the corner's difference across times that, and the difference of differences."""
STATE_ROWS = 2 * DEPTH + 12
EVERYTHING = 1e300
"""Bound of a branch that closes no loop."""


@kernel
def _continues(x: float, present: float, turn: float, bound: float) -> float:
    """Return 1 if an input continues along the branch from a turn, 0 if it leaves it."""
    if present > turn:
        return 1.0 if x >= present and x < bound else 0.0
    return 1.0 if x <= present and x > bound else 0.0


@kernel
def _cell(a: float, last: float) -> float:
    """Return the cell of an input in cells, the last one included its upper end."""
    return min(int(a) * 1.0, last)


@kernel
def _bound(n: int, x: float, turn: float, closing: float, start: float, low: float) -> float:
    """Return the input at which a branch from ``n`` stored points ends.

    ``closing`` is the last but one of them. A virgin curve ends at once, and the first branch from
    it at its largest excursion.
    """
    if n == 0:
        return x
    largest = EVERYTHING if start == low else abs(start)
    if n == 1:
        return largest if x > turn else -largest
    return closing


@kernel
def _list_leaving(
    x: Any, rows: Any, low: Any, high: Any, inverse_cell: Any, last_cell: float, at: int,
    leaving: Any, first: int, last: int,
) -> int:  # fmt: skip
    """List the lanes whose inputs leave their branches or cells in row 0; return how many.

    Row 1 of ``leaving`` is 1 for a lane that continues along its branch.
    """
    present = rows[at + PRESENT]
    turn = rows[at + TURN]
    bound = rows[at + BOUND]
    cell = rows[at + CELL]
    staying = 0
    for j in range(first, last):
        held = _held(x[j], low[j], high[j])
        leaving[1][j] = _continues(held, present[j], turn[j], bound[j])
        same = 1.0 if _cell((held - low[j]) * inverse_cell[j], last_cell) == cell[j] else 0.0
        leaving[2][j] = leaving[1][j] * same
        staying = staying + int(leaving[2][j])
    if staying == last - first:
        return 0
    number = 0
    for j in range(first, last):
        leaving[0][number] = j
        number = number + (1 - int(leaving[2][j]))
    return number


@kernel
def _enter(x: float, rows: Any, counts: Any, at: int, count: int, j: int, low: float) -> None:
    """Move one lane from its present branch to that of the input ``x``."""
    stack, sums, points = rows[at : at + DEPTH], rows[at + DEPTH : at + 2 * DEPTH], counts[count]
    now = points[j] - 1
    stack[now][j], sums[now][j] = rows[at + PRESENT][j], rows[at + OUTPUT][j]
    n, turn, output, part = _find_turn(x, stack, sums, points, j, low)
    rows[at + TURN][j], rows[at + TURN_OUTPUT][j], rows[at + PART][j] = turn, output, part
    rows[at + BOUND][j] = _bound(n, x, turn, stack[max(n - 2, 0)][j], stack[0][j], low)
    stack[n][j] = x
    points[j] = n + 1


@kernel
def _enter_cell(x: float, rows: Any, at: int, j: int, table: Any, low: float, per: float) -> None:
    """Keep the corners of the map's cell of the input ``x`` and of the branch's turn."""
    b = (rows[at + TURN][j] - low) * per
    i, k = int(_cell((x - low) * per, len(table) - 2.0)), int(_cell(b, len(table) - 2.0))
    e00, e01, e10, e11 = table[i][k], table[i][k + 1], table[i + 1][k], table[i + 1][k + 1]
    share = b - k
    rows[at + CELL][j], rows[at + CORNER][j], rows[at + RISE][j] = i * 1.0, e00, e10 - e00
    rows[at + SHARE][j], rows[at + OFFSET][j] = share, share * (e01 - e00)
    rows[at + BEND][j] = (e00 + e11) - (e10 + e01)


@kernel
def _follow(
    x: Any, y: Any, rows: Any, low: Any, high: Any, inverse_cell: Any, at: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write the outputs on the present branches and in the present cells."""
    turn_output, part, cell = rows[at + TURN_OUTPUT], rows[at + PART], rows[at + CELL]
    corner, rise, share = rows[at + CORNER], rows[at + RISE], rows[at + SHARE]
    offset, bend = rows[at + OFFSET], rows[at + BEND]
    for j in range(first, last):
        s = (_held(x[j], low[j], high[j]) - low[j]) * inverse_cell[j] - cell[j]
        change = corner[j] + (s * rise[j] + offset[j]) + s * share[j] * bend[j]
        y[j] = turn_output[j] + part[j] * change


@kernel
def relays_step(
    x: Any, y: Any, rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int,
    model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Advance the extrema of a tile (:class:`~pam_envs.hysteresis.protocol.Kernels`)."""
    low, inverse_cell, high = fixed[model + LOW], fixed[model + INVERSE_CELL], fixed[model + HIGH]
    leaving, last_cell = scratch(3, LANES), len(table[0]) - 2.0
    present, output, members = rows[at + PRESENT], rows[at + OUTPUT], counts[member]
    number = _list_leaving(x, rows, low, high, inverse_cell, last_cell, at, leaving, first, last)
    for q in range(number):
        j = int(leaving[0][q])
        held = _held(x[j], low[j], high[j])
        if leaving[1][j] == 0.0:
            _enter(held, rows, counts, at, count, j, low[j])
        _enter_cell(held, rows, at, j, table[members[j]], low[j], inverse_cell[j])
    _follow(x, output, rows, low, high, inverse_cell, at, first, last)
    for j in range(first, last):
        y[j], present[j] = output[j], _held(x[j], low[j], high[j])


@kernel
def relays_peek(
    rows: Any, fixed: Any, counts: Any, table: Any, state: int, elements: int, x_at: int,
    lag_at: int, stick_at: int, operators: int, model: int, count: int, member: int, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write the lags at inputs, and their growth since the states were last moved."""
    leaving, last_cell, members = scratch(3, LANES), len(table[0]) - 2.0, counts[member]
    low, inverse_cell, high = fixed[model + LOW], fixed[model + INVERSE_CELL], fixed[model + HIGH]
    for m in range(operators):
        at = state + m * STATE_ROWS
        x, lag, stick = rows[x_at + m], rows[lag_at + m], rows[stick_at + m]
        present, output = rows[at + PRESENT], rows[at + OUTPUT]
        stack, sums = rows[at : at + DEPTH], rows[at + DEPTH : at + 2 * DEPTH]
        points = counts[count + m]
        _follow(x, lag, rows, low, high, inverse_cell, at, first, last)
        number = _list_leaving(
            x, rows, low, high, inverse_cell, last_cell, at, leaving, first, last
        )
        for q in range(number):
            j = int(leaving[0][q])
            held, now = _held(x[j], low[j], high[j]), points[j] - 1
            turn, start, part = rows[at + TURN][j], rows[at + TURN_OUTPUT][j], rows[at + PART][j]
            if leaving[1][j] == 0.0:
                stack[now][j], sums[now][j] = present[j], output[j]
                _, turn, start, part = _find_turn(held, stack, sums, points, j, low[j])
            a, b = (held - low[j]) * inverse_cell[j], (turn - low[j]) * inverse_cell[j]
            lag[j] = start + part * everett(a, b, table[members[j]])
        for j in range(first, last):
            found = lag[j]
            lag[j] = x[j] - found
            stick[j] = growth(x[j] - found - (present[j] - output[j]), x[j] - present[j])


@kernel
def growth(change: float, moved: float) -> float:
    """Return a difference quotient from 0 to 1, and a half where nothing moved."""
    if abs(moved) < 1e-9:
        return 0.5
    return clip(change / moved, 0.0, 1.0)


@kernel
def relays_begin(
    rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int, model: int, count: int,
    member: int, j: int,
) -> None:  # fmt: skip
    """Put every relay of one lane down, or leave it virgin (see ``BOTTOM``)."""
    bottom, output = fixed[model + BOTTOM][j], fixed[model + START_OUTPUT][j]
    rows[at][j], rows[at + DEPTH][j] = bottom, output
    rows[at + PRESENT][j] = rows[at + TURN][j] = rows[at + BOUND][j] = bottom
    rows[at + OUTPUT][j], rows[at + CELL][j] = output, -1.0
    counts[count][j] = 1
