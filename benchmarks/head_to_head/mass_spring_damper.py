"""Mass-spring-damper with a known force, as a second diagnosable plant.

:class:`MassSpringDamper` implements :class:`pam_envs.diagnosis.fit.least_squares.PlantFamily`.
With the causes below it is diagnosed like a muscle, from one output instead of two.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from benchmarks.diagnosis.plain_plant import Parameters, PlainPlant, plain_causes
from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.decide.structure import FILTERS, Regressors, low_pass
from pam_envs.diagnosis.fit.starting_values import grid

SUBSTEPS = 4  # simulation steps between two readings
NEWTON = 12
STRETCH = 0.05  # reference displacement of nonlinear springs [m]
STRONG = 5.0  # reference force of a nonlinear actuator [N]
BROKEN_AWAY = 0.001  # Stribeck speed [m/s] (canudas1995)
CREEPING = 2e-4  # speed over which friction is regularised [m/s]
FORCES = (0.1, 0.16, 0.27, 0.43, 0.7, 1.14, 1.85, 3.0)
"""Grid of starting values of the dry friction [N]."""
PARAMETERS: Parameters = {
    "mass": (1.0, 0.05, 20.0, 0.1),
    "stiffness": (100.0, 1.0, 1e4, 10.0),
    "damping": (2.0, 0.01, 100.0, 0.2),
    "friction.force": (0.0, 0.0, 10.0, 0.1),
    "friction.breakaway": (0.0, 0.0, 1.0, 0.05),
    "drag.quadratic": (0.0, 0.0, 50.0, 0.5),
    "spring.hardening": (0.0, -0.5, 5.0, 0.05),
    "spring.asymmetry": (0.0, -0.8, 0.8, 0.05),
    "actuator.dead_time": (0.0, 0.0, 0.2, 0.005),
    "actuator.lag": (0.0, 0.0, 1.0, 0.01),
    "actuator.bend": (0.0, -0.5, 0.5, 0.02),
    "position.bias": (0.0, -0.1, 0.1, 1e-3),
    "position.drift": (0.0, -0.01, 0.01, 1e-5),
    "position.play": (0.0, 0.0, 0.05, 5e-4),
    "relaxation.stiffness": (0.0, 0.0, 1e3, 5.0),
    "relaxation.time": (1.0, 0.02, 100.0, 0.1),
}


@dataclass(frozen=True)
class MassSpringDamper(PlainPlant):
    """Mass-spring-damper under the force of a recording."""

    force: Array  # [N], held from each reading to the next
    period: float  # sampling period [s]
    start: dict[str, float]  # overrides neutral starting values

    channels = ("position",)
    units = ("mm",)
    parameters = PARAMETERS
    base_names = ("mass", "stiffness", "damping")
    logarithmic = (*base_names, "relaxation.time")

    @property
    def values(self) -> dict[str, float]:
        """Parameters before a fit."""
        return {**super().values, **self.start}

    def simulate(self, columns: Array) -> Array:
        """Return sensor readings [m], shape (1, T, n)."""
        found = _positions(np.ascontiguousarray(columns), self.force, self.period)
        return np.ascontiguousarray(found.T)[None]

    def regressors(self, position: Array) -> Regressors:
        """Return the regressors of a residual, from the simulated position [m]."""
        time: Array = np.asarray(np.arange(len(position)) * self.period, np.float64)
        speed = np.gradient(position, self.period)
        slow = [low_pass(self.force, tau, self.period) for tau in FILTERS]
        s = time / max(float(time[-1]), 1e-9)
        x, v, f = (u / max(float(np.std(u)), 1e-12) for u in (position, speed, self.force))
        rows = [np.ones_like(s), s, s**2, s**3]
        rows += [x, x**2, x**3, v, v * np.abs(v), np.tanh(v), np.tanh(5.0 * v), np.abs(v), x * v]
        rows += [f, f * np.abs(f), *(self.force - u for u in slow)]
        # "pressure" is the engine's name of the motion
        values: dict[str, Array] = {"time": time, "pressure": position, "rate": speed}
        values["load"] = self.force
        return Regressors(values, np.array(rows))


@njit(cache=True)  # type: ignore[untyped-decorator]
def _positions(columns: Array, force: Array, period: float) -> Array:  # pragma: no cover
    """Return positions, shape (n, T), by a midpoint rule with implicit friction."""
    n, samples = len(columns), len(force)
    out = np.empty((n, samples))
    h = period / SUBSTEPS
    for lane in range(n):
        m, k, c, dry, rest, drag, hard, skew = columns[lane, :8]
        dead, lag, bend, bias, drift, play, arm, relax = columns[lane, 8:]
        x = v = arm_force = felt = shown = 0.0
        fade = np.exp(-h / relax)
        catch = 1.0 - np.exp(-h / lag) if lag > 1e-9 else 1.0
        for i in range(samples):
            shown = min(max(shown, x - play), x + play)
            out[lane, i] = shown + bias + drift * i * period
            for j in range(SUBSTEPS):
                push = _late(force, i + (j * h - dead) / period, h / period)
                push *= 1.0 - bend * abs(push) / STRONG
                felt += catch * (push - felt)
                middle = x + 0.5 * h * v
                u = middle / STRETCH
                spring = k * middle * (1.0 + skew * u + hard * u * u)
                arm_force = fade * arm_force + arm * h * v
                loss = 0.5 * h * (c + drag * abs(v))
                b = (m - loss) * v + h * (felt - spring - arm_force)
                held = dry * (1.0 + rest * np.exp(-((v / BROKEN_AWAY) ** 2)))
                v = _with_friction(m + loss, b, h * held)
                x = middle + 0.5 * h * v
    return out


@njit(cache=True)  # type: ignore[untyped-decorator]
def _late(force: Array, start: float, length: float) -> float:  # pragma: no cover
    """Return the mean of held forces over an interval, in samples; zero before the first."""
    first, last = int(np.floor(start)), int(np.floor(start + length))
    before = force[min(first, len(force) - 1)] if first >= 0 else 0.0
    if last == first:
        return before
    after = force[min(last, len(force) - 1)] if last >= 0 else 0.0
    part = (start + length - last) / length
    return (1.0 - part) * before + part * after


@njit(cache=True)  # type: ignore[untyped-decorator]
def _with_friction(a: float, b: float, dry: float) -> float:  # pragma: no cover
    """Solve ``a v + dry tanh(v / CREEPING) = b`` for v by Newton's method from below."""
    if dry <= 0.0:
        return b / a
    size = abs(b)
    v = max((size - dry) / a, 0.0)
    for _ in range(NEWTON):
        t = np.tanh(v / CREEPING)
        step = (size - a * v - dry * t) / (a + dry * (1.0 - t * t) / CREEPING)
        v += step
        if step < 1e-9:
            break
    return v if b >= 0.0 else -v


CAUSES = (
    Cause(
        "dry_friction",
        "dry friction of the guide",
        (
            Form("sliding", (Term("friction.force", (0.5,)),), search=grid(FORCES)),
            Form(
                "sliding and breakaway",
                (
                    Term("friction.force", (0.5,)),
                    Term("friction.breakaway", (0.1,), amount=False),
                ),
                search=grid(FORCES, (0.1, 0.3)),
            ),
        ),
    ),
    *plain_causes(
        {
            "quadratic_drag": (
                "drag that grows with the square of the speed",
                ("square", "drag.quadratic", 1.0),
            ),
            "hardening_spring": (
                "a spring that hardens or softens",
                ("cubic", "spring.hardening", 0.05, -0.05),
            ),
            "asymmetric_spring": (
                "a spring that is stiffer one way",
                ("square", "spring.asymmetry", 0.05, -0.05),
            ),
            "dead_time": (
                "a delay between the force asked for and the reading",
                ("delay", "actuator.dead_time", 0.01, 0.04),
            ),
            "actuator_lag": (
                "a force that follows its command with a lag",
                ("first order", "actuator.lag", 0.01, 0.05),
            ),
            "actuator_bend": (
                "a force that is not in proportion to its command",
                ("quadratic", "actuator.bend", 0.02, -0.02),
            ),
            "sensor_bias": ("a bias of the sensor", ("constant", "position.bias", 1e-3)),
            "sensor_drift": ("a drifting sensor", ("straight", "position.drift", 2e-5)),
            "play": (
                "play in the linkage of the sensor",
                ("backlash", "position.play", 5e-4, 3e-3),
            ),
        }
    ),
    Cause(
        "relaxation",
        "a spring that relaxes",
        (
            Form(
                "one arm",
                (
                    Term("relaxation.stiffness", (5.0, 5.0)),
                    Term("relaxation.time", (0.3, 3.0), log=True, amount=False),
                ),
            ),
        ),
    ),
)
"""Effects that a mass-spring-damper may lack."""
