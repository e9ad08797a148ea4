"""Nominal elbow orthosis: signals, friction of the bundles, pressures for torque and stiffness.

Friction inside the bundles depends on their contraction, and thus on the sensed angle. A nominal
hysteresis model driven by the angle gives the increase of the force in one direction of motion and
its decrease in the other.

chakarov2018 computes the pressures by an optimisation. Torque and stiffness are linear in both
pressures, so that the solution of two linear equations gives the pressures exactly. For references
out of reach the torque has priority, and the stiffness is as close to its reference as possible
(:mod:`pam_envs.mechanics`).
"""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from baselines.core.controller import Reader, encode_actions, reader
from baselines.core.entry import ELBOW, Entry, Spec
from pam_envs.arrays import Array
from pam_envs.hysteresis.protocol import RowsState
from pam_envs.mechanics.allocation import allocate
from pam_envs.parameters import Signal
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

ELBOW_ENTRY = partial(
    Entry, knowledge="nominal model", feedback=True, envs=ELBOW, plants=(ElbowOrthosis,)
)
NAMES = ["angle", "rate", "pressure_a", "pressure_b", "torque", "reference", "stiffness_reference"]


class ElbowView(NamedTuple):
    """One observation of every row in SI units, as arrays of shape (n_env,).

    The pressures of bundles a and b have the shape (2, n_env), the torque is estimated, and
    ``accepts`` marks the rows whose valves accept the next action.
    """

    angle: Array
    rate: Array
    pressure: Array
    torque: Array
    torque_reference: Array
    stiffness_reference: Array
    accepts: NDArray[np.bool_]


@dataclass(frozen=True)
class ElbowSignalMap:
    """Reader of observations as an :class:`ElbowView`, and writer of actions of both bundles.

    ``to_pulse`` reads the time until on/off valves accept a pulse; ``period`` is the control period
    [s].
    """

    reader: Reader
    to_pulse: Reader | None
    actions: tuple[Signal, Signal]
    period: float

    def read(self, observation: ArrayLike) -> ElbowView:
        """Return the view of an observation of shape (n_obs,) or (n_env, n_obs)."""
        angle, rate, a, b, torque, reference, stiffness = self.reader.rows(observation)
        accepts = np.ones(len(angle), bool)
        if self.to_pulse is not None:
            accepts = self.to_pulse.rows(observation)[0] < 0.5 * self.period
        return ElbowView(angle, rate, np.array([a, b]), torque, reference, stiffness, accepts)

    def write(self, commands: Array, observation: ArrayLike) -> NDArray[np.float32]:
        """Return the action for commands of both bundles, shape (2, n_env)."""
        return encode_actions(self.actions, commands, observation)


def make_elbow_signal_map(spec: Spec[ElbowOrthosis]) -> ElbowSignalMap:
    """Return the reader and writer of the elbow's signals."""
    signals, names = spec.signals, set(spec.actions.names())
    form = "pulse_{}" if "pulse_a" in names else "pressure_{}_set_point"
    if form.format("a") not in names:
        raise ValueError(
            f"the actions are {', '.join(sorted(names))}; these controllers give pressures or "
            "pulses: make the environment with action='pressures'"
        )
    return ElbowSignalMap(
        reader(signals, NAMES),
        reader(signals, ["to_pulse"]) if "to_pulse" in signals.names() else None,
        (spec.actions[form.format("a")], spec.actions[form.format("b")]),
        spec.plant.control_period,
    )


Shares = tuple[Array, Array]


@dataclass(frozen=True)
class ElbowFriction:
    """Friction of a nominal orthosis."""

    plant: ElbowOrthosis

    def initial(self, rows: int) -> RowsState:
        """Return the virgin hysteresis states of a number of rows."""
        return self.plant.hysteresis.initial(rows)

    def losses(self, view: ElbowView, state: RowsState) -> tuple[Shares, RowsState]:
        """Return the friction losses [m^2] of both bundles' shapes, and the next state."""
        return self.plant.slide(view.angle, view.pressure, state)

    def torque(self, view: ElbowView, losses: Shares) -> Array:
        """Return the torque [N m] of friction at the sensed pressures."""
        factor_a, factor_b = self.plant.coefficients(*view.pressure)
        return self.plant.pulley.torque(-factor_a * losses[0], -factor_b * losses[1])


def make_elbow_friction(plant: ElbowOrthosis, known: bool) -> ElbowFriction:
    """Return the friction of a nominal plant, or none if it is not ``known``."""
    return ElbowFriction(plant if known else plant.replace({"hysteresis.operator": None}))


def pressures_for(
    plant: ElbowOrthosis,
    angle: Array,
    torque: Array,
    stiffness: Array,
    friction: tuple[Array | float, Array | float] = (0.0, 0.0),
    limits: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Return the pressures [Pa] of bundles a and b of a nominal orthosis, shape (n_env,).

    References and angle are in SI units; ``friction`` is the loss of the bundles' shapes [m^2]. The
    limits are the lowest and highest pressures [Pa], shapes (2, n_env); by default they are those
    of the whole range.
    """
    full = plant.full_pressure
    phi_a, phi_b, psi_a, psi_b = (np.ravel(x) for x in plant.geometry(angle))
    low, high = limits or (np.zeros((2, len(angle))), np.full((2, len(angle)), full))
    shapes = (phi_a - friction[0], phi_b - friction[1], psi_a, psi_b)
    (low_a, low_b), (high_a, high_b) = plant.coefficients(*low), plant.coefficients(*high)
    columns = (torque, stiffness, *shapes, low_a, high_a, low_b, high_b)
    found = [
        allocate(q, s, plant.pulley.radius, *rest)
        for q, s, *rest in zip(*(x.tolist() for x in columns), strict=True)
    ]
    a, b = plant.pressures_of(*np.array(found).T)
    return np.clip(a, low[0], high[0]), np.clip(b, low[1], high[1])
