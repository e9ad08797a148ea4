"""Call graphs of kernels: copies with replaced global names, and digests for the cache."""

import hashlib
import types
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Bound = frozenset[tuple[str, Any]]
"""Global names of a call graph and their values."""


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
        A kernel. It is copied again in every call.
    names : dict
        Values for global names, wherever the call graph uses them.
    finish : callable
        Takes the copy, the original, and the names and values that are bound in its call graph.
    done : dict
        The callees so far, by original and what is bound in it; may serve calls with other names.
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
    function: Callable[..., Any],
    names: Mapping[str, Any],
    known: dict[Any, str] | None = None,
    describe: Callable[[Any], list[str]] | None = None,
) -> str:
    """Return a digest of a call graph: the key of machine code on disk.

    Covers the byte code, the constants and the values of global names (replaced by ``names``) of a
    kernel and of all that it calls. Comments, docstrings, line numbers and the names of modules do
    not matter. ``known`` holds the digests with these ``names`` so far; ``describe`` returns what
    identifies the code of one function, by default :func:`byte_code`.
    """
    known = {} if known is None else known
    if function not in known:
        known[function] = ""  # ends recursion
        code, scope = function.__code__, function.__globals__  # type: ignore[attr-defined]
        parts = (describe or byte_code)(function)
        for used in code.co_names:
            value = names.get(used, scope.get(used))
            if isinstance(value, types.ModuleType):
                read = {n: getattr(value, n) for n in code.co_names if hasattr(value, n)}
                parts += [f"{n}={_value_text(v, names, known, describe)}" for n, v in read.items()]
            elif used in scope or used in names:
                parts.append(f"{used}={_value_text(value, names, known, describe)}")
        known[function] = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]
    return known[function]


def byte_code(function: Any) -> list[str]:
    """Return byte code, constants and names of a function, which differ between Python versions."""
    code = function.__code__
    constants = code.co_consts[1:] if function.__doc__ else code.co_consts
    parts = [code.co_code.hex(), repr(constants), repr(code.co_names), repr(code.co_varnames)]
    return [*parts, repr(function.__defaults__)]


def place(function: Any) -> list[str]:
    """Return file and line of a function, which identify it where the files are known."""
    code = function.__code__
    return [code.co_filename, str(code.co_firstlineno), code.co_name, repr(function.__defaults__)]


def _value_text(
    value: Any,
    names: Mapping[str, Any],
    known: dict[Any, str],
    describe: Callable[[Any], list[str]] | None,
) -> str:
    """Return the value of a global name as text that is the same in every process."""
    if isinstance(value, types.FunctionType):
        return graph_digest(value, names, known, describe)
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}{value.tobytes().hex()}"
    if isinstance(value, int | float | str | tuple | frozenset | None):
        return repr(value)
    return f"{type(value).__name__} {getattr(value, '__qualname__', '')}"
