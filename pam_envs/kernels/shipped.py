"""Object code of default configurations that is part of the wheel.

The wheel for every platform holds code for Linux on x86-64 with AVX2; others compile. A manifest
holds the digest of the sources from which the code was made. It is used only if the installed
sources, the functions of the kernel and the values that they read are the same.
"""

import hashlib
import json
import platform
import sys
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pam_envs.kernels.build import INTRINSICS
from pam_envs.kernels.rebind import graph_digest, place

if TYPE_CHECKING:
    from pam_envs.kernels.machine_code import AddressKernel

PACKAGE = Path(__file__).resolve().parents[1]
FOLDER = Path(__file__).resolve().parent / "objects"
MANIFEST = "manifest.json"
TRIPLE, CPU = "x86_64-unknown-linux-gnu", "x86-64-v3"
NEEDED = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
"""Features of the processor that the code uses."""


def find(kernel: "AddressKernel") -> bytes | None:
    """Return the object code of a kernel, or None if none was shipped for it or it has changed."""
    entry = _codes().get(kernel.name)
    if entry is None or entry["kernel"] != located(kernel):
        return None
    try:
        data = (FOLDER / entry["file"]).read_bytes()
    except OSError:
        return None
    return data if hashlib.sha256(data).hexdigest() == entry["sha256"] else None


def located(kernel: "AddressKernel") -> str:
    """Return a digest of the places of a kernel's functions and of the values that they read."""

    def relative(function: Any) -> list[str]:
        file, *rest = place(function)
        path = Path(file)
        return [
            path.relative_to(PACKAGE).as_posix() if path.is_relative_to(PACKAGE) else file,
            *rest,
        ]

    return graph_digest(kernel.function, {**kernel.names, **INTRINSICS}, None, relative)


def sources() -> str:
    """Return the digest of the package's Python files."""
    found = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        found.update(path.relative_to(PACKAGE).as_posix().encode())
        found.update(path.read_bytes())
    return found.hexdigest()


def write(codes: Iterable[tuple["AddressKernel", bytes]], folder: Path = FOLDER) -> None:
    """Write object files and their manifest."""
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    entries: dict[str, Any] = {}
    for kernel, data in codes:
        file = f"{kernel.name}.o"
        (folder / file).write_bytes(data)
        digest = hashlib.sha256(data).hexdigest()
        entries[kernel.name] = {"file": file, "sha256": digest, "kernel": located(kernel)}
    manifest = {"sources": sources(), "codes": entries}
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")


def supported() -> bool:
    """Return whether this processor runs the shipped code."""
    if sys.platform != "linux" or platform.machine() not in ("x86_64", "AMD64"):
        return False
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    return all(features.get(name) for name in NEEDED)


@lru_cache(maxsize=1)
def _codes() -> Mapping[str, Any]:
    """Return the entries of the manifest, none on other processors and for other sources."""
    if not (FOLDER / MANIFEST).exists() or not supported():
        return {}
    manifest = json.loads((FOLDER / MANIFEST).read_text(encoding="utf-8"))
    return manifest["codes"] if manifest["sources"] == sources() else {}
