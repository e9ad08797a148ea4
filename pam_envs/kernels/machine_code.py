"""Machine code of kernels that take an address book: shipped, cached, or compiled once.

Loading it needs llvmlite but not numba. Where there is none, a child process compiles it while the
caller continues in plain Python, with the same bits. ``PAM_ENVS_COMPILE=wait`` compiles at once.
"""

import atexit
import ctypes
import hashlib
import lzma
import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from pam_envs.kernels import shipped
from pam_envs.kernels.build import INTRINSICS
from pam_envs.kernels.cache import FOLDER, complain, read_whole, write_whole
from pam_envs.kernels.notice import Notice, announce
from pam_envs.kernels.rebind import graph_digest

if TYPE_CHECKING:
    from pam_envs.kernels.emission import Target

Run = Callable[[int, int], None]
"""Takes the address of an address book, and a mode."""
BUSY = 3
"""Exit code of a child whose work another process is doing."""
STALE = 600.0
"""Age [s] at which the mark of a process that compiles is taken for that of a dead one."""
_TOOLS = ("compiler.py", "intermediate.py")
_LOADED: list[Any] = []  # engines, which own the code


@dataclass(frozen=True)
class AddressKernel:
    """A kernel that takes an address book and a mode, with the names that are bound in it."""

    name: str
    """Name, also of its files."""
    function: Callable[[Any, int], None]
    names: Mapping[str, Any]
    words: int
    """Length of the address book."""
    dtype: str = "float64"
    """Type of numbers that are not integers: "float64" or "float32"."""

    @cached_property
    def digest(self) -> str:
        """Digest of the call graph and of the tools that make its LLVM IR."""
        graph = graph_digest(self.function, {**self.names, **INTRINSICS})
        used = _TOOLS if self.dtype == "float64" else (*_TOOLS, "single_precision.py")
        tools = b"".join(Path(__file__).with_name(name).read_bytes() for name in used)
        return hashlib.sha256(graph.encode() + tools).hexdigest()[:16]

    def intermediate(self) -> str:
        """Return the LLVM IR, compiled in this process."""
        if self.dtype == "float64":
            from pam_envs.kernels.intermediate import intermediate
        else:
            from pam_envs.kernels.single_precision import intermediate
        return intermediate(self.function, self.names, self.words)

    @property
    def ir_file(self) -> Path:
        """File of the LLVM IR, the same on every machine."""
        return FOLDER / f"{self.name}_{self.digest}.ll.xz"

    @property
    def busy_file(self) -> Path:
        """Mark of a process that compiles."""
        return FOLDER / f"{self.name}_{self.digest}.busy"

    def object_file(self) -> Path:
        """Return the file of the object code for this processor."""
        from pam_envs.kernels import emission

        tool = Path(emission.__file__).read_bytes()
        key = hashlib.sha256(repr(emission.host()).encode() + tool).hexdigest()[:8]
        return FOLDER / f"{self.name}_{self.digest}_{key}.o"


class Source(Protocol):
    """Something picklable that builds the kernel again in another process."""

    @property
    def by_address(self) -> AddressKernel:
        """The kernel."""


class MachineCode:
    """Machine code of one kernel: shipped, cached or compiled."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self.run: Run | None = None  # the code, once it has been used in this process
        self._child: subprocess.Popen[bytes] | None = None

    def ready(self) -> Run | None:
        """Return the code, or None while a child process compiles it."""
        if self.run is None:
            self.run = self._stored()
        if self.run is None and (waiting() or not self._in_background()):
            self.run = load(self._compiled())
        return self.run

    def wait(self) -> Run:
        """Return the code; wait until it is compiled if there is none."""
        self.run = self.run or self._stored() or load(self._compiled())
        return self.run

    def _stored(self) -> Run | None:
        """Return code that was shipped with the package or cached on this machine."""
        kernel = self._source.by_address
        try:
            data = shipped.find(kernel)
            if data is not None:
                shipped.try_loading(data, FOLDER)
                return load(data)
        except Exception as error:  # whatever it is, the kernel can be compiled here
            announce(
                f"the shipped code of {kernel.name} cannot be used and is compiled here: {error!r}"
            )
        data = read_whole(kernel.object_file())
        return None if data is None else load(data)

    def _compiled(self) -> bytes:
        """Compile and wait; keep the code where that is possible."""
        from pam_envs.kernels import emission

        kernel, notice = self._source.by_address, Notice()
        notice.begin(kernel.name)
        try:
            text = intermediate_of(self._source)
        except RuntimeError:  # the family cannot be imported, or nothing can be written
            text = ""
        finally:
            notice.end()
        text = text or kernel.intermediate()
        data = emission.emit(text, emission.host())
        try:
            write_whole(kernel.object_file(), data)
        except OSError:
            complain(FOLDER, "cannot be written")
        return data

    def _in_background(self) -> bool:
        """Return whether another process compiles; start one if there is none yet."""
        kernel = self._source.by_address
        if self._child is not None:
            code = self._child.poll()
            if code not in (None, BUSY):
                return False  # it failed, or compiled something else: try in this process
            if code is None:
                return True
            self._child = None
        if is_busy(kernel.busy_file):
            return True
        self._child = start(self._source, background=True)
        if self._child is None:
            return False
        announce(
            f"compiling {kernel.name} in the background, once on this machine; until then "
            "steps run in plain Python with the same results ('pam-envs warmup' compiles ahead)"
        )
        return True


def waiting() -> bool:
    """Return whether the caller waits for a compilation (``PAM_ENVS_COMPILE=wait``)."""
    return os.environ.get("PAM_ENVS_COMPILE", "").lower() == "wait"


def load(data: bytes) -> Run:
    """Return the function of an object file, which releases the lock of the interpreter.

    Raises
    ------
    RuntimeError
        If the data are no object file, or have no such function. LLVM ends the process that loads
        an object file of another platform.
    """
    import llvmlite.binding as llvm

    from pam_envs.kernels.emission import host
    from pam_envs.kernels.intermediate import ENTRY

    target = host()
    machine = llvm.Target.from_triple(target.triple).create_target_machine(
        cpu=target.cpu, features=target.features, jit=True
    )
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    code = llvm.object_file.ObjectFileRef.from_data(data)
    if not code:  # otherwise the loader crashes
        raise RuntimeError("the data are no object file")
    engine.add_object_file(code)
    engine.finalize_object()
    _LOADED.append((engine, code, machine))
    address = engine.get_function_address(ENTRY)
    if not address:
        raise RuntimeError(f"the object code has no function {ENTRY}")
    return ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64)(address)


def is_busy(mark: Path) -> bool:
    """Return whether a process that may be alive has set a mark."""
    try:
        return time.time() - mark.stat().st_mtime < STALE
    except OSError:
        return False


def start(source: Source, background: bool = False) -> "subprocess.Popen[bytes] | None":
    """Start a process that compiles a kernel into the cache; None if that is impossible.

    In the background it has a low priority; one that is waited for has not.
    """
    from pam_envs.kernels.intermediate import GENERIC

    try:
        job = pickle.dumps(source)
    except (pickle.PicklingError, AttributeError, TypeError):
        return None
    path = os.pathsep.join(p or os.getcwd() for p in sys.path)
    environment = {**os.environ, **GENERIC, "PYTHONPATH": path, "PAM_ENVS_CACHE": str(FOLDER)}
    try:
        child = subprocess.Popen(
            [sys.executable, "-m", "pam_envs.kernels.ahead", *["--background"] * background],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
            start_new_session=True,
        )
        assert child.stdin is not None
        child.stdin.write(job)
        child.stdin.close()
    except OSError:
        return None
    atexit.register(_leave, child)
    return child


def _leave(child: "subprocess.Popen[bytes]") -> None:
    """Let a child finish after this process, so that the next one finds the code."""
    if child.poll() is None:
        child.returncode = 0  # no warning about a process that still runs


def intermediate_of(source: Source) -> str:
    """Return the LLVM IR of a kernel, from the cache or from a child process.

    Raises
    ------
    RuntimeError
        If the child process cannot build the kernel.
    """
    kernel = source.by_address
    deadline = time.monotonic() + STALE
    while (packed := read_whole(kernel.ir_file)) is None:
        code: int | None = BUSY
        if not is_busy(kernel.busy_file):
            child = start(source)
            code = None if child is None else child.wait()
            if code == 0 and kernel.ir_file.exists():
                continue
        if code != BUSY or time.monotonic() > deadline:
            raise RuntimeError(
                f"{kernel.name} could not be compiled in a process of its own (exit code {code}): "
                f"its family has to be importable, and {FOLDER} writable (PAM_ENVS_CACHE)"
            )
        time.sleep(0.2)
    return lzma.decompress(packed).decode()


def emitted(text: str, target: "Target", assembly: bool = False) -> bytes:
    """Return the code of LLVM IR for a target (see ``emission.emit``), from the cache if kept."""
    from pam_envs.kernels import emission

    tool = Path(emission.__file__).read_text(encoding="utf-8")
    key = hashlib.sha256("\n".join((repr(target), str(assembly), tool, text)).encode()).hexdigest()
    file = FOLDER / f"emitted_{key[:24]}.{'s' if assembly else 'o'}"
    data = read_whole(file)
    if data is None:
        data = emission.emit(text, target, assembly)
        try:
            write_whole(file, data)
        except OSError:
            complain(FOLDER, "cannot be written")
    return data
