"""Feedback of the knee's tension and angle by loop transfer recovery on a nominal plant.

    nominal plant -> frequency response -> transfer function -> integrator -> LTR -> discrete

with a compensator that keeps a controller settled while it is off-line or its command is limited
(:mod:`baselines.linear.bumpless`). The bandwidths are those of yeh2010, section 4.1, read in
rad/s. The compensator's gains are 0, which satisfies its matrix inequality for every stable plant:
the fictitious loop does the work.

All controllers answer in kPa of deviation from a feed-forward, as in the paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Array
from baselines.core.knobs import AS_DESIGNED, Bounds, Knobs, knob
from baselines.knee.identification import Output, identify
from baselines.knee.published import printed_bumpless, printed_controller
from baselines.linear.bumpless import Bumpless, BumplessGains, BumplessState, make_bumpless
from baselines.linear.ltr import LtrDesign, design_ltr
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

KILO = 1e3
"""Pascals in the controllers' unit of pressure."""
BANDWIDTHS: dict[Output, float] = {"tension": 26.2, "angle": 14.4}
"""Of the target loops [rad/s]."""
RECOVERY = {"lag": 1e-5, "measured": 1e-7}
"""Control weight over the plant's static gain squared: recovers the bandwidth to a fifth, with no
more gain at high frequencies than the printed controller."""
KNOBS: Bounds = {"bandwidth": (0.4, 4.0), "recovery": (0.1, 10.0)}
"""On the target loop's bandwidth and on the control weight, which recovers it the less."""

_DESIGNS: dict[tuple[str, str, float, float], LtrDesign] = {}


def design(
    plant: KneeOrthosis,
    output: Output,
    bandwidth: float | None = None,
    knobs: Knobs = AS_DESIGNED,
) -> LtrDesign:
    """Return the design for an output of a nominal plant.

    Parameters
    ----------
    plant : KneeOrthosis
        It is identified about 2 bar, mounted as :mod:`baselines.knee.identification` says.
    output : {"tension", "angle"}
    bandwidth : float, optional
        Of the target loop [rad/s]; the paper's if not given.
    knobs : mapping
        Of ``KNOBS``.
    """
    wanted = knob(knobs, "bandwidth") * (bandwidth or BANDWIDTHS[output])
    key = (plant.digest(), output, wanted, knob(knobs, "recovery"))
    if key not in _DESIGNS:
        fit = identify(plant, output)
        weight = knob(knobs, "recovery") * RECOVERY[plant.dynamics] * fit.static_gain**2
        _DESIGNS[key] = design_ltr(fit, wanted, weight)
    return _DESIGNS[key]


@dataclass(frozen=True)
class Loop:
    """A controller with its compensator, in Pa.

    Attributes
    ----------
    bumpless : Bumpless
        In kPa.
    """

    bumpless: Bumpless

    @cached_property
    def _integral(self) -> Array:
        """State of the controller, shape (n,), that holds 1 kPa without any error."""
        system = self.bumpless.controller
        _, _, rows = np.linalg.svd(system.a - np.eye(len(system.b)))
        return np.asarray(rows[-1] / (rows[-1] @ system.c))

    def start(self, command: Array) -> BumplessState:
        """Return the state that holds a command [Pa], shape (n_env,)."""
        rest = self.bumpless.initial_state(len(command))
        return rest._replace(controller=np.multiply.outer(command / KILO, self._integral))

    def output(
        self, wanted: Array, measured: Array, state: BumplessState, low: Array, high: Array
    ) -> Array:
        """Return the command [Pa] between limits [Pa], all of shape (n_env,)."""
        made = self.bumpless.output(wanted, measured, state, low / KILO, high / KILO)
        return np.asarray(KILO * made)

    def advance(
        self,
        wanted: Array,
        measured: Array,
        applied: Array,
        state: BumplessState,
        in_charge: ArrayLike = False,
    ) -> BumplessState:
        """Return the state after a period in which a command [Pa], its own or not, acted."""
        return self.bumpless.advance(wanted, measured, applied / KILO, state, in_charge)


def make_loop(
    plant: KneeOrthosis, output: Output, bumpless: bool = True, knobs: Knobs = AS_DESIGNED
) -> Loop:
    """Return the designed feedback of an output; ``bumpless=False`` has clamping instead."""
    made = design(plant, output, knobs=knobs)
    order = made.plant.order
    whole = make_bumpless(
        made.plant, made.controller, plant.control_period, *_limits(plant),
        BumplessGains(np.zeros(order)),
    )  # fmt: skip
    return Loop(whole if bumpless else whole.without())


def printed_loop(plant: KneeOrthosis) -> Loop:
    """Return the printed tension controller with the printed compensator, whatever the plant."""
    model, gains = printed_bumpless()
    made = make_bumpless(
        model, printed_controller(), plant.control_period, *_limits(plant), gains
    )  # fmt: skip
    return Loop(made)


def _limits(plant: KneeOrthosis) -> tuple[float, float]:
    full = plant.regulator.max_pressure / KILO
    return -full, full
