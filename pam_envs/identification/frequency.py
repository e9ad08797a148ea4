"""Rational transfer function of a measured frequency response, by vector fitting.

Each round solves a weighted linear least-squares problem for the residues of the response and of a
scaling function with the same poles, and takes the zeros of the latter as the new poles. Unstable
poles are mirrored, so that the fit is always stable. Partial fractions keep the problem
well-conditioned where powers of ``s`` do not.

References
----------
B. Gustavsen, A. Semlyen, "Rational approximation of frequency domain responses by vector fitting",
IEEE Trans. Power Delivery 14 (1999); B. Gustavsen, "Improving the pole relocating properties of
vector fitting", IEEE Trans. Power Delivery 21 (2006).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import null_space

from pam_envs.arrays import Array

Complex = NDArray[np.complex128]

ROUNDS = 60


@dataclass(frozen=True)
class RationalFit:
    """A strictly proper, stable transfer function, and how well it fits."""

    poles: Complex  # (n,) [rad/s], complex ones in neighbouring conjugate pairs
    residues: Complex  # (n,) [output per input, times rad/s]
    relative_error: float  # RMS of abs(fit - measured) / abs(measured)

    @property
    def static_gain(self) -> float:
        """Gain at rest."""
        return float(np.sum(-self.residues / self.poles).real)

    def response(self, frequency: ArrayLike) -> Complex:
        """Return the response at angular frequencies [rad/s], of their shape."""
        s = 1j * np.asarray(frequency, float)
        return np.asarray((self.residues / (s[..., None] - self.poles)).sum(axis=-1))

    def state_space(self) -> tuple[Array, Array, Array]:
        """Return ``(a, b, c)`` in real modal form, shapes (n, n), (n,), (n,)."""
        return _modal(self.poles, self.residues)

    def polynomials(self) -> tuple[Array, Array]:
        """Return numerator and denominator, highest power of ``s`` first."""
        top = np.zeros(len(self.poles), complex)
        for k, residue in enumerate(self.residues):
            top = top + residue * np.poly(np.delete(self.poles, k))
        return np.asarray(top.real), np.asarray(np.poly(self.poles).real, float)


def fit_rational(
    frequency: ArrayLike,
    response: ArrayLike,
    order: int,
    relative_degree: int = 1,
    weight: ArrayLike | None = None,
) -> RationalFit:
    """Return the stable transfer function of some order that is nearest to a response.

    ``frequency`` (m,) [rad/s] is above 0, ``response`` (m,) complex, output per input; ``weight``
    (m,) is ``1 / abs(response)`` by default, for errors relative to the response.
    ``relative_degree``, poles less zeros, is from 1 to ``order``: without it a fit may put needless
    zeros beyond the measured range, in the right half-plane too, where no controller can be
    recovered. A ValueError says that the shapes do not agree, or that there are too few frequencies
    for the order.
    """
    w, values = np.asarray(frequency, float), np.asarray(response, complex)
    _check(w, values, order, relative_degree)
    scale = float(np.exp(np.mean(np.log(w))))
    s = 1j * w / scale
    weights = 1.0 / np.abs(values) if weight is None else np.asarray(weight, float)
    poles = _start(w / scale, order)
    for _ in range(ROUNDS):
        poles = _relocated(s, values, weights, poles, relative_degree)
    residues = _residues(s, values, weights, poles, relative_degree)
    fitted = (residues / (s[:, None] - poles)).sum(axis=1)
    error = float(np.sqrt(np.mean(np.abs(fitted / values - 1.0) ** 2)))
    return RationalFit(poles * scale, residues * scale, error)


def _check(w: Array, values: Complex, order: int, relative_degree: int) -> None:
    if w.ndim != 1 or w.shape != values.shape:
        raise ValueError(
            f"frequency has shape {w.shape} and response {values.shape}; give two series of one"
            " length"
        )
    if not np.all(w > 0.0) or not np.all(np.isfinite(values)) or np.any(values == 0.0):
        raise ValueError("a frequency is not above 0, or a response 0 or not finite: leave it out")
    if order < 1 or len(w) < order:
        raise ValueError(
            f"order is {order} with {len(w)} frequencies; it must be from 1 to their number:"
            " measure more frequencies or choose fewer poles"
        )
    if not 1 <= relative_degree <= order:
        raise ValueError(
            f"relative_degree is {relative_degree}; it must be from 1 to the order, {order}:"
            " 2 or 3 suits most plants"
        )


def _start(w: Array, order: int) -> Complex:
    """Return lightly damped pairs spread over the measured range, and a real pole if odd."""
    places = np.geomspace(w.min(), w.max(), order // 2) if order > 1 else np.array([])
    pairs = [p for b in places for p in (-0.1 * b + 1j * b, -0.1 * b - 1j * b)]
    real = [-float(np.sqrt(w.min() * w.max()))] if order % 2 else []
    return np.array([*real, *pairs], complex)


def _pairs(poles: Complex) -> NDArray[np.int64]:
    """Return the index of the first pole of each conjugate pair; the second follows it."""
    return np.flatnonzero(poles.imag > 0.0)


def _basis(s: Complex, poles: Complex) -> Complex:
    """Return partial fractions with real coefficients, shape (m, n)."""
    columns, k = 1.0 / (s[:, None] - poles), _pairs(poles)
    one, other = columns[:, k], columns[:, k + 1]
    columns[:, k], columns[:, k + 1] = one + other, 1j * (one - other)
    return np.asarray(columns)


def _modal(poles: Complex, residues: Complex) -> tuple[Array, Array, Array]:
    a, c, k = np.diag(poles.real), residues.real.copy(), _pairs(poles)
    a[k, k + 1], a[k + 1, k] = poles[k].imag, -poles[k].imag
    c[k + 1] = residues[k].imag
    return a, 1.0 + np.sign(poles.imag), c


def _solve(columns: Complex, target: Complex, weights: Array) -> Array:
    """Return real least-squares weights of complex columns."""
    rows = np.concatenate([(columns * weights[:, None]).real, (columns * weights[:, None]).imag])
    right = np.concatenate([(target * weights).real, (target * weights).imag])
    size = np.linalg.norm(rows, axis=0)
    return np.asarray(np.linalg.lstsq(rows / size, right, rcond=None)[0] / size)


def _numerators(poles: Complex, relative_degree: int) -> Array:
    """Return the residues, as columns of real coefficients, whose response falls steeply enough.

    With the modal ``(a, b)`` they are the ``c`` with ``c b = c a b = ... = 0``.
    """
    a, b, _ = _modal(poles, np.zeros(len(poles), complex))
    rows = [b / np.linalg.norm(b)]
    for _ in range(relative_degree - 2):
        rows.append(a @ rows[-1])
        rows[-1] = rows[-1] / np.linalg.norm(rows[-1])
    return null_space(np.array(rows)) if relative_degree > 1 else np.eye(len(poles))


def _relocated(
    s: Complex, values: Complex, weights: Array, poles: Complex, relative_degree: int
) -> Complex:
    """Return the zeros of the scaling function, mirrored into the left half-plane, in pairs."""
    n, basis = len(poles), _basis(s, poles)
    free = basis @ _numerators(poles, relative_degree)
    columns = np.hstack([free, -basis * values[:, None]])
    found = _solve(columns, values, weights)[-n:]
    a, b, _ = _modal(poles, np.zeros(n, complex))
    zeros = np.linalg.eigvals(a - np.outer(b, found))
    zeros = np.where(zeros.real > 0.0, -zeros.conjugate(), zeros)
    return _paired(zeros)


def _paired(values: NDArray) -> Complex:
    z = np.asarray(values, complex)
    real = z[np.abs(z.imag) <= 1e-12 * np.abs(z)].real + 0j
    upper = z[z.imag > 1e-12 * np.abs(z)]
    return np.array([*real, *[p for u in upper for p in (u, u.conjugate())]], complex)


def _residues(
    s: Complex, values: Complex, weights: Array, poles: Complex, relative_degree: int
) -> Complex:
    numerators = _numerators(poles, relative_degree)
    found = numerators @ _solve(_basis(s, poles) @ numerators, values, weights)
    residues, k = np.asarray(found, complex), _pairs(poles)
    residues[k] = found[k] + 1j * found[k + 1]
    residues[k + 1] = residues[k].conjugate()
    return residues
