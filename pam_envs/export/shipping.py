"""Write the object code of default configurations into the package, before a wheel is built.

``python -m pam_envs.export.shipping``: for Linux on x86-64, see :mod:`pam_envs.kernels.shipped`.
"""

from collections.abc import Iterator

import gymnasium as gym

from pam_envs.envs.registration import register_all
from pam_envs.kernels import shipped
from pam_envs.kernels.emission import Target, emit
from pam_envs.kernels.machine_code import Source, intermediate_of
from pam_envs.mechanics.redundancy.resolution import PathKernel

STAGES = 6
"""Joints of the shipped manipulator, whose paths are resolved when it is made."""


def sources() -> Iterator[Source]:
    """Yield the kernels of every environment's default configuration, each once."""
    seen = set()
    for name in sorted(name for name in gym.registry if name.startswith("PAM/")):
        kernels = gym.make(name).unwrapped.setup.kernels  # type: ignore[attr-defined]
        if kernels.by_address.name not in seen:
            seen.add(kernels.by_address.name)
            yield kernels
    yield PathKernel(STAGES)


def main() -> None:
    """Write the folder of object files."""
    register_all()
    target = Target(shipped.TRIPLE, shipped.CPU, jit=True)
    codes = []
    for source in sources():
        kernel = source.by_address
        codes.append((kernel, emit(intermediate_of(source), target)))
        print(f"{kernel.name}: {len(codes[-1][1]) / 1e3:.0f} kB", flush=True)
    shipped.write(codes)


if __name__ == "__main__":
    main()
