"""Object code of default configurations that is part of the wheel, for six platforms.

A platform is an operating system with a processor; others compile. A manifest holds the digests of
the sources from which the code was made and of the files. Code is used only if the installed
sources, the functions of the kernel and the values that they read are the same.
"""

import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pam_envs.kernels.build import INTRINSICS
from pam_envs.kernels.cache import make_folder, read_whole, write_whole
from pam_envs.kernels.rebind import graph_digest, place

if TYPE_CHECKING:
    from pam_envs.kernels.machine_code import AddressKernel

PACKAGE = Path(__file__).resolve().parents[1]
FOLDER = Path(__file__).resolve().parent / "objects"
MANIFEST = "manifest.json"
BESIDE = ("agents", "baselines", "sweeps")
"""Folders that are in the package only in the wheel (``hatch_build.py``); no kernel of an
environment is among them, nor calls one there."""


class Platform(NamedTuple):
    """Operating system and processor, in LLVM's terms."""

    triple: str
    cpu: str
    needed: tuple[str, ...] = ()
    """Features of the processor that the code uses, and that not every one of its kind has."""


AVX2 = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
PLATFORMS = {
    "linux-x86_64": Platform("x86_64-unknown-linux-gnu", "x86-64-v3", AVX2),
    "linux-arm64": Platform("aarch64-unknown-linux-gnu", "generic"),
    "macos-x86_64": Platform("x86_64-apple-darwin20.0.0", "x86-64-v3", AVX2),
    "macos-arm64": Platform("arm64-apple-darwin20.0.0", "apple-m1"),
    "windows-x86_64": Platform("x86_64-pc-windows-msvc", "x86-64-v3", AVX2),
    "windows-arm64": Platform("aarch64-pc-windows-msvc", "generic"),
}
"""Platforms of the code, which are also the names of its folders."""
LOADING = """
import sys
sys.path.insert(0, sys.argv[1])
from pam_envs.kernels.machine_code import load
load(sys.stdin.buffer.read())
"""
TRIED = ("linux-x86_64", "linux-arm64")
"""Platforms on which the code has been run; on others a child process loads it first."""
PROCESSORS = {"x86_64": "x86_64", "aarch64": "arm64", "arm64": "arm64"}
SYSTEMS = {"linux": "linux", "darwin": "macos", "macosx": "macos", "windows-msvc": "windows"}
"""Parts of the names of platforms, by what LLVM calls them."""


def platform_of(triple: str) -> str | None:
    """Return the platform of a process; None if no code is shipped for it."""
    processor, _, rest = triple.partition("-")
    system = next((own for part, own in SYSTEMS.items() if part in rest), None)
    name = f"{system}-{PROCESSORS.get(processor)}"
    return name if name in PLATFORMS else None


def supported(platform: str) -> bool:
    """Return whether this processor has the features that the code of a platform uses."""
    import llvmlite.binding as llvm

    needed = PLATFORMS[platform].needed
    return not needed or all(map(llvm.get_host_cpu_features().get, needed))


def find(kernel: "AddressKernel") -> bytes | None:
    """Return the object code of a kernel, or None if none was shipped for it or it has changed."""
    platform, codes = _codes()
    entry = codes.get(kernel.name)
    if entry is None or entry["kernel"] != located(kernel):
        return None
    try:
        data = file_of(FOLDER, platform, kernel.name).read_bytes()
    except OSError:
        return None
    return data if hashlib.sha256(data).hexdigest() == entry["sha256"].get(platform) else None


def try_loading(data: bytes, cache: Path) -> None:
    """Let a child process load object code on a platform where nobody has run it yet.

    It does so once on a machine, since LLVM ends a process that loads what it cannot use. ``cache``
    is the folder that holds the answer. A RuntimeError says that the child has failed.
    """
    if _codes()[0] in TRIED:
        return
    answer = cache / f"loads_{hashlib.sha256(data).hexdigest()[:16]}"
    known = read_whole(answer)
    if known is None:
        child = [sys.executable, "-c", LOADING, str(PACKAGE.parent)]
        done = subprocess.run(child, input=data, capture_output=True, timeout=60, check=False)
        known = b"no" if done.returncode else b"yes"
        make_folder(cache)
        write_whole(answer, known)
    if known != b"yes":
        raise RuntimeError("a process that loaded it has failed")


def file_of(folder: Path, platform: str, name: str) -> Path:
    """Return the file of a kernel's object code."""
    return folder / platform / f"{name}.o"


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
    files = {path.relative_to(PACKAGE): path for path in PACKAGE.rglob("*.py")}
    for inside, path in sorted(files.items(), key=lambda item: item[0].as_posix()):
        if inside.parts[0] not in BESIDE:
            found.update(inside.as_posix().encode())
            found.update(path.read_bytes())
    return found.hexdigest()


def write(
    codes: Mapping[str, Mapping[str, bytes]],
    kernels: Sequence["AddressKernel"],
    folder: Path = FOLDER,
) -> None:
    """Write the object code of kernels for each platform, by their names, and the manifest."""
    if folder.exists():
        shutil.rmtree(folder)
    entries: dict[str, Any] = {}
    for kernel in kernels:
        digests = {}
        for platform, of in codes.items():
            file = file_of(folder, platform, kernel.name)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(of[kernel.name])
            digests[platform] = hashlib.sha256(of[kernel.name]).hexdigest()
        entries[kernel.name] = {"kernel": located(kernel), "sha256": digests}
    manifest = {"sources": sources(), "codes": entries}
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")


@lru_cache(maxsize=1)
def _codes() -> tuple[str, Mapping[str, Any]]:
    """Return the platform and the manifest's entries, none of other platforms and sources."""
    if not (FOLDER / MANIFEST).exists():
        return "", {}
    import llvmlite.binding as llvm

    platform = platform_of(llvm.get_process_triple())
    if platform is None or not supported(platform):
        return "", {}
    manifest = json.loads((FOLDER / MANIFEST).read_text(encoding="utf-8"))
    return platform, manifest["codes"] if manifest["sources"] == sources() else {}
