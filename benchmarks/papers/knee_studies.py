"""Runs of the knee environments for comparison with yeh2010.

An error is a root mean square over the half-range of the reference, without the first 2 s, the
paper's transient. Sensors are ideal, and the controllers know the plant.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import pam_envs  # noqa: F401  registers the ids
from baselines.core.entry import Spec
from baselines.knee.feedforward import make_knee_forward
from baselines.knee.ltr import make_knee_ltr
from benchmarks.papers.published import as_published
from benchmarks.runs import rollout
from benchmarks.scoring.group import rms
from benchmarks.scoring.groups import knee as metrics_knee
from pam_envs.plants.knee_orthosis.plant import Activity, Dynamics, KneeOrthosis, Mounting
from pam_envs.references.gait import PAPER_STRIDE

DROPPED = 2.0
"""Seconds left out at the beginning."""
CYCLES = 2.0
"""Cycles of the sine that are scored."""
FREQUENCY = 0.1
"""[Hz]."""
PRESET_FRICTION = 0.5e5
"""Pressure [Pa] that all elements of the preset's hysteresis hold together: its loop width."""
IDS: dict[Activity, str] = {
    "walk": "PAM/KneeWalk-v0",
    "stairs_up": "PAM/KneeStairsUp-v0",
    "stairs_down": "PAM/KneeStairsDown-v0",
}


@dataclass(frozen=True)
class TensionErrors:
    """Errors [%] of tension tracking by the feedback alone, and with either of two feedforwards."""

    feedback: float
    with_line: float
    with_inverse: float


@dataclass(frozen=True)
class Switch:
    """Transient after switches from swing to stance, the mean over strides.

    ``tension`` is the largest error [N] in the first 0.5 s. ``at_switch`` is the error of the first
    period of stance, caused by the swing controller; ``excess`` is the difference [N] of the two,
    the transient of the stance controller. ``command`` is the change of the setpoint [Pa] over the
    control period of the switch.
    """

    tension: float
    at_switch: float
    excess: float
    command: float


def tension_errors(
    width: float = PRESET_FRICTION,
    feedback: Literal["printed", "designed"] = "printed",
    mounting: Mounting = "rig",
    dynamics: Dynamics = "measured",
) -> TensionErrors:
    """Return the errors of tracking a tension of 0.1 Hz in ``PAM/KneeTension-v0``.

    ``width`` is the sum of the pressures [Pa] of all hysteresis elements. The feedback is
    controller (11), or our design on the identified plant; the mounting the isometric preset, 80 to
    330 N, or the wearable one, 80 to 205 N; the dynamics the published frequency response, or the
    regulator's lag.
    """
    preset = {"rig": KneeOrthosis.rig, "no_load": KneeOrthosis.no_load}[mounting]
    wide = width / PRESET_FRICTION
    plant = preset("maxwell_slip", dynamics=dynamics, hysteresis__width=wide).without_noise()
    plant = as_published(plant)
    kinds = ("nominal", "line", "inverse")
    printed = feedback == "printed"
    return TensionErrors(
        *(_error("Tension", plant, make_knee_ltr, forward=k, printed=printed) for k in kinds)
    )


def stiffness_errors() -> tuple[float, float]:
    """Return the errors [%] of inverse and straight line in ``PAM/KneeStiffness-v0``."""
    plant = as_published(KneeOrthosis.rig("maxwell_slip").without_noise())
    inverse, line = (
        _error("Stiffness", plant, make_knee_forward, kind=kind) for kind in ("inverse", "line")
    )
    return inverse, line


def _error(quantity: str, plant: KneeOrthosis, make: Any, **knobs: Any) -> float:
    """Return the error [%] of a controller that tracks a sine with the brace's tension."""
    how: dict[str, Any] = {"start": "paper", "reference": "sine", "frequency": FREQUENCY}
    how |= {"plant": plant, "episode_seconds": DROPPED + CYCLES / FREQUENCY}
    env: Any = gym.make(f"PAM/Knee{quantity}-v0", disable_env_checker=True, **how).unwrapped
    controller = make(Spec(plant, env.signals, env.action_signals), **knobs)
    signals = rollout.run(env, controller, 0).signals
    kept = signals["time"] > DROPPED + 1e-6
    reference = signals["reference"][kept]
    error = signals["output"][kept] - reference
    return 100.0 * rms(error) / metrics_knee.half_range(reference)


@lru_cache(maxsize=32)
def stride(
    activity: Activity = "walk",
    mismatch: float = 0.0,
    bumpless: bool = True,
    preview: bool = False,
    pace: float = PAPER_STRIDE,
) -> Mapping[str, NDArray[np.float64]]:
    """Return the signals (SI) of three strides from rest at contact, with the paper's control.

    While the tension controller is off-line, its reference has an error of ``mismatch`` [N].
    ``bumpless`` turns on the compensators of bumpless transfer. With ``preview`` the feedforward
    has a preview of one lag of the regulator, unlike the paper's. ``pace`` is the duration of a
    stride [s]. The keys are those of the environment's ``info``, and ``set_point`` [Pa].
    """
    plant = as_published(KneeOrthosis.on_leg(activity, pace, "maxwell_slip").without_noise())
    env: Any = gym.make(
        IDS[activity],
        disable_env_checker=True,
        plant=plant,
        mismatch=mismatch,
        start="heel_contact",
        episode_seconds=round(3.2 * pace, 2),
    ).unwrapped
    signals = (env.signals, env.action_signals)
    controller = make_knee_ltr(Spec(plant, *signals), bumpless=bumpless, preview=preview)
    episode = rollout.run(env, controller, 0)
    command = signals[1]["pressure_set_point"].decode(episode.actions)
    return {**episode.signals, "set_point": command}


def switching(
    mismatch: float = 10.0,
    bumpless: bool = True,
    preview: bool = False,
    pace: float = PAPER_STRIDE,
) -> Switch:
    """Return the transient after the switches to stance in ``PAM/KneeWalk-v0``, see :func:`stride`.

    The setpoint of the last period of swing is compared with the first of the tension controller.
    """
    signals, period = stride("walk", mismatch, bumpless, preview, pace), KneeOrthosis.control_period
    starts = metrics_knee.landings(signals["sensor/stance"], period)
    error = signals["output"] - signals["reference"]
    long = round(metrics_knee.JUMP_SECONDS / period)
    # signals of step k are recorded after it: its next setpoint has index k + 1
    jumps = [abs(signals["set_point"][k + 1] - signals["set_point"][k]) for k in starts]
    return Switch(
        tension=metrics_knee.largest_after(error, starts, long),
        at_switch=metrics_knee.largest_after(error, starts, 1),
        excess=metrics_knee.excess_after(error, starts, long),
        command=float(np.mean(jumps)),
    )


def emg_ratios(activity: Activity = "walk") -> dict[str, float]:
    """Return the ratio of assisted to unassisted RMS of the EMG proxy over whole strides.

    The names are those of the ``emg_`` metrics of :data:`benchmarks.scoring.knee.GAIT`.
    """
    signals = stride(activity)
    window = (signals["time"] > PAPER_STRIDE) & (signals["time"] < 3.0 * PAPER_STRIDE + 1e-6)
    return metrics_knee.emg(signals, window, KneeOrthosis.control_period, activity)
