"""LLVM IR of a kernel, from numba, without what belongs to Python or to numba's runtime.

The module has one public function, ``void ENTRY(int64_t *book, int64_t mode)``.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any

ENTRY = "pam_kernel"
"""Name of the public function."""
GENERIC = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_OPT": "1"}
"""Environment variables with which numba makes IR that does not depend on this machine.

It optimises little, because a target's own pipeline does so: unrolled loops are not made small
again.
"""

_ENTRY = """
define internal void @NRT_incref(ptr %0) alwaysinline {{ ret void }}
define internal void @NRT_decref(ptr %0) alwaysinline {{ ret void }}
define void @{entry}(ptr %book, i64 %mode) {{
  %result = alloca ptr
  %error = alloca ptr
  %status = call i32 @{kernel}(ptr %result, ptr %error, ptr null, ptr null, i64 {words}, i64 8,
                               ptr %book, i64 {words}, i64 8, i64 %mode)
  ret void
}}
"""
_RUNTIME = re.compile(r"^define [^\n]*@NRT_(?:incref|decref)\(.*?^}\n", re.MULTILINE | re.DOTALL)
_SQRT = re.compile(r"^declare double @(?:llvm\.sqrt\.f64|sqrt)\(.*\n", re.MULTILINE)
_LINKAGE = re.compile(r"^define (?:linkonce_odr |weak_odr )?", re.MULTILINE)
_SYMBOL = re.compile(r'@(_Z[\w.$]+|"[^"]+"|\.const[\w.$]*)')


def intermediate(
    function: Callable[..., Any], names: Mapping[str, Any], words: int, entry: str = ENTRY
) -> str:
    """Return the LLVM IR of a kernel that takes an address book and a mode.

    Parameters
    ----------
    function : callable
        The kernel, ``function(book, mode)``.
    names : mapping
        Values of global names in its call graph (see ``build.build``).
    words : int
        Length of the address book.
    entry : str
        Name of the public function of the module.
    """
    from numba import types

    from pam_envs.kernels.compiler import compiled

    dispatcher: Any = compiled(function, entry, False, dict(names), for_python=False)
    dispatcher.compile((types.Array(types.int64, 1, "C"), types.int64))
    (made,) = dispatcher.overloads.values()
    return freestanding(made.library.get_llvm_str(), made.fndesc.mangled_name, words, entry)


def freestanding(text: str, kernel: str, words: int, entry: str) -> str:
    """Return IR of numba without its runtime, with internal symbols and a plain entry function."""
    text = _SQRT.sub("", _RUNTIME.sub("", text)).replace("@sqrt(", "@llvm.sqrt.f64(")
    text = _LINKAGE.sub("define internal ", text).replace(" = common ", " = internal ")
    text = text.replace("define internal internal ", "define internal ")
    text += "\ndeclare double @llvm.sqrt.f64(double)\n"
    text += _ENTRY.format(entry=entry, kernel=kernel, words=words)
    short: dict[str, str] = {}  # without process-wide counters in their names
    text = _SYMBOL.sub(lambda m: f"@k{short.setdefault(m[1], str(len(short)))}", text)
    return f"; entry: {entry}\n" + text
