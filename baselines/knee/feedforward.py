"""Feedforward control of the knee from a reference tension to a pressure.

The reference tension over the measured stretch of the muscle is the reference stiffness (yeh2010,
section 4.1). Its pressure comes from the inverse of the identified hysteresis ("inverse"), from the
straight line between the tips of its loop ("line"), or is the nominal pressure ("nominal"). The
inverse is static, as in yeh2010, without the regulator's dead time and lag; with a preview it
tracks the reference stiffness ahead by both.

In stance, and with the brace alone, the reference tension is tracked; in swing the tension cancels
the wire's torque on the knee.
"""

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from baselines.core.controller import (
    Prediction,
    Reader,
    RowController,
    encode_action,
    preview_names,
    preview_weights,
    reader,
)
from baselines.core.entry import GAIT, KNEE, Bounds, Entry, Spec
from baselines.knee.nominal import KneeObserver, KneeView, make_knee_observer
from baselines.knee.published import NOMINAL_PRESSURE
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.parameters import Signal
from pam_envs.plants.knee_orthosis.plant import KneeOrthosis

Kind = Literal["nominal", "line", "inverse"]
KNOBS: Bounds = {"lead": (0.05, 4.0)}


@dataclass(frozen=True)
class Forward:
    """Feedforward, its reference previewed or present; its state is the nominal hysteresis.

    With a preview it holds readers of the references with their previews (of the angle only in gait
    environments), and the weights of their samples.
    """

    kind: Kind
    observer: KneeObserver
    tension: Reader | None = None
    angle: Reader | None = None
    weights: Array | None = None

    def tensions(self, view: KneeView, observation: ArrayLike) -> tuple[Array, Array]:
        """Return the reference tension, and that of zero wire torque on the knee [N].

        With a preview both are those of the stiffness [N/m] interpolated at the later time.
        """
        nominal = self.observer.nominal
        free = nominal.free_tension(view.angle)
        if self.tension is None or self.weights is None:
            return view.reference, free
        samples, weights = self.tension.rows(observation), self.weights[:, None]
        angles = None if self.angle is None else self.angle.rows(observation)
        if angles is not None:
            later = nominal.free_tension(angles) / nominal.stretch(angles)
            free = np.add.reduce(weights * later, axis=0) * view.stretch
        if not self.observer.stiffness:
            planned = nominal.angle_of(samples) if angles is None else angles
            samples = samples / nominal.stretch(planned)
        return np.add.reduce(weights * samples, axis=0) * view.stretch, free

    def start(self, pressure: Array) -> RowsState:
        """Return the state after inflation to a pressure [Pa], shape (n_env,)."""
        return self.observer.nominal.inflated(pressure) if self.kind == "inverse" else ()

    def pressure(self, tension: Array, stretch: Array, state: RowsState) -> Array:
        """Return the pressure [Pa], within the capacity, for a tension [N] at a stretch [m]."""
        if self.kind == "nominal":
            return np.full_like(tension, NOMINAL_PRESSURE)
        nominal, stiffness = self.observer.nominal, np.maximum(0.0, tension) / stretch
        if self.kind == "inverse":
            return nominal.pressure_for(stiffness, state)
        return np.minimum(nominal.line(stiffness), nominal.full_pressure)

    def advance(self, pressure: Array, state: RowsState) -> RowsState:
        """Return the state after a pressure [Pa] of this feedforward."""
        return self.observer.nominal.advance(pressure, state) if self.kind == "inverse" else state


def make_forward(spec: Spec[KneeOrthosis], kind: Kind, preview: bool) -> Forward:
    """Return the feedforward; a preview is by dead time, lag and half a control period."""
    observer, signals = make_knee_observer(spec), spec.signals
    if not preview:
        return Forward(kind, observer)
    names = preview_names("reference", signals)
    law = spec.plant.regulator
    delay = law.dead_time + law.time_constant + 0.5 * spec.plant.control_period
    times = [signals[name].ahead for name in names]
    return Forward(
        kind,
        observer,
        reader(signals, names),
        reader(signals, preview_names("angle_reference", signals)) if observer.gait else None,
        preview_weights(times, spec.knob("lead") * delay),
    )


@dataclass(frozen=True)
class KneeForward(RowController):
    """Feedforward control; see the module.

    ``assist``: whether the reference is tracked in stance; otherwise the wire's torque is
    cancelled throughout, so that the orthosis neither assists nor resists.
    """

    forward: Forward
    action_signal: Signal
    assist: bool

    def initial_state(self, observation: ArrayLike) -> RowsState:
        """Return the state after inflation to the present setpoint."""
        return self.forward.start(self.forward.observer.read(observation).set_point)

    def respond(self, observation: ArrayLike, state: RowsState) -> Prediction:
        """Return the action and the next state."""
        view = self.forward.observer.read(observation)
        reference, free = self.forward.tensions(view, observation)
        tension = np.where(view.stance & self.assist, reference, free)
        pressure = self.forward.pressure(tension, view.stretch, state)
        after = self.forward.advance(pressure, state)
        return encode_action(self.action_signal, pressure, observation), after


def make_knee_forward(
    spec: Spec[KneeOrthosis], kind: Kind = "inverse", assist: bool = True, preview: bool = False
) -> KneeForward:
    """Return the controller; ``preview``: whether the reference is previewed."""
    signal = spec.actions["pressure_set_point"]
    return KneeForward(make_forward(spec, kind, preview), signal, assist)


FORWARD = partial(Entry, knowledge="nominal model", envs=KNEE, plants=(KneeOrthosis,))
ENTRIES = {
    "knee_free": FORWARD(
        "inverse for zero torque on the knee: neither assistance nor resistance",
        make=partial(make_knee_forward, assist=False),
        citation="yeh2010",
        envs=GAIT,
    ),
    "knee_line": FORWARD(
        "straight line between the tips of the loop: hysteresis ignored",
        make=partial(make_knee_forward, kind="line"),
    ),
    "knee_inverse": FORWARD(
        "inverse of the hysteresis at the present reference, as in the paper",
        make=make_knee_forward,
        citation="yeh2010",
    ),
    "knee_inverse_ahead": FORWARD(
        "knee_inverse at the reference previewed by dead time and lag of the regulator",
        make=partial(make_knee_forward, preview=True),
        preview=True,
        citation="yeh2010",
        knobs=KNOBS,
    ),
}
