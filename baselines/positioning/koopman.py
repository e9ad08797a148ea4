"""Predictive control of the muscle with a learned linear model (Koopman operator, EDMD).

Measured contraction and pressure, their last values and the setpoints of one dead time, lifted by
products, form a state that evolves almost linearly (extended dynamic mode decomposition,
williams2015; korda2018):

    z = [x, x_-, p, p_-, u_-1 .. u_-m, x^2, p^2, x p],    z_+ = A z + B u

A and B are least squares on recorded data: here of random steps of the nominal muscle, at each
measured load; the same code takes records of a rig. The lifting follows the measurement in every
period. The controller is the linear predictive one (:mod:`baselines.predictive.linear`).

Hysteresis is no function of this state. What the model misses is a disturbance at the output: the
difference of the contraction from its prediction ``LOOK`` periods before, filtered, is subtracted
from the reference, so that a constant reference is reached.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import (
    Prediction,
    Reader,
    RowController,
    by_load,
    encode_action,
    preview_names,
    reader,
)
from baselines.core.entry import Bounds, Entry, Spec
from baselines.positioning.contraction_tables import LOADS
from baselines.predictive.linear import LinearPredictor, linear_predictor
from baselines.predictive.preview import Preview, PreviewMemory
from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.parameters import Signal
from pam_envs.plants.single_muscle.plant import SingleMuscle
from pam_envs.plants.single_muscle.rollout import simulate

HORIZON = 30
"""Control periods."""
WEIGHT = 0.05
"""Weight of a squared change of 1 bar over a squared error of 1 mm."""
LOOK = 14
"""Periods of the prediction that shows the disturbance: dead time and two lags."""
SHARE = 0.1
"""Share of the difference that enters the disturbance in a period."""
PERIODS, RECORDS = 1200, 16
"""Length and number of the records of one load."""
RIDGE = 1e-8
"""Regularisation over the mean square of the data."""
KNOBS: Bounds = {"weight": (0.05, 20.0), "disturbance": (0.25, 4.0)}


@dataclass(frozen=True)
class LiftedModel:
    """Identified model at one load, in mm and bar.

    ``z_+ - centre = a (z - centre) + b (u - level)``.
    """

    a: Array
    b: Array
    centre: Array
    level: float


def lift(contraction: Array, pressure: Array, past: Array) -> Array:
    """Return the lifted states, shape (..., n).

    Contraction [mm] and pressure [bar] with their last values, shapes (..., 2), and the last
    setpoints [bar], newest first, (..., m).
    """
    x, p = contraction[..., :1], pressure[..., :1]
    return np.concatenate([contraction, pressure, past, x * x, p * p, x * p], axis=-1)


def identify(contraction: Array, pressure: Array, set_points: Array, past: int) -> LiftedModel:
    """Return the model of records [mm], [bar], [bar], shape (T, n): least squares with a ridge.

    ``set_points[t]`` acts from the measurement ``t`` on; ``past`` is the number of setpoints m.
    """
    at = np.arange(past, len(set_points) - 1, dtype=np.int64)

    def lifted(at: NDArray[np.int64]) -> Array:
        older = np.stack([set_points[at - k] for k in range(1, past + 1)], axis=-1)
        x, p = (np.stack([s[at], s[at - 1]], axis=-1) for s in (contraction, pressure))
        return lift(x, p, older)

    now, after = (lifted(t).reshape(-1, 7 + past) for t in (at, at + 1))
    given = set_points[at].reshape(-1, 1)
    centre, level = now.mean(axis=0), float(given.mean())
    data = np.hstack([now - centre, given - level])
    normal = data.T @ data
    normal += RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
    found = np.linalg.solve(normal, data.T @ (after - centre)).T
    return LiftedModel(found[:, :-1], found[:, -1], centre, level)


def excitation(full: float, seed: int = 0) -> Array:
    """Return setpoints [Pa], shape (PERIODS, RECORDS): random levels, held for random times."""
    draws = np.random.default_rng(seed)
    made = np.empty((PERIODS, RECORDS))
    for record in made.T:
        at = 0
        while at < PERIODS:
            held = int(draws.integers(3, 60))
            record[at : at + held] = full * draws.uniform()
            at += held
    return made


@dataclass(frozen=True)
class Design:
    """Model of one load, its predictor, and the prediction over ``LOOK`` periods.

    ``by_state``, shape (n,), and ``by_input``, shape (LOOK,), the oldest input first, give the
    contraction [mm] above the centre.
    """

    model: LiftedModel
    predictor: LinearPredictor
    by_state: Array
    by_input: Array


def design(plant: SingleMuscle, past: int, weight: float, load: float) -> Design:
    """Return the design for a nominal plant with a load [kg]."""
    loaded = dataclasses.replace(plant, mass=dataclasses.replace(plant.mass, load=load))
    given = excitation(plant.regulator.max_pressure)
    record = simulate([loaded] * RECORDS, given)
    before = (np.vstack([s[:1] * 0.0, s[:-1]]) for s in (record["contraction"], record["pressure"]))
    contraction, pressure = before
    model = identify(contraction / MM, pressure / BAR, given / BAR, past)
    output = np.eye(len(model.b))[0]
    rows = [output]
    for _ in range(LOOK):
        rows.append(rows[-1] @ model.a)
    pulses = np.array([row @ model.b for row in rows[:LOOK]])[::-1]
    predictor = linear_predictor(model.a, model.b, output, weight, HORIZON)
    return Design(model, predictor, rows[LOOK], pulses)


class KoopmanState(NamedTuple):
    """Preview, histories, the newest first, and disturbance [mm].

    Lifted states have the shape (n_env, LOOK, n), setpoints [bar] (n_env, m); the last contraction
    [mm] and pressure [bar] have (n_env,).
    """

    seen: Preview
    lifted: Array
    past: Array
    contraction: Array
    pressure: Array
    disturbance: Array


@dataclass(frozen=True)
class Koopman(RowController):
    """Predictive control with the lifted model; see the module."""

    plant: SingleMuscle
    weight: float
    reader: Reader
    references: Reader
    memory: PreviewMemory
    past: int
    share: float
    action_signal: Signal

    @cached_property
    def design(self) -> Callable[[float], Design]:
        """Return the design for a load [kg], cached."""
        return cache(partial(design, self.plant, self.past, self.weight))

    def initial_state(self, observation: ArrayLike) -> KoopmanState:
        """Return the state at rest at the first measurement."""
        contraction, pressure, set_point, _ = self._read(observation)
        past = np.repeat(set_point[:, None], max(self.past, LOOK), axis=1)
        x, p = (np.stack([s, s], axis=1) for s in (contraction, pressure))
        lifted = lift(x, p, past[:, : self.past])
        return KoopmanState(
            self.memory.start(self.references.rows(observation).T[:, None]),
            np.repeat(lifted[:, None], LOOK, axis=1),
            past,
            contraction,
            pressure,
            np.zeros_like(contraction),
        )

    def respond(self, observation: ArrayLike, state: KoopmanState) -> Prediction:
        """Return the action and the next state."""
        contraction, pressure, _, load = self._read(observation)
        x = np.stack([contraction, state.contraction], axis=1)
        p = np.stack([pressure, state.pressure], axis=1)
        lifted = lift(x, p, state.past[:, : self.past])
        seen = self.memory.add(state.seen, self.references.rows(observation).T[:, None])
        ends = seen.step[:, None] + np.arange(1.0, HORIZON + 1.0)
        reference = self.memory.read(seen, ends)[0][:, 0] / MM
        nearest = np.array(LOADS)[np.abs(load[:, None] - np.array(LOADS)).argmin(axis=1)]
        answer = partial(by_load, nearest, self._answer)
        disturbance, command = answer(
            lifted, state.lifted[:, -1], state.past, contraction, reference, state.disturbance
        )
        after = KoopmanState(
            seen,
            np.concatenate([lifted[:, None], state.lifted[:, :-1]], axis=1),
            np.hstack([command[:, None], state.past[:, :-1]]),
            contraction,
            pressure,
            disturbance,
        )
        return encode_action(self.action_signal, BAR * command, observation), after

    def _answer(
        self, load: float, lifted: Array, older: Array, past: Array, contraction: Array,
        reference: Array, disturbance: Array,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Return disturbances [mm] and setpoints [bar] of rows with one load [kg]."""
        made, signal = self.design(load), self.action_signal
        model, newest = made.model, past[:, :LOOK]
        due = np.add.reduce((older - model.centre) * made.by_state, axis=1)
        due = due + np.add.reduce((newest[:, ::-1] - model.level) * made.by_input, axis=1)
        off = contraction - model.centre[0] - due
        disturbance = disturbance + self.share * (off - disturbance)
        inputs = made.predictor.inputs(
            lifted - model.centre,
            past[:, 0] - model.level,
            reference - model.centre[0] - disturbance[:, None],
            signal.low / BAR - model.level,
            signal.high / BAR - model.level,
        )
        return disturbance, inputs[:, 0] + model.level

    def _read(self, observation: ArrayLike) -> tuple[Array, Array, Array, Array]:
        """Return contraction [mm], pressure and setpoint [bar], and load [kg]."""
        contraction, pressure, set_point, load = self.reader.rows(observation)
        return contraction / MM, pressure / BAR, set_point / BAR, load


def make_koopman(spec: Spec[SingleMuscle]) -> Koopman:
    """Return the controller."""
    plant, names = spec.plant, preview_names("reference", spec.signals)
    period = plant.control_period
    ahead = np.array([round(spec.signals[name].ahead / period) for name in names])
    past = int(np.ceil(plant.regulator.dead_time / period)) + 1
    return Koopman(
        plant,
        spec.knob("weight") * WEIGHT,
        reader(spec.signals, ["contraction", "pressure", "set_point", "load"]),
        reader(spec.signals, names),
        PreviewMemory.make(ahead),
        past,
        spec.knob("disturbance") * SHARE,
        spec.actions["pressure_set_point"],
    )


ENTRIES = {
    "koopman": Entry(
        "linear predictive control with a lifted model, identified from records by least squares",
        "nominal model",
        make_koopman,
        preview=True,
        feedback=True,
        citation="korda2018; williams2015; beck2009; rawlings2017",
        plants=(SingleMuscle,),
        knobs=KNOBS,
    ),
}
