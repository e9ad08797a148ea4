"""Feedback of the knee's tension and angle by loop transfer recovery on a nominal plant.

    nominal plant -> frequency response -> transfer function -> integrator -> LTR -> discrete

with a compensator for transfer between controllers and limited commands
(:mod:`baselines.linear.bumpless`). The bandwidths are those of yeh2010, section 4.1, read in
rad/s. The gains of the compensator are 0, which satisfies its inequality for every stable plant.

The designs are in kPa, as in the paper; the loops command Pa of deviation from a feedforward.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from baselines.core.entry import AS_DESIGNED, Bounds, Knobs
from baselines.knee.identification import Output, identify
from baselines.knee.published import printed_bumpless, printed_controller
from baselines.linear.bumpless import Bumpless, BumplessGains, make_bumpless
from baselines.linear.ltr import LtrDesign, design_ltr
from baselines.linear.systems import StateSpace
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

KILO = 1e3
"""Pascals in the designs' unit of pressure."""
BANDWIDTHS: dict[Output, float] = {"tension": 26.2, "angle": 14.4}
"""Bandwidths of the target loops [rad/s]."""
RECOVERY = {"lag": 1e-5, "measured": 1e-7}
"""Control weight over the squared static gain of the plant: recovers the bandwidth to a fifth, with
at most the high-frequency gain of the printed controller."""
KNOBS: Bounds = {"bandwidth": (0.4, 4.0), "recovery": (0.1, 10.0)}
"""Factors on the bandwidth of the target loop and on the control weight."""

_DESIGNS: dict[tuple[str, str, float, float], LtrDesign] = {}


def design(plant: KneeOrthosis, output: Output, knobs: Knobs = AS_DESIGNED) -> LtrDesign:
    """Return the design for an output of a nominal plant, identified about 2 bar."""
    target = knobs.get("bandwidth", 1.0) * BANDWIDTHS[output]
    recovery = knobs.get("recovery", 1.0)
    key = (plant.digest(), output, target, recovery)
    if key not in _DESIGNS:
        fit = identify(plant, output)
        weight = recovery * RECOVERY[plant.dynamics] * fit.static_gain**2
        _DESIGNS[key] = design_ltr(fit, target, weight)
    return _DESIGNS[key]


def make_loop(
    plant: KneeOrthosis, output: Output, bumpless: bool = True, knobs: Knobs = AS_DESIGNED
) -> Bumpless:
    """Return the designed feedback of an output [Pa]; ``bumpless=False`` clamps instead."""
    made = design(plant, output, knobs)
    gains = BumplessGains(np.zeros(made.plant.nstates))
    loop = _in_pascals(plant, made.plant, made.controller, gains)
    return loop if bumpless else loop.without()


def printed_loop(plant: KneeOrthosis) -> Bumpless:
    """Return the printed tension controller with the printed compensator, for any plant [Pa]."""
    model, gains = printed_bumpless()
    return _in_pascals(plant, model, printed_controller(), gains)


def _in_pascals(
    plant: KneeOrthosis, model: StateSpace, controller: StateSpace, gains: BumplessGains
) -> Bumpless:
    """Return a loop whose commands are in Pa, from a design in kPa."""
    full = plant.regulator.max_pressure
    loop = make_bumpless(model, controller, plant.control_period, -full / KILO, full / KILO, gains)
    return replace(
        loop,
        controller=loop.controller.scaled(outputs=KILO),
        model=loop.model.scaled(inputs=1.0 / KILO),
        gains=replace(loop.gains, state_gain=KILO * loop.gains.state_gain),
        low=-full,
        high=full,
    )
