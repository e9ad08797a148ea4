"""The batch of environments on a device."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from pam_envs.envs.core.batch import Batch
from pam_envs.envs.core.lanes import PARTS, LaneKernel
from pam_envs.envs.core.setup import Setup, check_choice
from pam_envs.envs.core.step import EPISODE
from pam_envs.envs.device.cuda import CudaDevice
from pam_envs.envs.device.device import Device, HostDevice
from pam_envs.kernels.build import COMPILED
from pam_envs.kernels.random import seed_words

BOOK = (
    *("rows", "fixed", "counts", "ahead", "tables", "samples", "settings", "choices"),
    *("actions", "observations", "report", "flags"),
)
"""Arrays in the order of the address book."""
SHARED = ("actions", "observations", "report", "flags")
"""Those that torch has as tensors in the same memory."""
DTYPES = ("float64", "float32")
"""Types of numbers that are neither integers nor observations."""


class DeviceVectorEnv(Batch):
    """``num_envs`` environments that one launch steps on a GPU.

    Row ``i`` of a batch reset with seed ``s`` is the single environment reset with ``s + i``. Steps
    with actions on the device wait for nothing: they queue work and return. Results are tensors of
    torch on the device where torch is installed, otherwise arrays that other libraries take by
    DLPack; each belongs to the caller. Actions may be tensors on the device, of any type, which are
    not checked for finite values, or NumPy arrays.

    Resets happen in the same step. Every step's ``infos["final_obs"]`` and, with ``info``,
    ``infos["final_info"]`` hold the values before the resets, for all rows: those of ended episodes
    are where ``infos["_final_obs"]`` is true.

    Parameters
    ----------
    num_envs : int
        Number of rows.
    device : Device or str
        "cuda", "cuda:1" for the second GPU, or "host" for the processor in its place.
    dtype : {"float64", "float32"}
        Type of the state, of parameters and of all arithmetic but random numbers.
    info : bool
        Whether steps return ``info``; learning needs none and is faster without.
    autoreset_mode : AutoresetMode or str
        Only "SameStep".
    setup : Setup
        Configuration.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        device: Device | str = "cuda",
        dtype: str = "float64",
        info: bool = True,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        setup: Setup,
    ) -> None:
        if not COMPILED:
            raise ValueError("batches on a device are compiled: leave PAM_ENVS_COMPILE unset")
        self._configure(setup, {})
        self._configure_batch(num_envs, setup)
        check_choice("render_mode of a batch on a device", setup.render_mode, (None,))
        check_choice(
            "autoreset_mode of a batch on a device",
            str(getattr(autoreset_mode, "value", autoreset_mode)),
            (AutoresetMode.SAME_STEP.value,),
        )
        self.device = device_of(device) if isinstance(device, str) else device
        check_choice("dtype", dtype, DTYPES)
        self.dtype = dtype
        self.with_info = bool(info)
        self._torch = _torch()
        self._arrays = {name: self.device.upload(a) for name, a in self._initial().items()}
        if self._torch is not None:
            with self._torch.inference_mode(False):
                self._tensors = {
                    name: self.device.tensor(self._arrays[name], self._torch) for name in SHARED
                }
        book = np.zeros((len(BOOK), 4), np.int64)
        for row, name in zip(book, BOOK, strict=True):
            array = self._arrays[name]
            row[0], row[1 : 1 + len(array.shape)] = self.device.address(array), array.shape
        self._book = self.device.upload(book.ravel())
        self._launches = {
            part: self.device.load(LaneKernel(setup.kernels, part, dtype)) for part in PARTS
        }

    def _initial(self) -> dict[str, NDArray[Any]]:
        """Return the arrays of the address book at their initial values."""
        setup, n = self.setup, self.num_envs
        kernels, keys = setup.kernels, len(setup.info_keys) if self.with_info else 0
        own = (
            np.zeros((kernels.rows, n)),
            np.zeros((kernels.parameters, n if setup.drawn else 1)),
            np.zeros((kernels.n_counts, n), np.int64),
            np.zeros((setup.ring, n)),
        )
        outputs = (
            np.zeros((n, len(setup.action_signals))),
            np.zeros((1, n, len(setup.signals)), np.float32),
            np.zeros((1, keys + 1, n)),
            np.zeros((3, n), np.int8),
        )
        arrays = zip(BOOK, (*own, *setup.shared, *outputs), strict=True)
        return {name: a.astype(self.dtype) if a.dtype == np.float64 else a for name, a in arrays}

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start episodes; see Gymnasium. ``options["reset_mask"]`` resets some rows only."""
        self.device.check_stream()
        mask = self._mask(options)
        self._seed_rows(self._seeds(seed), mask)
        report = self._arrays["report"]
        self.device.write(report, np.zeros(report.shape))
        self.device.write(self._arrays["flags"], np.array([2 * mask, 0 * mask, mask], np.int8))
        self._launch("restart")
        self._seeded = True
        return self._give("observations")[0], self._infos(self._give("report")[0])

    def _seed_rows(self, seeds: list[int | None] | None, mask: NDArray[np.bool_]) -> None:
        a, b, _ = self.setup.seed_rows
        counts = self.device.read(self._arrays["counts"])
        for row in np.flatnonzero(mask).tolist():
            seed = None if seeds is None else seeds[row]
            if seed is None:
                counts[EPISODE, row] += 1
            else:
                counts[a, row], counts[b, row] = seed_words(seed)
                counts[EPISODE, row] = 0
        self.device.write(self._arrays["counts"], counts)

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Apply one action a row; see Gymnasium."""
        if not self._seeded:
            raise gym.error.ResetNeeded("call reset() before step()")
        self.device.check_stream()
        self._take(actions)
        self._launch("step")
        final = self._give("observations")[0]
        final_info = self._infos(self._give("report")[0]) if self.with_info else {}
        self._launch("restart")
        flags, report = self._give("flags", np.bool_), self._give("report")[0]
        infos = {**self._infos(report), "final_obs": final, "_final_obs": flags[2]}
        if self.with_info:
            infos |= {"final_info": final_info, "_final_info": flags[2]}
        return self._give("observations")[0], report[0], flags[0], flags[1], infos

    def _take(self, actions: Any) -> None:
        """Copy actions to the device."""
        array, torch = self._arrays["actions"], self._torch
        if hasattr(actions, "__dlpack__") and not isinstance(actions, np.ndarray):
            if tuple(actions.shape) != array.shape:
                raise ValueError(f"actions of shape {tuple(actions.shape)}, expected {array.shape}")
            if torch is not None and isinstance(actions, torch.Tensor):
                self._tensors["actions"].copy_(actions.detach())
            else:
                self.device.take(array, actions)
        else:
            self.device.write(array, self._numbers(actions, array.shape, "actions"))

    def _launch(self, part: str) -> None:
        self._launches[part](self._book, self.num_envs)

    def _give(self, name: str, dtype: Any = None) -> Any:
        """Return a copy of an array for the caller."""
        if self._torch is None:
            return self.device.copy(self._arrays[name], dtype)
        tensor = self._tensors[name]
        return (tensor.view(self._torch.bool) if dtype is np.bool_ else tensor).clone()

    def values(self, name: str) -> NDArray[Any]:
        """Return the present values of an array of the address book, once all steps are done."""
        return self.device.read(self._arrays[name])

    def _infos(self, report: Any) -> dict[str, Any]:
        if not self.with_info:
            return {}
        return {key: report[1 + i] for i, key in enumerate(self.setup.info_keys)}


def _torch() -> Any:
    """Return torch, or None where it is not installed."""
    try:
        import torch
    except ImportError:
        return None
    return torch


def device_of(name: str) -> Device:
    """Return the device of a name: "host", "cuda", or "cuda:1" for the second GPU."""
    kind, _, number = name.partition(":")
    if name == "host":
        return HostDevice()
    if kind == "cuda" and (number.isdigit() or name == "cuda"):
        return CudaDevice(int(number or 0))
    raise ValueError(
        f"device = {name!r} is not known; choose 'cpu', 'cuda', 'cuda:1' (the second GPU), or "
        "'host' (the kernels of the GPU on the processor, for tests)"
    )
