"""Kernels: pure functions, compiled with numba or run as plain Python.

A *kernel* is a plain Python function of scalars (or of rows of scalars) marked :func:`kernel`.
:func:`build` turns one and all that it calls into machine code with numba, or, with
``PAM_ENVS_COMPILE=0`` in the environment, leaves it plain Python. Both give the same bits, because
kernels do not call libm, BLAS or LAPACK, fast-math is off, and random numbers are integer
arithmetic on a counter.

Arrays reach a kernel as *rows*: ``rows[FIELD][lane]``. Compiled, ``rows`` is a two-dimensional
array whose last axis is the lane, so that the innermost loop over lanes vectorises; uncompiled, a
list of lists does the same work on Python floats.
"""

import os
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pam_envs.kernels.rebind import rebind

F = TypeVar("F", bound=Callable[..., Any])

COMPILED: bool = os.environ.get("PAM_ENVS_COMPILE", "1").lower() not in {"0", "false", "no", "off"}
"""True if kernels are compiled (``PAM_ENVS_COMPILE=0`` runs them as plain Python)."""

LANES = 32 if COMPILED else 4
"""Environments that one tile of a batch advances together. Plain Python computes them one by one,
those that fill up the last tile too."""

prange = range


def kernel(function: F) -> F:
    """Mark a function that kernels call; compiled, it is inlined into them."""
    function.__pam_kernel__ = True  # type: ignore[attr-defined]
    return function


def routine(function: F) -> F:
    """Mark a function that kernels rarely call; compiled, it is not inlined."""
    function.__pam_kernel__ = False  # type: ignore[attr-defined]
    return function


class Entry:
    """A function for Python to call, built when it is first called."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func = function
        self._built: Callable[..., Any] | None = None
        self.__doc__ = function.__doc__

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function."""
        if self._built is None:
            self._built = build(self.py_func, self.py_func.__name__)
        return self._built(*arguments)


def entry(function: F) -> F:
    """Mark a function that Python calls: compiled on its first call and cached on disk."""
    return Entry(function) if COMPILED else function  # type: ignore[return-value]


def scratch(rows: int, lanes: int) -> Any:
    """Return rows of scratch for one tile."""
    return [[0.0] * lanes for _ in range(rows)]


def tile_view(tiles: Any, tile: int, rows: int, lanes: int) -> Any:
    """Return one tile of ``rows`` by ``lanes`` numbers.

    Compiled, the sizes are constants, so that the compiler knows the strides of the rows.
    """
    return tiles[tile]


def array_at(book: Any, index: int, dimensions: int, kind: int) -> Any:
    """Return an array of an :func:`address_book`.

    ``kind`` is 0 for float64, 1 for int64, 2 for float32 and 3 for int8.
    """
    raise NotImplementedError("only compiled kernels read arrays by their address")


def lane_view(rows: Any, lane: int) -> Any:
    """Return rows of shape (n, N) such that ``[k][0]`` is the element of a lane.

    An array of one column is the same for all lanes.
    """
    raise NotImplementedError("only compiled kernels view one lane of a batch")


INTRINSICS = dict.fromkeys(
    ("prange", "tile_view", "lane_view", "scratch", "array_at"), "of the compiler"
)
"""Names that the compiler replaces, for digests of a call graph."""


def address_book(arrays: Sequence[NDArray[Any]]) -> NDArray[np.int64]:
    """Return addresses and shapes of arrays that stay alive, four words each.

    A compiled function takes one such book faster than it takes the arrays.
    """
    book = np.zeros((len(arrays), 4), np.int64)
    for row, array in zip(book, arrays, strict=True):
        if not array.flags.c_contiguous or array.ndim > 3:
            raise ValueError(f"an array of shape {array.shape} is not contiguous or too deep")
        row[0], row[1 : 1 + array.ndim] = array.ctypes.data, array.shape
    return book.ravel()


def threads() -> int:
    """Return the number of threads that a kernel may use, at most ``OMP_NUM_THREADS``."""
    if not COMPILED:
        return 1
    from pam_envs.kernels.compiler import get_num_threads

    given = os.environ.get("OMP_NUM_THREADS", "")
    most = int(get_num_threads())
    return max(1, min(most, int(given))) if given.isdigit() else most


def build(
    function: Callable[..., Any], name: str, parallel: bool = False, **names: Any
) -> Callable[..., Any]:
    """Return ``function`` ready to call, with some global names of its call graph replaced.

    So a loop nest is written once and built for each plant: the physics that it calls are
    placeholders in its module. ``name`` is also that of its file in the cache; ``parallel`` spreads
    ``prange`` loops over the cores.
    """
    if COMPILED:
        from pam_envs.kernels.compiler import compiled

        return compiled(function, name, parallel, names)
    return interpreted(function, names)


def interpreted(function: Callable[..., Any], names: dict[str, Any]) -> Callable[..., Any]:
    """Return ``function`` as plain Python, with some global names of its call graph replaced."""
    return rebind(function, names, lambda made, *_: made, {}) if names else function
