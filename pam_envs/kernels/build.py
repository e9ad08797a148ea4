"""Kernels: pure functions, compiled with numba or run as plain Python.

A *kernel* is a plain Python function of scalars (or of rows of scalars) marked :func:`kernel`.
:func:`build` turns one and all that it calls into machine code with numba, or, with
``PAM_ENVS_COMPILE=0`` in the environment, leaves it plain Python. Both give the same bits, because
nothing here calls libm, BLAS or LAPACK, no fast-math is allowed, and random numbers are integer
arithmetic on a counter.

Arrays reach a kernel as *rows*: ``rows[FIELD][lane]``. Compiled, ``rows`` is a two-dimensional
array whose last axis is the lane, so that the innermost loop over lanes vectorises; uncompiled, a
list of lists does the same work on Python floats.
"""

from __future__ import annotations

import hashlib
import os
import types
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

F = TypeVar("F", bound=Callable[..., Any])
Bound = frozenset[tuple[str, Any]]
"""Global names of a call graph and their values."""

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
    """Mark a function that kernels call seldom; compiled, it stays a function of its own."""
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
    """Mark a function that Python calls: compiled on its first call and kept on disk."""
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
    """Return how many threads a kernel may use: ``OMP_NUM_THREADS`` bounds them, as elsewhere."""
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
    placeholders in its module.

    Parameters
    ----------
    function : callable
        A kernel.
    name : str
        Its name, also of its file in the cache.
    parallel : bool
        Spread ``prange`` loops over the cores.
    **names : object
        Values for global names, wherever the call graph uses them.
    """
    if COMPILED:
        from pam_envs.kernels.compiler import compiled

        return compiled(function, name, parallel, names)
    return interpreted(function, names)


def interpreted(function: Callable[..., Any], names: dict[str, Any]) -> Callable[..., Any]:
    """Return ``function`` as plain Python, with some global names of its call graph replaced."""
    return rebind(function, names, lambda made, *_: made, {}) if names else function


def rebind(
    function: Callable[..., Any],
    names: dict[str, Any],
    finish: Callable[[Callable[..., Any], Any, Bound], Callable[..., Any]],
    done: dict[Any, Callable[..., Any]],
    known: dict[Any, Bound] | None = None,
) -> Callable[..., Any]:
    """Return a copy of a kernel whose callees are copies too, each passed through ``finish``.

    Parameters
    ----------
    function : callable
        A kernel. It is copied anew in every call.
    names : dict
        Values for global names, wherever the call graph uses them.
    finish : callable
        Gets the copy, the original, and the names and values that are bound in its call graph.
    done : dict
        The callees so far, by original and what is bound in it: those that use none of the names,
        or the same values, are made once. It can serve several calls with other names.
    known : dict, optional
        What is bound in each function with these ``names``.
    """
    known = {} if known is None else known
    scope = dict(function.__globals__)  # type: ignore[attr-defined]
    for used in function.__code__.co_names:  # type: ignore[attr-defined]
        value: Any = names.get(used, scope.get(used))
        if hasattr(value, "__pam_kernel__"):
            key = (value, bound(value, names, known))
            if key not in done:
                done[key] = rebind(value, names, finish, done, known)
            value = done[key]
        if used in scope:
            scope[used] = value
    made = types.FunctionType(
        function.__code__,  # type: ignore[attr-defined]
        scope,
        function.__name__,
        function.__defaults__,  # type: ignore[attr-defined]
    )
    made.__qualname__ = function.__qualname__
    made.__module__ = function.__module__
    return finish(made, function, bound(function, names, known))


def bound(function: Callable[..., Any], names: dict[str, Any], known: dict[Any, Bound]) -> Bound:
    """Return those of ``names`` that the call graph of a kernel uses, with their values."""
    if function not in known:
        scope = function.__globals__  # type: ignore[attr-defined]
        found: set[tuple[str, Any]] = set()
        for used in function.__code__.co_names:  # type: ignore[attr-defined]
            value: Any = names.get(used, scope.get(used))
            if used in names and used in scope:
                found.add((used, value))
            if hasattr(value, "__pam_kernel__"):
                found |= bound(value, names, known)
        known[function] = frozenset(found)
    return known[function]


def graph_digest(
    function: Callable[..., Any], names: Mapping[str, Any], known: dict[Any, str] | None = None
) -> str:
    """Return a digest of a call graph: what machine code on disk is valid for.

    Covers the byte code, the constants and the values of global names of a kernel and of all that
    it calls. Comments, docstrings, line numbers and the names of modules do not matter.

    Parameters
    ----------
    function : callable
        A kernel.
    names : mapping
        Values that replace global names, wherever the call graph uses them.
    known : dict, optional
        Digests of functions with these ``names`` so far.
    """
    known = {} if known is None else known
    if function not in known:
        known[function] = ""  # ends recursion
        code, scope = function.__code__, function.__globals__  # type: ignore[attr-defined]
        constants = code.co_consts[1:] if function.__doc__ else code.co_consts
        parts = [code.co_code.hex(), repr(constants), repr(code.co_names), repr(code.co_varnames)]
        parts.append(repr(function.__defaults__))  # type: ignore[attr-defined]
        for used in code.co_names:
            value = names.get(used, scope.get(used))
            if isinstance(value, types.ModuleType):
                read = {n: getattr(value, n) for n in code.co_names if hasattr(value, n)}
                parts += [f"{n}={_value_text(v, names, known)}" for n, v in read.items()]
            elif used in scope or used in names:
                parts.append(f"{used}={_value_text(value, names, known)}")
        known[function] = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]
    return known[function]


def _value_text(value: Any, names: Mapping[str, Any], known: dict[Any, str]) -> str:
    """Return the value of a global name as text that is the same in every process."""
    if isinstance(value, types.FunctionType):
        return graph_digest(value, names, known)
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{value.tobytes().hex()}"
    if isinstance(value, int | float | str | tuple | frozenset | None):
        return repr(value)
    return f"{type(value).__name__} {getattr(value, '__qualname__', '')}"


def cache_folder() -> Path:
    """Return the folder for compiled code (``PAM_ENVS_CACHE``, else the user's cache folder)."""
    given = os.environ.get("PAM_ENVS_CACHE")
    if given:
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "pam_envs"
