"""Serial chain of joints and links in numpy: pose, its derivatives, and the equations of motion.

    x = g(q),   M(q) qdd + bias(q, qd) = joint torques

fluidic_muscles, sections 1.2 and 2: six stages, each a joint of +-30 degrees. The base's frame has
its origin in the first joint and its z along the straight arm. A *pose* is the tip's position and
the direction in which the last link points (a unit vector): six numbers, five degrees of freedom.
These are textbook formulas, by Jacobians; the kernels of ``kinematics`` and ``dynamics`` compute
the same numbers recursively, for lanes side by side.
"""

import dataclasses
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.mechanics.serial_chain.kernels import BLOCK_ROWS, gravity_rows
from pam_envs.parameters import assumed

MOST_JOINTS = 12
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
BOUNDS = {
    "lengths": ("m", 1e-3, 5.0),
    "masses": ("kg", 1e-3, 100.0),
    "centres": ("m", 0.0, 5.0),
    "across": ("kg m2", 0.0, 100.0),
    "along": ("kg m2", 1e-9, 100.0),
}
"""Unit and bounds of the properties of a link."""
HEAVY = ("masses", "across", "along")
"""Properties that are proportional to the mass of the links."""


@dataclass(frozen=True)
class LinkForm:
    """Link of the arm of fluidic_muscles, a solid cylinder."""

    length: float = assumed(0.25, "m", 1e-3, 5.0, "fluidic_muscles, as its figures suggest")
    mass: float = assumed(
        0.1, "kg", 1e-3, 100.0, "not published; near the most that two DMSP-10 a joint can carry"
    )
    centre: float = assumed(0.5, "1", 0.0, 1.0, "place of the mass, as a share of the length")
    radius: float = assumed(0.05, "m", 1e-4, 1.0, "of the cylinder")


FORM = LinkForm()


@dataclass(frozen=True)
class SerialChain:
    """Joints and links, from the base to the tip; one entry a joint.

    Attributes
    ----------
    axes : tuple of str
        Axis of each joint in the frame before it: ``"x"``, ``"y"`` or ``"z"``.
    lengths : tuple of float
        From a joint to the next one, or to the tip [m].
    masses : tuple of float
        [kg].
    centres : tuple of float
        Centre of mass, from the joint along the link [m].
    across, along : tuple of float
        Moments of inertia about the centre of mass, across and along the link [kg m2].
    gravity : tuple of float
        In the base's frame [m/s2]. By default the arm hangs.
    """

    axes: tuple[str, ...]
    lengths: tuple[float, ...]
    masses: tuple[float, ...]
    centres: tuple[float, ...]
    across: tuple[float, ...]
    along: tuple[float, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, GRAVITY)

    def __post_init__(self) -> None:
        """Check names, numbers of entries and bounds."""
        if not 1 <= len(self.axes) <= MOST_JOINTS or set(self.axes) - set(AXES):
            raise ValueError(
                f"axes = {self.axes!r}; give 1 to {MOST_JOINTS} of the letters x, y, z, one a joint"
            )
        for name, (unit, low, high) in BOUNDS.items():
            values = getattr(self, name)
            if len(values) != len(self.axes):
                raise ValueError(
                    f"{name} has {len(values)} entries for {len(self.axes)} joints; give each one"
                )
            _check(name, values, unit, low, high)
        if len(self.gravity) != 3:
            raise ValueError(f"gravity = {self.gravity!r}; give three numbers [m/s2]")
        _check("gravity", self.gravity, "m/s2", -30.0, 30.0)

    @classmethod
    def uniform(
        cls,
        axes: str | tuple[str, ...] = "xyxyxy",
        length: float = FORM.length,
        mass: float = FORM.mass,
        centre: float = FORM.centre,
        radius: float = FORM.radius,
        gravity: tuple[float, float, float] = (0.0, 0.0, GRAVITY),
    ) -> Self:
        """Return a chain of equal links, each with the inertia of a solid cylinder.

        One letter of ``axes`` a joint; length [m], mass [kg], radius [m] and centre of mass (as a
        share of the length) of one link, by default those of :class:`LinkForm`; ``gravity`` [m/s2]
        in the base's frame.
        """
        n, square = len(axes), radius * radius
        return cls(
            tuple(axes),
            (length,) * n,
            (mass,) * n,
            (centre * length,) * n,
            (mass * (3.0 * square + length * length) / 12.0,) * n,
            (0.5 * mass * square,) * n,
            gravity,
        )

    @property
    def stages(self) -> int:
        """Number of joints."""
        return len(self.axes)

    @cached_property
    def reach(self) -> float:
        """Length of the straight arm [m]."""
        return float(sum(self.lengths))

    def heavier(self, factor: float) -> Self:
        """Return the chain with masses and moments of inertia times a factor."""
        scaled = {name: tuple(factor * v for v in getattr(self, name)) for name in HEAVY}
        return dataclasses.replace(self, **scaled)

    def rows(self) -> Array:
        """Return gravity and links as the kernels read them, shape (3 + 8 n,)."""
        turns = np.array([AXES[name] for name in self.axes])
        links = np.column_stack([turns, *(getattr(self, name) for name in BOUNDS)])
        return np.concatenate([self.gravity, links.ravel()])

    # --- kinematics -----------------------------------------------------------------------------

    def frames(self, angles: ArrayLike) -> tuple[Array, Array, Array]:
        """Return joint axes, joint positions and link directions in the base's frame.

        For angles [rad] of shape (..., n) the shapes are (..., n, 3), (..., n + 1, 3) and (..., n,
        3); the last point is the tip [m].
        """
        given = self._angles(angles)
        turn = np.broadcast_to(np.eye(3), (*given.shape[:-1], 3, 3))
        axes, directions = [], []
        points = [np.zeros((*given.shape[:-1], 3))]
        for k in range(self.stages):
            axis = np.array(AXES[self.axes[k]])
            axes.append(turn @ axis)
            turn = turn @ _rotation(axis, given[..., k])
            directions.append(turn[..., :, 2])
            points.append(points[-1] + self.lengths[k] * directions[-1])
        return np.stack(axes, -2), np.stack(points, -2), np.stack(directions, -2)

    def joints(self, angles: ArrayLike) -> Array:
        """Return the positions of all joints and of the tip [m], shape (..., n + 1, 3)."""
        return self.frames(angles)[1]

    def pose(self, angles: ArrayLike) -> Array:
        """Return the poses ``g(q)``, shape (..., 6), of joint angles (..., n) [rad]."""
        _, points, directions = self.frames(angles)
        return np.concatenate([points[..., -1, :], directions[..., -1, :]], -1)

    def jacobian(self, angles: ArrayLike) -> Array:
        """Return the geometric Jacobian of the pose, shape (..., 6, n)."""
        axes, points, directions = self.frames(angles)
        arms = points[..., -1:, :] - points[..., :-1, :]
        linear, angular = np.cross(axes, arms), np.cross(axes, directions[..., -1:, :])
        return np.swapaxes(np.concatenate([linear, angular], -1), -1, -2)

    # --- dynamics -------------------------------------------------------------------------------

    def mass_matrix(self, angles: ArrayLike, payload: float = 0.0) -> Array:
        """Return the mass matrix [kg m2], shape (n, n); ``payload`` [kg] is a point at the tip."""
        total = np.zeros((self.stages, self.stages))
        for mass, linear, inertia, angular, _ in self._bodies(angles, payload):
            total += mass * linear.T @ linear + angular.T @ inertia @ angular
        return total

    def bias(self, angles: ArrayLike, rates: ArrayLike, payload: float = 0.0) -> Array:
        """Return the torques [N m] of gravity, Coriolis and centrifugal forces, shape (n,).

        The joints exert them where nothing accelerates.
        """
        axes, points, directions = self.frames(angles)
        speed = self._angles(rates)
        spins = np.cumsum(axes * speed[:, None], axis=0)
        ends = np.cumsum(np.cross(spins, np.diff(points, axis=0)), axis=0)
        starts = np.vstack([np.zeros(3), ends[:-1]])
        total = self.gravity_torque(angles, payload)
        for mass, linear, inertia, angular, (link, offset) in self._bodies(angles, payload):
            point = points[link] + offset * directions[link]
            moving = starts[link] + np.cross(spins[link], offset * directions[link])
            drift, turn = np.zeros(3), np.zeros(3)  # J' qd, of point and spin
            for k in range(link + 1):
                before = spins[k] - axes[k] * speed[k]
                tilt = np.cross(before, axes[k])
                arm, sway = point - points[k], moving - starts[k]
                drift += speed[k] * (np.cross(tilt, arm) + np.cross(axes[k], sway))
                turn += speed[k] * tilt
            gyro = np.cross(spins[link], inertia @ spins[link])
            total += mass * linear.T @ drift + angular.T @ (inertia @ turn + gyro)
        return total

    def gravity_torque(self, angles: ArrayLike, payload: ArrayLike = 0.0) -> Array:
        """Return the torques [N m] that hold the arm still, shape (..., n).

        ``angles`` [rad] have shape (..., n), ``payload`` [kg] shape (...) or ().
        """
        given, load = self._angles(angles), np.asarray(payload, float)
        shape = np.broadcast_shapes(given.shape[:-1], load.shape)
        held = np.array(np.broadcast_to(given, (*shape, self.stages))).reshape(-1, self.stages)
        masses = np.array(np.broadcast_to(load, shape)).reshape(-1)
        torques, work = np.empty_like(held), np.empty(((self.stages + 1) * BLOCK_ROWS, 1))
        gravity_rows(held, masses, self._column, work, torques)
        return torques.reshape(*shape, self.stages)

    @cached_property
    def _column(self) -> Array:
        return self.rows()[:, None]

    def energy(
        self, angles: ArrayLike, rates: ArrayLike, payload: float = 0.0
    ) -> tuple[float, float]:
        """Return kinetic and potential energy [J]; the latter is 0 with all mass in the origin."""
        speed = self._angles(rates)
        _, points, directions = self.frames(angles)
        kinetic = 0.5 * speed @ self.mass_matrix(angles, payload) @ speed
        height = 0.0
        for mass, _, _, _, (link, offset) in self._bodies(angles, payload):
            height -= mass * np.array(self.gravity) @ (points[link] + offset * directions[link])
        return float(kinetic), float(height)

    def _angles(self, angles: ArrayLike) -> Array:
        given = np.asarray(angles, float)
        if given.ndim == 0 or given.shape[-1] != self.stages:
            raise ValueError(
                f"joint values of shape {given.shape} do not fit a chain of {self.stages} joints; "
                f"give shape (..., {self.stages})"
            )
        return given

    def _bodies(
        self, angles: ArrayLike, payload: float
    ) -> list[tuple[float, Array, Array, Array, tuple[int, float]]]:
        """Return mass, Jacobian, inertia, Jacobian of the spin, and place of each body."""
        axes, points, directions = self.frames(angles)
        places = [(k, self.centres[k], self.masses[k]) for k in range(self.stages)]
        places.append((self.stages - 1, self.lengths[-1], payload))
        bodies = []
        for number, (link, offset, mass) in enumerate(places):
            direction = directions[link]
            arms = points[link] + offset * direction - points[: link + 1]
            linear, angular = np.zeros((3, self.stages)), np.zeros((3, self.stages))
            linear[:, : link + 1] = np.cross(axes[: link + 1], arms).T
            angular[:, : link + 1] = axes[: link + 1].T
            inertia = np.zeros((3, 3))
            if number < self.stages:
                outer = np.outer(direction, direction)
                inertia = self.across[link] * (np.eye(3) - outer) + self.along[link] * outer
            bodies.append((mass, linear, inertia, angular, (link, offset)))
        return bodies


def _rotation(axis: Array, angle: Array) -> Array:
    """Return the rotations about an axis by angles (...), shape (..., 3, 3)."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    return np.asarray(np.eye(3) + sine * skew + (1.0 - cosine) * (skew @ skew))


def _check(name: str, values: tuple[float, ...], unit: str, low: float, high: float) -> None:
    for k, value in enumerate(values):
        if not low <= value <= high:  # also not a number
            raise ValueError(
                f"{name}[{k}] = {value!r} {unit} is outside [{low:g}, {high:g}] {unit}; "
                "all numbers are SI: move it inside the bounds"
            )
