"""Linear state-space models of plants about points of rest, as objects of python-control.

Five lines from a plant to a linear-quadratic regulator::

    import control, numpy as np
    from pam_envs.plants import SingleMuscle
    model = SingleMuscle.mas10(mass__load=2.55).linearise(pressure=3e5)
    gain, _, poles = control.lqr(model, np.diag([0.0, 1e6, 1e2]), [[1e-9]])
    set_point = lambda state, rest: 3e5 - gain @ (state - rest)  # state: model.state_labels

A family of plants declares its smooth equations in a module ``at_rest`` beside its ``plant``: a
function ``at_rest(plant, ...)`` of the operating point that returns an :class:`Equilibrium`. The
Jacobians are central differences of these equations in continuous time: lag of the regulators and
motion, without dead time (``control.pade`` in series adds one) and rate limit.

Hysteresis is replaced by the slope of one branch: ``branch="loading"`` (default) is the branch on
which the point was reached from the state at the beginning, for motions that continue in that
direction; ``branch="turned"`` the one right after a turn, for small motions about the point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import HysteresisModel, operator_of

if TYPE_CHECKING:
    from pam_envs.plants.core.plant import Plant

Branch = Literal["loading", "turned"]
MISSING = "linearise needs python-control: pip install 'pam-envs[baselines]'"


@dataclass(frozen=True)
class Equilibrium:
    """Smooth equations of a plant about a point of rest.

    Attributes
    ----------
    derivative : callable
        From state, shape (n,), and input, (m,), to the state's derivative, (n,), in SI.
    outputs : callable
        From state to output, shape (p,).
    state, command : ndarray, shapes (n,) and (m,)
        Point of rest [SI].
    steps : ndarray, shape (n + m,)
        Half widths of the central differences of state and input [SI].
    names : tuple of tuple of str
        Names of states, inputs and outputs.
    """

    derivative: Callable[[Array, Array], Array]
    outputs: Callable[[Array], Array]
    state: Array
    command: Array
    steps: Array
    names: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]


def local_branch(
    operator: HysteresisModel | None, point: float, start: float, branch: Branch, size: float
) -> Callable[[ArrayLike], Array]:
    """Return a line in place of an operator about ``point``, reached one way from ``start``.

    Its slope is the mean one over ``size`` (in the unit of the input) in that direction
    (``"loading"``) or back (``"turned"``).
    """
    if branch not in ("loading", "turned"):
        raise ValueError(f"branch = {branch!r}; choose 'loading' or 'turned'")
    model = operator_of(operator)
    outward = 1.0 if point >= start else -1.0
    step = size * (outward if branch == "loading" else -outward)
    output, state = model.simulate(np.array([start, point]))
    beyond = float(np.asarray(model.step(point + step, state)[0]))
    held, slope = float(output[-1]), (beyond - float(output[-1])) / step
    return lambda x: np.asarray(held + slope * (np.asarray(x, float) - point))


def linearise(plant: Plant, **point: Any) -> Any:
    """Return the continuous-time ``control.StateSpace`` of a plant about a point of rest.

    Parameters
    ----------
    plant : Plant
        With effects off.
    **point
        Operating point: the arguments of ``at_rest`` of the plant's family.

    Returns
    -------
    control.StateSpace
        Deviations from the point of rest, in SI; states, inputs and outputs are named.

    Raises
    ------
    ModuleNotFoundError
        If python-control is not installed.
    ValueError
        If effects are on, or the point is out of reach.
    """
    try:
        import control
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(MISSING) from error
    if plant.extended:
        raise ValueError(
            "effects are on, and the linear model is that of the plain equations: linearise "
            "plant.replace(plant.neutral)"
            + (" (which has air = 'regulator' in place of 'flow')" if plant.air == "flow" else "")
        )
    found: Equilibrium = plant.module("at_rest").at_rest(plant, **point)
    n = len(found.state)
    both = np.concatenate([found.state, found.command])
    rates, outputs = [], []
    for k, step in enumerate(found.steps):
        ends = [both + sign * step * np.eye(len(both))[k] for sign in (1.0, -1.0)]
        up, down = (found.derivative(z[:n], z[n:]) for z in ends)
        rates.append((up - down) / (2.0 * step))
        up, down = (found.outputs(z[:n]) for z in ends)
        outputs.append((up - down) / (2.0 * step))
    a, b = np.array(rates[:n]).T, np.array(rates[n:]).T
    c = np.array(outputs[:n]).T
    states, inputs, shown = found.names
    return control.ss(
        a, b, c, np.zeros((len(shown), len(inputs))), states=states, inputs=inputs, outputs=shown
    )
