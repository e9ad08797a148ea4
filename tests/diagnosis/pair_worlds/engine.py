"""Equations of rigs with joints between muscles, integrated by semi-implicit Euler steps.

The force of a muscle is that of a braid of threads at an angle (Chou and Hannaford 1996) or a
difference of exponentials; its friction is a Bouc-Wen or a Dahl model driven by its length; the
regulator is of second order, or a lag with a limited rate; the friction of a bearing is a LuGre
model; a mechanical stop is a Hertzian contact that dissipates (Hunt and Crossley 1975).
"""

import math

import numpy as np
from numba import njit

BRAID, EXPONENTIAL = 0, 1
BOUC_WEN, DAHL = 0, 1
SECOND_ORDER, LIMITED_LAG = 0, 1
LEVER, PULLEY, BRACE = 0, 1, 2
CONTACT, LOSS = 4300.0, 0.3
"""Stiffness of a mechanical stop [N m/rad^1.5], which 10 N m press in by a degree, and its
damping over its force [s/rad]."""
MUSCLE = (
    "size",  # force at 2 bar and full length [N]
    "most",  # contraction without force [1]
    "curve",  # of the force over the contraction
    "passive",  # force of the empty muscle at full length [N]
    "friction",  # half width of the loop without pressure [N]
    "growth",  # of the half width by 1 bar [N]
    "onset",  # contraction within which friction builds up [1]
    "viscous",  # [N s] per unit of contraction
    "creep",  # share of the pressure that follows
    "creep_s",  # its time constant [s]
    "loss",  # force of Eyring's flow at 0.02 per second [N]
)
PACE = 1e-3
"""Rate of contraction [1/s] below which Eyring's flow is in proportion to it."""

VALVE = (
    "rate",  # eigenfrequency [rad/s], or reciprocal lag [1/s]
    "damping",
    "limit",  # [bar/s]
    "gain",
    "offset",  # [bar]
    "dead_s",
    "band",  # dead band of the spool [bar]
)
JOINT = (
    "inertia",
    "damping",
    "weight",  # mass times distance times gravity [N m]
    "spring",  # [N m/rad]
    "rest",  # angle without its torque [rad]
    "stiction",  # breakaway torque [N m]
    "kinetic",  # over the breakaway torque
    "stribeck",  # [rad/s]
    "bristle",  # deflection of the bristles at breakaway [rad]
)


@njit(cache=True)
def law(kind: int, c: np.ndarray, pressure: float, strain: float) -> float:
    """Force of a muscle [N] at a pressure [bar], with a tangent to zero where it is slack."""
    size, most, curve, passive = c[0], c[1], c[2], c[3]
    if kind == 0:
        # p (a (1 - k e)^2 - b), normed to 1 at 2 bar and no contraction
        k = curve
        edge = (1.0 - k * most) ** 2
        shape = ((1.0 - k * strain) ** 2 - edge) / (1.0 - edge)
    else:
        far = math.exp(-curve * most)
        shape = (math.exp(-curve * strain) - far) / (1.0 - far)
    rubber = passive * math.exp(-8.0 * strain) - 0.12 * size * (1.0 - math.exp(-12.0 * strain))
    stop = 9.0 * size * max(-strain, 0.0)
    total = 0.5 * size * pressure * shape + rubber + stop
    width = 0.01 * size
    y = total / width
    return total if y > 30.0 else width * math.log1p(math.exp(y))


@njit(cache=True)
def place(kind: int, g: np.ndarray, side: int, angle: float) -> tuple[float, float]:
    """Return the contraction of a muscle and its growth by the angle [1/rad]."""
    if kind == 0:  # two plates, fixing points beside and above the joint
        r, arm, fittings, length = g[0], g[1], g[2], g[3]
        sign = 1.0 - 2.0 * side
        half = 0.5 * angle
        span = 2.0 * (arm * math.cos(half) - sign * r * math.sin(half))
        slope = -arm * math.sin(half) - sign * r * math.cos(half)
        return 1.0 - (span - fittings) / length, -slope / length
    if kind == 1:  # pulley
        r, low, high, length = g[0], g[1], g[2], g[3]
        if side == 0:
            return r * (high - angle) / length, -r / length
        return r * (angle - low) / length, r / length
    arm, fittings, length = g[0], g[1], g[3]  # isosceles wire that the muscle closes
    return (
        1.0 - (2.0 * arm * math.sin(0.5 * angle) - fittings) / length,
        -arm * math.cos(0.5 * angle) / length,
    )


@njit(cache=True)
def regulate(
    kind: int, c: np.ndarray, p: float, speed: float, held: float, target: float, dt: float
) -> tuple[float, float, float]:
    """Return pressure [bar], its speed and the target behind the dead band after a step."""
    if abs(target - held) > c[6]:
        held = target
    aim = max(c[3] * held + c[4], 0.0)
    if kind == 0:
        speed += dt * (c[0] * c[0] * (aim - p) - 2.0 * c[1] * c[0] * speed)
        speed = min(max(speed, -c[2]), c[2])
    else:
        speed = min(max((aim - p) * c[0], -c[2]), c[2])
    return p + dt * speed, speed, held


@njit(cache=True)
def loop(kind: int, c: np.ndarray, z: float, du: float) -> float:
    """Return the state of a muscle's friction, from -1 to 1, after a change of contraction.

    At constant pressure neither loop creates energy: that of Bouc and Wen stiffens on the way back.
    """
    s = du / c[6]
    if kind == 0:
        side = 1.0 if du * z > 0.0 else -1.0
        z += s * (1.0 - abs(z) ** 1.4 * (0.4 + 0.6 * side))
    else:
        side = 1.0 if du > 0.0 else -1.0
        z += 0.7 * s * max(1.0 - side * z, 0.0) ** 1.5
    return min(max(z, -1.0), 1.0)


@njit(cache=True)
def stopped(angle: float, speed: float, end: float) -> float:
    """Return the torque of the stops at ``-end`` and ``end`` [rad], away from the nearer one."""
    over = abs(angle) - end
    if over <= 0.0:
        return 0.0
    inwards = -1.0 if angle > 0.0 else 1.0
    return inwards * max(CONTACT * over**1.5 * (1.0 - LOSS * inwards * speed), 0.0)


@njit(cache=True)
def run(
    kinds: np.ndarray,
    muscles: np.ndarray,
    valve: np.ndarray,
    joints: np.ndarray,
    geometry: np.ndarray,
    link: np.ndarray,
    commands: np.ndarray,
    payload: np.ndarray,
    period: float,
    sub: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angles [rad], pressures [bar] and forces [N] at every row, from rest.

    ``commands`` [bar] has the shape (muscles, rows); muscle m moves joint ``m // sides``. ``link``
    is length [m], mass [kg], centre [m], first angle and angle of the stops [rad].
    """
    n, m, rows = joints.shape[0], muscles.shape[0], commands.shape[1]
    sides, dt = m // n, period / sub
    q, v, bristle = np.zeros(n), np.zeros(n), np.zeros(n)
    p, speed, held = commands[:, 0].copy(), np.zeros(m), commands[:, 0].copy()
    z, slow, force, strain = np.zeros(m), commands[:, 0].copy(), np.zeros(m), np.zeros(m)
    torque, out = np.zeros(n), np.zeros((n, rows))
    pressures, forces = np.zeros((m, rows)), np.zeros((m, rows))
    q[:] = link[3]
    for k in range(m):
        strain[k] = place(kinds[3], geometry, k % sides, q[k // sides])[0]
    settle = int(20.0 / dt)  # reaches rest before the first row
    late = round(valve[5] / dt)
    for step in range(-settle, rows * sub):
        row = max(step, 0) // sub
        then = max(step - late, 0) // sub
        if step >= 0 and step % sub == 0:
            out[:, row], pressures[:, row], forces[:, row] = q, p, force
        torque[:] = 0.0
        for k in range(m):
            c = muscles[k]
            p[k], speed[k], held[k] = regulate(
                kinds[2], valve, p[k], speed[k], held[k], commands[k, then], dt
            )
            slow[k] += dt / c[9] * (p[k] - slow[k])
            effective = p[k] + c[8] * slow[k]
            e, rate = place(kinds[3], geometry, k % sides, q[k // sides])
            z[k] = loop(kinds[1], c, z[k], e - strain[k])
            strain[k] = e
            rub = (c[4] + c[5] * max(effective, 0.0)) * z[k]
            moving = c[7] * effective * rate * v[k // sides]
            if c[10] > 0.0:
                moving += c[10] * math.asinh(rate * v[k // sides] / PACE) / math.asinh(0.02 / PACE)
            base = law(kinds[0], c, effective, e)
            # friction ends with the force of a slack muscle
            force[k] = max(base - min(1.0, base / (0.05 * c[0])) * (rub + moving), 0.0)
            length = geometry[3]
            torque[k // sides] += force[k] * rate * length
        extra = payload[row]
        for i in range(n):
            j = joints[i]
            torque[i] += j[3] * (j[4] - q[i]) - j[1] * v[i] + stopped(q[i], v[i], link[4])
            if j[5] > 0.0:
                bound = j[5] * (j[6] + (1.0 - j[6]) * math.exp(-((v[i] / j[7]) ** 2)))
                stiff = j[5] / j[8]
                bristle[i] = (bristle[i] + dt * v[i]) / (1.0 + dt * abs(v[i]) * stiff / bound)
                torque[i] -= stiff * bristle[i] + 0.3 * math.sqrt(stiff * j[0]) * v[i]
        if n == 1:
            arm = link[0]
            inertia = joints[0, 0] + extra * arm * arm
            weight = joints[0, 2] + extra * arm * 9.80665
            v[0] += dt * (torque[0] - weight * math.sin(q[0])) / inertia
        else:  # two hanging links in a plane
            arm, mass, centre = link[0], link[1], link[2]
            own = joints[0, 0]
            bent = mass * arm * centre
            cosine, sine = math.cos(q[1]), math.sin(q[1])
            m22 = own
            m12 = own + bent * cosine
            m11 = 2.0 * own + mass * arm * arm + 2.0 * bent * cosine
            both = math.sin(q[0] + q[1])
            g2 = mass * centre * 9.80665 * both
            g1 = g2 + mass * (centre + arm) * 9.80665 * math.sin(q[0])
            t1 = torque[0] - g1 + bent * sine * (2.0 * v[0] * v[1] + v[1] * v[1])
            t2 = torque[1] - g2 - bent * sine * v[0] * v[0]
            det = m11 * m22 - m12 * m12
            v[0] += dt * (m22 * t1 - m12 * t2) / det
            v[1] += dt * (m11 * t2 - m12 * t1) / det
        for i in range(n):
            q[i] += dt * v[i]
    return out, pressures, forces
