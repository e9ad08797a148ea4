"""Test of a rig's hysteresis: Everett map, symmetry, congruency and wiping out, with a verdict.

fluidic_muscles (section 3.2) drives the joint along the ascending branch, turns at chosen setpoints
and lets it fall to negative saturation: first-order descending curves, which give the Everett map
``E(alpha, beta) = f_alpha - f_alphabeta`` (3.2). The printed rule for the other half, ``f_alphabeta
= -f_betaalpha``, is wrong; the correct rule is ``E(beta, alpha) = -E(alpha, beta)``.

- *symmetry*, ``mu(a, b) = mu(-b, -a)``: the descending branches are the ascending ones turned by
  half a turn. Two equal antagonistic muscles are symmetric, a single muscle is not.
- *congruency*: loops between the same two inputs are equal, whatever their history.
- *wiping out*: a closed loop returns to where it began.

The last two are necessary and sufficient for a Preisach operator (I. D. Mayergoyz, "Mathematical
Models of Hysteresis", Springer 1991, section 1.2).

The printed inverse (3.5) sums over an inverted Everett map,

    u = u_min + sum_i G(F_(i+1), F_i) + G(f, F_k),   G(f_alpha, f_alphabeta) = u_alpha - u_beta

with ``F_i`` the past extrema of the output. ``G`` is read from first-order curves: the sum is exact
up to the first turn, and after two turns only for a map that depends on ``alpha - beta`` alone. The
exact inverse is :meth:`~pam_envs.hysteresis.preisach.Preisach.inverse_step`;
:func:`series_inverse` serves as a comparison.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from pam_envs.arrays import Array
from pam_envs.hysteresis import everett as maps
from pam_envs.hysteresis.everett import everett
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.identification import preisach_forc as forc

Rig = Callable[[Array], Array]
"""From a series of inputs, shape (T,), to the outputs at rest after each, shape (T,)."""

SYMMETRY, CONGRUENCY, WIPING_OUT = 0.03, 0.1, 0.03
"""Largest errors with which a hysteresis counts as a symmetric Preisach operator."""
LOOPS = ((-1.0, 0.0), (-0.5, 0.5), (0.0, 1.0), (-0.25, 0.25))
"""Ends of the minor loops that are compared, shares of 70 % of the half-range."""
INSIDE = 0.7


@dataclass(frozen=True)
class JointHysteresis:
    """Result of the test."""

    # operator of the map; a symmetric map is made exactly symmetric, and the operator starts
    # virgin, any other map is used as measured, and the operator starts at the low end
    model: Preisach
    symmetry: float  # largest abs(E(a, b) - E(-b, -a)) over the largest entry of the map
    congruency: float  # largest difference of two loops of the same inputs, over a loop's height
    wiping_out: float  # largest distance of a closed loop's end from its beginning, over its height
    clipped: float  # weight of the relays that came out negative, as a part of all weight

    @property
    def symmetric(self) -> bool:
        """True if the map counts as symmetric."""
        return self.symmetry <= SYMMETRY

    @property
    def preisach(self) -> bool:
        """True if congruency and wiping out allow a Preisach operator."""
        return self.congruency <= CONGRUENCY and self.wiping_out <= WIPING_OUT

    @property
    def verdict(self) -> str:
        """Result in a sentence, with a remedy."""
        found = (
            f"symmetry {self.symmetry:.3f} (bound {SYMMETRY:g}), congruency {self.congruency:.3f}"
            f" (bound {CONGRUENCY:g}), wiping out {self.wiping_out:.3f} (bound {WIPING_OUT:g})"
        )
        if not self.preisach:
            return f"fails as a Preisach operator: {found}; its minor loops need another model"
        if not self.symmetric:
            return f"fails the symmetry: {found}; use the map as measured, from the low end only"
        return f"passes as a symmetric Preisach operator: {found}"

    @property
    def gain(self) -> float:
        """Output over input between the tips of the major loop."""
        return float(self.model.everett[-1, 0]) / (self.model.high - self.model.low)


def measure_joint(rig: Rig, amplitude: float, levels: int = 21) -> JointHysteresis:
    """Return the hysteresis of a joint between ``-amplitude`` and ``amplitude`` [rad]."""
    return measure_hysteresis(rig, -amplitude, amplitude, levels)


def measure_hysteresis(rig: Rig, low: float, high: float, levels: int = 21) -> JointHysteresis:
    """Return the hysteresis of a rig between two inputs, in units of its input and output.

    ``rig`` maps inputs to outputs, shape (T,), and begins every call in its own start state;
    ``levels`` are those of the grid. A ValueError says that the range is empty, or that the rig
    does not return one finite number an input.
    """
    if not low < high or levels < 3:
        raise ValueError(
            f"low is {low}, high {high} and levels {levels}; low must be below high and levels at"
            " least 3: widen the range"
        )
    up = np.linspace(low, high, levels)  # the major loop, then the first-order curves
    sweep = np.concatenate([up, up[-2::-1], forc.curve_inputs(low, high, levels)[1:]])
    outputs = _answers(rig, sweep)
    curves = forc.descending_curves(sweep, outputs)
    first = float(outputs[2 * (levels - 1)])
    fit = forc.preisach_from_curves(curves, low, high, levels, start_output=first)
    symmetry = maps.symmetry_error(fit.model.everett)
    congruency, wiping_out = _loops(rig, low, high, levels)
    model = symmetrised(fit.model) if symmetry <= SYMMETRY else fit.model
    return JointHysteresis(model, symmetry, congruency, wiping_out, fit.clipped)


def symmetrised(model: Preisach) -> Preisach:
    """Return the operator with the mean weights of mirrored relays, from mid-range, virgin."""
    weights = model.weights
    mean = np.tril(0.5 * (weights + weights[::-1, ::-1].T))
    half = 0.5 * (model.high - model.low)
    return Preisach.from_weights(mean, -half, half, model.depth, "virgin")


def _answers(rig: Rig, inputs: Array) -> Array:
    outputs = np.asarray(rig(inputs), float)
    if outputs.shape != inputs.shape or not np.all(np.isfinite(outputs)):
        raise ValueError(
            f"the rig returned outputs of shape {outputs.shape} for inputs of {inputs.shape}; it "
            "must give one finite number for each: let it settle after every input"
        )
    return outputs


def _loops(rig: Rig, low: float, high: float, levels: int) -> tuple[float, float]:
    """Return the errors of congruency and wiping out over minor loops."""
    middle, half, cell = 0.5 * (low + high), 0.5 * INSIDE * (high - low), (high - low) / levels
    congruency, wiping_out = 0.0, 0.0
    for ends in LOOPS:
        a, b = (middle + half * end for end in ends)
        records = [_loop(rig, path, cell) for path in ((low, b, a, b, a), (low, high, a, b, a))]
        congruency = max(congruency, forc.congruency_error(records))
        for _, outputs in records:
            wiping_out = max(wiping_out, abs(outputs[-1] - outputs[0]) / float(np.ptp(outputs)))
    return congruency, wiping_out


def _loop(rig: Rig, turns: tuple[float, ...], cell: float) -> tuple[Array, Array]:
    """Return the last two legs of a path through turns."""
    legs = [np.linspace(a, b, 2 + round(abs(b - a) / cell))[1:] for a, b in pairwise(turns)]
    inputs = np.concatenate([[turns[0]], *legs])
    outputs = _answers(rig, inputs)
    kept = len(legs[-1]) + len(legs[-2]) + 1
    return inputs[-kept:], outputs[-kept:]


def series_inverse(model: Preisach, outputs: ArrayLike) -> Array:
    """Return the inputs (T,) that (3.5) gives for outputs (T,) of a model that starts low."""
    if model.start != "low":
        raise ValueError(f"start is {model.start!r}; (3.5) counts from u_min: use start='low'")
    stack, found = [model.start_output], []
    for f in np.asarray(outputs, float):
        stack = _dominant(stack, float(f))
        steps = pairwise(stack)
        found.append(model.low + sum(_difference(model, late, early) for early, late in steps))
    return np.array(found)


def _dominant(stack: list[float], f: float) -> list[float]:
    """Return the extrema that an output leaves, and itself at the end."""
    kept = list(stack)
    while len(kept) > 1:
        last, before = kept[-1], kept[-2]
        if (f - last) * (last - before) >= 0.0:  # onward
            kept.pop()
        elif len(kept) > 2 and (f - before) * (before - last) >= 0.0:  # a closed loop
            kept = kept[:-2]
        else:
            break
    return [*kept, f]


def _difference(model: Preisach, late: float, early: float) -> float:
    """Return ``G``: on the first-order curve that turns at the larger output."""
    if late == early:
        return 0.0
    high, low = max(late, early), min(late, early)
    alpha = _root(model, lambda u: _map(model, u, model.low) + model.start_output - high)
    beta = _root(model, lambda u: high - low - _map(model, alpha, u))
    return (alpha - beta) if late > early else (beta - alpha)


def _map(model: Preisach, a: float, b: float) -> float:
    cells = model.inverse_cell
    return float(everett((a - model.low) * cells, (b - model.low) * cells, model.everett))


def _root(model: Preisach, function: Callable[[float], float]) -> float:
    """Return where a rising function crosses 0, or the nearer end of the range."""
    low, high = function(model.low), function(model.high)
    if low >= 0.0 or high <= 0.0:
        return model.low if low >= 0.0 else model.high
    return float(brentq(function, model.low, model.high, xtol=1e-15, rtol=1e-15))
