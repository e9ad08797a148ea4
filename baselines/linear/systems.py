"""Linear systems of one input and one output, in continuous time and at a control period."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eig, matrix_balance
from scipy.signal import cont2discrete

from baselines.core.controller import Array

Complex = NDArray[np.complex128]
Method = Literal["bilinear", "zoh"]


@dataclass(frozen=True)
class LinearSystem:
    """A system ``dx/dt = a x + b u``, ``y = c x + d u``.

    Attributes
    ----------
    a : ndarray, shape (n, n)
        [1/s].
    b : ndarray, shape (n,)
    c : ndarray, shape (n,)
    d : float
    """

    a: Array
    b: Array
    c: Array
    d: float = 0.0

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.b))
        for name, shape in (("a", (n, n)), ("b", (n,)), ("c", (n,))):
            value = np.asarray(getattr(self, name), float)
            if value.shape != shape or not np.all(np.isfinite(value)):
                raise ValueError(
                    f"{name} has shape {value.shape}; it must be finite and of shape {shape}:"
                    " give one input and one output as plain vectors"
                )
            object.__setattr__(self, name, value)

    @classmethod
    def from_polynomials(cls, numerator: ArrayLike, denominator: ArrayLike) -> LinearSystem:
        """Return a system from its transfer function, highest power of ``s`` first.

        Time is scaled by the geometric mean of the poles while the companion form is built, and
        the form balanced: as it stands it would be ill-conditioned from order 5 or so.
        """
        top = np.trim_zeros(np.atleast_1d(np.asarray(numerator, float)), "f")
        low = np.trim_zeros(np.atleast_1d(np.asarray(denominator, float)), "f")
        n = len(low) - 1
        if n < 1 or len(top) > n + 1:
            raise ValueError(
                f"numerator has degree {len(top) - 1} and denominator {n}; it must be proper and"
                " of order 1 at least: add the poles that the plant has beyond its bandwidth"
            )
        scale = _time_scale(low)
        powers = scale ** np.arange(n + 1)
        low = low / low[0] / powers
        top = np.concatenate(
            [np.zeros(n + 1 - len(top)), top / float(np.atleast_1d(denominator)[0])]
        )
        top = top / powers
        a = np.vstack([-low[1:], np.eye(n - 1, n)])
        b, c = np.eye(n)[0], top[1:] - low[1:] * top[0]
        balanced, (sizes, _) = matrix_balance(a, permute=False, separate=True)
        return cls(scale * balanced, scale * b / sizes, c * sizes, float(top[0]))

    @classmethod
    def from_roots(cls, zeros: ArrayLike, poles: ArrayLike, static_gain: float) -> LinearSystem:
        """Return a system from zeros and poles [rad/s] and the gain at rest (no pole at 0)."""
        top, low = np.poly(np.atleast_1d(zeros)).real, np.poly(np.atleast_1d(poles)).real
        if low[-1] == 0.0:
            raise ValueError("a pole is at 0, so that the gain at rest has no bound: leave it out")
        return cls.from_polynomials(top * (static_gain * low[-1] / top[-1]), low)

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.b)

    @property
    def static_gain(self) -> float:
        """Gain at rest, ``d - c a^-1 b``."""
        return float(self.d - self.c @ np.linalg.solve(self.a, self.b))

    @property
    def poles(self) -> Complex:
        """Poles [rad/s], the slowest first."""
        values = np.linalg.eigvals(self.a).astype(complex)
        return values[np.argsort(np.abs(values))]

    @property
    def zeros(self) -> Complex:
        """Finite zeros [rad/s], the slowest first."""
        n = self.order
        pencil = np.block([[self.a, self.b[:, None]], [self.c[None, :], np.array([[self.d]])]])
        mass = np.diag([1.0] * n + [0.0])
        found = eig(pencil, mass, right=False, homogeneous_eigvals=True)
        fast = 1e6 * np.max(np.abs(self.poles))
        finite = np.abs(found[1]) * fast > np.abs(found[0])
        values = (found[0][finite] / found[1][finite]).astype(complex)
        return values[np.argsort(np.abs(values))]

    def response(self, frequency: ArrayLike) -> Complex:
        """Return the frequency response at angular frequencies [rad/s], of their shape."""
        s = 1j * np.asarray(frequency, float)
        matrices = s[..., None, None] * np.eye(self.order) - self.a
        states = np.linalg.solve(
            matrices, np.broadcast_to(self.b, s.shape + self.b.shape)[..., None]
        )
        return np.asarray(states[..., 0] @ self.c + self.d)

    def series(self, after: LinearSystem) -> LinearSystem:
        """Return this system followed by another."""
        a = np.block(
            [
                [self.a, np.zeros((self.order, after.order))],
                [np.outer(after.b, self.c), after.a],
            ]
        )
        b = np.concatenate([self.b, after.b * self.d])
        return LinearSystem(a, b, np.concatenate([after.d * self.c, after.c]), self.d * after.d)

    def discrete(self, period: float, method: Method = "bilinear") -> DiscreteSystem:
        """Return the system at a control period [s].

        ``"bilinear"`` (Tustin) keeps stability and, without warping to speak of below a tenth of
        the sampling frequency, the phase: the choice for controllers. ``"zoh"`` is exact for an
        input that is held over the period: the choice for plants.
        """
        if not period > 0.0:
            raise ValueError(f"period is {period}; it must be above 0: give it in seconds")
        system = (self.a, self.b[:, None], self.c[None, :], np.array([[self.d]]))
        a, b, c, d, _ = cont2discrete(system, period, method)
        return DiscreteSystem(a, b[:, 0], c[0], float(d[0, 0]), period)


@dataclass(frozen=True)
class DiscreteSystem:
    """A system ``x' = a x + b u``, ``y = c x + d u`` at a fixed period.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b, c : ndarray, shape (n,)
    d : float
    period : float
        [s].
    """

    a: Array
    b: Array
    c: Array
    d: float
    period: float

    def initial_state(self, rows: int | Sequence[int] = ()) -> Array:
        """Return zeros of shape (*rows, n)."""
        shape = (rows,) if isinstance(rows, int) else tuple(rows)
        return np.zeros((*shape, len(self.b)))

    def rest_state(self, u: ArrayLike) -> Array:
        """Return the state, shape (..., n), in which a constant input changes nothing."""
        gain = np.linalg.solve(np.eye(len(self.b)) - self.a, self.b)
        return np.asarray(np.multiply.outer(np.asarray(u, float), gain))

    def step(self, u: ArrayLike, state: Array) -> tuple[Array, Array]:
        """Return the output, shape (...), and the next state, (..., n), for an input (...)."""
        return self.output(u, state), self.advance(u, state)

    def output(self, u: ArrayLike, state: Array) -> Array:
        """Return the output, shape (...), without moving on."""
        return np.einsum("...i,i->...", state, self.c) + self.d * np.asarray(u, float)

    def advance(self, u: ArrayLike, state: Array) -> Array:
        """Return the next state, shape (..., n)."""
        moved = np.einsum("...j,ij->...i", state, self.a)
        return np.asarray(moved + np.multiply.outer(np.asarray(u, float), self.b))

    def response(self, frequency: ArrayLike) -> Complex:
        """Return the response of the sampled system at angular frequencies [rad/s]."""
        z = np.exp(1j * np.asarray(frequency, float) * self.period)
        matrices = z[..., None, None] * np.eye(len(self.b)) - self.a
        states = np.linalg.solve(
            matrices, np.broadcast_to(self.b, z.shape + self.b.shape)[..., None]
        )
        return np.asarray(states[..., 0] @ self.c + self.d)


def _time_scale(denominator: Array) -> float:
    """Return the geometric mean of the poles that are not at 0 [rad/s], or 1."""
    poles = np.abs(np.roots(denominator))
    poles = poles[poles > 1e-12 * max(1.0, float(np.max(poles, initial=0.0)))]
    return float(np.exp(np.mean(np.log(poles)))) if poles.size else 1.0
