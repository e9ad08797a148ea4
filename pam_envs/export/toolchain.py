"""Processors for which code is emitted, and the C compiler that links it."""

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from pam_envs.export.model import Model
from pam_envs.kernels.emission import Target, emit

OBJECTS: dict[str, Target] = {
    "x86_64-linux": Target("x86_64-unknown-linux-gnu", "x86-64"),
    "aarch64-linux": Target("aarch64-unknown-linux-gnu", "generic"),
    "x86_64-windows": Target("x86_64-w64-windows-gnu", "x86-64"),
    "x86_64-darwin": Target("x86_64-apple-macosx11.0.0", "x86-64"),
    "aarch64-darwin": Target("arm64-apple-macosx11.0.0", "apple-m1"),
    "cortex-m7": Target("thumbv7em-none-eabihf", "cortex-m7"),
}
"""Processors, by the names of FMI 3.0 where it has one."""
WASM = Target("wasm32-unknown-unknown", "generic", "+simd128,+bulk-memory,+nontrapping-fptoint")
ZIG = {
    "x86_64-linux": "x86_64-linux-gnu.2.17",
    "aarch64-linux": "aarch64-linux-gnu.2.17",
    "x86_64-windows": "x86_64-windows-gnu",
    "x86_64-darwin": "x86_64-macos",
    "aarch64-darwin": "aarch64-macos",
}
"""Platforms for which zig links shared libraries, by its names."""


def host_platform() -> str:
    """Return the name of this platform."""
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    system = {"win32": "windows", "darwin": "darwin"}.get(sys.platform, "linux")
    return f"{machine}-{system}"


def emit_object(model: Model, platform: str) -> bytes:
    """Return the object file of a model's kernels for a processor of ``OBJECTS``."""
    if platform not in OBJECTS:
        raise ValueError(f"platform = {platform!r}; choose one of {', '.join(OBJECTS)}")
    return emit(model.intermediates, OBJECTS[platform])


def zig() -> list[str] | None:
    """Return the command of zig's C compiler, or None."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc"]
    found = shutil.which("zig")
    return [found, "cc"] if found else None


def native_compiler() -> list[str]:
    """Return the command of a C compiler for this platform.

    Raises
    ------
    OSError
        If there is none.
    """
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        if name and shutil.which(name):
            return [name]
    found = zig()
    if found is None:
        raise OSError(
            "linking needs a C compiler (CC, cc, gcc or clang): install one, or "
            'pip install "pam-envs[export]", which has one'
        )
    return found


def cross_compiler(platform: str) -> list[str] | None:
    """Return the command of a compiler that links for a platform, or None."""
    found = zig()
    return None if found is None else [*found, "-target", ZIG[platform]]


def run(command: Sequence[str | Path], folder: Path) -> None:
    """Run a compiler.

    Raises
    ------
    RuntimeError
        With its message if it fails.
    """
    done = subprocess.run(
        [str(word) for word in command], cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, command))} failed:\n{done.stderr.strip()[-2000:]}")
