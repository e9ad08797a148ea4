"""Equations of rigs with joints between muscles, integrated by semi-implicit Euler steps.

The force of a muscle is that of a braid of threads at an angle (Chou and Hannaford 1996), a
difference of exponentials, or a spring whose stiffness is a polynomial in stretch and pressure
(Wickramatunge and Leephakpreeda 2009); its friction is a Bouc-Wen, a Dahl or a Maxwell-slip model
(Vo-Minh et al. 2011) driven by its length; the regulator is of second order, a lag with a limited
rate, or a proportional valve with the flow of an orifice (ISO 6358); the friction of a bearing is
a LuGre model or the set-valued one of Karnopp (1985); a mechanical stop is a Hertzian contact that
dissipates (Hunt and Crossley 1975).
"""

import math

import numpy as np
from numba import njit

from .fields import ELEMENTS

BRAID, EXPONENTIAL, POLYNOMIAL = 0, 1, 2
BOUC_WEN, DAHL, MAXWELL_SLIP = 0, 1, 2
SECOND_ORDER, LIMITED_LAG, ORIFICE = 0, 1, 2
LEVER, PULLEY, BRACE = 0, 1, 2
CONTACT, LOSS = 4300.0, 0.3
"""Stiffness of a mechanical stop [N m/rad^1.5], which 10 N m press in by a degree, and its
damping over its force [s/rad]."""
PACE = 1e-3
"""Rate of contraction [1/s] below which Eyring's flow is in proportion to it."""
YIELD = 1.5e-3
"""Rate of contraction [1/s] below which the power law of a viscous loss is nearly linear."""
AIR = 1.013
"""Pressure of the atmosphere [bar]."""
SEALED, DRIVEN = 0.02, 0.6
"""Half width of the rounding of a slack muscle over its size, and difference of pressures [bar]
beyond which creep by activation is faster than its time constant."""
OVERLAP = 0.4
"""Overlap of the spool on either side of its ports, over the dead band."""
WINDUP = 0.1
"""Bound of the integral term, over the error that opens the valve fully."""
SHEAR = 0.4
"""Speed [rad/s] at which the viscous torque of a bearing equals its breakaway torque."""


@njit(cache=True)
def polynomial(c: np.ndarray, pressure: float, strain: float) -> float:
    """Force [N] of a spring that pressure beyond a threshold stiffens, pulled from its free length.

    The rubber of the bladder resists the contraction up to a bound.
    """
    size, most, curve, passive, skew = c[0], c[1], c[2], c[3], c[12]
    width = 0.08
    net = width * math.log1p(math.exp((pressure - c[11]) / width))
    full = width * math.log1p(math.exp((2.0 - c[11]) / width))
    drive = net / full * (1.0 + c[13] * (pressure - 2.0))
    s = 1.0 - strain / most
    if s > 0.0:
        shape = s * (1.0 + (s - 1.0) * (curve + skew * (s - 0.5)))
    else:
        shape = s * (1.0 - curve + 0.5 * skew)
    rubber = passive * max(s, 0.0) ** 2 - c[14] * size * strain / (abs(strain) + 0.06)
    total = size * (drive * shape + 40.0 * max(-strain, 0.0) ** 1.5) + rubber
    edge = SEALED * size
    return total if total > edge else max(total + edge, 0.0) ** 2 / (4.0 * edge)


@njit(cache=True)
def law(kind: int, c: np.ndarray, pressure: float, strain: float) -> float:
    """Force of a muscle [N] at a pressure [bar], with a tangent to zero where it is slack."""
    if kind == 2:
        return polynomial(c, pressure, strain)
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
def through(one: float, other: float, choke: float) -> float:
    """Return the flow of an orifice between two pressures [bar], choked below a critical ratio.

    It is scaled so that choked flow equals the upstream pressure. Above a ratio of 0.995 it is
    laminar.
    """
    up, down = max(one, other), min(one, other)
    ratio = down / up
    part = max(min(ratio, 0.995) - choke, 0.0) / (1.0 - choke)
    flow = up * math.sqrt(1.0 - part * part) * min((1.0 - ratio) / 0.005, 1.0)
    return flow if one > other else -flow


@njit(cache=True)
def valve_flow(
    c: np.ndarray,
    p: float,
    spool: float,
    total: float,
    target: float,
    volume: float,
    grown: float,
    dt: float,
) -> tuple[float, float, float]:
    """Return pressure [bar], position of the spool and integral of the error [bar] after a step.

    A PI controller with anti-windup (Astrom and Hagglund 1995) moves the spool, which overlaps its
    ports. ``volume`` is that of the muscle over its volume at full length, ``grown`` its change.
    """
    error, span = max(c[3] * target + c[4], 0.0) - p, c[2] / c[0]
    error -= min(max(error, -OVERLAP * c[6]), OVERLAP * c[6])
    if abs(error) < span:
        total = min(max(total + dt / c[7] * error, -WINDUP * span), WINDUP * span)
    closed = error == 0.0 and c[6] > 0.0
    wish = 0.0 if closed else min(max((error + total) / span, -1.0), 1.0)
    spool += dt / c[8] * (wish - spool)
    inside = p + AIR
    if spool > 0.0:
        flow = spool * c[2] * through(c[9], inside, c[12]) / c[9]
    else:
        flow = spool * c[2] * c[10] * through(inside, AIR, c[12]) / c[9]
    p += (dt * flow - 1.2 * inside * grown) / volume
    return p, spool, total


@njit(cache=True)
def swelling(c: np.ndarray, strain: float) -> float:
    """Return the growth of a muscle's volume by contraction, over that at full length.

    By virtual work it goes with the force that a rise of the pressure gives (Chou and Hannaford
    1996): otherwise a muscle that is shut in would do work in a cycle of its length.
    """
    given = polynomial(c, 2.5, strain) - polynomial(c, 1.5, strain)
    return given / (polynomial(c, 2.5, 0.0) - polynomial(c, 1.5, 0.0))


@njit(cache=True)
def swollen(c: np.ndarray, widening: float, strain: float) -> float:
    """Return the volume of a muscle over that at full length."""
    total, parts = 0.0, 400
    for i in range(parts):
        total += swelling(c, strain * (i + 0.5) / parts)
    return 1.0 + widening * strain * total / parts


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
def slip(c: np.ndarray, elements: np.ndarray, du: float) -> float:
    """Return the state of friction, from -1 to 1, of springs in parallel that slip one by one.

    It stores no more energy than it took, also where its width varies with the contraction.
    """
    total = 0.0
    for k in range(ELEMENTS):
        elements[k] = min(max(elements[k] + du / (c[6] * c[16 + k]), -1.0), 1.0)
        total += c[16 + ELEMENTS + k] * elements[k]
    return total


@njit(cache=True)
def lost(kind: int, c: np.ndarray, rate: float) -> float:
    """Force [N] of Eyring's flow, or of a power law, at a rate of contraction [1/s]."""
    if kind == 2:  # Herschel and Bulkley 1926, with an exponent of 0.3
        return c[10] * rate / 0.02 * ((0.02**2 + YIELD**2) / (rate * rate + YIELD**2)) ** 0.35
    return c[10] * math.asinh(rate / PACE) / math.asinh(0.02 / PACE)


@njit(cache=True)
def crept(kind: int, c: np.ndarray, slow: float, p: float, dt: float) -> float:
    """Return the pressure [bar] that creep follows, by a lag or by thermal activation."""
    if kind == 2:  # nearly logarithmic in time after a large step
        if c[8] == 0.0:
            return p
        return slow + dt * DRIVEN / (2.5 * c[9]) * math.sinh((p - slow) / DRIVEN)
    return slow + dt / c[9] * (p - slow)


@njit(cache=True)
def hold(
    joints: np.ndarray,
    inverse: np.ndarray,
    before: np.ndarray,
    v: np.ndarray,
    push: np.ndarray,
    dt: float,
) -> None:
    """Apply the friction impulses ``push`` of bearings that stick or slip to speeds [rad/s].

    An impulse stops its joint unless that exceeds a bound: the breakaway torque at rest, less at a
    higher speed ``before`` (Hess and Soom 1990). Impulses are solved joint by joint (Moreau 1988).
    """
    n = len(v)
    for i in range(n):
        for k in range(n):
            v[k] += inverse[k, i] * push[i]
    for _ in range(1 if n == 1 else 12):
        for i in range(n):
            j = joints[i]
            bound = dt * j[5] * (j[6] + (1.0 - j[6]) / (1.0 + (before[i] / j[7]) ** 2))
            new = min(max(push[i] - v[i] / inverse[i, i], -bound), bound)
            for k in range(n):
                v[k] += inverse[k, i] * (new - push[i])
            push[i] = new


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
    elements, inverse = np.zeros((m, ELEMENTS)), np.zeros((n, n))
    before, push = np.zeros(n), np.zeros(n)
    pressures, forces = np.zeros((m, rows)), np.zeros((m, rows))
    q[:] = link[3]
    for k in range(m):
        strain[k] = place(kinds[3], geometry, k % sides, q[k // sides])[0]
    volume = np.ones(m)
    if kinds[2] == 2:
        held[:] = 0.0  # here the integral of the controller's error
        for k in range(m):
            volume[k] = swollen(muscles[k], valve[11], strain[k])
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
            e, rate = place(kinds[3], geometry, k % sides, q[k // sides])
            aim = commands[k, then]
            if kinds[2] == 2:
                grown = valve[11] * swelling(c, 0.5 * (e + strain[k])) * (e - strain[k])
                volume[k] += grown
                p[k], speed[k], held[k] = valve_flow(
                    valve, p[k], speed[k], held[k], aim, volume[k], grown, dt
                )
            else:
                p[k], speed[k], held[k] = regulate(
                    kinds[2], valve, p[k], speed[k], held[k], aim, dt
                )
            slow[k] = crept(kinds[0], c, slow[k], p[k], dt)
            effective = p[k] + c[8] * slow[k]
            if kinds[1] == 2:
                z[k] = slip(c, elements[k], e - strain[k])
                rub = (c[4] + c[5] * max(effective, 0.0) ** c[15]) * z[k]
            else:
                z[k] = loop(kinds[1], c, z[k], e - strain[k])
                rub = (c[4] + c[5] * max(effective, 0.0)) * z[k]
            strain[k] = e
            moving = c[7] * effective * rate * v[k // sides]
            if c[10] > 0.0:
                moving += lost(kinds[1], c, rate * v[k // sides])
            base = law(kinds[0], c, effective, e)
            # friction ends with the force of a slack muscle
            force[k] = max(base - min(1.0, base / (0.05 * c[0])) * (rub + moving), 0.0)
            length = geometry[3]
            torque[k // sides] += force[k] * rate * length
        extra = payload[row]
        before[:] = v
        for i in range(n):
            j = joints[i]
            torque[i] += j[3] * (j[4] - q[i]) - j[1] * v[i] + stopped(q[i], v[i], link[4])
            if j[5] > 0.0 and kinds[1] != 2:
                bound = j[5] * (j[6] + (1.0 - j[6]) * math.exp(-((v[i] / j[7]) ** 2)))
                stiff = j[5] / j[8]
                bristle[i] = (bristle[i] + dt * v[i]) / (1.0 + dt * abs(v[i]) * stiff / bound)
                torque[i] -= stiff * bristle[i] + 0.3 * math.sqrt(stiff * j[0]) * v[i]
            elif kinds[1] == 2:
                torque[i] -= j[5] / SHEAR * v[i]
        if n == 1:
            arm = link[0]
            inertia = joints[0, 0] + extra * arm * arm
            weight = joints[0, 2] + extra * arm * 9.80665
            v[0] += dt * (torque[0] - weight * math.sin(q[0])) / inertia
            inverse[0, 0] = 1.0 / inertia
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
            inverse[0, 0], inverse[1, 1] = m22 / det, m11 / det
            inverse[0, 1] = inverse[1, 0] = -m12 / det
        if kinds[1] == 2 and joints[0, 5] > 0.0:
            hold(joints, inverse, before, v, push, dt)
        for i in range(n):
            q[i] += dt * v[i]
    return out, pressures, forces
