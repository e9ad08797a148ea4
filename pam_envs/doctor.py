"""Report on an installation: versions, extras, compiler, cache, first step, GPU."""

import platform
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib import metadata
from importlib.util import find_spec
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from pam_envs.kernels import build, cache
from pam_envs.kernels.machine_code import waiting
from pam_envs.wording import package

ENVIRONMENT = "PAM/MusclePositioning-v0"
CORE = ("numpy", "scipy", "numba", "llvmlite", "gymnasium")
USER_EXTRAS = ("plot", "data", "formats", "baselines", "agents", "export", "rig", "cuda")
REQUIREMENT = re.compile(r"([\w.-]+)[^;]*;.*extra == ['\"](\w+)['\"]")
STEPS = 5  # compared between plain Python and machine code


class Finding(NamedTuple):
    """Result of a check; ``ok`` is False for a fault, whose remedy the text names."""

    topic: str
    text: str
    ok: bool = True


def versions() -> Iterator[Finding]:
    """Yield versions of the package, Python and the core dependencies."""
    yield Finding("package", package())
    yield Finding("python", f"{platform.python_version()} on {platform.platform(terse=True)}")
    yield Finding("versions", ", ".join(f"{name} {_version(name)}" for name in CORE))


def extras() -> Iterator[Finding]:
    """Yield which extras are installed, and the packages that the others lack."""
    wants: dict[str, list[str]] = {extra: [] for extra in USER_EXTRAS}
    for line in metadata.requires("pam-envs") or ():
        found = REQUIREMENT.match(line)
        if found and found[2] in wants:
            wants[found[2]].append(found[1])
    for extra, names in wants.items():
        missing = [name for name in names if not _version(name)]
        text = f"{extra}: " + (f"not installed: {', '.join(missing)}" if missing else "installed")
        yield Finding("extra", text)


def compiler() -> Iterator[Finding]:
    """Yield the mode of compilation, the processor and the threads."""
    if not build.COMPILED:
        yield Finding("compiler", "off (PAM_ENVS_COMPILE=0): plain Python, with the same bits")
        return
    from llvmlite import binding

    how = "compiles at once" if waiting() else "compiles in the background"
    yield Finding("compiler", f"{how}; {binding.get_host_cpu_name()}, {build.threads()} threads")


def stored() -> Iterator[Finding]:
    """Yield the folder of compiled code, its size, and whether it can be written."""
    folder = cache.FOLDER
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        remedy = "set PAM_ENVS_CACHE to a folder that can be written, or every process compiles"
        yield Finding("cache", f"{folder}: {error.strerror}; {remedy}", ok=False)
        return
    sizes = [file.stat().st_size for file in folder.rglob("*") if file.is_file()]
    yield Finding("cache", f"{folder}, {len(sizes)} files, {sum(sizes) / 1e6:.1f} MB")


def first_step() -> Iterator[Finding]:
    """Yield the time to a first step, and whether machine code gives the bits of plain Python."""
    began = time.perf_counter()
    env: Any = gym.make(ENVIRONMENT).unwrapped
    plain = _episode(env)
    yield Finding("first step", f"{ENVIRONMENT} after {time.perf_counter() - began:.2f} s")
    if build.COMPILED:
        began = time.perf_counter()
        env._use(env.setup.kernels.single.wait(), compiled=True)
        spent = time.perf_counter() - began
        if (plain == _episode(env)).all():
            yield Finding("machine code", f"ready after {spent:.2f} s, bits of plain Python")
        else:
            text = f"differs from plain Python; delete {cache.FOLDER}, and report it if it remains"
            yield Finding("machine code", text, ok=False)


def gpu() -> Iterator[Finding]:
    """Yield the GPU that torch finds, if torch is installed; simulation needs none."""
    if not find_spec("torch"):
        yield Finding("GPU", "torch is not installed; simulation needs no GPU")
        return
    import torch

    if torch.cuda.is_available():
        yield Finding("GPU", f"torch {torch.__version__}, {torch.cuda.get_device_name(0)}")
    elif torch.version.cuda and not shutil.which("nvidia-smi"):
        text = "built for CUDA, but there is no GPU: the CPU build takes a tenth of the space"
        yield Finding("GPU", f"torch {torch.__version__} {text}")
    else:
        yield Finding("GPU", f"torch {torch.__version__} finds none; training runs on the CPU")


def batches() -> Iterator[Finding]:
    """Yield the GPU that cuda-core finds for ``gym.make_vec(..., device="cuda")``."""
    version = _version("cuda-core")
    if not version:
        text = "cuda-core is not installed (pip install 'pam-envs[cuda]'); batches run on the CPU"
        yield Finding("GPU batches", text)
        return
    from pam_envs.envs.device.cuda import CudaDevice

    try:
        yield Finding("GPU batches", f"cuda-core {version}, {CudaDevice().model}")
    except (RuntimeError, gym.error.DependencyNotInstalled) as error:
        yield Finding("GPU batches", f"cuda-core {version}: {error}")


CHECKS: tuple[Callable[[], Iterator[Finding]], ...] = (
    versions,
    extras,
    compiler,
    stored,
    first_step,
    gpu,
    batches,
)


def examine() -> Iterator[Finding]:
    """Yield the findings of all checks; a check that raises is a fault."""
    for check in CHECKS:
        try:
            yield from check()
        except Exception as error:  # the fault is the finding
            topic = check.__name__.replace("_", " ")
            yield Finding(topic, f"{type(error).__name__}: {error}", ok=False)


def doctor() -> int:
    """Check the installation: versions, extras, compiler, cache, first step, GPU.

    Exit code 0 without faults, 1 otherwise.
    """
    faults = 0
    for finding in examine():
        faults += not finding.ok
        print(f"{'ok   ' if finding.ok else 'FAULT'}  {finding.topic:12}  {finding.text}")
    total = f"{faults} fault{'s' * (faults > 1)}" if faults else "no faults"
    print(total, file=sys.stderr if faults else sys.stdout)
    return 1 if faults else 0


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _episode(env: Any) -> np.ndarray:
    """Return the observations of a few steps."""
    seen = [env.reset(seed=0)[0]]
    seen += [env.step(np.full(1, 0.1 * k, np.float32))[0] for k in range(STEPS)]
    return np.array(seen)
