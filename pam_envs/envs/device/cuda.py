"""A GPU through cuda-core and cuda-bindings, NVIDIA's bindings of the CUDA driver."""

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import DTypeLike, NDArray

from pam_envs.envs.core.lanes import LaneKernel
from pam_envs.envs.device.device import Launch

THREADS = 128
"""Threads of a block."""
ENTRY = "pam_envs_lanes"
"""Name of a kernel in its PTX."""


class CudaArray:
    """Array in the memory of a GPU, which other libraries take without a copy.

    ``torch.from_dlpack``, ``cupy.from_dlpack`` and ``jax.dlpack.from_dlpack`` take it, and what
    reads ``__cuda_array_interface__``. ``array[i]`` is row ``i``, in the same memory.
    """

    def __init__(
        self, buffer: Any, shape: tuple[int, ...], dtype: DTypeLike, offset: int = 0
    ) -> None:
        self._buffer = buffer
        self._offset = offset
        self.shape = shape
        self.dtype = np.dtype(dtype)

    @property
    def address(self) -> int:
        """Address of the first element."""
        return int(self._buffer.handle) + self._offset

    @property
    def nbytes(self) -> int:
        """Size in bytes."""
        return int(np.prod(self.shape)) * self.dtype.itemsize

    @property
    def part(self) -> Any:
        """Bytes of the array as a buffer of cuda-core."""
        if self.nbytes == self._buffer.size:
            return self._buffer
        from cuda.core import Buffer

        return Buffer.from_handle(self.address, self.nbytes, owner=self._buffer)

    @property
    def view(self) -> Any:
        """View of cuda-core."""
        from cuda.core.utils import StridedMemoryView

        return StridedMemoryView.from_buffer(self.part, self.shape, dtype=self.dtype)

    def __getitem__(self, index: int) -> "CudaArray":
        """Return a row."""
        if not 0 <= index < self.shape[0]:
            raise IndexError(f"row {index} is not among the {self.shape[0]} rows of the array")
        step = self.nbytes // self.shape[0]
        return CudaArray(self._buffer, self.shape[1:], self.dtype, self._offset + index * step)

    def __dlpack__(self, **options: Any) -> Any:
        """Return a DLPack capsule."""
        return self.view.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        """Return type and number of the device, for DLPack."""
        kind, number = self.view.__dlpack_device__()
        return int(kind), int(number)

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        """Shape, type and address, of version 3 of the protocol; stream 1 is the default one."""
        return {
            "shape": self.shape,
            "typestr": self.dtype.str,
            "data": (self.address, False),
            "version": 3,
            "stream": 1,
        }


class CudaDevice:
    """A GPU. Work is queued in its default stream, and makes the GPU the current one.

    Parameters
    ----------
    number : int
        Number of the GPU.
    """

    def __init__(self, number: int = 0) -> None:
        self.name = f"cuda:{number}"
        self._torch: Any = None  # once it has tensors of the batch
        try:
            from cuda.core import LEGACY_DEFAULT_STREAM, Device
        except ImportError as error:
            raise gym.error.DependencyNotInstalled(
                f"device='cuda' needs cuda-core ({error}); pip install 'pam-envs[cuda]'"
            ) from error
        try:
            self._device = Device(number)
            self._device.set_current()
        except Exception as error:  # of the driver's library, which may be missing
            raise RuntimeError(
                f"device = {self.name!r} cannot be used ({str(error).strip()}); it needs an NVIDIA "
                "GPU and its driver (nvidia-smi lists them). device='cpu' needs none"
            ) from error
        self._stream = LEGACY_DEFAULT_STREAM
        self.model = str(self._device.name)

    def _empty(self, shape: tuple[int, ...], dtype: DTypeLike) -> CudaArray:
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        buffer = self._device.allocate(max(size, 8), stream=self._stream)
        return CudaArray(buffer, shape, dtype)

    def upload(self, values: NDArray[Any]) -> CudaArray:
        """Return an array of the GPU with these values."""
        array = self._empty(values.shape, values.dtype)
        self.write(array, values)
        return array

    def write(self, array: CudaArray, values: NDArray[Any]) -> None:
        """Overwrite an array of the GPU."""
        if array.nbytes:
            source = np.array(values, array.dtype, order="C").reshape(array.shape)
            self._call("cuMemcpyHtoD", array.address, source.ctypes.data, array.nbytes)

    def read(self, array: CudaArray) -> NDArray[Any]:
        """Return the values of an array."""
        values = np.empty(array.shape, array.dtype)
        if array.nbytes:
            self._call("cuMemcpyDtoH", values.ctypes.data, array.address, array.nbytes)
        return values

    def _call(self, name: str, *arguments: Any) -> None:
        """Call a function of the driver for this GPU."""
        from cuda.bindings import driver

        self._device.set_current()
        (error,) = getattr(driver, name)(*arguments)
        if int(error):
            raise RuntimeError(f"{name} on {self.name}: {getattr(error, 'name', error)}")

    def copy(self, array: CudaArray, dtype: DTypeLike | None = None) -> CudaArray:
        """Return a copy in the memory of the GPU."""
        made = self._empty(array.shape, array.dtype if dtype is None else dtype)
        self._copy(made, array.address)
        return made

    def _copy(self, array: CudaArray, source: int) -> None:
        """Queue a copy from an address of the GPU."""
        if array.nbytes:
            stream = int(self._stream.handle)
            self._call("cuMemcpyDtoDAsync", array.address, source, array.nbytes, stream)

    def tensor(self, array: CudaArray, torch: Any) -> Any:
        """Return a tensor in the memory of an array; ``torch`` is the module."""
        if not torch.cuda.is_available():
            raise RuntimeError(
                f"PyTorch {torch.__version__} finds no GPU, but the batch is on {self.name}; "
                "install its build for CUDA, or uninstall it to get arrays for DLPack"
            )
        self._torch = torch
        return torch.as_tensor(array, device=self.name)

    def check_stream(self) -> None:
        """Raise RuntimeError if torch queues its work in another stream than the device."""
        number = self._device.device_id
        if self._torch is not None and self._torch.cuda.current_stream(number).cuda_stream:
            raise RuntimeError(
                "torch uses another stream than the default one, in which the batch queues its "
                "work; step outside torch.cuda.stream and torch.cuda.graph"
            )

    def take(self, array: CudaArray, given: Any) -> None:
        """Overwrite an array with one of another library, of the same shape and type."""
        from cuda.core.utils import StridedMemoryView

        source = StridedMemoryView.from_any_interface(given, int(self._stream.handle))
        if (tuple(source.shape), source.dtype) != (array.shape, array.dtype):
            raise ValueError(
                f"actions of shape {source.shape} and type {source.dtype}, expected {array.shape} "
                f"of {array.dtype}; convert them, or install torch, whose tensors are converted"
            )
        if not _contiguous(source.shape, source.strides):
            raise ValueError(
                f"actions of shape {source.shape} with strides {source.strides}, expected rows one "
                "after the other; give a contiguous copy"
            )
        if not source.is_device_accessible or source.device_id != self._device.device_id:
            raise ValueError(
                f"actions that are not in the memory of {self.name}; move them there, or give a "
                "NumPy array"
            )
        self._copy(array, source.ptr)
        self.synchronise()  # the other library may reuse the memory

    def address(self, array: CudaArray) -> int:
        """Return the address of an array."""
        return array.address

    def load(self, kernel: LaneKernel) -> Launch:
        """Return a kernel whose PTX the driver has compiled for this GPU."""
        from cuda.core import LaunchConfig, launch

        compiled = self.compiled(kernel)

        def run(book: CudaArray, number: int) -> None:
            self._device.set_current()
            config = LaunchConfig(grid=-(-number // THREADS), block=THREADS)
            launch(self._stream, config, compiled, book.part, np.int64(number))

        return run

    def compiled(self, kernel: LaneKernel) -> Any:
        """Return a kernel of cuda-core, whose attributes are its registers and local memory."""
        from cuda.core import ObjectCode

        self._device.set_current()
        return ObjectCode.from_ptx(kernel.ptx(ENTRY)).get_kernel(ENTRY)

    def synchronise(self) -> None:
        """Wait until all earlier work is done."""
        self._device.set_current()
        self._stream.sync()


def _contiguous(shape: tuple[int, ...], strides: tuple[int, ...] | None) -> bool:
    """Return whether rows are one after the other, by the strides in elements."""
    if strides is None:
        return True
    expected = [int(np.prod(shape[i + 1 :])) for i in range(len(shape))]
    return all(
        n == 1 or own == other for n, own, other in zip(shape, strides, expected, strict=True)
    )
