"""A linear system for every joint, worked together: arrays with the joint as their first axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from baselines.core.controller import Array
from baselines.linear.systems import DiscreteSystem


@dataclass(frozen=True)
class Bank:
    """Systems ``x' = a x + b u``, ``y = c x + d u`` of one order, one for each joint.

    Attributes
    ----------
    a : ndarray, shape (n_joints, k, k)
    b, c : ndarray, shape (n_joints, k)
    d : ndarray, shape (n_joints,)
    """

    a: Array
    b: Array
    c: Array
    d: Array

    @classmethod
    def of(cls, systems: Sequence[DiscreteSystem]) -> Bank:
        """Return the bank of systems of one order."""
        a, b, c = (np.array([getattr(s, name) for s in systems]) for name in "abc")
        return cls(a, b, c, np.array([s.d for s in systems]))

    def rest(self, u: Array) -> Array:
        """Return the states, (n_env, n_joints, k), in which constant inputs change nothing."""
        gain = np.linalg.solve(np.eye(self.a.shape[1]) - self.a, self.b[..., None])[..., 0]
        return np.asarray(u[..., None] * gain)

    def holding(self, y: Array) -> Array:
        """Return the states, (n_env, n_joints, k), of integrators that hold outputs without input.

        Of each system, the mode that does not decay carries the whole output.
        """
        modes = np.linalg.svd(self.a - np.eye(self.a.shape[1]))[2][:, -1]
        return np.asarray(y[..., None] * (modes / np.sum(modes * self.c, axis=1)[:, None]))

    def output(self, u: Array, state: Array) -> Array:
        """Return the outputs, shape (n_env, n_joints), for inputs of that shape."""
        return np.asarray(np.add.reduce(state * self.c, axis=-1) + self.d * u)

    def advance(self, u: Array, state: Array) -> Array:
        """Return the next states, shape (n_env, n_joints, k)."""
        moved = np.add.reduce(self.a * state[..., None, :], axis=-1)
        return np.asarray(moved + self.b * u[..., None])
