"""GPU through cuda-core: addresses, copies, launches and arrays, with the driver replaced."""

import sys
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pam_envs  # noqa: F401  registers the environments
from pam_envs.envs.core.lanes import LaneKernel
from pam_envs.envs.device.cuda import CudaArray, CudaDevice
from pam_envs.kernels.build import COMPILED
from pam_envs.kernels.emission import host
from pam_envs.kernels.machine_code import load
from tests.envs.device import fake_cuda

pytestmark = pytest.mark.skipif(not COMPILED, reason="batches on a device are compiled")
ID = "PAM/MusclePositioning-v0"
TENSOR = CudaDevice.tensor


@pytest.fixture(autouse=True)
def driver(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the driver; a kernel is the loop over environments on the processor."""
    fake_cuda.install(monkeypatch)

    def compiled(self: CudaDevice, kernel: LaneKernel) -> Any:
        return load(kernel.object_code(host()))

    def tensor(self: CudaDevice, array: CudaArray, torch: Any) -> Any:
        return torch.from_numpy(array.view.array)

    monkeypatch.setattr(CudaDevice, "compiled", compiled)
    monkeypatch.setattr(CudaDevice, "tensor", tensor)


@pytest.mark.parametrize("with_torch", [True, False])
@pytest.mark.parametrize("number", [7, 130])
def test_batch_through_the_binding_has_the_same_bits(
    number: int, with_torch: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if with_torch:
        pytest.importorskip("torch")
    else:
        monkeypatch.setitem(sys.modules, "torch", None)
    ours: Any = gym.make_vec(ID, number, device="cuda", episode_seconds=0.3)
    theirs: Any = gym.make_vec(ID, number, device="cpu", episode_seconds=0.3)
    assert ours.device.name == "cuda:0"
    first, expected = ours.reset(seed=4)[0], theirs.reset(seed=4)[0]
    assert np.array_equal(np.from_dlpack(first), expected)
    generator = np.random.default_rng(0)
    for _ in range(40):
        actions = generator.uniform(-1.0, 1.0, theirs.action_space.shape)
        *found, info = ours.step(actions)
        *expected, other = theirs.step(actions)
        for one, two in zip(found, expected, strict=True):
            assert np.array_equal(np.from_dlpack(one), two)
        for key in ours.setup.info_keys:
            assert np.array_equal(np.from_dlpack(info[key]), other[key])


def test_float32_through_the_binding_has_the_bits_of_the_processor() -> None:
    both: list[Any] = [gym.make_vec(ID, 5, device=d, dtype="float32") for d in ("cuda", "host")]
    for envs in both:
        envs.reset(seed=4)
        for action in np.linspace(-1.0, 1.0, 5):
            envs.step(np.full(envs.action_space.shape, action))
    for name in ("rows", "observations", "report"):
        ours, theirs = (envs.values(name) for envs in both)
        assert ours.dtype == np.float32
        assert np.array_equal(ours, theirs)


def test_rows_of_an_array_share_its_memory() -> None:
    device = CudaDevice()
    values = np.arange(24.0).reshape(2, 3, 4)
    array = device.upload(values)
    row = array[1][2]
    assert np.array_equal(np.from_dlpack(row), values[1, 2])
    device.write(row, np.full(4, -1.0))
    assert np.array_equal(device.read(array)[1, 2], np.full(4, -1.0))
    assert np.array_equal(device.read(array)[0], values[0])
    with pytest.raises(IndexError, match="row 2 is not among the 2 rows"):
        array[2]


def test_array_interface_names_address_shape_and_type() -> None:
    array = CudaDevice().upload(np.zeros((2, 5), np.float32))
    found = array[1].__cuda_array_interface__
    assert found["data"] == (array.address + 20, False)
    assert (found["shape"], found["typestr"], found["version"]) == ((5,), "<f4", 3)


def test_actions_of_another_library_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    device = CudaDevice()
    array, given = device.upload(np.zeros((3, 2))), device.upload(np.ones((3, 2)))
    device.take(array, given)
    assert np.array_equal(device.read(array), np.ones((3, 2)))
    with pytest.raises(ValueError, match=r"float32.*expected"):
        device.take(array, CudaArray(given._buffer, (3, 2), np.float32))
    with pytest.raises(ValueError, match=r"strides \(1, 3\), expected rows"):
        device.take(array, np.ones((2, 3)).T)
    column = device.upload(np.zeros((3, 1)))
    device.take(column, np.arange(3.0)[:, None])  # strides (1, 0)
    assert np.array_equal(device.read(column)[:, 0], np.arange(3.0))


def test_actions_elsewhere_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    device = CudaDevice()
    array = device.upload(np.zeros((3, 2)))
    view = fake_cuda.StridedMemoryView(np.ones((3, 2)), None)
    view.is_device_accessible = False
    monkeypatch.setattr(
        fake_cuda.StridedMemoryView, "from_any_interface", staticmethod(lambda *given: view)
    )
    with pytest.raises(ValueError, match="not in the memory of cuda:0; move them"):
        device.take(array, np.ones((3, 2)))


def test_torch_without_the_gpu_is_named_with_its_remedy() -> None:
    torch = pytest.importorskip("torch")
    if torch.cuda.is_available():
        pytest.skip("torch has a GPU")
    device = CudaDevice()
    with pytest.raises(RuntimeError, match=r"finds no GPU, but the batch is on cuda:0.*its build"):
        TENSOR(device, device.upload(np.zeros(3)), torch)


def test_other_stream_of_torch_is_refused() -> None:
    device = CudaDevice()
    streams = {0: SimpleNamespace(cuda_stream=0)}
    device._torch = SimpleNamespace(cuda=SimpleNamespace(current_stream=streams.get))
    device.check_stream()
    streams[0] = SimpleNamespace(cuda_stream=7)
    with pytest.raises(RuntimeError, match=r"another stream.*torch\.cuda\.stream"):
        device.check_stream()


def test_error_of_the_driver_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    device = CudaDevice()
    driver = sys.modules["cuda.bindings"].driver
    monkeypatch.setattr(driver, "cuMemcpyHtoD", lambda *given: (2,))
    with pytest.raises(RuntimeError, match="cuMemcpyHtoD on cuda:0: 2"):
        device.upload(np.zeros(3))


def test_missing_gpu_is_named_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(number: int) -> Any:
        raise OSError("the driver's library is missing")

    monkeypatch.setattr(sys.modules["cuda.core"], "Device", fail)
    with pytest.raises(RuntimeError, match=r"'cuda:1' cannot be used.*missing.*nvidia-smi"):
        gym.make_vec(ID, 2, device="cuda:1")
