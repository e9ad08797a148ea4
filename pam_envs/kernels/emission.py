"""Object code and assembly of LLVM IR for any processor.

The code calls nothing but ``memset`` and ``memcpy`` (``bzero`` on macOS), and on Windows the stack
probe ``__chkstk``: every process has them. No target fuses a multiplication with an addition,
because the IR does not allow it: all of them compute the same bits.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import llvmlite.binding as llvm

_ALLOWED = re.compile(
    r"(?:mem(?:set|cpy|move)$|llvm\.(?:mem\w+|[su](?:min|max|add|sub|mul)\b|abs|fabs|copysign|sqrt"
    r"|assume|expect|lifetime|ct(?:lz|tz|pop)|b(?:swap|itreverse)|fsh[lr]|masked|vector"
    r"|experimental|dbg|trap|nvvm)\b)"
)
"""Functions that no target takes from libm or another library."""


@dataclass(frozen=True)
class Target:
    """A processor for which code is emitted, in LLVM's terms."""

    triple: str
    cpu: str = ""
    features: str = ""
    jit: bool = False
    """Whether the code is loaded into this process."""


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
