"""Small kernels that take an address book."""

import math
import os
from dataclasses import dataclass
from typing import Any

from pam_envs.kernels.build import array_at, kernel
from pam_envs.kernels.machine_code import AddressKernel

GAIN = 0.0  # a placeholder


@kernel
def scaled(x: float) -> float:
    """Return a multiple of a number."""
    return math.sqrt(x) * GAIN


@kernel
def scale_by_address(book: Any, mode: int) -> None:
    """Write scaled values of the first array into the second."""
    values, out = array_at(book, 0, 1, 0), array_at(book, 1, 1, 0)
    for k in range(len(values)):
        out[k] = scaled(values[k]) + mode


@kernel
def sine_by_address(book: Any, mode: int) -> None:
    """Call libm, which no kernel may do."""
    values = array_at(book, 0, 1, 0)
    values[0] = math.sin(values[0])


@dataclass(frozen=True)
class Scale:
    """Source of the kernel that scales by a gain."""

    gain: float

    @property
    def by_address(self) -> AddressKernel:
        """The kernel."""
        return AddressKernel("scale", scale_by_address, {"GAIN": self.gain}, 8)


@dataclass(frozen=True)
class OnlyIn:
    """Source that only one process can build."""

    process: int

    @property
    def by_address(self) -> AddressKernel:
        """The kernel, or an error elsewhere."""
        if os.getpid() != self.process:
            raise RuntimeError("of another process")
        return AddressKernel("only", scale_by_address, {"GAIN": 3.0}, 8)
