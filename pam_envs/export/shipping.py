"""Write the object code of default configurations into the package, before a wheel is built.

``python -m pam_envs.export.shipping``: for all platforms of :mod:`pam_envs.kernels.shipped`.
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
    kernels = [(source.by_address, intermediate_of(source)) for source in sources()]
    codes = {}
    for name, platform in shipped.PLATFORMS.items():
        target = Target(platform.triple, platform.cpu, jit=True)
        codes[name] = {kernel.name: emit(text, target) for kernel, text in kernels}
        print(f"{name}: {sum(map(len, codes[name].values())) / 1e3:.0f} kB", flush=True)
    shipped.write(codes, [kernel for kernel, _ in kernels])


if __name__ == "__main__":
    main()
