"""Experiments and controllers on a hidden rig after its diagnosis."""

from dataclasses import replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from benchmarks.diagnosis.cases import NOISE, Case, Made, recording_of
from benchmarks.diagnosis.sources import Effects, columns_of, sheet_of
from pam_envs.arrays import Array
from pam_envs.constants import BAR, MM
from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.closed_loop.gain import DURATION
from pam_envs.diagnosis.experiment.plans import Means, Plan, plans
from pam_envs.plants.core.stepper import PERIOD
from tests.diagnosis import hidden
from tests.diagnosis.hidden.catalogue import constants
from tests.diagnosis.hidden.kernel import begin, one_period
from tests.diagnosis.hidden.records import STATE, blank
from tests.diagnosis.hidden.rig import steps_in

FULL = 6.0  # largest pressure [bar] of the rigs
FRESH = ("cycles_after_rest",)  # plans with a rested muscle, for which the rig is reset


def again(case: Case, made: Made, plan_name: str) -> tuple[Recording, Rig]:
    """Return the recording of campaign and subsequent experiment, and the rig file."""
    means = Means.of(made.recording, made.sheet)
    plan = {p.name: p for p in plans(means)}[plan_name]
    before = made.ground.campaign
    extra = _campaign(plan, before)
    names = ("command_bar", "segment", "load_N", "temperature_C", "valve_closed")
    both: Any = {n: np.concatenate([getattr(before, n), getattr(extra, n)]) for n in names}
    whole = replace(before, **both)
    sheet = sheet_of(made.ground.base, whole, case.noise)
    if plan.name in FRESH:  # time restarts in the second recording
        runs = [(made.effects, before), (made.effects, extra)]
    else:
        share = before.command_bar.size / whole.command_bar.size
        runs = [(_sooner(made.effects, share), whole)]
    columns = [
        columns_of(made.ground.base, effects, campaign, case.seed + 13 + k, case.noise)
        for k, (effects, campaign) in enumerate(runs)
    ]
    joined = {name: np.concatenate([run[name] for run in columns]) for name in columns[0]}
    return recording_of(joined, sheet, f"case {case.seed} and {plan.name}"), sheet


def _campaign(plan: Plan, before: hidden.Campaign) -> hidden.Campaign:
    """Return a plan as a campaign, with one segment per stretch of open or closed valve."""
    shut = plan.command < 0.0
    piece = np.concatenate([[0], np.cumsum(shut[1:] != shut[:-1])])
    held = np.where(shut, 0.0, plan.command)
    return hidden.Campaign(
        np.round(held / BAR, 4),
        np.array([f"next_{chr(ord('a') + k)}" for k in piece]),
        plan.load.astype(float),
        np.round(before.temperature_C[-1] + plan.kelvin, 2),
        shut,
        before.period,
    )


def _sooner(effects: Effects, share: float) -> Effects:
    """Keep the absolute time of an event given as a share of the run when the run gets longer.

    The worlds give absolute times.
    """
    made = []
    for effect, amplitude in effects:
        shape = dict(getattr(effect, "shape", {}))
        if "slip_time" in shape:
            shape["slip_time"] *= share
            made.append((replace(effect, shape=shape), amplitude))
        else:
            made.append((effect, amplitude))
    return made


# --- controllers on the rig ---------------------------------------------------------------------


class DrivenRig:
    """A hidden rig in closed loop, see :class:`pam_envs.diagnosis.closed_loop.gain.Rig`."""

    period = PERIOD

    def __init__(self, made: Made, load: float, celsius: float) -> None:
        self._rig = hidden.Stepper(
            made.ground.base,
            made.effects,
            load,
            0,
            PERIOD,
            noise_factor=float(made.noise[0] / NOISE[0]),
            temperature_C=celsius,
            duration=DURATION,
        )

    @property
    def position(self) -> float:
        """True contraction [m]."""
        return self._rig.position_mm * MM

    def reset(self, seed: int | None = None) -> None:
        """Return to rest and restart the noise."""
        self._rig.reset(seed or 0)

    def step(self, set_point: float) -> tuple[float, float]:
        """Hold a setpoint [Pa] for a period; return measured contraction [m] and pressure [Pa]."""
        place, pressure = self._rig.step(set_point / BAR)
        return place * MM, pressure * BAR


@njit(cache=True)
def _advance(
    parameters: Any, states: Any, commands: Any, heat: float, steps: int
) -> NDArray[np.float64]:
    """Advance copies of a rig through ``commands[t, lane]`` [bar]; return (3, t, lane)."""
    rows = np.empty((3, *commands.shape))
    for lane in range(commands.shape[1]):
        state = states[lane : lane + 1]
        for t in range(commands.shape[0]):
            place, pressure, true = one_period(parameters, state, commands[t, lane], heat, steps)
            rows[0, t, lane], rows[1, t, lane], rows[2, t, lane] = place, pressure, true
    return rows


class OracleBatch:
    """Copies of a hidden rig side by side, free of noise; ``position`` [m] is true, shape (n,)."""

    def __init__(self, constants_of: Any, states: Any, celsius: float) -> None:
        self._constants, self.states, self._celsius = constants_of, states, celsius
        self.position = np.zeros(len(states))

    def run(self, set_points: ArrayLike) -> Array:
        """Hold setpoints [Pa], shape (T, n); return readings and position, (3, T, n)."""
        commands = np.ascontiguousarray(set_points, np.float64) / BAR
        heat, steps = self._celsius, steps_in(PERIOD)
        rows = _advance(self._constants, self.states, commands, heat, steps)
        rows *= np.array([MM, BAR, MM])[:, None, None]
        self.position = rows[2, -1]
        return rows

    def step(self, set_points: ArrayLike) -> tuple[Array, Array]:
        """Hold setpoints [Pa] for a period; return contractions [m] and pressures [Pa] read."""
        rows = self.run(np.asarray(set_points, float)[None, :])
        return rows[0, 0], rows[1, 0]


class OracleRig:
    """The rig itself, see :class:`pam_envs.diagnosis.closed_loop.plant_inverse.Simulated`."""

    period = PERIOD
    max_pressure = FULL * BAR

    def __init__(self, made: Made, load: float, celsius: float) -> None:
        self.noise = float(made.noise[0])
        self._constants = constants(made.ground.base, made.effects, DURATION)
        self._rest = blank(STATE)
        begin(self._constants, self._rest, load)
        self._celsius = celsius
        self.reset()

    def reset(self, seed: int | None = None) -> None:
        """Bring it to rest; it has no noise."""
        self._one = self.batch(1)

    @property
    def position(self) -> float:
        """True contraction [m]."""
        return float(self._one.position[0])

    def step(self, set_point: float) -> tuple[float, float]:
        """Hold a setpoint [Pa] for a period; return measured contraction [m] and pressure [Pa]."""
        rows = self._one.run([[set_point]])
        return float(rows[0, 0, 0]), float(rows[1, 0, 0])

    def try_ahead(self, set_points: ArrayLike, periods: int) -> Array:
        """Return where copies would be [m], shape (periods, m); the rig stays as it is."""
        given = np.asarray(set_points, float)
        plans = np.broadcast_to(given, (periods, given.shape[-1]))
        copies = np.repeat(self._one.states, given.shape[-1])
        return np.asarray(OracleBatch(self._constants, copies, self._celsius).run(plans)[2])

    def batch(self, n: int) -> OracleBatch:
        """Return ``n`` copies at rest."""
        return OracleBatch(self._constants, np.repeat(self._rest, n), self._celsius)
