"""LLVM IR of a kernel, and machine code for any processor from it.

The IR comes from numba, for a generic processor. All that belongs to Python or to numba's runtime
is taken out, so that the module has one public function, ``void ENTRY(int64_t *book, int64_t
mode)``, and calls nothing but ``memset`` and ``memcpy``. llvmlite optimises it for a target and
writes the object file or the assembly. No target fuses a multiplication with an addition, because
the IR does not allow it: all of them compute the same bits.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm

ENTRY = "pam_kernel"
"""Name of the public function."""
GENERIC = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
"""Environment variables with which numba makes IR that does not depend on this machine."""

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
_ALLOWED = re.compile(r"llvm\.|mem(?:set|cpy|move)$")


@dataclass(frozen=True)
class Target:
    """A processor for which code is emitted, in LLVM's terms."""

    triple: str
    cpu: str = ""
    features: str = ""
    jit: bool = False
    """Whether the code is loaded into this process."""


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


def emit(texts: str | Iterable[str], target: Target, assembly: bool = False) -> bytes:
    """Return the object file, or the assembly, of one or several modules of IR for a target.

    Raises
    ------
    RuntimeError
        If the code would call a function of Python, of numba or of libm.
    """
    module, machine = optimised([texts] if isinstance(texts, str) else list(texts), target)
    if assembly:
        return machine.emit_assembly(module).encode()  # type: ignore[no-any-return]
    return machine.emit_object(module)  # type: ignore[no-any-return]


def optimised(texts: Sequence[str], target: Target) -> tuple[Any, Any]:
    """Return the linked module after the O3 pipeline, and the target machine."""
    _initialise()
    options = {"reloc": "pic", "codemodel": "default"}
    if target.jit:  # as numba's own code of this process
        x86 = target.triple.startswith(("x86", "i386", "i686"))
        options = {"reloc": "static" if x86 else "default", "codemodel": "jitdefault"}
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu, features=target.features, opt=3, jit=target.jit, **options
    )
    module, *others = map(llvm.parse_assembly, texts)
    for other in others:
        module.link_in(other)
    module.triple, module.data_layout = target.triple, str(machine.target_data)
    tuning = llvm.create_pipeline_tuning_options(speed_level=3)
    tuning.loop_vectorization = tuning.slp_vectorization = True
    builder = llvm.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    module.verify()
    needed = {f.name for f in module.functions if f.is_declaration}
    foreign = sorted(name for name in needed if not _ALLOWED.match(name))
    foreign += sorted(g.name for g in module.global_variables if g.is_declaration)
    if foreign:
        raise RuntimeError(
            f"the code would need {', '.join(foreign)}: a kernel may only compute on its arguments"
        )
    return module, machine


def host() -> Target:
    """Return the processor of this process, with all that it can do."""
    _initialise()
    features = llvm.get_host_cpu_features().flatten()
    return Target(llvm.get_process_triple(), llvm.get_host_cpu_name(), features, jit=True)


@lru_cache(maxsize=1)
def _initialise() -> None:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
