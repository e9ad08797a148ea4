"""Yielding element: friction that grows smoothly with the distance since a reversal.

The model of Bouc and Wen (wen1976) with exponent 1, for a share ``z`` of the largest friction and
a driving quantity ``s`` that moves in one direction:

    b dz/ds = 1 - |z| (r1 sign(ds) sign(z) + r2),    r1 + r2 = 1,    ratio = r1 - r2

The term of ``r1`` relaxes the friction towards zero, that of ``r2`` lowers the stiffness, in both
directions. With ``y = z sign(ds)``, the share along the motion, and the distance ``u = |ds| / b``,

    dy/du = 1 - y          where y >= 0, along the friction
    dy/du = 1 - ratio y    where y <  0, back from it

so that ``z`` stays within -1 and 1. ``ratio = 1`` is the friction of Dahl (dahl1976); with
``ratio = 0`` the way back is that of a spring. The energy ``b z^2 / 2`` is stored, and the rest of
the work, ``y^2`` or ``ratio y^2`` over the distance, is lost: with ``ratio >= 0`` nothing is
created on any path (erlicher2004). Unlike those of play operators, minor loops are not closed.

A ``tail`` from -1 to 1 sets how the friction approaches its largest value:

    dy/du = (1 - y) (1 - tail y)                           where y >= 0
    dy/du = (1 - ratio y) (1 - max(0, tail) ratio y)       where y <  0

``tail = 0`` is the above, ``tail = 1`` with ``ratio = 1`` the friction of Dahl with exponent 2,
whose approach is slow, and ``tail = -1`` on the way there that of Bouc and Wen with exponent 2,
which is abrupt. The lost work is ``y^2 (1 + tail (1 - y))`` over the distance, and back at least
``ratio y^2``: again, nothing is created.
"""

from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import kernel

SHORTEST = 1e-12
"""Least break of an element whose limit has fallen to zero."""


@kernel
def log_over(x: float) -> float:
    """Return ``log(1 + x) / x`` for ``x`` from 0 to 1, to 1e-15; 1 at 0."""
    q = 1.0 / (2.0 + x)
    y = x * q
    y = y * y
    t = y * (1.0 / 29.0) + 1.0 / 27.0
    t = t * y + 1.0 / 25.0
    t = t * y + 1.0 / 23.0
    t = t * y + 1.0 / 21.0
    t = t * y + 1.0 / 19.0
    t = t * y + 1.0 / 17.0
    t = t * y + 1.0 / 15.0
    t = t * y + 1.0 / 13.0
    t = t * y + 1.0 / 11.0
    t = t * y + 1.0 / 9.0
    t = t * y + 1.0 / 7.0
    t = t * y + 1.0 / 5.0
    t = t * y + 1.0 / 3.0
    t = t * y + 1.0
    return 2.0 * q * t


@kernel
def decayed_over(x: float) -> float:
    """Return ``(1 - exp(-x)) / x`` for ``x`` from 0 to 1, to 1e-15; 1 at 0."""
    y = -x
    t = y * (1.0 / 355687428096000.0) + 1.0 / 20922789888000.0
    t = t * y + 1.0 / 1307674368000.0
    t = t * y + 1.0 / 87178291200.0
    t = t * y + 1.0 / 6227020800.0
    t = t * y + 1.0 / 479001600.0
    t = t * y + 1.0 / 39916800.0
    t = t * y + 1.0 / 3628800.0
    t = t * y + 1.0 / 362880.0
    t = t * y + 1.0 / 40320.0
    t = t * y + 1.0 / 5040.0
    t = t * y + 1.0 / 720.0
    t = t * y + 1.0 / 120.0
    t = t * y + 1.0 / 24.0
    t = t * y + 1.0 / 6.0
    t = t * y + 0.5
    return t * y + 1.0


@kernel
def yielded(z: float, moved: float, ratio: float) -> tuple[float, float]:
    """Return the share of the largest friction after a monotonic motion, and its slope.

    Parameters
    ----------
    z : float
        Share before, from -1 to 1.
    moved : float
        Motion over the break ``b``.
    ratio : float
        Ratio of the module, from 0 to 1.
    """
    sign, left = (1.0, moved) if moved >= 0.0 else (-1.0, -moved)
    y = z * sign
    back = max(0.0, -y)
    first = min(left, back * log_over(ratio * back))  # to the change of sign, or to the end
    y = y + (1.0 + ratio * back) * first * decayed_over(ratio * first)
    left = left - first
    if left > 0.0:
        y = 1.0 - (1.0 - max(0.0, y)) * decay(left)
    return sign * y, 1.0 - (y if y >= 0.0 else ratio * y)


@kernel
def yielded_with_tail(z: float, moved: float, ratio: float, tail: float) -> tuple[float, float]:
    """Return the share after a monotonic motion, and its slope, of a friction with a tail.

    Parameters are those of :func:`yielded`, and the tail of the module. Both equations are solved
    exactly: ``y / (1 - tail ratio y)`` and ``1 / (1 - y)`` obey linear ones.
    """
    sign, left = (1.0, moved) if moved >= 0.0 else (-1.0, -moved)
    y = z * sign
    slow = max(0.0, tail) * ratio
    fade = ratio - slow
    back = max(0.0, -y)
    far = back / (1.0 + slow * back)
    first = min(left, far * log_over(fade * far))  # to the change of sign, or to the end
    near = max(0.0, far - (1.0 + fade * far) * first * decayed_over(fade * first))
    y = max(0.0, y) - near / (1.0 - slow * near)
    left = left - first
    if left > 0.0:
        rest, rate = 1.0 - max(0.0, y), 1.0 - tail
        x = rate * left
        gone = decay(x)
        over = left * decayed_over(x) if x < 1.0 else (1.0 - gone) / rate
        y = 1.0 - rest * gone / (1.0 + tail * rest * over)
    slope = (1.0 - y) * (1.0 - tail * y) if y >= 0.0 else (1.0 - ratio * y) * (1.0 - slow * y)
    return sign * y, slope


@kernel
def deflected_with_tail(
    deflection: float, moved: float, limit: float, ratio: float, tail: float
) -> tuple[float, float]:
    """Return the same as :func:`deflected` for a friction with a tail."""
    reach = max(SHORTEST, limit)
    z, slope = yielded_with_tail(
        max(-1.0, min(1.0, deflection / reach)), moved / reach, ratio, tail
    )
    return reach * z, slope


@kernel
def deflected(deflection: float, moved: float, limit: float, ratio: float) -> tuple[float, float]:
    """Return the deflection of a yielding spring after a motion, and its slope.

    ``limit`` is its largest deflection, in the unit of the motion. Where the limit has fallen below
    the deflection, this falls with it, and energy is lost.
    """
    reach = max(SHORTEST, limit)
    z, slope = yielded(max(-1.0, min(1.0, deflection / reach)), moved / reach, ratio)
    return reach * z, slope
