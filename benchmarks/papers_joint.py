"""Figures of the joint's control, seed 002: PI, memory, inverse, model-following, disturbances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.papers import Figure

Array = NDArray[np.float64]

SOURCE = "seed 002"
BEFORE = "published value: computed beforehand by another program"
GRID = 0.6006743720854 / 99
"""Samples [s] on which the rise and settling of the PI were read beforehand."""


def at_least(name: str, where: str, unit: str, bound: float, ours: float, note: str = "") -> Figure:
    """Return a figure that passes at a bound and anywhere above it."""
    text = "; ".join(t for t in ("published value is a lower bound: more is better", note) if t)
    return Figure(name, where, unit, bound, ours, max(0.0, ours - bound), text)


def at_most(name: str, where: str, unit: str, bound: float, ours: float, note: str = "") -> Figure:
    """Return a figure that passes at a bound and anywhere below it."""
    text = "; ".join(t for t in ("published value is an upper bound: less is better", note) if t)
    return Figure(name, where, unit, bound, ours, max(0.0, bound - ours), text)


def nominal_step() -> tuple[Array, Array]:
    """Return times [s] and the step response of the nominal plant with the PI."""
    from baselines.joint_loop import pi_system, pole_cancelling
    from baselines.joint_model import nominal_motion

    closed = _closed(pi_system(pole_cancelling()).series(nominal_motion()))
    fine = closed.discrete(1e-4, "zoh")
    state, outputs = fine.initial_state(), []
    for _ in range(20000):
        state = fine.advance(1.0, state)
        outputs.append(float(fine.output(1.0, state)))
    return 1e-4 * (1.0 + np.arange(len(outputs))), np.array(outputs)


def _closed(loop: object) -> object:
    from baselines.linear import LinearSystem

    assert isinstance(loop, LinearSystem)
    return LinearSystem(loop.a - np.outer(loop.b, loop.c), loop.b, loop.c)


def pi_figures() -> list[Figure]:
    """PI with pole cancellation on the nominal plant."""
    from baselines.joint_loop import pi_system, pole_cancelling
    from baselines.joint_model import nominal_motion
    from baselines.ltr import loop_figures
    from benchmarks.joint_studies import step_figures

    time, output = nominal_step()
    exact = step_figures(time, output)
    grid = GRID * np.arange(1.0, 100.0)
    read = np.interp(grid, time, output)
    rise = GRID * float(np.argmax(read >= 0.9) - np.argmax(read >= 0.1))
    gains = pole_cancelling()
    margin = loop_figures(pi_system(gains).series(nominal_motion()).response).phase_margin
    where = f"{SOURCE}, section 4"
    coarse = f"read on samples of {1e3 * GRID:.2f} ms, as {BEFORE}"
    lines = [
        ("K_p K", "1", 0.5, gains.proportional, 1e-9, ""),
        ("K_i K", "1/s", 11.5, gains.integral, 1e-9, ""),
        ("overshoot", "%", 4.32, exact.overshoot, 0.043, BEFORE),
        ("rise, on coarse samples", "s", 0.1274, rise, 0.00127, coarse),
        ("rise", "s", 0.1274, exact.rise, None, f"exact; {coarse}"),
        ("settling to 2 %", "s", 0.370, exact.settling, 0.0037, f"exact; {coarse}"),
        ("phase margin", "deg", 65.5, float(np.degrees(margin)), 0.65, BEFORE),
    ]
    return [Figure(f"PI: {n}", where, u, p, o, t, text) for n, u, p, o, t, text in lines]


def robust_figures() -> list[Figure]:
    """Structured singular value and sensitivity of the disturbance loops as frozen."""
    from baselines.robust import robust_controller
    from baselines.robust_design import FREQUENCIES, RobustDesign, sensitivity

    design, where = RobustDesign(), f"{SOURCE}, section 4"
    figures = []
    for stage in ("full", "reduced"):
        controller = robust_controller("mu", stage)  # type: ignore[arg-type]
        loop = design.plant.response(FREQUENCIES) * controller.response(FREQUENCIES)
        value = float(design.structured_value(loop).max())
        figures.append(at_most(f"mu, gain +-35 % and 4 rad/s, {stage}", where, "1", 1.0, value))
    for frequency, published in ((0.1, 0.013), (1.0, 0.126), (4.0, 0.443)):
        size = float(np.interp(frequency, FREQUENCIES, sensitivity(loop)))
        name = f"sensitivity of the mu loop at {frequency:g} rad/s"
        figures.append(Figure(name, where, "1", published, size, 0.05 * published, BEFORE))
    peak = float(sensitivity(loop).max())
    return [*figures, Figure("its peak", where, "1", 1.07, peak, 0.07, BEFORE)]


STEPS = {
    "joint_pi": 0.165,
    "joint_pid": 0.213,
    "joint_pi_slow": 0.437,
    "joint_mfc_mu": 0.132,
    "joint_mfc_hinf": None,
    "joint_mfc_mu_plain": 0.171,
    "joint_mfc_mu_wrong": 0.142,
}
"""Rise [s] of a step of 10 degrees, computed beforehand with other tunings of PID and slow PI."""


def step_lines() -> list[Figure]:
    """Step of 10 degrees with hysteresis, for every controller."""
    from benchmarks.joint_studies import Setting, step

    where, figures = f"{SOURCE}, Fig. 16", []
    found = {name: step(name) for name in STEPS}
    best = found["joint_mfc_mu"]
    for name, published in STEPS.items():
        figure, first = found[name], step(name, Setting(turned=False))
        text = (
            f"overshoot {figure.overshoot:.1f} %, settling {figure.settling:.2f} s; the first step"
            f" after the virgin state {first.rise:.3f} s, {first.overshoot:.1f} %"
        )
        known = float("nan") if published is None else published
        figures.append(Figure(f"10 deg, rise, {name}", where, "s", known, figure.rise, None, text))
    for name, bound, words in (
        ("joint_pi", 1.2, "the same PI"),
        ("joint_pi_slow", 3.0, "a slow PI"),
    ):
        ratio = found[name].rise / best.rise
        figures.append(at_least(f"rise of {words} over MFC + inverse", where, "", bound, ratio))
    gap = best.overshoot - found["joint_pi"].overshoot
    name = "overshoot of MFC + inverse above that of the same PI"
    return [*figures, at_most(name, where, "% points", 2.0, gap)]


def memory_lines() -> list[Figure]:
    """Open-loop inverse, recursion and printed sum, disturbance and tracking."""
    from benchmarks.joint_inverses import inverse_error, width_ratio
    from benchmarks.joint_studies import rejection, tracking_error

    where = f"{SOURCE}, section 3"
    exact, series = inverse_error()
    recursion = "largest error over the range, 60 random histories"
    lines = [
        at_least("loop width without over with inverse", f"{SOURCE}, Fig. 10", "", 5.0,
                 width_ratio()),
        Figure("inverse by recursion", where, "1", 0.0, exact, 1e-12, recursion),
        Figure("inverse (3.5) as printed", where, "%", 1.0, 100.0 * series, None,
               f"{recursion}; {BEFORE}, for another mildly inhomogeneous memory"),
    ]  # fmt: skip
    for name, published in (("joint_mfc_mu", 0.28), ("joint_pi", 0.23)):
        lines.append(
            Figure(f"2 deg off rejected to 10 %, {name}", f"{SOURCE}, section 4", "s", published,
                   rejection(name), 0.03, BEFORE)
        )  # fmt: skip
    for name, published in (("joint_mfc_mu", 19.5), ("joint_pi", 22.7)):
        error, to_model = tracking_error(name)
        text = f"RMS over the amplitude; to the model's output {to_model:.4f} deg; {BEFORE}"
        lines.append(
            Figure(f"sine of 0.5 Hz, 20 deg, {name}", f"{SOURCE}, section 4", "%", published,
                   error, 3.0, text)
        )  # fmt: skip
    return lines


GROUPS: tuple[Callable[[], list[Figure]], ...] = (
    pi_figures,
    robust_figures,
    step_lines,
    memory_lines,
)
