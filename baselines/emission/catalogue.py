"""Controllers of the catalogue that can be exported."""

from collections.abc import Callable
from typing import Any

from baselines.emission import inverse, knee, pid
from baselines.emission.book import Design, model_of
from baselines.knee.feedforward import KneeForward
from baselines.knee.ltr import KneeLtr
from baselines.knee.pid import TensionView
from baselines.linear.pid import Pid
from baselines.positioning.inverse import Inverse, InversePid
from baselines.positioning.pid import MuscleView
from pam_envs.export.model import Model
from pam_envs.parameters import Signals

DESIGNS: dict[type, Callable[[Any], Design]] = {
    MuscleView: pid.muscle_pid,
    TensionView: knee.knee_pid,
    Inverse: inverse.inverse,
    InversePid: inverse.inverse_pid,
    KneeForward: knee.knee_forward,
    KneeLtr: knee.knee_ltr,
}
"""Design of each class of controllers; for a PID, of its view."""


def controller_model(
    name: str, controller: Any, signals: Signals, actions: Signals, period: float
) -> Model:
    """Return the model of a controller for export.

    Parameters
    ----------
    name : str
        Its name in the catalogue.
    controller : Controller
        As made for a nominal plant and these signals.
    period : float
        Control period [s].

    Raises
    ------
    ValueError
        If this kind of controller cannot be exported.
    """
    kind = type(controller.view) if isinstance(controller, Pid) else type(controller)
    if kind not in DESIGNS:
        known = "PID of the muscle and of the knee, inverse, knee feedforward, knee LTR"
        raise ValueError(f"{name} ({kind.__name__}) cannot be exported; these can: {known}")
    return model_of(DESIGNS[kind](controller), name, signals, actions, period)
