"""Machine code for kernels: numba, imported when the first kernel is built."""

import contextlib
import hashlib
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from numba import get_num_threads, njit, prange, types
from numba.core import caching, cgutils, event
from numba.core.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from pam_envs.kernels import rebind
from pam_envs.kernels.cache import FOLDER, complain, make_folder, read_whole, write_whole
from pam_envs.kernels.notice import Notice

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "fastmath": False}
_CALLEE: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Only kernels call a callee: wrappers for Python are left out."""


class _Locator(caching._CacheLocator):
    """Keeps compiled code by the digest of its call graph, which is part of the function's name.

    Numba's own locator looks only at the file of the function itself, so that an edit of a
    function that it calls, in another file, would go unnoticed, and an edited comment would not.
    """

    def __init__(self, py_file: str) -> None:
        self._py_file = py_file  # for numba's message where it cannot write

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(FOLDER)

    def get_source_stamp(self) -> str:
        """Return the key of the code beside its name."""
        return _COMPILER

    def get_disambiguator(self) -> str:
        """Return nothing: names are unique here."""
        return ""

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> Any:
        """Return a locator, or None without a folder; one that is only read is used, too."""
        try:
            make_folder(FOLDER)
        except OSError:
            return None
        return cls(py_file)


class _CacheImpl(caching.CompileResultCacheImpl):
    _locator_classes: ClassVar[list[Any]] = [_Locator]

    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        """Return the file's name: the function's unique name, without that of its module."""
        base: str = super().get_filename_base(fullname.partition(".")[2], abiflags)
        return f"{base}.sha256"  # the format of the files, see cache.py


class _CacheFile(caching.IndexDataCacheFile):
    """Index and code of a kernel; a damaged file counts as missing."""

    def _load_index(self) -> dict[Any, str]:
        data = read_whole(Path(self._index_path))
        version, stamp, names = (None, None, {}) if data is None else pickle.loads(data)
        return names if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        data = self._dump((self._version, self._source_stamp, overloads))
        write_whole(Path(self._index_path), data)

    def _load_data(self, name: str) -> Any:
        data = read_whole(Path(self._data_path(name)))
        return None if data is None else pickle.loads(data)

    def _save_data(self, name: str, data: Any) -> None:
        write_whole(Path(self._data_path(name)), self._dump(data))


class _Cache(caching.Cache):
    """Cache whose faults cost a compilation, and nothing else."""

    _impl_class = _CacheImpl

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file: Any = _CacheFile(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return stored code, or None where there is none that can be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # of whatever made the file
            complain(FOLDER, "has files that cannot be read")
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store code where that is possible."""
        try:
            super().save_overload(sig, data)
        except OSError:
            complain(FOLDER, "cannot be written")


def _sizes(*given: Any) -> tuple[int, ...] | None:
    """Return literal integers as numbers, or None if one is not literal."""
    literal = all(isinstance(size, types.IntegerLiteral) for size in given)
    return tuple(size.literal_value for size in given) if literal else None


def _view(context: Any, builder: Any, view: Any, data: Any, shape: list[Any]) -> Any:
    """Return an array value of a shape over an address that it does not own."""
    itemsize = context.get_constant(
        types.intp, context.get_abi_sizeof(context.get_data_type(view.dtype))
    )
    strides = [itemsize]
    for size in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], size))
    made = make_array(view)(context, builder)
    parent = cgutils.get_null_value(made.parent.type)
    populate_array(
        made,
        data=data,
        shape=shape,
        strides=strides,
        itemsize=itemsize,
        meminfo=None,
        parent=parent,
    )
    return made._getvalue()


@intrinsic(prefer_literal=True)
def _tile_view(typing: Any, tiles: Any, tile: Any, rows: Any, lanes: Any) -> Any:
    """Return a view of one tile whose shape and strides are constants of the code."""
    sizes = _sizes(rows, lanes)
    if sizes is None:
        return None
    view = types.Array(tiles.dtype, 2, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source = make_array(signature.args[0])(context, builder, arguments[0])
        shape = [context.get_constant(types.intp, size) for size in sizes]
        offset = context.get_constant(types.intp, sizes[0] * sizes[1])
        data = builder.gep(source.data, [builder.mul(arguments[1], offset)])
        return _view(context, builder, view, data, shape)

    return view(tiles, types.intp, rows, lanes), generate


@intrinsic
def _lane_view(typing: Any, rows: Any, lane: Any) -> Any:
    """Return a view of rows that begins at the element of a lane (see ``build.lane_view``)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source = make_array(signature.args[0])(context, builder, arguments[0])
        shape = cgutils.unpack_tuple(builder, source.shape)
        shared = builder.icmp_signed("==", shape[1], context.get_constant(types.intp, 1))
        first = builder.select(shared, context.get_constant(types.intp, 0), arguments[1])
        return _view(context, builder, rows, builder.gep(source.data, [first]), shape)

    return rows(rows, types.intp), generate


@intrinsic(prefer_literal=True)
def _scratch(typing: Any, rows: Any, lanes: Any) -> Any:
    """Return rows of scratch on the stack, of constant shape."""
    sizes = _sizes(rows, lanes)
    if sizes is None:
        return None
    view = types.Array(types.float64, 2, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = context.get_data_type(types.float64)
        block = cgutils.alloca_once(builder, kind, size=sizes[0] * sizes[1])
        shape = [context.get_constant(types.intp, size) for size in sizes]
        return _view(context, builder, view, block, shape)

    return view(rows, lanes), generate


_DTYPES = (types.float64, types.int64, types.float32, types.int8)


@intrinsic(prefer_literal=True)
def _array_at(typing: Any, book: Any, index: Any, dimensions: Any, kind: Any) -> Any:
    """Return the array with an address and a shape of ``book`` (see ``build.address_book``)."""
    sizes = _sizes(dimensions, kind)
    if sizes is None:
        return None
    ndim, dtype = sizes[0], _DTYPES[sizes[1]]
    view = types.Array(dtype, ndim, "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        words = make_array(signature.args[0])(context, builder, arguments[0]).data
        first = builder.mul(arguments[1], context.get_constant(types.intp, 4))

        def word(k: int) -> Any:
            place = builder.add(first, context.get_constant(types.intp, k))
            return builder.load(builder.gep(words, [place]))

        data = builder.inttoptr(word(0), context.get_data_type(dtype).as_pointer())
        return _view(context, builder, view, data, [word(k + 1) for k in range(ndim)])

    return view(book, types.intp, dimensions, kind), generate


_REPLACED: dict[str, Any] = {
    "tile_view": _tile_view,
    "lane_view": _lane_view,
    "scratch": _scratch,
    "array_at": _array_at,
}
__all__ = ["compiled", "get_num_threads"]
_DONE: dict[Any, Any] = {}
_COMPILER = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:16]
"""Digest of this file: its options and intrinsics are part of the code."""


class _Listener(event.Listener):
    """Shows a message while a kernel is compiled, not while it is read from the disk."""

    def __init__(self) -> None:
        self._notice = Notice()

    def on_start(self, event: Any) -> None:
        """Begin the message with the name of the outermost kernel."""
        name = event.data["dispatcher"].py_func.__name__
        self._notice.begin(name.rpartition("_")[0])

    def on_end(self, event: Any) -> None:
        """End the message."""
        self._notice.end()


event.register("numba:compile", _Listener())


def compiled(
    function: Callable[..., Any],
    name: str,
    parallel: bool,
    names: dict[str, Any],
    for_python: bool = True,
) -> Callable[..., Any]:
    """Return a dispatcher for a kernel with replaced names (see ``build.build``).

    Without ``for_python`` there is no wrapper for Python and no cache: a source of LLVM IR.
    """
    names = {"prange": prange if parallel else range, **_REPLACED, **names}
    digests: dict[Any, str] = {}
    entry_name = f"{name}_parallel" if parallel else name

    def finish(made: Callable[..., Any], original: Any, bound: rebind.Bound) -> Callable[..., Any]:
        # code from the disk links by name: the name contains the digest
        entry = original is function
        digest = rebind.graph_digest(original, names, digests)
        made.__name__ = f"{entry_name if entry else original.__name__}_{digest}"
        made.__qualname__ = made.__name__
        made.__module__ = rebind.__name__  # code from the disk imports it: no kernel's own place
        if not entry:
            return njit(forceinline=original.__pam_kernel__, **_CALLEE)(made)  # type: ignore[no-any-return]
        if not for_python:
            return njit(**_CALLEE)(made)  # type: ignore[no-any-return]
        dispatcher = njit(parallel=parallel, **_OPTIONS)(made)
        with contextlib.suppress(RuntimeError):  # without a folder nothing is kept
            dispatcher._cache = _Cache(made)
        return dispatcher  # type: ignore[no-any-return]

    return rebind.rebind(function, names, finish, _DONE)
