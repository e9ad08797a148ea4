"""Allocation of torque and stiffness of a joint to its two bundles: exact, torque first.

A bundle's force is ``P = X phi(C)`` and its slope over the contraction ``dP/dC = X psi(C)``, with
``phi = (L_n - C)(C_max - C)``, ``psi = 2 C - L_n - C_max`` and the *factor* ``X = k_0 + k_1 p``
linear in the pressure (chakarov2018, Eqs. 4, 5, 7). Over a pulley of radius ``r`` bundle b bends
the joint and bundle a straightens it (Eqs. 16, 22 of chakarov2018), so that torque ``Q`` and
stiffness ``S = -dQ/dq`` are linear in both factors:

    Q / r     = -phi_a X_a + phi_b X_b
    -S / r^2  =  psi_a X_a + psi_b X_b,       determinant -(phi_a psi_b + phi_b psi_a) > 0

for contractions below ``C_max``: the feasible set is a parallelogram. Outside, the torque is
limited to its range, then the stiffness to what the pressures leave at that torque, which is
box-constrained least squares in the limit of a weight on the torque alone. The paper searches for
the same pressures by an optimisation.
"""

from pam_envs.kernels.build import kernel

LEAST_SHAPE = 1e-9
"""Smallest ``phi`` [m^2] that is divided by: bundles contracted to ``C_max`` give no force."""


@kernel
def determinant(phi_a: float, phi_b: float, psi_a: float, psi_b: float) -> float:
    """Return the determinant [m^3] of the linear map from factors to ``(Q / r, -S / r^2)``."""
    return -(phi_a * psi_b + phi_b * psi_a)


@kernel
def torque_of(x_a: float, x_b: float, radius: float, phi_a: float, phi_b: float) -> float:
    """Return the torque [N m] of both factors [N/m^2], bending positive."""
    return radius * (phi_b * x_b - phi_a * x_a)


@kernel
def stiffness_of(x_a: float, x_b: float, radius: float, psi_a: float, psi_b: float) -> float:
    """Return the stiffness ``-dQ/dq`` [N m/rad] of both factors [N/m^2]."""
    return -radius * radius * (psi_a * x_a + psi_b * x_b)


@kernel
def factors_for(
    torque: float,
    stiffness: float,
    radius: float,
    phi_a: float,
    phi_b: float,
    psi_a: float,
    psi_b: float,
) -> tuple[float, float]:
    """Return the factors [N/m^2] that give torque and stiffness, without limits on the pressures.

    ``torque`` [N m], bending positive, ``stiffness`` [N m/rad], ``radius`` of the pulley [m];
    ``phi`` [m^2] and ``psi`` [m] of both bundles.
    """
    pull, slope = torque / radius, -stiffness / (radius * radius)
    over = 1.0 / determinant(phi_a, phi_b, psi_a, psi_b)
    return (psi_b * pull - phi_b * slope) * over, -(psi_a * pull + phi_a * slope) * over


@kernel
def allocate(
    torque: float,
    stiffness: float,
    radius: float,
    phi_a: float,
    phi_b: float,
    psi_a: float,
    psi_b: float,
    low_a: float,
    high_a: float,
    low_b: float,
    high_b: float,
) -> tuple[float, float]:
    """Return the factors [N/m^2] within their limits for torque and stiffness, torque first.

    ``low`` and ``high`` are the factors at the lowest and the highest pressure; the others as in
    :func:`factors_for`.
    """
    a, b = max(phi_a, LEAST_SHAPE), max(phi_b, LEAST_SHAPE)
    x_a, x_b = factors_for(torque, stiffness, radius, a, b, psi_a, psi_b)
    if low_a <= x_a <= high_a and low_b <= x_b <= high_b:
        return x_a, x_b
    lowest, highest = torque_of(high_a, low_b, radius, a, b), torque_of(low_a, high_b, radius, a, b)
    held = max(lowest, min(highest, torque))
    pull = held / radius
    x_a, _ = factors_for(held, stiffness, radius, a, b, psi_a, psi_b)
    # along a line of equal torque the stiffness grows with both factors
    x_a = max(x_a, low_a, (b * low_b - pull) / a)
    x_a = max(low_a, min(x_a, high_a, (b * high_b - pull) / a))
    return x_a, max(low_b, min(high_b, (pull + a * x_a) / b))
