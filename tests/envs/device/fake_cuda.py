"""cuda-core in the memory of the processor: the calls of the package, without a driver."""

from __future__ import annotations

import ctypes
import sys
from dataclasses import dataclass
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np


@dataclass
class Buffer:
    """Bytes in the memory of the processor."""

    handle: int
    size: int
    owner: Any = None

    @staticmethod
    def from_handle(ptr: int, size: int, *, owner: Any) -> Buffer:
        return Buffer(ptr, size, owner)

    def bytes(self) -> np.ndarray:
        raw: Any = (ctypes.c_uint8 * self.size).from_address(self.handle)
        raw.buffer = self  # which lives as long as its arrays
        return np.ctypeslib.as_array(raw)


class StridedMemoryView:
    """Array over bytes, with its own reference to them."""

    def __init__(self, array: np.ndarray, keep: Any) -> None:
        self.array, self.keep = array, keep
        self.shape, self.dtype, self.ptr = array.shape, array.dtype, array.ctypes.data
        self.strides = tuple(step // array.itemsize for step in array.strides)
        self.is_device_accessible, self.device_id = True, 0

    @staticmethod
    def from_buffer(
        buffer: Buffer, shape: tuple[int, ...], *, dtype: np.dtype[Any]
    ) -> StridedMemoryView:
        return StridedMemoryView(buffer.bytes().view(dtype).reshape(shape), buffer)

    @staticmethod
    def from_any_interface(given: Any, stream: int) -> StridedMemoryView:
        assert stream == STREAM.handle
        return StridedMemoryView(np.from_dlpack(given), given)

    def __dlpack__(self, **options: Any) -> Any:
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.array.__dlpack_device__()


@dataclass
class Stream:
    """The default stream."""

    handle: int = 1
    waits: int = 0

    def sync(self) -> None:
        self.waits += 1


STREAM = Stream()


@dataclass
class Device:
    """A GPU whose memory is that of the processor."""

    device_id: int
    name: str = "processor"

    def set_current(self) -> None:
        pass

    def allocate(self, size: int, *, stream: Any) -> Buffer:
        assert stream is STREAM
        memory = np.full(size, 0xA5, np.uint8)  # nothing is zero by chance
        return Buffer(memory.ctypes.data, size, memory)


@dataclass
class LaunchConfig:
    """Blocks and threads of a block."""

    grid: int
    block: int


def launch(stream: Any, config: LaunchConfig, kernel: Any, book: Buffer, number: np.int64) -> None:
    """Run a kernel that is a function of the address of the book and the number of lanes."""
    assert stream is STREAM
    assert config.grid * config.block >= number > (config.grid - 1) * config.block
    kernel(book.handle, int(number))


def copied(target: int, source: int, size: int, stream: int = STREAM.handle) -> tuple[int]:
    """Copy bytes, as the driver's functions for it; the error 0 is none."""
    assert stream == STREAM.handle
    ctypes.memmove(target, source, size)
    return (0,)


def install(monkeypatch: Any) -> None:
    """Make the modules importable as ``cuda.core``, ``cuda.core.utils`` and ``cuda.bindings``."""
    core: Any = ModuleType("cuda.core")
    bindings: Any = ModuleType("cuda.bindings")
    bindings.driver = driver = SimpleNamespace()
    driver.cuMemcpyHtoD = driver.cuMemcpyDtoH = driver.cuMemcpyDtoDAsync = copied
    core.utils = utils = ModuleType("cuda.core.utils")
    core.Buffer, core.Device, core.LaunchConfig, core.launch = Buffer, Device, LaunchConfig, launch
    core.LEGACY_DEFAULT_STREAM = STREAM
    utils.StridedMemoryView = StridedMemoryView  # type: ignore[attr-defined]
    for name, module in (
        ("cuda", ModuleType("cuda")),
        ("cuda.core", core),
        ("cuda.core.utils", utils),
        ("cuda.bindings", bindings),
    ):
        monkeypatch.setitem(sys.modules, name, module)
