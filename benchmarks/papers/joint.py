"""Figures of the joint's control (fluidic_muscles): PI, robustness, hysteresis, steps, sines.

The paper prints few numbers for its control. The expected values were computed from its equations
by an independent program. The figures of the PI are judged within 1 %, all others with an expected
value within 5 %; a miss states its reason. Every feedback loop on the joint's angle (for
model-following, the disturbance loop) is evaluated with the same nominal plant in continuous time.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.joint.model import POLE, pi_system, pole_cancelling
from baselines.linear import ltr
from baselines.linear.systems import StateSpace, discrete, double_lag, response
from baselines.robust.requirements import FREQUENCIES, RobustDesign, robust_controller, sensitivity
from benchmarks.papers.joint_hysteresis import (
    antisymmetry_error,
    inhomogeneous,
    inverse_error,
    relay_output,
    verdicts,
    width_ratio,
)
from benchmarks.papers.joint_studies import (
    CASES,
    STEPPED,
    ReducedRig,
    Setting,
    StepFigures,
    controller,
    plant_step,
    rejection,
    step,
    step_figures,
    tracking_error,
)
from benchmarks.papers.published import Group, Values, as_published
from pam_envs.arrays import Array
from pam_envs.identification.joint_forc import CONGRUENCY, SYMMETRY
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

Complex = NDArray[np.complex128]

LOW = {0.1: 0.013, 1.0: 0.126, 4.0: 0.443}
"""Frequencies [rad/s] of the tabulated sensitivity, and the expected one of the mu loop."""
BEST = "joint_mfc_mu"
EXPECTED = {
    "joint_pi": 0.165,
    "joint_mfc_mu": 0.132,
    "joint_mfc_mu_plain": 0.171,
    "joint_mfc_mu_wrong": 0.142,
}
"""Rise [s] of a step of 10 degrees, computed independently with loops of 10 %."""
SINGLE = {
    "joint_pid": "a PID by SIMC",
    "joint_pid_smooth": "a PID as fast as the plant",
    "joint_pi": "the same PI",
    "joint_pi_slow": "a slow PI",
}
"""Single loops, with their titles."""
LEVELS = (0, 24, 8, 20, 12, 32, 4, 28, 10)
"""Grid points of a history of inputs with wiped-out and dominant extrema."""
GRID = 0.6006743720854 / 99
"""Sampling time [s] of the independently computed rise and settling of the PI."""


def unit_step(system: StateSpace, seconds: float) -> tuple[Array, Array]:
    """Return times [s] and the step response of a continuous system."""
    fine = discrete(system, 1e-4, "zoh")
    state, outputs = fine.initial_state(), []
    for _ in range(round(seconds / 1e-4)):
        state = fine.advance(1.0, state)
        outputs.append(float(fine.output(1.0, state)))
    return 1e-4 * np.arange(1.0, len(outputs) + 1.0), np.array(outputs)


def nominal_step() -> tuple[Array, Array]:
    """Return times [s] and the step response of the nominal plant with the PI."""
    return unit_step((double_lag(POLE) * pi_system(pole_cancelling())).feedback(), 2.0)


def pi_figures() -> Values:
    """PI with pole cancellation on the nominal plant."""
    time, output = nominal_step()
    exact = step_figures(time, output)
    read = np.interp(GRID * np.arange(1.0, 100.0), time, output)
    rise = GRID * float(np.argmax(read >= 0.9) - np.argmax(read >= 0.1))
    gains = pole_cancelling()
    loop = double_lag(POLE) * pi_system(gains)
    coarse = {"milliseconds": 1e3 * GRID, "read": rise}
    yield "PI: K_p K", gains.proportional
    yield "PI: K_i K", gains.integral
    yield "PI: overshoot", exact.overshoot
    yield "PI: rise", exact.rise, coarse
    yield "PI: rise on the coarse samples", rise, coarse
    yield "PI: settling to 2 %", exact.settling
    margin = ltr.loop_figures(lambda w: loop(1j * w)).phase_margin
    yield "PI: phase margin", float(np.degrees(margin))
    yield "rise of the double pole", step_figures(*unit_step(double_lag(POLE), 1.0)).rise
    yield "pole of the plant", float(double_lag(POLE).poles().real.max())
    poles = ltr.closed_loop_poles(double_lag(POLE), pi_system(gains))
    pair = poles[np.abs(poles.imag) > 1e-6][0]
    yield "PI: damping ratio", float(-pair.real / abs(pair))
    with_it = step("joint_pi").rise / step("joint_pi", Setting(width=0.0)).rise
    yield "PI: rise with the assumed hysteresis over that without", with_it


def robust_figures() -> Values:
    """Structured singular value and sensitivity of the disturbance loops as frozen."""
    design = RobustDesign()
    for stage in ("full", "reduced"):
        made = robust_controller("mu", stage)  # type: ignore[arg-type]
        loop = response(design.plant, FREQUENCIES) * response(made, FREQUENCIES)
        value = float(design.structured_value(loop).max())
        yield "mu, gain +-35 % and 4 rad/s, {stage}", value, {"stage": stage}
    size = sensitivity(loop)
    for frequency, expected in LOW.items():
        ours, at = float(np.interp(frequency, FREQUENCIES, size)), {"frequency": frequency}
        name = "sensitivity of the mu loop at {frequency:g} rad/s"
        yield name, ours, at | {"expected": expected}
    peak = float(size.max())
    yield "its peak", peak, {"above": peak - 1.0}


@dataclass(frozen=True)
class LoopFigures:
    """Figures of one controller's loop.

    ``mu`` is the largest structured singular value, at most 1 for robust performance;
    ``sensitivity`` is ``|S|`` at the frequencies of ``LOW``, ``peak`` its largest value; ``step``
    is the response to 10 degrees after a turn, with the assumed hysteresis.
    """

    name: str
    mu: float
    sensitivity: tuple[float, ...]
    peak: float
    step: StepFigures


def law_response(made: Any, frequency: Array) -> Complex:
    """Return the response of a controller's loop from error to command at frequencies [rad/s].

    Its discrete form follows from the bilinear rule, which is inverted by ``z = (1 + s T / 2) / (1
    - s T / 2)``.
    """
    loop = made.disturbance if hasattr(made, "disturbance") else made.loop
    bank, half = loop.controller, 0.5j * frequency * loop.controller.period
    eye = np.eye(bank.a.shape[1])
    z = (1.0 + half) / (1.0 - half)
    found = np.linalg.solve(z[:, None, None] * eye - bank.a[0], bank.b[0][:, None])
    return np.asarray(found[..., 0] @ bank.c[0] + bank.d[0])


@cache
def loop_figures(name: str) -> LoopFigures:
    """Return the figures of a controller of the catalogue."""
    design, made = RobustDesign(), controller(name, ReducedRig())
    loop = response(design.plant, FREQUENCIES) * law_response(made, FREQUENCIES)
    size = sensitivity(loop)
    low = tuple(float(np.interp(f, FREQUENCIES, size)) for f in LOW)
    value = float(design.structured_value(loop).max())
    return LoopFigures(name, value, low, float(size.max()), step(name))


def loop_lines() -> Values:
    """Robustness, disturbance rejection and rise time of every loop."""
    for row in map(loop_figures, STEPPED):
        low = ", ".join(f"{value:.3f}" for value in row.sensitivity)
        yield "mu of the loop of {row.name}", row.mu, {"row": row, "low": low}
    poles = ltr.closed_loop_poles(double_lag(POLE), pi_system(pole_cancelling()))
    yield "slowest pole of the PI loop", float(poles.real.max())


def hysteresis_lines() -> Values:
    """Symmetry and congruency of the hysteresis of joints and of one muscle, and of its inverse."""
    for name, found in verdicts().items():
        alone = name.startswith("one ")
        title, known = name if alone else "{joint}", {"joint": name}
        end = "at_least" if alone else "at_most"
        text = {"note": found.verdict, end: SYMMETRY}
        yield f"{title}: error of symmetry", found.symmetry, known | text
        yield f"{title}: error of congruency", found.congruency, known | {end: CONGRUENCY}
    for plant in ("paper", "measured"):
        joint = as_published(getattr(AntagonisticJoint, plant)("maxwell_slip"))
        for size in (10.0, 15.0, 20.0):
            name = "{plant} joint, {size:g} deg: loop width without over with inverse"
            yield name, width_ratio(joint, np.radians(size)), {"plant": plant, "size": size}
    exact, series = inverse_error()
    yield "inverse by recursion", exact
    yield "inverse (3.5) as printed", series
    model, relays = inhomogeneous(), relay_output(inhomogeneous(), LEVELS)
    off = float(np.abs(model.simulate(model.levels[list(LEVELS)])[0] - relays).max())
    yield "output (3.3) less the sum of relays (3.1)", off / float(model.everett[-1, 0])
    yield "error of f_ab = -f_ba over the range", antisymmetry_error()
    uneven = verdicts()["paper joint"].symmetry
    yield "asymmetry of the joint's relay weights", uneven, {"at_most": SYMMETRY}
    yield "3 % of the length over 25 % of stroke", 300.0 / 25.0


def disturbance_lines() -> Values:
    """Time until a step on the angle is down to 10 %."""
    best, alone = rejection(BEST), rejection("joint_pi")
    yield f"2 deg off rejected to 10 %, {BEST}", best
    yield "2 deg off rejected to 10 %, joint_pi", alone
    yield "time of the PI over that of the mu loop", alone / best


def sine_lines() -> Values:
    """Error of a sine of 0.5 Hz and 20 degrees, at two control periods."""
    for period in (0.01, 0.001):
        error, to_model = tracking_error(BEST, period=period)
        alone = tracking_error("joint_pi", period=period)[0]
        at = {"period": 1e3 * period, "to_model": to_model}
        title = "sine of 0.5 Hz, 20 deg, {period:g} ms, "
        yield f"{title}{BEST}", error, at
        yield f"{title}joint_pi", alone, at
        title = "sine, {period:g} ms: error of the PI "
        yield f"{title}less that of model-following", alone - error, at
        yield f"{title}over that of model-following", alone / error, at


def rise_lines() -> Values:
    """Rise time of a step of 10 degrees after a turn, for every controller."""
    for name in STEPPED:
        known: dict[str, Any] = {"found": step(name), "first": step(name, Setting(turned=False))}
        title = f"10 deg, rise, {name}"
        if name in EXPECTED:
            title = "10 deg, rise, {controller}"
            known |= {"controller": name, "expected": EXPECTED[name]}
        yield title, step(name).rise, known


def bound_lines() -> Values:
    """Bounds on a step of 10 degrees after a turn, on the hysteresis of the studies."""
    best, same = step(BEST), step("joint_pi")
    fine = step("joint_pi", Setting(period=1e-3))
    for name, title in SINGLE.items():
        yield f"rise of {title} over MFC + inverse", step(name).rise / best.rise
    above = best.overshoot - same.overshoot
    yield "overshoot of MFC + inverse above that of the same PI", above
    name = "rise of the same PI at 1 ms over MFC + inverse at 10 ms"
    yield name, fine.rise / best.rise, {"fine": fine}


def ratio_lines() -> Values:
    """Rise time of the same PI over that of model-following, on three plants, by size and turn."""
    title = "rise of the same PI over MFC + inverse, {plant}, {size:g} deg, {when}"
    for plant, size, turned in CASES:
        alone, best = (plant_step(plant, n, size, turned) for n in ("joint_pi", BEST))
        known = {"plant": plant, "size": size, "when": "after a turn" if turned else "first step"}
        yield title, alone.rise / best.rise, known | {"alone": alone, "best": best}


GROUPS: tuple[Group, ...] = (
    pi_figures,
    robust_figures,
    loop_lines,
    hysteresis_lines,
    disturbance_lines,
    sine_lines,
    rise_lines,
    bound_lines,
    ratio_lines,
)
