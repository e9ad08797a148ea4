"""Studies of the joint's control on the paper's reduced plant: fluidic_muscles, sections 3.2 and 4.

The plant is the paper's: a symmetric Preisach operator from set-point to ``w``, then ``23^2 / (s +
23)^2``. The controllers are those of the catalogue, at 10 ms; the angle is sampled every 1 ms.
The paper prints no hysteresis; the assumed one has loops whose half-gap is 10 % of their amplitude
at 10 and at 30 degrees, gain 1 between the tips of the largest loop, and 0.65 after a turn, the low
end of the uncertain gain. A step follows a turn: up, back, and up again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.core.catalogue import CONTROLLERS
from baselines.joint.model import POLE
from baselines.linear.systems import discrete, double_lag
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.parameters import Signal, Signals

Array = NDArray[np.float64]

PERIOD, FINE = 0.01, 1e-3
"""Control period of the environments, and time between samples of the angle [s]."""
DEGREE = np.pi / 180.0
RANGE = 30.0 * DEGREE
STEP = 10.0 * DEGREE
THRESHOLDS = (2.0, 5.0, 8.0, 35.0 / 3.0)
"""Half dead widths [deg] of plays of equal weight."""
AFTER_TURN, TOTAL = 0.65, 1.1
"""Gain after a turn, the low end of the uncertain gain, and with all plays moving."""


@cache
def assumed_hysteresis(width: float = 1.0) -> Preisach:
    """Return the hysteresis of the reduced plant, from set-point [rad] to ``w`` [rad].

    Parameters
    ----------
    width : float
        Of the loops over the assumed ones; 0: no hysteresis.
    """
    weights = ((TOTAL - AFTER_TURN) / len(THRESHOLDS),) * len(THRESHOLDS)
    plays = PlayOperator(tuple(DEGREE * r for r in THRESHOLDS), weights, AFTER_TURN)
    model = Preisach.from_play(plays, -RANGE, RANGE, levels=61, start="virgin")
    return model.scaled(width, 1.0)


@dataclass(frozen=True)
class ReducedRig:
    """The reduced plant, both as the simulated plant and as the model of the controllers.

    Attributes
    ----------
    width : float
        Width of the hysteresis loops relative to the assumed ones.
    """

    width: float = 1.0
    stages: int = 1
    control_period: float = PERIOD
    angle_range: tuple[float, float] = (-RANGE, RANGE)

    @cached_property
    def hysteresis(self) -> Preisach:
        """The hysteresis."""
        return assumed_hysteresis(self.width)

    def digest(self) -> str:
        """Return an identifier of this plant."""
        return f"reduced rig {self.width}"

    def rest_angles(self, commands: Array) -> Array:
        """Return the angles at rest [rad] after each of a series of set-points."""
        return self.hysteresis.simulate(commands)[0]


SIGNALS = Signals(
    Signal(name, "rad", -RANGE, RANGE, k, normalized=False)
    for k, name in enumerate(("angle", "set_point", "reference"))
)
ACTIONS = Signals([Signal("angle_set_point", "rad", -RANGE, RANGE, 0, normalized=False)])


@dataclass(frozen=True)
class Run:
    """Record of a run.

    Attributes
    ----------
    time, angle : ndarray
        Every 1 ms [s], [rad].
    set_point, model : ndarray, shape (T,)
        [rad]; ``model``, the angle of the controller's model at the end of the period, is empty
        where there is none.
    """

    time: Array
    angle: Array
    set_point: Array
    model: Array


def run(
    controller: Any,
    reference: Array,
    rig: ReducedRig,
    disturbance: Callable[[Array], Array] | None = None,
) -> Run:
    """Run a controller on the reduced plant from rest at 0.

    Parameters
    ----------
    controller : Controller
    reference : ndarray, shape (T,)
        [rad] at the control instants.
    rig : ReducedRig
    disturbance : callable, optional
        Of the angle [rad], from times [s].
    """
    motion, hysteresis = discrete(double_lag(POLE), FINE, "zoh"), rig.hysteresis
    fine = round(rig.control_period / FINE)
    x, held, state = motion.initial_state(), hysteresis.initial_state(), None
    time = np.arange(1.0, fine * len(reference) + 1.0) * FINE
    off = np.zeros(len(time) + 1) if disturbance is None else disturbance(np.append(0.0, time))
    angles, commands, models = np.zeros(len(time)), np.zeros(len(reference)), []
    command, angle = 0.0, float(off[0])
    for k, desired in enumerate(reference):
        action, state = controller.predict(np.array([angle, command, desired]), state)
        command = float(action[0])
        w, held = hysteresis.step(command, held)
        for i in range(fine * k, fine * (k + 1)):
            x = motion.advance(float(w), x)
            angles[i] = motion.c @ x + off[i + 1]
        angle, commands[k] = angles[fine * (k + 1) - 1], command
        if hasattr(controller, "model_output"):
            models.append(float(np.squeeze(controller.model_output(state))))
    return Run(time, angles, commands, np.array(models))


def controller(name: str, rig: ReducedRig) -> Any:
    """Return a controller of the catalogue for the reduced plant."""
    return CONTROLLERS[name].make(rig, SIGNALS, ACTIONS)


@dataclass(frozen=True)
class StepFigures:
    """Figures of a step response.

    Attributes
    ----------
    rise : float
        From 10 to 90 % [s].
    overshoot : float
        [%] of the step.
    settling : float
        To within 2 % for good [s].
    """

    rise: float
    overshoot: float
    settling: float


def step_figures(time: Array, output: Array) -> StepFigures:
    """Return the figures of a response to a unit step at 0, from ``time[0] > 0`` on."""
    t, y = np.append(0.0, time), np.append(0.0, output)
    first, last = (_reached(t, y, level) for level in (0.1, 0.9))
    outside = np.flatnonzero(np.abs(y - 1.0) > 0.02)
    k = int(outside[-1])
    settled = float("inf")
    if k + 1 < len(y):
        edge = 1.0 + np.copysign(0.02, y[k] - 1.0)
        settled = t[k] + (t[k + 1] - t[k]) * (edge - y[k]) / (y[k + 1] - y[k])
    return StepFigures(last - first, 100.0 * max(0.0, float(y.max()) - 1.0), float(settled))


def _reached(t: Array, y: Array, level: float) -> float:
    k = int(np.flatnonzero(y >= level)[0])
    return float(t[k - 1] + (t[k] - t[k - 1]) * (level - y[k - 1]) / (y[k] - y[k - 1]))


STEPPED = (
    "joint_pi",
    "joint_pi_slow",
    "joint_pid",
    "joint_pid_smooth",
    "joint_mfc_hinf",
    "joint_mfc_mu",
    "joint_mfc_mu_plain",
    "joint_mfc_mu_wrong",
)


@dataclass(frozen=True)
class Setting:
    """Circumstances of a step.

    Attributes
    ----------
    width : float
        Width of the hysteresis loops relative to the assumed ones; 0: no hysteresis.
    size : float
        Of the step [rad].
    period : float
        Control period [s].
    turned : bool
        Whether the step is the second of two, with one back in between; else the first.
    """

    width: float = 1.0
    size: float = STEP
    period: float = PERIOD
    turned: bool = True


HOLD = 3.0
"""Seconds for which a step is held."""


@cache
def step_run(name: str, setting: Setting = Setting()) -> Run:
    """Return the run of two steps and one back with a controller of the catalogue."""
    rig = ReducedRig(setting.width, control_period=setting.period)
    held = round(HOLD / setting.period)
    reference = setting.size * np.repeat([1.0, 0.0, 1.0], held)
    return run(controller(name, rig), reference, rig)


@cache
def step(name: str, setting: Setting = Setting()) -> StepFigures:
    """Return the figures of a step with a controller of the catalogue."""
    found, held = step_run(name, setting), round(HOLD / FINE)
    first = 2 * held if setting.turned else 0
    kept = slice(first, first + held)
    return step_figures(found.time[kept] - FINE * first, found.angle[kept] / setting.size)


def rejection(name: str, width: float = 1.0, size: float = 2.0 * DEGREE) -> float:
    """Return the time [s] after which a step added to the angle stays below 10 % of its size.

    Parameters
    ----------
    name : str
        Of the controller.
    width : float
        Width of the hysteresis loops relative to the assumed ones.
    size : float
        [rad].
    """
    rig = ReducedRig(width)

    def step_at_one(time: Array) -> Array:
        return np.where(time >= 1.0 - 1e-9, size, 0.0)

    found = run(controller(name, rig), np.zeros(300), rig, step_at_one)
    left = np.flatnonzero(np.abs(found.angle) > 0.1 * size)
    return float(found.time[left[-1]] - 1.0)


def tracking_error(
    name: str,
    frequency: float = 0.5,
    amplitude: float = 20.0 * DEGREE,
    period: float = PERIOD,
) -> tuple[float, float]:
    """Return the RMS error of a sine [% of the amplitude], and to the model's output [deg].

    The first cycle is left out. Without a model the second is not a number.

    Parameters
    ----------
    name : str
        Of the controller.
    frequency : float
        [Hz].
    amplitude : float
        [rad].
    period : float
        Control period [s].
    """
    rig = ReducedRig(control_period=period)
    periods = round(3.0 / (frequency * period))
    time = np.arange(periods + 1) * period
    reference = amplitude * np.sin(2.0 * np.pi * frequency * time)
    found = run(controller(name, rig), reference[:-1], rig)
    reached, kept = found.angle[round(period / FINE) - 1 :: round(period / FINE)], periods // 3
    error = (reached - reference[1:])[kept:]
    size = 100.0 * float(np.sqrt(np.mean(error**2))) / amplitude
    if not found.model.size:
        return size, float("nan")
    gap = (reached - found.model)[kept:]
    return size, float(np.sqrt(np.mean(gap**2))) / DEGREE


def half_gap(amplitude: float) -> float:
    """Return half the largest loop width of the assumed hysteresis, over its amplitude [rad]."""
    up = np.linspace(-amplitude, amplitude, 201)
    path = np.concatenate([np.linspace(0.0, amplitude, 101), up[::-1], up])
    output = assumed_hysteresis().simulate(path)[0]
    return 0.5 * float(np.max(output[101:302][::-1] - output[302:])) / amplitude
