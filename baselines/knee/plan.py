"""Phase of a wearer: how early or late he is in the previewed stride.

The environments preview the *planned* stride, which repeats; the wearer is early or late by a few
per cent of it.

The shift between plan and wearer is estimated by a histogram filter (thrun2005): probabilities of
shifts on a grid spread from period to period and are multiplied by the likelihood of what is
observed: swing or stance, in swing the path of the knee, in stance the torque and the angle less
the predicted deviation. The torque has an unknown scale, since the wearer may be heavier or lighter
than planned: a second axis of the grid. A linearised filter diverges where path or torque have a
turning point.

Times are in control periods from the start of the episode.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from baselines.core.controller import Rows
from baselines.predictive.preview import Preview, PreviewMemory
from pam_envs.arrays import Array

RANGE = 3.0
"""Largest shift over its standard deviation."""
DRIFT = 0.2
"""Share of a probability that moves to each neighbour in a period."""
SCALES = np.linspace(0.75, 1.25, 11)
"""Grid of the wearer's torque over the planned one: another body mass."""
SCALE_SPREAD = 0.1
"""Standard deviation of that ratio."""
FLOOR = 1e-4
"""Share of the prior in every period: the filter recovers from a wrong estimate."""
OUTLIER = 0.02
"""Likelihood of an observation that no shift explains, over that of a fitting one."""
NEAR = 3
"""Grid points on both sides of the most likely shift whose mean is the estimate."""


class Plan(NamedTuple):
    """Previewed samples, shift of the wearer [periods], and probabilities on the grid.

    The shift has the shape (n_env,), the probabilities (n_env, n_scales, n_shifts).
    """

    seen: Preview
    shift: Array
    chances: Array


@dataclass(frozen=True)
class PhaseFilter:
    """Filter of the shift; ``spread`` is its standard deviation between strides [periods]."""

    memory: PreviewMemory
    spread: float

    def start(self, samples: Array) -> Plan:
        """Return the plan before :meth:`add` of first samples."""
        n = len(samples)
        chances = np.repeat(self.prior[None], n, axis=0)
        return Plan(self.memory.start(samples), np.zeros(n), chances)

    def add(self, plan: Plan, samples: Array) -> Plan:
        """Return the plan one period later, with its previewed samples."""
        return plan._replace(seen=self.memory.add(plan.seen, samples))

    def present(self, plan: Plan) -> Array:
        """Return the wearer's time in the plan [control periods], shape (n_env,)."""
        return np.asarray(plan.seen.step + plan.shift)

    def read(self, plan: Plan, ends: Array) -> tuple[Array, Rows]:
        """Return the samples of the wearer after ``ends`` periods, shape (n_env, n_times).

        See :meth:`PreviewMemory.read`.
        """
        return self.memory.read(plan.seen, self.present(plan)[:, None] + ends)

    @cached_property
    def shifts(self) -> Array:
        """Grid of shifts, one a period, shape (n_shifts,)."""
        most = math.ceil(RANGE * self.spread)
        return np.arange(-most, most + 1.0)

    @cached_property
    def prior(self) -> Array:
        """Probabilities without observations, shape (n_scales, n_shifts)."""
        shift = np.exp(-0.5 * (self.shifts / max(self.spread, 0.1)) ** 2)
        scale = np.exp(-0.5 * ((SCALES - 1.0) / SCALE_SPREAD) ** 2)
        made = scale[:, None] * shift
        return np.asarray(made / made.sum())

    def follow(self, plan: Plan, likelihood: Callable[[Array], Array]) -> Plan:
        """Return the plan with its shift corrected by an observation.

        ``likelihood`` returns those of planned samples, shape (n_env, n_channels, n_shifts), over
        that of a perfect fit: shape (n_env, n_scales, n_shifts).
        """
        old = plan.chances
        wide = np.concatenate([old[..., :1], old, old[..., -1:]], axis=-1)
        chances = old + DRIFT * (wide[..., 2:] + wide[..., :-2] - 2.0 * old)
        samples, known = self.memory.read(plan.seen, plan.seen.step[:, None] + self.shifts)
        fits = OUTLIER + (1.0 - OUTLIER) * likelihood(samples)
        known = np.broadcast_to(known[:, None], fits.shape)
        sure = np.where(known, chances, 0.0)
        usual = _total(sure * fits) / np.maximum(_total(sure), 1e-30)
        chances = chances * np.where(known, fits, usual)
        chances = (1.0 - FLOOR) * chances / _total(chances) + FLOOR * self.prior
        marginal = np.add.reduce(chances, axis=1)
        best = np.argmax(marginal, axis=1)
        near = np.abs(np.arange(len(self.shifts)) - best[:, None]) <= NEAR
        weight = np.where(near, marginal, 0.0)
        shift = np.add.reduce(weight * self.shifts, axis=1) / np.add.reduce(weight, axis=1)
        return plan._replace(shift=shift, chances=chances)


def _total(chances: Array) -> Array:
    """Return the sum over the grid, shape (n_env, 1, 1)."""
    return np.asarray(np.add.reduce(chances, axis=(1, 2), keepdims=True))
