"""Feedback of tension in stance and of angle in swing, with a feedforward (yeh2010, section 4).

    stance   setpoint = forward(T_d) + K_T (T_d - T)
    swing    setpoint = forward(T_0) + K_theta (theta_d - theta)

``T_d`` is the reference tension, ``T_0`` the tension of zero wire torque on the knee. Both
controllers always run; the sensed load of the heel selects the active one. The off-line controller
receives the references of the environment (in swing a tension that may have an offset, in stance
the angle itself). With compensators each controller receives the applied command. Without them the
off-line controller integrates an error that it cannot affect, and the active one is clamped, so
that both forms differ only in the transfer. The brace alone is always in stance.

Design of both:

    nominal plant -> frequency response -> transfer function -> integrator -> LTR -> discrete

with a compensator for transfer between controllers and limited commands
(:mod:`baselines.linear.bumpless`). The bandwidths are those of yeh2010, section 4.1, read in
rad/s, where the regulator has no dead time: the paper's identified plant has none. A dead time, of
which an identified rational function is no model, limits the bandwidth to ``REACH`` over it, and
the compensators' models are behind it. The gains of the compensator are 0, which satisfies its
inequality for every stable plant. The setpoint changes no faster than the pressure can: the rate
limit is one of the command, which the compensators count, and not one of the plant, which would
oscillate. The designs are in kPa, as in the paper; the loops command Pa of deviation from a
feedforward.
"""

from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import Prediction, RowController, encode_action
from baselines.core.entry import AS_DESIGNED, GAIT, Bounds, Knobs, Spec
from baselines.knee.feedforward import FORWARD, Forward, Kind, make_forward
from baselines.knee.feedforward import KNOBS as PREVIEW_KNOBS
from baselines.knee.identification import Output, identify
from baselines.knee.nominal import Limits, set_point_limits
from baselines.knee.published import printed_bumpless, printed_controller
from baselines.linear.bumpless import Bumpless, BumplessGains, BumplessState, make_bumpless
from baselines.linear.ltr import LtrDesign, design_ltr
from baselines.linear.systems import StateSpace
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.parameters import Signal
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

KILO = 1e3
"""Pascals in the designs' unit of pressure."""
BANDWIDTHS: dict[Output, float] = {"tension": 26.2, "angle": 14.4}
"""Bandwidths of the target loops [rad/s]."""
REACH = 0.5
"""Largest bandwidth times dead time: a phase loss of 29 degrees."""
RECOVERY = {"lag": 1e-5, "measured": 1e-7}
"""Control weight over the squared static gain of the plant: recovers the bandwidth to a fifth, with
at most the high-frequency gain of the printed controller."""
KNOBS: Bounds = {"bandwidth": (0.2, 4.0), "recovery": (0.01, 100.0)}
"""Factors on the bandwidth of the target loop and on the control weight."""

_DESIGNS: dict[tuple[str, str, float, float], LtrDesign] = {}


def design(plant: KneeOrthosis, output: Output, knobs: Knobs = AS_DESIGNED) -> LtrDesign:
    """Return the design for an output of a nominal plant, identified about 2 bar."""
    usual = BANDWIDTHS[output]
    if plant.dead_time > 0.0:
        usual = min(usual, REACH / plant.dead_time)
    target = knobs.get("bandwidth", 1.0) * usual
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
    loop = make_bumpless(
        model, controller, plant.control_period, -full / KILO, full / KILO, gains, plant.dead_time
    )
    return replace(
        loop,
        controller=loop.controller.scaled(outputs=KILO),
        model=loop.model.scaled(inputs=1.0 / KILO),
        gains=replace(loop.gains, state_gain=KILO * loop.gains.state_gain),
        low=-full,
        high=full,
    )


class LtrState(NamedTuple):
    """States of the controllers (without a gait: tension only) and the feedforward's hysteresis."""

    tension: BumplessState
    angle: BumplessState | tuple[()]
    hysteresis: RowsState


@dataclass(frozen=True)
class KneeLtr(RowController):
    """Feedback of tension and, with a gait, of the angle, and feedforward; see the module."""

    tension: Bumpless
    angle: Bumpless | None
    forward: Forward
    action_signal: Signal
    within: Limits

    def initial_state(self, observation: ArrayLike) -> LtrState:
        """Return the state at rest, or holding the present setpoint."""
        view = self.forward.observer.read(observation)
        held = np.zeros_like(view.set_point)
        if self.forward.kind == "nominal":
            held = view.set_point - self.forward.pressure(view.reference, view.stretch, ())
        angle = () if self.angle is None else self.angle.holding_state(held)
        return LtrState(self.tension.holding_state(held), angle, self.forward.start(view.set_point))

    def respond(self, observation: ArrayLike, state: LtrState) -> Prediction:
        """Return the action and the next state."""
        view, forward = self.forward.observer.read(observation), self.forward
        reference, free = forward.tensions(view, observation)
        stance = forward.pressure(reference, view.stretch, state.hysteresis)
        tension = view.reference, view.tension
        low, high = self.within(view)
        command = stance + self.tension.output(*tension, state.tension, low - stance, high - stance)
        used, after = stance, state.angle
        if self.angle is not None and state.angle:
            path = view.angle_reference, view.angle
            swing = forward.pressure(free, view.stretch, state.hysteresis)
            swung = swing + self.angle.output(*path, state.angle, low - swing, high - swing)
            command = np.where(view.stance, command, swung)
            used = np.where(view.stance, stance, swing)
            after = self.angle.advance(*path, command - swing, state.angle, ~view.stance)
        held = self.tension.advance(*tension, command - stance, state.tension, view.stance)
        following = LtrState(held, after, forward.advance(used, state.hysteresis))
        return encode_action(self.action_signal, command, observation), following


def make_knee_ltr(
    spec: Spec[KneeOrthosis],
    forward: Kind = "inverse",
    bumpless: bool = True,
    printed: bool = False,
    preview: bool = False,
) -> KneeLtr:
    """Return the controller.

    ``bumpless``: whether the compensators are active; ``printed``: whether the tension controller
    is the printed one; ``preview``: whether the feedforward is previewed. The knobs of
    :data:`baselines.knee.ltr.KNOBS` are for the tension loop only.
    """
    plant, ahead = spec.plant, make_forward(spec, forward, preview)
    return KneeLtr(
        printed_loop(plant) if printed else make_loop(plant, "tension", bumpless, spec.knobs),
        make_loop(plant, "angle", bumpless) if ahead.observer.gait else None,
        ahead,
        spec.actions["pressure_set_point"],
        set_point_limits(spec),
    )


LTR = partial(FORWARD, feedback=True)
ENTRIES = {
    "knee_ltr": LTR(
        "loop transfer recovery on the identified plant, about 2 bar",
        make=partial(make_knee_ltr, forward="nominal"),
        citation="yeh2010; athans1986; zaccarian2002",
        knobs=KNOBS,
    ),
    "knee_line_ltr": LTR(
        "knee_ltr with knee_line as feedforward: the share of the gain due to feedforward",
        make=partial(make_knee_ltr, forward="line"),
        citation="athans1986; zaccarian2002",
        knobs=KNOBS,
    ),
    "knee_inverse_ltr": LTR(
        "knee_ltr and knee_inverse: the paper's control system, with compensator gains K = L = 0,"
        " which satisfy its matrix inequality for a stable plant",
        make=make_knee_ltr,
        citation="yeh2010; athans1986; zaccarian2002",
        knobs=KNOBS,
    ),
    "knee_inverse_ahead_ltr": LTR(
        "knee_inverse_ltr, its feedforward previewed by dead time and lag of the regulator",
        make=partial(make_knee_ltr, preview=True),
        preview=True,
        citation="yeh2010; athans1986; zaccarian2002",
        knobs={**KNOBS, **PREVIEW_KNOBS},
    ),
    "knee_inverse_ltr_bumpy": LTR(
        "knee_inverse_ltr without compensators: each loop integrates off-line, clamped in charge",
        make=partial(make_knee_ltr, bumpless=False),
        citation="yeh2010; athans1986",
        envs=GAIT,
    ),
    "knee_printed": LTR(
        "knee_inverse_ltr with the printed tension controller (11) and compensator; for"
        ' dynamics="measured" (1.1 % on its sine), limit cycles on plants with a regulator lag',
        make=partial(make_knee_ltr, printed=True),
        citation="yeh2010",
    ),
}
