"""The one place that knows the compiler, and the arithmetic that every kernel may use.

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
import math
import os
import types
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

F = TypeVar("F", bound=Callable[..., Any])
Bound = frozenset[tuple[str, Any]]
"""Global names of a call graph and what stands for them."""

COMPILED: bool = os.environ.get("PAM_ENVS_COMPILE", "1").lower() not in {"0", "false", "no", "off"}
"""Whether kernels are compiled (``PAM_ENVS_COMPILE=0`` runs them as plain Python)."""

LANES = 32 if COMPILED else 4
"""Environments that one tile of a batch advances together. Plain Python computes them one by one,
those that fill up the last tile too."""

WITHOUT_KERNELS = ("data", "diagnosis", "__main__.py")
"""Parts of the package that compiled code does not depend on."""

_MASK = 0xFFFFFFFF
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

    Compiled, the sizes are constants, so that the compiler knows how far apart the rows lie.
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
    from pam_envs.compiler import get_num_threads

    wanted = os.environ.get("OMP_NUM_THREADS", "")
    most = int(get_num_threads())
    return max(1, min(most, int(wanted))) if wanted.isdigit() else most


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
        What to call it (and its file in the cache).
    parallel : bool
        Spread ``prange`` loops over the cores.
    **names : object
        Values for global names, wherever the call graph uses them.
    """
    if COMPILED:
        from pam_envs.compiler import compiled

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


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Return a digest of the package's sources: what compiled code on disk is valid for.

    The folders that hold no kernels are left out.
    """
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        if path.relative_to(root).parts[0] in WITHOUT_KERNELS:
            continue
        digest.update(str(path.relative_to(root)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder for compiled code (``PAM_ENVS_CACHE``, else the user's cache folder)."""
    given = os.environ.get("PAM_ENVS_CACHE")
    if given:
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "pam_envs"


# --- arithmetic without libm --------------------------------------------------------------------


@kernel
def clip(x: float, low: float, high: float) -> float:
    """Return ``x`` held between ``low`` and ``high``."""
    return max(low, min(high, x))


@kernel
def round_to_integer(x: float) -> float:
    """Return the nearest integer as a float, ties to even, for ``abs(x) < 2**51``."""
    return (x + 6755399441055744.0) - 6755399441055744.0


@kernel
def quantise(x: float, step: float) -> float:
    """Return the nearest multiple of ``step``; ``step = 0`` leaves ``x`` as it is."""
    if step > 0.0:
        return round_to_integer(x / step) * step
    return x


@kernel
def decay(x: float) -> float:
    """Return ``exp(-x)`` for ``x`` from -20 to 40, to 1e-9 relative (1e-13 up to 5 in size).

    The tenth-order series of ``exp(-x / 64)``, squared six times. Larger ``x`` count as 40.
    """
    y = -min(x, 40.0) * 0.015625
    y2 = y * y
    low = (1.0 + y) + y2 * (0.5 + y * (1.0 / 6.0))
    middle = (1.0 / 24.0 + y * (1.0 / 120.0)) + y2 * (1.0 / 720.0 + y * (1.0 / 5040.0))
    high = (1.0 / 40320.0 + y * (1.0 / 362880.0)) + y2 * (1.0 / 3628800.0)
    y4 = y2 * y2
    t = low + y4 * (middle + y4 * high)
    t = t * t
    t = t * t
    t = t * t
    t = t * t
    t = t * t
    return t * t


@kernel
def sine_of_turns(turns: float) -> float:
    """Return ``sin(2 pi turns)`` to 1e-15, for ``abs(turns) < 1e9``."""
    x = turns - round_to_integer(turns)
    if x > 0.25:
        x = 0.5 - x
    if x < -0.25:
        x = -0.5 - x
    a = x * 6.283185307179586
    y = a * a
    t = y * (1.0 / 51090942171709440000.0) - 1.0 / 121645100408832000.0
    t = t * y + 1.0 / 355687428096000.0
    t = t * y - 1.0 / 1307674368000.0
    t = t * y + 1.0 / 6227020800.0
    t = t * y - 1.0 / 39916800.0
    t = t * y + 1.0 / 362880.0
    t = t * y - 1.0 / 5040.0
    t = t * y + 1.0 / 120.0
    t = t * y - 1.0 / 6.0
    t = t * y + 1.0
    return t * a


# --- random numbers: a function of (seed, episode, stream, draw) --------------------------------


@kernel
def mix(x: int) -> int:
    """Return a 32-bit word that depends on every bit of the 32-bit word ``x`` (a bijection).

    Three multiply-and-xorshift rounds with the constants of the "triple32" search
    (C. Wellons, hash-prospector, public domain), whose bias is near that of a random permutation.
    """
    x = x ^ (x >> 17)
    x = (x * 0xED5AD4BB) & 0xFFFFFFFF
    x = x ^ (x >> 11)
    x = (x * 0xAC4C1B51) & 0xFFFFFFFF
    x = x ^ (x >> 15)
    x = (x * 0x31848BAB) & 0xFFFFFFFF
    return x ^ (x >> 14)


@kernel
def episode_key(seed_word: int, episode: int) -> int:
    """Return the key word of one episode from one key word of the seed."""
    return mix(seed_word ^ mix((episode + 0x5851F42D) & 0xFFFFFFFF))


@kernel
def random_word(key_a: int, key_b: int, stream: int, draw: int) -> int:
    """Return 32 random bits for one draw of one stream of one episode."""
    counter = draw * 0x9E3779B9 + stream * 0x85EBCA6B
    return mix((key_b ^ mix((key_a ^ counter) & 0xFFFFFFFF)) & 0xFFFFFFFF)


@kernel
def uniform(key_a: int, key_b: int, stream: int, draw: int) -> float:
    """Return a uniform number in (0, 1)."""
    return (random_word(key_a, key_b, stream, draw) + 0.5) * 2.3283064365386963e-10


@kernel
def log_of_fraction(u: float) -> float:
    """Return ``log(u)`` for ``2**-33 <= u <= 1``, to 1e-11 absolute."""
    e = 0.0
    if u < 1.52587890625e-05:
        u = u * 65536.0
        e = e - 16.0
    if u < 0.00390625:
        u = u * 256.0
        e = e - 8.0
    if u < 0.0625:
        u = u * 16.0
        e = e - 4.0
    if u < 0.25:
        u = u * 4.0
        e = e - 2.0
    if u < 0.5:
        u = u * 2.0
        e = e - 1.0
    if u < 0.5:  # 2**-33 needs one step more
        u = u * 2.0
        e = e - 1.0
    s = (u - 0.7071067811865476) / (u + 0.7071067811865476)
    y = s * s
    t = y * (2.0 / 13.0) + 2.0 / 11.0
    t = t * y + 2.0 / 9.0
    t = t * y + 2.0 / 7.0
    t = t * y + 2.0 / 5.0
    t = t * y + 2.0 / 3.0
    t = t * y + 2.0
    return s * t + (e - 0.5) * 0.6931471805599453


@kernel
def normal_quantile(u: float) -> float:
    """Return the standard normal quantile of ``u`` in (0, 1), to 1e-6.

    M. J. Wichura, "Algorithm AS 241: the percentage points of the normal distribution",
    Applied Statistics 37 (1988), the seven-figure variant.
    """
    q = u - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        top = ((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179
        low = ((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0
        return q * top / low
    r = math.sqrt(-log_of_fraction(min(u, 1.0 - u))) - 1.6
    top = ((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777
    low = (0.12021132975 * r + 0.73700164250) * r + 1.0
    value = top / low
    if q < 0.0:
        return -value
    return value


@kernel
def normal(key_a: int, key_b: int, stream: int, draw: int) -> float:
    """Return a standard normal number (32 bits of it: at most 6.3 in size)."""
    return normal_quantile(uniform(key_a, key_b, stream, draw))


def seed_words(seed: int) -> tuple[int, int]:
    """Return the two 32-bit key words of a non-negative integer seed of any size."""
    if seed < 0:
        raise ValueError(f"seed must be a non-negative integer, got {seed}")
    a, b = 0x243F6A88, 0xB7E15162
    while True:
        word = seed & _MASK
        a = int(mix(a ^ mix(word)))
        b = int(mix((b + a) & _MASK ^ mix(word ^ 0x5BF03635)))
        seed >>= 32
        if not seed:
            return a, b
