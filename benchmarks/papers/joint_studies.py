"""Studies of the joint's control on the paper's reduced plant: fluidic_muscles, sections 3.2 and 4.

The plant is the paper's: a symmetric Preisach operator from setpoint to ``w``, then ``23^2 / (s +
23)^2``. The controllers are those of the catalogue, at 10 ms; the angle is sampled every 1 ms.
The paper prints no hysteresis; the assumed one has loops whose half-gap is 10 % of their amplitude
at 10 and at 30 degrees, gain 1 between the tips of the largest loop, and 0.65 after a turn, the low
end of the uncertain gain. A step follows a turn: up, back, and up again.

The advantage of model-following over the PI alone depends on the hysteresis, on the size of the
step and on a preceding turn; all combinations are evaluated, also on the plants of
``PAM/AntagonisticJoint-v0`` without noise. There, *reduced* is the paper's plant with the
hysteresis identified on the muscles; *paper* is the joint of two muscles that carries its link.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product
from typing import Any

import gymnasium
import numpy as np
from scipy.interpolate import CubicSpline

import pam_envs  # noqa: F401  registers the ids
from baselines.core.catalogue import CONTROLLERS, make_controller
from baselines.core.entry import Spec
from baselines.joint.model import POLE
from baselines.linear.systems import discrete, double_lag
from benchmarks.papers.published import as_published
from benchmarks.runs import rollout
from benchmarks.scoring.group import rms
from pam_envs.arrays import Array
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach
from pam_envs.parameters import Signal, Signals
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint

PERIOD, FINE = 0.01, 1e-3
"""Control period of the environments, and time between samples of the angle [s]."""
DEGREE = np.pi / 180.0
RANGE = 30.0 * DEGREE
STEP = 10.0 * DEGREE
HOLD = 3.0
"""Seconds for which a step is held."""
THRESHOLDS = (2.0, 5.0, 8.0, 35.0 / 3.0)
"""Half dead widths [deg] of plays of equal weight."""
AFTER_TURN, TOTAL = 0.65, 1.1
"""Gain after a turn, the low end of the uncertain gain, and with all plays moving."""
PLANTS = ("study", "reduced", "paper")
SIZES = (5.0, 10.0, 15.0, 20.0)
"""Sizes of the steps [deg]."""
CASES = tuple(product(PLANTS, SIZES, (True, False)))
"""Plant, size [deg], and whether the step follows a turn."""
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
SIGNALS = Signals(
    Signal(name, "rad", -RANGE, RANGE, k, normalized=False)
    for k, name in enumerate(("angle", "set_point", "reference"))
)
ACTIONS = Signals([Signal("angle_set_point", "rad", -RANGE, RANGE, 0, normalized=False)])


@cache
def assumed_hysteresis(width: float = 1.0) -> Preisach:
    """Return the hysteresis of the reduced plant, from setpoint [rad] to ``w`` [rad].

    ``width`` scales the assumed loop width; 0: no hysteresis.
    """
    weights = ((TOTAL - AFTER_TURN) / len(THRESHOLDS),) * len(THRESHOLDS)
    plays = PlayOperator(tuple(DEGREE * r for r in THRESHOLDS), weights, AFTER_TURN)
    model = Preisach.resembling(plays, -RANGE, RANGE, levels=61, start="virgin")
    return model.scaled(width, 1.0)


@dataclass(frozen=True)
class ReducedRig:
    """The reduced plant, used as simulated plant and as model of the controllers."""

    width: float = 1.0
    dead_time: float = 0.0
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
        """Return the angles at rest [rad] after each of a series of setpoints."""
        return self.hysteresis.simulate(commands)[0]


@dataclass(frozen=True)
class Run:
    """Record of a run: time [s] and angle [rad] every 1 ms, setpoint [rad] once per control period.

    ``model`` is the angle [rad] of the controller's model at the end of each period, empty for a
    controller without one.
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

    The reference [rad] has a value for each control instant; ``disturbance`` returns the output
    disturbance of the angle [rad] at times [s].
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
    return CONTROLLERS[name].make(Spec(rig, SIGNALS, ACTIONS))


@dataclass(frozen=True)
class StepFigures:
    """Rise time from 10 to 90 % [s], overshoot [%], and 2 % settling time [s]."""

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


@dataclass(frozen=True)
class Setting:
    """Conditions of a step of a size [rad] at a control period [s].

    ``width`` scales the assumed loop width. A ``turned`` step is the second of two equal steps,
    with a step back between them.
    """

    width: float = 1.0
    size: float = STEP
    period: float = PERIOD
    turned: bool = True


@cache
def step_run(name: str, setting: Setting = Setting()) -> Run:
    """Return the run of a step, a step back and a second step with a catalogue controller."""
    rig = ReducedRig(setting.width, control_period=setting.period)
    reference = setting.size * np.repeat([1.0, 0.0, 1.0], round(HOLD / setting.period))
    return run(controller(name, rig), reference, rig)


@cache
def step(name: str, setting: Setting = Setting()) -> StepFigures:
    """Return the figures of a step with a controller of the catalogue."""
    found, held = step_run(name, setting), round(HOLD / FINE)
    first = 2 * held if setting.turned else 0
    kept = slice(first, first + held)
    return step_figures(found.time[kept] - FINE * first, found.angle[kept] / setting.size)


def plant_run(joint: AntagonisticJoint, name: str, size: float) -> Array:
    """Return noise-free angles [rad] every 10 ms of a step [deg], a step back and a second step."""
    joint = joint.without_noise()
    reference = size * DEGREE * np.repeat([1.0, 0.0, 1.0], round(HOLD / PERIOD))
    env: Any = gymnasium.make(
        "PAM/AntagonisticJoint-v0",
        disable_env_checker=True,
        plant=joint,
        reference=reference,
        start="straight",
        episode_seconds=PERIOD * len(reference),
    ).unwrapped
    controller = make_controller(name, joint, env.signals, env.action_signals)
    return np.concatenate([[0.0], rollout.run(env, controller, 0).signals["output"]])


@cache
def _angles(plant: str, name: str, size: float) -> Array:
    joint = as_published(getattr(AntagonisticJoint, plant)("maxwell_slip"))
    return plant_run(joint, name, size)


def plant_step(plant: str, name: str, size: float, turned: bool) -> StepFigures:
    """Return the figures of a step [deg] on one of ``PLANTS``, see :class:`Setting`.

    Between the control instants of an environment the angle is interpolated by a cubic spline.
    """
    if plant == "study":
        return step(name, Setting(size=size * DEGREE, turned=turned))
    angles = _angles(plant, name, size)
    begin = 2.0 * HOLD if turned else 0.0
    fine = FINE * np.arange(1.0, round(HOLD / FINE))
    output = CubicSpline(PERIOD * np.arange(len(angles)), angles)(begin + fine)
    return step_figures(fine, np.asarray(output) / (size * DEGREE))


def rejection(name: str) -> float:
    """Return the time [s] after which a step of 2 degrees on the angle stays below 10 % of it."""
    rig, size = ReducedRig(), 2.0 * DEGREE
    found = run(
        controller(name, rig), np.zeros(300), rig, lambda t: np.where(t >= 1.0 - 1e-9, size, 0.0)
    )
    left = np.flatnonzero(np.abs(found.angle) > 0.1 * size)
    return float(found.time[left[-1]] - 1.0)


def tracking_error(name: str, period: float = PERIOD) -> tuple[float, float]:
    """Return the RMS error of a sine [% of the amplitude], and to the model's output [deg].

    The sine of 20 degrees and 0.5 Hz is sampled at the control period [s]; the first of three
    cycles is omitted. Without a model the second error is NaN.
    """
    frequency, amplitude = 0.5, 20.0 * DEGREE
    rig = ReducedRig(control_period=period)
    periods = round(3.0 / (frequency * period))
    time = np.arange(periods + 1) * period
    reference = amplitude * np.sin(2.0 * np.pi * frequency * time)
    found = run(controller(name, rig), reference[:-1], rig)
    each, kept = round(period / FINE), slice(periods // 3, None)
    reached = found.angle[each - 1 :: each]
    size = 100.0 * rms((reached - reference[1:])[kept]) / amplitude
    if not found.model.size:
        return size, float("nan")
    return size, rms((reached - found.model)[kept]) / DEGREE
