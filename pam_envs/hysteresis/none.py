"""No hysteresis: the identity, as a model of the protocol with no plays."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.hysteresis.elements import plays_lag, plays_peek
from pam_envs.hysteresis.protocol import HysteresisModel, Kernels, Start, register
from pam_envs.kernels.build import kernel


@kernel
def identity_step(
    x: Any, y: Any, rows: Any, fixed: Any, counts: Any, table: Any, elements: int, at: int,
    model: int, count: int, member: int, first: int, last: int,
) -> None:  # fmt: skip
    """Write the inputs as outputs."""
    for j in range(first, last):
        y[j] = x[j]


@register
@dataclass(frozen=True)
class NoHysteresis(HysteresisModel):
    """The identity; ``operator=None`` of a plant means the same."""

    kind: ClassVar[str] = "none"
    identity: ClassVar[bool] = True
    kernels: ClassVar[Kernels] = Kernels(identity_step, lag=plays_lag, peek=plays_peek)
    state_rows: ClassVar[int] = 0

    def scaled(self, width: float, slope: float | None = None) -> "NoHysteresis":
        """Return the identity."""
        return self

    def initial_state(self, batch_shape: tuple[int, ...] = ()) -> NDArray[np.float64]:
        """Return no state, shape ``(*batch_shape, 0)``."""
        return np.zeros((*batch_shape, 0))

    def step(self, x: ArrayLike, state: Any) -> tuple[NDArray[np.float64], Any]:
        """Return the input."""
        return np.asarray(x, float), state

    def inverse_step(self, y: ArrayLike, state: Any) -> tuple[NDArray[np.float64], Any]:
        """Return the output."""
        return np.asarray(y, float), state

    @classmethod
    def resembling(cls, reference: Any, low: float, high: float, levels: int, start: Start) -> None:
        """Return None, by which plants name the identity."""
