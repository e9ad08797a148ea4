"""Arrays of a controller's kernel, and the arithmetic that the kernels have in common.

A kernel computes the action of one control period from an observation. It takes the address book of
the arrays below, and a mode: 1 starts an episode.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.arrays import Array
from pam_envs.export.model import Block, Model, identifier, signal_variables
from pam_envs.kernels.arithmetic import clip
from pam_envs.kernels.build import kernel
from pam_envs.kernels.machine_code import AddressKernel
from pam_envs.parameters import Signals

INPUT, OUTPUT, STATE, DATA, COLUMNS, NUMBERS = range(6)
"""Observation (float64), action (float32), state, numbers of the design, columns of the signals
that are read, counters; the arrays of a family follow."""
FAMILY = 6
"""First array of a family."""
STEPS = 2
"""Row of the counters: control periods since the start of the episode."""
SCALE = 4
"""Numbers of an action at the end of the design: gain, offset, lowest and highest value."""


@dataclass(frozen=True)
class ControllerKernel:
    """Kernel of a family of controllers: the design is data."""

    name: str
    function: Callable[[Any, int], None]
    arrays: int

    @property
    def by_address(self) -> AddressKernel:
        """The kernel."""
        return AddressKernel(f"controller_{self.name}", self.function, {}, 4 * self.arrays)


@dataclass(frozen=True)
class Design:
    """A controller as data for the kernel of its family.

    Attributes
    ----------
    family : str
        Name of the kernel.
    function : callable
        The kernel.
    state : int
        Numbers of state.
    numbers : sequence of float
        Numbers of the design, in the order in which the kernel reads them.
    columns : ndarray of int
        Columns of the observation that it reads.
    arrays : mapping
        Further arrays, by name; constant if they hold numbers other than 0.
    agreement : str
        How the actions compare with those of the Python controller.
    """

    family: str
    function: Callable[[Any, int], None]
    state: int
    numbers: Any
    columns: Any
    arrays: Mapping[str, Array]
    agreement: str


def model_of(design: Design, name: str, signals: Signals, actions: Signals, period: float) -> Model:
    """Return the model of a controller for export.

    Parameters
    ----------
    name : str
        Name of the controller, for files and functions.
    signals, actions : Signals
        Those of its environment.
    period : float
        Control period [s].
    """
    own: dict[str, NDArray[Any]] = {
        "input": np.zeros(len(signals)),
        "output": np.zeros(len(actions), np.float32),
    }
    own["state"] = np.zeros(max(1, design.state))
    own["data"] = np.asarray(design.numbers, np.float64)
    own["columns"] = np.asarray(design.columns, np.int64)
    own["numbers"] = np.zeros(4, np.int64)
    arrays = {**own, **{k: np.ascontiguousarray(v) for k, v in design.arrays.items()}}
    changing = ("input", "output", "state", "numbers")
    blocks = tuple(
        Block(k, v, v.shape, k not in changing and not k.startswith("work"))
        for k, v in arrays.items()
    )
    return Model(
        f"{name}, a controller",
        identifier(name),
        period,
        blocks,
        {"kernel": ControllerKernel(design.family, design.function, len(blocks))},
        tuple(signal_variables(signals, "input")),
        tuple(signal_variables(actions, "output", "action.")),
        (),
        "controller",
        {"controller": name},
        design.agreement,
    )


def scaled(reader: Any) -> list[float]:
    """Return gains and offsets of a reader's signals, as :func:`read` takes them."""
    return [*map(float, reader.gain), *map(float, reader.offset)]


def limits_of(signal: Any) -> list[float]:
    """Return the ``SCALE`` numbers of an action."""
    return [*signal.scale, signal.low, signal.high]


@kernel
def read(inputs: Any, columns: Any, data: Any, at: int, k: int, first: int, n: int) -> float:
    """Return signal ``first + k`` in SI; its ``n`` gains and offsets are in ``data`` at ``at``."""
    return (inputs[columns[first + k]] - data[at + n + k]) / data[at + k]  # type: ignore[no-any-return]


@kernel
def write(outputs: Any, k: int, value: float, data: Any, at: int) -> None:
    """Write an action in SI, held within its range, as an entry of the action's vector."""
    outputs[k] = data[at] * clip(value, data[at + 2], data[at + 3]) + data[at + 1]


@kernel
def row_sum(values: Any, first: int, n: int) -> float:
    """Return the sum of ``n`` numbers in the order of numpy's pairwise sum, for ``n`` up to 128."""
    if n < 8:
        total = 0.0
        for k in range(n):
            total = total + values[first + k]
        return total
    r0, r1, r2, r3 = values[first], values[first + 1], values[first + 2], values[first + 3]
    r4, r5, r6, r7 = values[first + 4], values[first + 5], values[first + 6], values[first + 7]
    k = 8
    while k < n - n % 8:
        i = first + k
        r0, r1, r2, r3 = (
            r0 + values[i], r1 + values[i + 1], r2 + values[i + 2], r3 + values[i + 3],
        )  # fmt: skip
        r4, r5, r6, r7 = (
            r4 + values[i + 4], r5 + values[i + 5], r6 + values[i + 6], r7 + values[i + 7],
        )  # fmt: skip
        k = k + 8
    total = ((r0 + r1) + (r2 + r3)) + ((r4 + r5) + (r6 + r7))
    while k < n:
        total = total + values[first + k]
        k = k + 1
    return total
