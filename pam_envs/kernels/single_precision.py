"""LLVM IR of a kernel in float32: numba's float64 is mapped to 32 bits.

All numbers that are float64 in a kernel become float32: arrays, constants, arithmetic, conversions
of integers. Random numbers are drawn in float64, from the same counters, and then rounded. Integers
keep their 64 bits.
"""

import contextlib
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.core.cpu import CPUContext
from numba.core.datamodel import default_manager
from numba.core.datamodel.models import PrimitiveModel
from numba.core.extending import intrinsic
from numba.core.registry import cpu_target
from numba.core.typing import Context

from pam_envs.kernels import random
from pam_envs.kernels.build import kernel
from pam_envs.kernels.compiler import _CALLEE, _REPLACED, compiled
from pam_envs.kernels.intermediate import ENTRY, freestanding
from pam_envs.kernels.rebind import Bound, graph_digest, rebind

BELOW_ONE = float(np.nextafter(np.float32(1.0), np.float32(0.0)))
"""Largest float32 below 1: uniform numbers stay in (0, 1)."""
_SQRT = re.compile(r"(call|declare) float @sqrt\(")


@kernel
def round_to_integer(x: float) -> float:
    """Return the nearest integer as a float, ties to even, for ``abs(x) < 2**22``."""
    return (x + 12582912.0) - 12582912.0


class _Single(PrimitiveModel):  # type: ignore[misc]
    """Data model of every floating-point type: 32 bits."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.FloatType())


@contextlib.contextmanager
def _single_precision() -> Iterator[None]:
    """Compile with contexts of numba's own kind in which every floating-point type has 32 bits."""
    kept = cpu_target.typing_context, cpu_target.target_context
    typing = Context()
    target = CPUContext(typing)
    target.data_model_manager = default_manager.copy()
    target.data_model_manager.register(types.Float, _Single)
    try:
        cpu_target._toplevel_typing_context, cpu_target._toplevel_target_context = typing, target
        yield
    finally:
        cpu_target._toplevel_typing_context, cpu_target._toplevel_target_context = kept


def _rounded(function: Callable[..., float], most: float) -> Any:
    """Return an intrinsic that calls a random number of float64 and rounds it to float32.

    It is at most ``most``. Its code is compiled at once, before the mapping.
    """
    dispatcher: Any = compiled(function, function.__name__, False, {}, for_python=False)
    dispatcher.compile((types.int64,) * 4)
    (made,) = dispatcher.overloads.values()

    def typed(typing: Any, a: Any, b: Any, stream: Any, draw: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            context.active_code_library.add_linking_library(made.library)
            double, word, pointer = ir.DoubleType(), ir.IntType(64), ir.IntType(8).as_pointer()
            errors = pointer.as_pointer()
            shape = ir.FunctionType(ir.IntType(32), [double.as_pointer(), errors, *[word] * 4])
            callee = cgutils.get_or_insert_function(
                builder.module, shape, made.fndesc.llvm_func_name
            )
            result = cgutils.alloca_once(builder, double)
            builder.call(callee, [result, cgutils.alloca_once(builder, pointer), *arguments])
            drawn = builder.load(result)
            limit = ir.Constant(double, most)
            held = builder.select(builder.fcmp_ordered("<", drawn, limit), drawn, limit)
            return builder.fptrunc(held, ir.FloatType())

        return types.float64(*(types.int64,) * 4), generate

    return intrinsic(typed)


def intermediate(
    function: Callable[..., Any], names: Mapping[str, Any], words: int, entry: str = ENTRY
) -> str:
    """Return the LLVM IR of a kernel in float32 (see ``intermediate.intermediate``)."""
    own = {
        **_REPLACED,
        "prange": range,
        **names,
        "uniform": _rounded(random.uniform, BELOW_ONE),
        "normal": _rounded(random.normal, float(np.finfo(np.float32).max)),
        "round_to_integer": round_to_integer,
    }
    digests: dict[Any, str] = {}

    def finish(made: Callable[..., Any], original: Any, bound: Bound) -> Callable[..., Any]:
        made.__name__ = f"{original.__name__}_{graph_digest(original, own, digests)}"
        made.__qualname__ = made.__name__
        inlined = original is not function and original.__pam_kernel__
        return njit(forceinline=inlined, **_CALLEE)(made)  # type: ignore[no-any-return]

    with _single_precision():
        dispatcher: Any = rebind(function, own, finish, {})
        dispatcher.compile((types.Array(types.int64, 1, "C"), types.int64))
    (made,) = dispatcher.overloads.values()
    text = _SQRT.sub(r"\1 float @llvm.sqrt.f32(", made.library.get_llvm_str())
    text = freestanding(text, made.fndesc.mangled_name, words, entry)
    check_calls(text)
    return text


def check_calls(text: str) -> None:
    """Raise TypeError if LLVM IR calls a function with arguments of other types than its own."""
    module = llvm.parse_assembly(text)
    expected = {f.name: [str(a.type) for a in f.arguments] for f in module.functions}
    for function in module.functions:
        for block in function.blocks:
            for call in (i for i in block.instructions if i.opcode == "call"):
                *given, callee = call.operands
                found = [str(value.type) for value in given]
                if found != expected[callee.name]:
                    raise TypeError(
                        f"{callee.name} takes {expected[callee.name]} and is given {found}: it is "
                        "of float64; call it as the random numbers are called"
                    )
