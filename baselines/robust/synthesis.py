"""Off-line synthesis of the joints' disturbance loops (fluidic_muscles, section 4).

    python -m baselines.robust.synthesis          # needs the extra "synthesis": control, slycot

Writes ``baselines/robust/joint_robust.json``, which the controllers read; nothing else needs the
extra. The steps:

1. H-infinity synthesis on the plant with its weights (:mod:`baselines.robust.requirements`), the
   three uncertainties taken as one full block: the loop ``hinf``.
2. D-K iteration for ``mu``: each block is scaled by the magnitude that minimises the norm (for the
   rank-one matrix at hand ``d_i^2 = 1 / |a_i|``), fitted by a stable system with a stable
   inverse, and the synthesis is repeated; the controller of the round with the smallest ``mu``.
3. Modes beyond ``FAST`` are replaced by their static gain; the slowest mode, an approximate
   integrator, is replaced by an exact one; the rest is reduced by balanced residualisation to
   ``ORDER`` states.

The reduction (fernando1982) balances a system and replaces the states with the smallest Hankel
singular values by their equilibrium instead of truncating them: the static gain stays exact, and
the error is at most twice the sum of the omitted values. python-control balances with SLICOT only.
On this mu-synthesised loop its ``hankel_singular_values`` loses one value to a negative square root
and has an error of 29 % in the smallest of the others; the square-root algorithm here is accurate
to 0.05 % in all nine.

The real gain is scaled as if it were complex (D instead of D, G scaling). For the result, the exact
``mu`` with a real gain and the bound by SLICOT's AB13MD are reported.
"""

import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import schur, solve_continuous_lyapunov, solve_sylvester
from scipy.optimize import least_squares

from baselines.linear.ltr import integrator
from baselines.linear.systems import Complex, StateSpace, from_polynomials, response, state_space
from baselines.robust.requirements import FREQUENCIES, RobustDesign, sensitivity
from pam_envs.arrays import Array

Scales = tuple[StateSpace, StateSpace] | None
FILE = Path(__file__).with_name("joint_robust.json")
FAST, INTEGRATOR = 1e3, 0.1
"""Frequencies [rad/s] above which modes count as static, and below which one is an integrator."""
ROUNDS = 6
SCALE_ORDER = 2
ORDER = 2
"""States besides the integrator; more states change no figure in its third digit."""
FITTED = FREQUENCIES <= 300.0
"""Frequencies at which the scales are fitted; no block matters above them."""
PROBES = (0.1, 1.0, 4.0)
"""Frequencies [rad/s] at which the sensitivity is reported."""


def generalised_plant(design: RobustDesign, scales: Scales) -> StateSpace:
    """Return the plant of the synthesis.

    Inputs: the outputs of the gain's and of the neglected dynamics' uncertainty and a disturbance,
    all added to the plant's output, and the command. Outputs: the inputs of the two uncertainties,
    the weighted output, the weighted command, and the controller's input.
    """
    import control

    g, performance, neglected = design.plant, design.performance, design.neglected
    a, b = np.zeros((4, 4)), np.zeros((4, 4))
    a[:2, :2], a[2, 2], a[3, 3] = g.A, performance.A[0, 0], neglected.A[0, 0]
    a[2, :2], a[3, :2] = performance.B @ g.C, neglected.B @ g.C
    b[:2, 3], b[2, :3] = g.B[:, 0], performance.B[0, 0]
    c, d = np.zeros((5, 4)), np.zeros((5, 4))
    c[0, :2] = design.gain_spread * g.C
    c[1, :2], c[1, 3] = neglected.D @ g.C, neglected.C[0, 0]
    c[2, :2], c[2, 2], d[2, :3] = performance.D @ g.C, performance.C[0, 0], performance.D[0, 0]
    d[3, 3] = design.effort
    c[4, :2], d[4, :3] = -g.C, -1.0
    plant = control.ss(a, b, c, d)
    if scales is None:
        return plant
    identity = [control.ss([], [], [], np.eye(n)) for n in (3, 2)]
    left = control.append(*scales, identity[0])
    right = control.append(*(scale**-1 for scale in scales), identity[1])
    return left * plant * right


def synthesise(design: RobustDesign, scales: Scales) -> StateSpace:
    """Return the H-infinity controller for scaled blocks."""
    import control

    return control.hinfsyn(generalised_plant(design, scales), 1, 1)[0]


def loop_of(design: RobustDesign, controller: StateSpace) -> Complex:
    """Return the loop's response at ``FREQUENCIES``."""
    return response(design.plant, FREQUENCIES) * response(controller, FREQUENCIES)


def scales_for(design: RobustDesign, loop: Complex) -> tuple[StateSpace, StateSpace]:
    """Return the scales of the two uncertainties, that of the performance being 1."""
    performance = np.abs(response(design.performance, FREQUENCIES) / (1.0 + loop))
    tracking = np.abs(loop / (1.0 + loop))
    spreads = (design.gain_spread, np.abs(response(design.neglected, FREQUENCIES)))
    first, second = (fit_scale(np.sqrt(performance / (s * tracking))) for s in spreads)
    return first, second


def fit_scale(magnitude: Array, order: int = SCALE_ORDER) -> StateSpace:
    """Return a stable system with a stable inverse, of real roots, with this magnitude."""
    w, target = FREQUENCIES[FITTED], np.log(magnitude[FITTED])

    def residual(q: Array) -> Array:
        zeros, poles = np.exp(q[1 : 1 + order]), np.exp(q[1 + order :])
        terms = np.log((w[:, None] ** 2 + zeros**2) / (w[:, None] ** 2 + poles**2))
        return np.asarray(q[0] + 0.5 * terms.sum(axis=1) - target)

    start = np.log(np.geomspace(2.0, 60.0, order))
    guess = np.concatenate([[target[-1]], start + 0.1, start - 0.1])
    q = least_squares(residual, guess, bounds=(-12.0, 12.0)).x
    top = np.exp(q[0]) * np.poly(-np.exp(q[1 : 1 + order]))
    return from_polynomials(top, np.poly(-np.exp(q[1 + order :])))


def d_k_iteration(design: RobustDesign) -> tuple[StateSpace, StateSpace, list[float]]:
    """Return the H-infinity controller, that with the smallest ``mu``, and ``mu`` by round."""
    controllers, values = [], []
    scales: Scales = None
    for _ in range(ROUNDS):
        controllers.append(synthesise(design, scales))
        loop = loop_of(design, controllers[-1])
        values.append(float(design.structured_value(loop).max()))
        scales = scales_for(design, loop)
    return controllers[0], controllers[int(np.argmin(values))], values


def residualised(system: StateSpace, order: int) -> tuple[StateSpace, Array]:
    """Return a stable system with fewer states, and all Hankel singular values."""
    import control

    slowest = np.max(system.poles().real)
    if not 0 < order <= system.nstates or slowest >= 0.0:
        raise ValueError(
            f"order is {order} of {system.nstates}, and the slowest pole {slowest:.3g}; give"
            " a stable system and from 1 to all of its states: set an integrator aside first"
        )
    balanced, sizes = _balanced(system)
    rest = list(range(order, system.nstates))
    reduced = control.model_reduction(balanced, rest, method="matchdc") if rest else balanced
    return reduced, sizes


def _balanced(system: StateSpace) -> tuple[StateSpace, Array]:
    a, b, c = system.A, system.B, system.C
    reachable = _root(np.asarray(solve_continuous_lyapunov(a, -b @ b.T), float))
    observable = _root(np.asarray(solve_continuous_lyapunov(a.T, -c.T @ c), float))
    left, sizes, right = np.linalg.svd(observable.T @ reachable)
    scale = 1.0 / np.sqrt(sizes)
    back, there = reachable @ right.T * scale, (observable @ left * scale).T
    return state_space(there @ a @ back, there @ b, c @ back, system.D[0, 0]), sizes


def _root(gramian: Array) -> Array:
    """Return ``R`` with ``R R' = gramian``."""
    values, vectors = np.linalg.eigh(0.5 * (gramian + gramian.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 1e-16 * values[-1])))


def split(system: StateSpace, frequency: float) -> tuple[StateSpace, StateSpace]:
    """Return the parts with poles within and beyond a frequency [rad/s], whose sum is the system.

    The feedthrough belongs to the second. (Ordered Schur form and a Sylvester equation.)
    """
    form, basis, k = schur(system.A, sort=lambda re, im: np.hypot(re, im) <= frequency)
    if not 0 < k < system.nstates:
        raise ValueError(
            f"{k} of {system.nstates} poles are within {frequency:g} rad/s; choose a frequency that"
            " separates them"
        )
    couple = solve_sylvester(form[:k, :k], -form[k:, k:], -form[:k, k:])
    b, c = basis.T @ system.B[:, 0], system.C[0] @ basis
    within = state_space(form[:k, :k], b[:k] - couple @ b[k:], c[:k])
    beyond = state_space(form[k:, k:], b[k:], c[k:] + c[:k] @ couple, system.D[0, 0])
    return within, beyond


def without_fast(system: StateSpace, frequency: float) -> StateSpace:
    """Return the system with its modes beyond a frequency [rad/s] replaced by their static gain."""
    if np.max(np.abs(system.poles())) <= frequency:
        return system
    within, beyond = split(system, frequency)
    return within + beyond.dcgain()


def reduced_controller(controller: StateSpace, order: int = ORDER) -> tuple[StateSpace, Array]:
    """Return a synthesised controller with an integrator and few states, and Hankel values."""
    slowest, rest = split(without_fast(controller, FAST), INTEGRATOR)
    small, sizes = residualised(rest, order)
    return integrator(float((slowest.C @ slowest.B)[0, 0])) + small, sizes


def frozen(design: RobustDesign, controller: StateSpace) -> dict[str, Any]:
    """Return the numbers of a controller: full, reduced, discrete, and its figures."""
    reduced, sizes = reduced_controller(controller)
    full_loop, loop = (loop_of(design, c) for c in (controller, reduced))
    at_probes = np.interp(PROBES, FREQUENCIES, sensitivity(loop))
    return {
        "full": _numbers(controller),
        "reduced": _numbers(reduced),
        "hankel": sizes.tolist(),
        "mu_full": float(design.structured_value(full_loop).max()),
        "mu_reduced": float(design.structured_value(loop).max()),
        "mu_bound_ab13md": _bound(design, loop),
        "sensitivity": dict(zip(map(str, PROBES), at_probes, strict=True)),
        "peak_sensitivity": float(sensitivity(loop).max()),
    }


def _bound(design: RobustDesign, loop: Complex) -> float:
    """Return SLICOT's upper bound of ``mu`` with a real gain."""
    from slycot import ab13md

    spreads = [np.full(len(loop), design.gain_spread), response(design.neglected, FREQUENCIES)]
    rows = np.vstack(
        [
            -np.array(spreads) * loop / (1.0 + loop),
            response(design.performance, FREQUENCIES) / (1.0 + loop),
        ]
    )
    kinds, sizes = np.array([1, 2, 2]), np.ones(3, int)
    return max(float(ab13md(np.outer(row, np.ones(3)), sizes, kinds)[0]) for row in rows.T)


def _numbers(system: StateSpace) -> dict[str, Any]:
    a, b, c = system.A.tolist(), system.B[:, 0].tolist(), system.C[0].tolist()
    return {"a": a, "b": b, "c": c, "d": float(system.D[0, 0])}


def main() -> None:
    """Synthesise, write the numbers, and print the figures."""
    design = RobustDesign()
    hinf, mu, rounds = d_k_iteration(design)
    loops = {"hinf": frozen(design, hinf), "mu": frozen(design, mu)}
    made = {
        "made_by": "python -m baselines.robust.synthesis",
        "versions": {name: version(name) for name in ("control", "slycot", "numpy", "scipy")},
        "mu_by_round": rounds,
        **loops,
    }
    FILE.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")
    for kind, numbers in loops.items():
        figures = {k: v for k, v in numbers.items() if k not in ("full", "reduced")}
        print(kind, json.dumps(figures))
    print("mu by round", rounds)


if __name__ == "__main__":
    main()
