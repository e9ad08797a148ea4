"""Devices that hold the arrays of a batch and launch its kernels."""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

from pam_envs.envs.core.lanes import LaneKernel
from pam_envs.kernels.emission import host
from pam_envs.kernels.machine_code import load

Launch = Callable[[Any, int], None]
"""Takes an address book, an array of the device, and the number of environments."""


class Device(Protocol):
    """A device with its own memory.

    Copies and launches are in order; ``read`` and ``write`` wait for earlier work.
    """

    name: str

    def upload(self, values: NDArray[Any]) -> Any:
        """Return an array of the device with these values."""

    def write(self, array: Any, values: NDArray[Any]) -> None:
        """Overwrite an array of the device with values of the same shape and type."""

    def read(self, array: Any) -> NDArray[Any]:
        """Return the values of an array, once all earlier work is done."""

    def copy(self, array: Any, dtype: DTypeLike | None = None) -> Any:
        """Return a copy of an array, its bytes read as another type of the same size."""

    def take(self, array: Any, given: Any) -> None:
        """Overwrite an array with one of another library, which it gives by DLPack."""

    def tensor(self, array: Any, torch: Any) -> Any:
        """Return a tensor in the memory of an array, which it keeps; ``torch`` is the module."""

    def address(self, array: Any) -> int:
        """Return the address of an array."""

    def load(self, kernel: LaneKernel) -> Launch:
        """Return a kernel ready to launch."""

    def check_stream(self) -> None:
        """Raise RuntimeError if torch queues its work in another stream than the device."""

    def synchronise(self) -> None:
        """Wait until all earlier work is done."""


class HostDevice:
    """The processor in place of a GPU: the same kernels, arrays and launches.

    It serves to test without a GPU what runs on one. Environments are computed one after the other,
    several times slower than by the batch of ``device="cpu"``.
    """

    name = "host"

    def upload(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return a copy."""
        return np.array(values, order="C")

    def write(self, array: NDArray[Any], values: NDArray[Any]) -> None:
        """Overwrite an array."""
        array[...] = values

    def read(self, array: NDArray[Any]) -> NDArray[Any]:
        """Return a copy."""
        return array.copy()

    def copy(self, array: NDArray[Any], dtype: DTypeLike | None = None) -> NDArray[Any]:
        """Return a copy, its bytes read as another type."""
        return array.copy() if dtype is None else array.copy().view(dtype)

    def take(self, array: NDArray[Any], given: Any) -> None:
        """Overwrite an array with one of another library."""
        array[...] = np.from_dlpack(given)

    def tensor(self, array: NDArray[Any], torch: Any) -> Any:
        """Return a tensor in the memory of an array."""
        return torch.from_numpy(array)

    def address(self, array: NDArray[Any]) -> int:
        """Return the address."""
        return int(array.ctypes.data)

    def load(self, kernel: LaneKernel) -> Launch:
        """Return the loop over environments in machine code."""
        run = load(kernel.object_code(host()))
        return lambda book, number: run(book.ctypes.data, number)

    def check_stream(self) -> None:
        """Do nothing: the processor has no streams."""

    def synchronise(self) -> None:
        """Do nothing: a launch returns when it is done."""
