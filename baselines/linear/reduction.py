"""Reduction of a linear system to fewer states by balanced residualisation.

The states are balanced (each as easily reached as seen), and those that matter least are taken as
settled instead of cut off, so that the gain at rest stays exact: the error is at most twice the sum
of the Hankel singular values left out. (K. Fernando, H. Nicholson, "Singular perturbational model
reduction of balanced systems", IEEE Trans. Automatic Control 27 (1982).) An integrator, or what
stands in for one, is set aside first and put back exactly.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag, schur, solve_continuous_lyapunov, solve_sylvester

from baselines.core.controller import Array
from baselines.linear.systems import LinearSystem


def residualised(system: LinearSystem, order: int) -> tuple[LinearSystem, Array]:
    """Return a stable system with fewer states, and all Hankel singular values.

    Raises
    ------
    ValueError
        If the system is not stable, or has not that many states.
    """
    if not 0 < order <= system.order or np.max(system.poles.real) >= 0.0:
        raise ValueError(
            f"order is {order} of {system.order}, and the slowest pole {system.poles[0]:.3g}; give"
            " a stable system and from 1 to all of its states: set an integrator aside first"
        )
    balanced, sizes = _balanced(system)
    k, n = order, system.order
    if k == n:
        return balanced, sizes
    a, b, c = balanced.a, balanced.b, balanced.c
    settled = np.linalg.solve(a[k:, k:], np.column_stack([a[k:, :k], b[k:]]))
    reduced = LinearSystem(
        a[:k, :k] - a[:k, k:] @ settled[:, :k],
        b[:k] - a[:k, k:] @ settled[:, k],
        c[:k] - c[k:] @ settled[:, :k],
        system.d - float(c[k:] @ settled[:, k]),
    )
    return reduced, sizes


def _balanced(system: LinearSystem) -> tuple[LinearSystem, Array]:
    reach = _root(solve_continuous_lyapunov(system.a, -np.outer(system.b, system.b)))
    seen = _root(solve_continuous_lyapunov(system.a.T, -np.outer(system.c, system.c)))
    left, sizes, right = np.linalg.svd(seen.T @ reach)
    scale = 1.0 / np.sqrt(sizes)
    back, there = reach @ right.T * scale, (seen @ left * scale).T
    return LinearSystem(there @ system.a @ back, there @ system.b, system.c @ back, system.d), sizes


def _root(gramian: Array) -> Array:
    """Return ``R`` with ``R R' = gramian``."""
    values, vectors = np.linalg.eigh(0.5 * (gramian + gramian.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 1e-16 * values[-1])))


def split(system: LinearSystem, frequency: float) -> tuple[LinearSystem, LinearSystem]:
    """Return the parts with poles within and beyond a frequency [rad/s], whose sum is the system.

    The feed-through goes to the second. (Schur form in order, and a Sylvester equation.)

    Raises
    ------
    ValueError
        If all poles are on one side.
    """
    form, basis, k = schur(system.a, sort=lambda re, im: np.hypot(re, im) <= frequency)
    if not 0 < k < system.order:
        raise ValueError(
            f"{k} of {system.order} poles are within {frequency:g} rad/s; choose a frequency that"
            " parts them"
        )
    couple = solve_sylvester(form[:k, :k], -form[k:, k:], -form[:k, k:])
    b, c = basis.T @ system.b, system.c @ basis
    within = LinearSystem(form[:k, :k], b[:k] - couple @ b[k:], c[:k])
    beyond = LinearSystem(form[k:, k:], b[k:], c[k:] + c[:k] @ couple, system.d)
    return within, beyond


def without_fast(system: LinearSystem, frequency: float) -> LinearSystem:
    """Return the system with its poles beyond a frequency [rad/s] taken as settled."""
    if np.max(np.abs(system.poles)) <= frequency:
        return system
    within, beyond = split(system, frequency)
    return LinearSystem(within.a, within.b, within.c, beyond.static_gain)


def with_integrator(residue: float, rest: LinearSystem) -> LinearSystem:
    """Return ``residue / s + rest``."""
    return LinearSystem(
        block_diag(np.zeros((1, 1)), rest.a),
        np.concatenate([[1.0], rest.b]),
        np.concatenate([[residue], rest.c]),
        rest.d,
    )
