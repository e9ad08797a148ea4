"""Design of the next experiment: the one of a list that best separates the fitted rivals.

The separation of two rivals in an experiment is the difference of their predicted readings that a
refit of either one's own parameters to the new data cannot remove.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.diagnosis.cause import Cause
from pam_envs.diagnosis.fit.least_squares import Fit, column_of, shifted
from pam_envs.diagnosis.plant_protocol import Experiment, Simulated

ENOUGH = 1.0
"""Least mean squared difference of the rivals, in noise variances, of a useful experiment."""
RANK = 1e-6  # relative size of the directions of a rival's parameters that count


@dataclass(frozen=True)
class Rival:
    """A fitted model with its sensitivity to its own parameters."""

    names: tuple[str, ...]
    columns: Array  # (1 + k, p): its parameters, then with one of those of its causes perturbed

    @property
    def label(self) -> str:
        """Name in the report."""
        return "+".join(self.names)


def rival_of(names: tuple[str, ...], fit: Fit, base: int, tie: Callable[[Array], None]) -> Rival:
    """Return the rival of a fit, whose own parameters follow the first ``base`` ones."""
    places = [fit.z, *(shifted(fit, k)[0] for k in range(base, len(fit.z)))]
    columns = np.array([column_of(fit, z) for z in places])
    tie(columns)
    return Rival(names, columns)


def _over_noise(outputs: Array, noise: Array) -> Array:
    """Return outputs (channels, T, n) over the noise, shape (n, channels * T).

    Means are removed: a constant offset disappears when the sensors are zeroed again.
    """
    flat = (outputs - outputs.mean(axis=1, keepdims=True)) / noise[:, None, None]
    return np.asarray(flat.transpose(2, 0, 1).reshape(outputs.shape[2], -1))


def separations(bound: Simulated, rivals: Sequence[Rival], noise: Array) -> list[float]:
    """Return the separation of the first rival from each other one in an experiment.

    Mean squares in noise variances, summed over the outputs: the difference that remains after one
    of the two is refitted to the other, the smaller of both directions. ``noise`` (channels,) is
    the RMS noise of the sensors [SI], infinite for a channel without a sensor.
    """
    columns = np.vstack([r.columns for r in rivals])
    outputs = bound.simulate(columns)
    found = _over_noise(outputs, noise)
    samples, traces, at = outputs.shape[1], [], 0
    for rival in rivals:
        end = at + len(rival.columns)
        traces.append((found[at], found[at + 1 : end] - found[at]))
        at = end
    (here, moves), *others = traces
    return [
        min(_left(here - there, own) for own in (moves, theirs)) / samples
        for there, theirs in others
    ]


def _left(difference: Array, moves: Array) -> float:
    """Return the sum of squares of a difference outside the span of parameter perturbations."""
    sizes = np.linalg.norm(moves, axis=1)
    moves = moves[sizes > 0.0] / sizes[sizes > 0.0, None]
    if len(moves):
        values, vectors = np.linalg.eigh(moves @ moves.T)
        keep = values > RANK * values[-1]
        basis = (vectors[:, keep].T @ moves) / np.sqrt(values[keep])[:, None]
        difference = difference - (basis @ difference) @ basis
    return float(difference @ difference)


def propose(
    plans: Sequence[Experiment],
    first: Rival,
    seconds: Sequence[Rival],
    noise: Array,
    causes: Sequence[Cause],
) -> dict[str, Any]:
    """Return the experiment with the largest separation of a model from its nearest rival."""
    rivals = (first, *seconds)
    scored = [(separations(p.bound, rivals, noise), p) for p in plans]
    apart, plan = max(scored, key=lambda pair: min(pair[0]))
    least = min(apart)
    nearest = seconds[int(np.argmin(apart))]
    return {
        "between": [r.label for r in rivals],
        "name": plan.name,
        "description": plan.description
        if least >= ENOUGH
        else f"no experiment of the list separates {first.label} from {nearest.label}; a further "
        "sensor would",
        "segments": plan.segments,
        "separation": least,
        "enough": bool(least >= ENOUGH),
        "sensor": sensors_for(rivals, causes),
    }


def sensors_for(rivals: Sequence[Rival], causes: Sequence[Cause]) -> str:
    """Return the sensors that would directly measure causes not common to all rivals."""
    by_name = {c.name: c for c in causes}
    names = dict.fromkeys(n for r in rivals for n in r.names)
    differing = [n for n in names if not all(n in r.names for r in rivals)]
    found = [by_name[n].sensor for n in differing if n in by_name and by_name[n].sensor]
    return "; ".join(dict.fromkeys(found))
