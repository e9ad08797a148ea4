"""Joint angles for the poses of a redundant chain: the smallest ones, away from their limits.

    minimise f(q)  with  g(q) = x,      f = sum_i 4 q_i^2 - ln(1 - (q_i / q_max)^2)         (2.1)

fluidic_muscles, section 2. The weight grows without bound towards the limits, so that a nearby
optimum within them is always found; the unweighted variant minimises ``q'q`` and has no limits.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pam_envs.arrays import Array
from pam_envs.kernels.build import COMPILED, address_book, array_at, interpreted, kernel
from pam_envs.kernels.machine_code import AddressKernel, MachineCode
from pam_envs.mechanics.redundancy.newton import TASK, resolve_path
from pam_envs.mechanics.serial_chain.chain import SerialChain
from pam_envs.mechanics.serial_chain.kernels import work_rows

LIMIT = float(np.deg2rad(30.0))
"""Largest angle of a joint [rad] (fluidic_muscles, section 2)."""
UNIT_TOLERANCE = 1e-6
REACHED = 1e-5
"""Distance [m] and turn [rad] below which the nearest pose counts as reached."""


class UnreachablePose(ValueError):
    """Pose for which no joint angles within the limits were found.

    Attributes
    ----------
    index : int
        Number of the pose in the path.
    pose : ndarray, shape (6,)
        Position [m] and direction.
    distance, turn : float
        Distance [m] and angle [rad] to the nearest pose found.
    """

    def __init__(
        self, index: int, pose: Array, distance: float, turn: float, limit: float, hint: str = ""
    ) -> None:
        self.index, self.pose, self.distance, self.turn = index, pose, distance, turn
        where = ", ".join(f"{v:.4g}" for v in pose[:3])
        along = ", ".join(f"{v:.4g}" for v in pose[3:])
        joints = f"joints of +-{np.rad2deg(limit):.4g} degrees"
        if distance < REACHED and turn < REACHED:
            answer = f"was not found with {joints}, though within reach; give start angles near it"
        else:
            answer = (
                f"is out of reach with {joints}: the nearest pose found is {1e3 * distance:.4g} mm "
                f"and {np.rad2deg(turn):.2f} degrees away; bring the path nearer to the middle of "
                "the workspace, or turn its direction along the bent arm"
            )
        super().__init__(f"pose {index} at ({where}) m, pointing along ({along}), {answer}{hint}")


@dataclass(frozen=True)
class Resolution:
    """Joint angles for the poses of a path.

    Attributes
    ----------
    angles : ndarray, shape (m, n)
        [rad].
    multipliers : ndarray, shape (m, 5)
        Lagrange multipliers [cost per unit of the constraint] of (2.2), from which a later path may
        continue.
    iterations : ndarray of int, shape (m,)
        Newton iterations that each pose took.
    limit : float
        Largest angle of a joint [rad].
    """

    angles: Array
    multipliers: Array
    iterations: NDArray[np.int64]
    limit: float

    @property
    def peak(self) -> float:
        """Largest angle of a joint in the path [rad]."""
        return float(np.max(np.abs(self.angles)))

    @property
    def within_limits(self) -> bool:
        """Whether no joint exceeds its limit."""
        return self.peak < self.limit

    @property
    def longest_step(self) -> float:
        """Largest change of a joint from pose to pose [rad]: large where it jumps."""
        return float(np.max(np.abs(np.diff(self.angles, axis=0)), initial=0.0))


def resolve(
    chain: SerialChain,
    poses: ArrayLike,
    limit: float = LIMIT,
    weighted: bool = True,
    start: ArrayLike | None = None,
    multipliers: ArrayLike | None = None,
) -> Resolution:
    """Return joint angles for the poses of a path, each found from those of the pose before.

    Parameters
    ----------
    chain : SerialChain
        At least as many joints as a pose has degrees of freedom.
    poses : array_like, shape (m, 6)
        Position of the tip [m] and direction of the last link (its length does not count).
    limit : float
        Largest angle of a joint [rad].
    weighted : bool
        Whether the weight (2.1) is minimised, or ``q'q``, which lets joints exceed the limit.
    start : array_like, shape (n,), optional
        Angles near the first pose [rad]. Without them, or where they are straight, the best of
        several bent poses is taken.
    multipliers : array_like, shape (5,), optional
        Of the solution in ``start``.

    Raises
    ------
    UnreachablePose
        Naming the first pose without a solution, and the distance of the nearest pose.
    ValueError
        If shapes or values do not make sense.
    """
    given = _checked_poses(chain, poses, limit)
    n, m = chain.stages, len(given)
    q, known = np.zeros((n, 1)), start is not None
    if start is not None:
        q[:, 0] = _checked_start(start, n, limit, weighted)
    forces = np.zeros(TASK) if multipliers is None else np.array(multipliers, float)
    angles, found, iterations = np.zeros((m, n)), np.zeros((m, TASK)), np.zeros(m, np.int64)
    sizes = ((work_rows(n), 1), (n + TASK, n + TASK + 1), (n, n), (n + TASK,))
    arrays = [given, q, forces, chain.rows()[:, None].copy(), *map(np.zeros, sizes)]
    done = _resolve(n, arrays, limit, weighted, known, [angles, found, iterations])
    if done < m:
        raise UnreachablePose(done, given[done], *nearest(chain, given[done], limit), limit)
    return Resolution(angles, found, iterations, limit)


def nearest(chain: SerialChain, pose: ArrayLike, limit: float = LIMIT) -> tuple[float, float]:
    """Return the distance [m] and turn [rad] from a pose to the nearest one within the limits."""
    from scipy.optimize import least_squares

    goal, best, least = np.asarray(pose, float), (np.inf, np.inf), np.inf
    bound = np.full(chain.stages, limit)

    def off(angles: Array) -> Array:
        return chain.pose(angles) - goal

    for amplitude in (0.5, -0.5):
        for period in (1, 2):  # bent, then in an S
            signs = np.where(np.arange(chain.stages) * period // chain.stages % 2, -1.0, 1.0)
            start = amplitude * limit * signs
            found = least_squares(off, start, chain.jacobian, bounds=(-bound, bound))
            if found.cost < least:
                left, least = chain.pose(found.x), found.cost
                cosine = float(np.clip(left[3:] @ goal[3:], -1.0, 1.0))
                best = (float(np.linalg.norm(left[:3] - goal[:3])), float(np.arccos(cosine)))
    return best


WEIGHTED, KNOWN = 1, 2
"""Flags of the mode of :func:`resolve_by_address`."""
N_ARRAYS = 13


@kernel
def resolve_by_address(book: Any, mode: int) -> None:
    """Resolve a path, given the address book of its arrays, the limit [rad] and the result."""
    limit, done = array_at(book, 11, 1, 0), array_at(book, 12, 1, 1)
    done[0] = resolve_path(
        array_at(book, 0, 2, 0),
        array_at(book, 1, 2, 0),
        array_at(book, 2, 1, 0),
        array_at(book, 3, 2, 0),
        array_at(book, 4, 2, 0),
        array_at(book, 5, 2, 0),
        array_at(book, 6, 2, 0),
        array_at(book, 7, 1, 0),
        limit[0],
        (mode & WEIGHTED) > 0,
        (mode & KNOWN) > 0,
        array_at(book, 8, 2, 0),
        array_at(book, 9, 2, 0),
        array_at(book, 10, 1, 1),
    )


@dataclass(frozen=True)
class PathKernel:
    """Kernel that resolves the paths of chains with a number of joints."""

    stages: int

    @property
    def names(self) -> dict[str, Any]:
        """Values of global names in its call graph."""
        return {"N_STAGES": self.stages, "LANES": 1}

    @property
    def by_address(self) -> AddressKernel:
        """The kernel."""
        name = f"resolve_path_{self.stages}"
        return AddressKernel(name, resolve_by_address, self.names, 4 * N_ARRAYS)


@lru_cache(maxsize=16)
def code_of(stages: int) -> MachineCode:
    """Return the machine code for a number of joints."""
    return MachineCode(PathKernel(stages))


def _resolve(
    stages: int, arrays: list[Any], limit: float, weighted: bool, known: bool, outputs: list[Any]
) -> int:
    """Call the kernel, which fills ``outputs``; with lists where it is not compiled."""
    if COMPILED:
        done, mode = np.zeros(1, np.int64), WEIGHTED * weighted + KNOWN * known
        held = [*arrays, *outputs, np.array([limit]), done]
        book = address_book(held)
        code_of(stages).wait()(book.ctypes.data, mode)
        return int(done[0])
    lists = [array.tolist() for array in outputs]
    function = interpreted(resolve_path, PathKernel(stages).names)
    filled = int(function(*(a.tolist() for a in arrays), limit, weighted, known, *lists))
    for array, values in zip(outputs, lists, strict=True):
        array[...] = values
    return filled


def _checked_poses(chain: SerialChain, poses: ArrayLike, limit: float) -> Array:
    given = np.array(poses, float)
    if chain.stages < TASK:
        raise ValueError(
            f"a chain of {chain.stages} joints has no joint to spare for {TASK} degrees of "
            f"freedom; give it {TASK} or more"
        )
    if given.ndim != 2 or given.shape[1] != TASK + 1 or not np.all(np.isfinite(given)):
        raise ValueError(
            f"poses of shape {given.shape} must be finite, of shape (m, 6): position [m], direction"
        )
    if not 0.0 < limit <= np.pi:
        raise ValueError(f"limit = {limit!r} rad is outside (0, pi]; give an angle in radians")
    size = np.linalg.norm(given[:, 3:], axis=1)
    if np.any(size < UNIT_TOLERANCE):
        k = int(np.argmin(size))
        raise ValueError(f"pose {k} has the direction 0; give a vector along the last link")
    given[:, 3:] /= size[:, None]
    return given


def _checked_start(start: ArrayLike, n: int, limit: float, weighted: bool) -> Array:
    given = np.asarray(start, float)
    if given.shape != (n,) or not np.all(np.isfinite(given)):
        raise ValueError(f"start of shape {given.shape} must be {n} finite joint angles [rad]")
    if weighted and np.any(np.abs(given) >= limit):
        raise ValueError(
            f"start = {given!r} rad has an angle beyond +-{limit:.4g} rad; begin between the limits"
        )
    return given
