"""Machine code for kernels: numba, imported when the first kernel is built."""

from __future__ import annotations

import contextlib
import hashlib
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from numba import get_num_threads, njit, prange, types
from numba.core import caching, cgutils
from numba.core.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from pam_envs.kernels import rebind

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "fastmath": False}
_CALLEE: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Nobody but kernels calls a callee: what Python would need for it is not made."""


class _Locator(caching._CacheLocator):
    """Keeps compiled code by the digest of its call graph, which is part of the function's name.

    Numba's own locator looks only at the file of the function itself, so that an edit of a
    function that it calls, in another file, would go unnoticed, and an edited comment would not.
    """

    def __init__(self, py_file: str) -> None:
        self._py_file = py_file  # numba names it where it cannot keep what it compiled

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(FOLDER)

    def get_source_stamp(self) -> str:
        """Return what the code is valid for, beside its name."""
        return _COMPILER

    def get_disambiguator(self) -> str:
        """Return nothing: names are unique here."""
        return ""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> Any:
        """Return a locator, or None where nothing can be written."""
        try:
            FOLDER.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=FOLDER):
                return cls(py_file)
        except OSError:
            return None


class _CacheImpl(caching.CompileResultCacheImpl):
    _locator_classes: ClassVar[list[Any]] = [_Locator]

    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        """Return the file's name: the function's unique name, without that of its module."""
        base: str = super().get_filename_base(fullname.partition(".")[2], abiflags)
        return base


class _Cache(caching.Cache):
    _impl_class = _CacheImpl


def _constant_view(context: Any, builder: Any, view: Any, data: Any, shape: tuple[int, int]) -> Any:
    """Return an array value of constant shape over an address that it does not own."""
    width = context.get_abi_sizeof(context.get_data_type(view.dtype))
    made = make_array(view)(context, builder)
    populate_array(
        made,
        data=data,
        shape=[context.get_constant(types.intp, n) for n in shape],
        strides=[context.get_constant(types.intp, n) for n in (shape[1] * width, width)],
        itemsize=context.get_constant(types.intp, width),
        meminfo=None,
        parent=cgutils.get_null_value(made.parent.type),
    )
    return made._getvalue()


@intrinsic(prefer_literal=True)
def _tile_view(typing: Any, tiles: Any, tile: Any, rows: Any, lanes: Any) -> Any:
    """Return a view of one tile whose shape and strides are constants of the code."""
    if not isinstance(rows, types.IntegerLiteral) or not isinstance(lanes, types.IntegerLiteral):
        return None
    view = types.Array(tiles.dtype, 2, "C")
    shape = (rows.literal_value, lanes.literal_value)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source = make_array(signature.args[0])(context, builder, arguments[0])
        size = context.get_constant(types.intp, shape[0] * shape[1])
        data = builder.gep(source.data, [builder.mul(arguments[1], size)])
        return _constant_view(context, builder, view, data, shape)

    return view(tiles, types.intp, rows, lanes), generate


@intrinsic(prefer_literal=True)
def _scratch(typing: Any, rows: Any, lanes: Any) -> Any:
    """Return rows of scratch on the stack, of constant shape."""
    if not isinstance(rows, types.IntegerLiteral) or not isinstance(lanes, types.IntegerLiteral):
        return None
    view = types.Array(types.float64, 2, "C")
    shape = (rows.literal_value, lanes.literal_value)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        block = cgutils.alloca_once(
            builder, context.get_data_type(types.float64), size=shape[0] * shape[1]
        )
        return _constant_view(context, builder, view, block, shape)

    return view(rows, lanes), generate


_DTYPES = (types.float64, types.int64, types.float32, types.int8)


@intrinsic(prefer_literal=True)
def _array_at(typing: Any, book: Any, index: Any, dimensions: Any, kind: Any) -> Any:
    """Return the array with an address and a shape of ``book`` (see ``build.address_book``)."""
    if not isinstance(dimensions, types.IntegerLiteral) or not isinstance(
        kind, types.IntegerLiteral
    ):
        return None
    ndim, dtype = dimensions.literal_value, _DTYPES[kind.literal_value]
    view = types.Array(dtype, ndim, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        words = make_array(signature.args[0])(context, builder, arguments[0]).data
        step = context.get_constant(types.intp, 4)
        first = builder.mul(arguments[1], step)

        def word(k: int) -> Any:
            place = builder.add(first, context.get_constant(types.intp, k))
            return builder.load(builder.gep(words, [place]))

        data = builder.inttoptr(word(0), context.get_data_type(dtype).as_pointer())
        width = context.get_abi_sizeof(context.get_data_type(dtype))
        itemsize = context.get_constant(types.intp, width)
        shape = [word(k + 1) for k in range(ndim)]
        strides = [itemsize]
        for size in shape[:0:-1]:
            strides.insert(0, builder.mul(strides[0], size))
        made = make_array(view)(context, builder)
        populate_array(
            made,
            data=data,
            shape=shape,
            strides=strides,
            itemsize=itemsize,
            meminfo=None,
            parent=cgutils.get_null_value(made.parent.type),
        )
        return made._getvalue()

    return view(book, types.intp, dimensions, kind), generate


_REPLACED: dict[str, Any] = {
    "tile_view": _tile_view,
    "scratch": _scratch,
    "array_at": _array_at,
}
__all__ = ["compiled", "get_num_threads"]
_DONE: dict[Any, Any] = {}
FOLDER = rebind.cache_folder()
_COMPILER = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:16]
"""Options and intrinsics of this file are part of what it compiles."""


def compiled(
    function: Callable[..., Any], name: str, parallel: bool, names: dict[str, Any]
) -> Callable[..., Any]:
    """Return a dispatcher for a kernel with replaced names (see ``build.build``)."""
    names = {"prange": prange if parallel else range, **_REPLACED, **names}
    digests: dict[Any, str] = {}
    entry_name = f"{name}_parallel" if parallel else name

    def finish(made: Callable[..., Any], original: Any, bound: rebind.Bound) -> Callable[..., Any]:
        # Code from the disk links by name: the name says what the code is.
        entry = original is function
        digest = rebind.graph_digest(original, names, digests)
        made.__name__ = f"{entry_name if entry else original.__name__}_{digest}"
        made.__qualname__ = made.__name__
        made.__module__ = rebind.__name__  # code from the disk imports it: no kernel's own place
        if not entry:
            return njit(forceinline=original.__pam_kernel__, **_CALLEE)(made)  # type: ignore[no-any-return]
        dispatcher = njit(parallel=parallel, **_OPTIONS)(made)
        with contextlib.suppress(RuntimeError):  # without a place to write nothing is kept
            dispatcher._cache = _Cache(made)
        return dispatcher  # type: ignore[no-any-return]

    return rebind.rebind(function, names, finish, _DONE)
