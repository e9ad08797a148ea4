"""Synthesis of the disturbance loops of joints, off line: fluidic_muscles, section 4.

    python -m baselines.robust.synthesis          # needs the extra "synthesis": control, slycot

Writes ``baselines/robust/joint_robust.json``, which the controllers read; nothing else needs the
extra. The steps:

1. H-infinity synthesis on the plant with its weights (:mod:`baselines.robust.requirements`), the
   three uncertainties taken as one full block: the loop ``hinf``.
2. D-K iteration for ``mu``: each block is scaled by the magnitude that minimises the norm (for the
   rank-one matrix at hand ``d_i^2 = 1 / |a_i|``), fitted by a stable system with a stable
   inverse, and the synthesis repeated; of all rounds that with the smallest ``mu``.
3. Poles beyond ``FAST`` are taken as settled, the slowest, which stands in for an integrator,
   becomes one, and the rest is reduced by balanced residualisation to ``ORDER`` states; the whole
   is made discrete by the bilinear rule at 10 ms.

The real gain is scaled as if it were complex (D and not D, G); ``mu`` of the outcome is that with a
real gain, exact, and its bound by SLICOT's AB13MD beside it.
"""

from __future__ import annotations

import hashlib
import json
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from baselines.core.controller import Array
from baselines.linear.reduction import residualised, split, with_integrator, without_fast
from baselines.linear.systems import Complex, LinearSystem
from baselines.robust.requirements import FREQUENCIES, RobustDesign, sensitivity

FILE = Path(__file__).with_name("joint_robust.json")
SOURCES = ("joint_synthesis.py", "robust_design.py", "reduction.py")
"""Files whose digest stands beside the numbers."""
Scales = tuple[LinearSystem, LinearSystem] | None
PERIOD = 0.01
FAST, INTEGRATOR = 1e3, 0.1
"""Poles [rad/s] beyond which a controller is settled, and within which it integrates."""
ROUNDS = 6
SCALE_ORDER = 2
ORDER = 2
"""States beside the integrator: more change no figure in its third digit."""
FITTED = FREQUENCIES <= 300.0
"""Where the scales are fitted: above, no block matters."""
PROBES = (0.1, 1.0, 4.0)
"""Frequencies [rad/s] at which the sensitivity is written down."""


def digest() -> str:
    """Return the SHA-256 of this script and of what it computes with."""
    made = hashlib.sha256()
    for name in SOURCES:
        made.update(Path(__file__).with_name(name).read_bytes())
    return made.hexdigest()


def generalised_plant(design: RobustDesign, scales: Scales) -> Any:
    """Return the plant of the synthesis as ``control.StateSpace``.

    Inputs: what the gain's and the neglected dynamics' uncertainty add to the output, a disturbance
    of the output, and the command. Outputs: what feeds the two uncertainties, the weighted output,
    the weighted command, and what the controller sees.
    """
    import control as ct

    g, performance, neglected = design.plant, design.performance, design.neglected
    a = np.zeros((4, 4))
    a[:2, :2] = g.a
    a[2, 2], a[3, 3] = performance.a[0, 0], neglected.a[0, 0]
    a[2, :2], a[3, :2] = performance.b[0] * g.c, neglected.b[0] * g.c
    b = np.zeros((4, 4))
    b[2, :3], b[:2, 3] = performance.b[0], g.b
    c, d = np.zeros((5, 4)), np.zeros((5, 4))
    c[0, :2] = design.gain_spread * g.c
    c[1, :2], c[1, 3] = neglected.d * g.c, neglected.c[0]
    c[2, :2], c[2, 2], d[2, :3] = performance.d * g.c, performance.c[0], performance.d
    d[3, 3] = design.effort
    c[4, :2], d[4, :3] = -g.c, -1.0
    plant = ct.ss(a, b, c, d)
    if scales is None:
        return plant
    one = [ct.ss([], [], [], np.eye(n)) for n in (3, 2)]
    left = ct.append(*(_state_space(s) for s in scales), one[0])
    right = ct.append(*(_state_space(_inverse(s)) for s in scales), one[1])
    return left * plant * right


def _state_space(system: LinearSystem) -> Any:
    import control as ct

    return ct.ss(system.a, system.b[:, None], system.c[None, :], [[system.d]])


def _inverse(system: LinearSystem) -> LinearSystem:
    back = 1.0 / system.d
    a = system.a - np.outer(system.b, system.c) * back
    return LinearSystem(a, system.b * back, -system.c * back, back)


def synthesise(design: RobustDesign, scales: Scales) -> LinearSystem:
    """Return the H-infinity controller for scaled blocks."""
    import control as ct

    controller = ct.hinfsyn(generalised_plant(design, scales), 1, 1)[0]
    return LinearSystem(
        controller.A, controller.B[:, 0], controller.C[0], float(controller.D[0, 0])
    )


def loop_of(design: RobustDesign, controller: LinearSystem) -> Complex:
    """Return the loop's response at ``FREQUENCIES``."""
    return np.asarray(
        design.plant.response(FREQUENCIES) * controller.response(FREQUENCIES), complex
    )


def scales_for(design: RobustDesign, loop: Complex) -> tuple[LinearSystem, LinearSystem]:
    """Return the scales of the two uncertainties, that of the performance being 1."""
    asked = np.abs(design.performance.response(FREQUENCIES) / (1.0 + loop))
    tracking = np.abs(loop / (1.0 + loop))
    feeds = (
        design.gain_spread * tracking,
        np.abs(design.neglected.response(FREQUENCIES)) * tracking,
    )
    first, second = (fit_scale(np.sqrt(asked / feed)) for feed in feeds)
    return first, second


def fit_scale(magnitude: Array, order: int = SCALE_ORDER) -> LinearSystem:
    """Return a stable system with a stable inverse, of real roots, with this magnitude."""
    w, wanted = FREQUENCIES[FITTED], np.log(magnitude[FITTED])

    def found(q: Array) -> Array:
        zeros, poles = np.exp(q[1 : 1 + order]), np.exp(q[1 + order :])
        terms = np.log((w[:, None] ** 2 + zeros**2) / (w[:, None] ** 2 + poles**2))
        return np.asarray(q[0] + 0.5 * terms.sum(axis=1))

    start = np.log(np.geomspace(2.0, 60.0, order))
    guess = np.concatenate([[wanted[-1]], start + 0.1, start - 0.1])
    q = least_squares(lambda q: found(q) - wanted, guess, bounds=(-12.0, 12.0)).x
    top = np.exp(q[0]) * np.poly(-np.exp(q[1 : 1 + order]))
    return LinearSystem.from_polynomials(top, np.poly(-np.exp(q[1 + order :])))


def d_k_iteration(design: RobustDesign) -> tuple[LinearSystem, LinearSystem, list[float]]:
    """Return the H-infinity controller, that with the smallest ``mu``, and ``mu`` by round."""
    rounds: list[tuple[float, LinearSystem]] = []
    scales: Scales = None
    for _ in range(ROUNDS):
        controller = synthesise(design, scales)
        loop = loop_of(design, controller)
        rounds.append((float(design.structured_value(loop).max()), controller))
        scales = scales_for(design, loop)
    best = min(rounds, key=lambda made: made[0])
    return rounds[0][1], best[1], [value for value, _ in rounds]


def frozen(design: RobustDesign, controller: LinearSystem, order: int = ORDER) -> dict[str, Any]:
    """Return the numbers of a controller: full, reduced, discrete, and what they reach."""
    slowest, rest = split(without_fast(controller, FAST), INTEGRATOR)
    residue = float(slowest.c @ slowest.b)
    small, sizes = residualised(rest, order)
    reduced = with_integrator(residue, small)
    discrete = reduced.discrete(PERIOD)
    full_loop, loop = (loop_of(design, c) for c in (controller, reduced))
    return {
        "full": _numbers(controller),
        "reduced": _numbers(reduced),
        "discrete": _numbers(discrete),
        "hankel": sizes.tolist(),
        "mu_full": float(design.structured_value(full_loop).max()),
        "mu_reduced": float(design.structured_value(loop).max()),
        "mu_bound_ab13md": _bound(design, loop),
        "sensitivity": dict(
            zip(map(str, PROBES), np.interp(PROBES, FREQUENCIES, sensitivity(loop)), strict=True)
        ),
        "peak_sensitivity": float(sensitivity(loop).max()),
    }


def _bound(design: RobustDesign, loop: Complex) -> float:
    """Return SLICOT's upper bound of ``mu`` with a real gain."""
    from slycot import ab13md

    feeds = np.array(
        [np.full(len(loop), design.gain_spread), design.neglected.response(FREQUENCIES)]
    )
    rows = np.vstack(
        [-feeds * loop / (1.0 + loop), design.performance.response(FREQUENCIES) / (1.0 + loop)]
    )
    kinds, sizes = np.array([1, 2, 2]), np.ones(3, int)
    return max(float(ab13md(np.outer(row, np.ones(3)), sizes, kinds)[0]) for row in rows.T)


def _numbers(system: Any) -> dict[str, Any]:
    return {
        "a": system.a.tolist(),
        "b": system.b.tolist(),
        "c": system.c.tolist(),
        "d": float(system.d),
    }


def main() -> None:
    """Synthesise, freeze, and say what came out."""
    design = RobustDesign()
    hinf, mu, rounds = d_k_iteration(design)
    made = {
        "made_by": "python -m baselines.robust.synthesis",
        "digest": digest(),
        "versions": {name: version(name) for name in ("control", "slycot", "numpy", "scipy")},
        "period": PERIOD,
        "mu_by_round": rounds,
        "hinf": frozen(design, hinf),
        "mu": frozen(design, mu),
    }
    FILE.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")
    for kind in ("hinf", "mu"):
        shown = {k: v for k, v in made[kind].items() if k not in ("full", "reduced", "discrete")}
        print(kind, json.dumps(shown))
    print("mu by round", rounds)


if __name__ == "__main__":
    main()
