"""A muscle whose length is imposed, as an actuator of a multibody simulator.

    setpoint -> dead time -> regulator -> pressure
    pressure, length -> static law, friction -> tension

Inputs are the setpoint and the muscle's length, held for a step; outputs are pressure and tension
at its end. The mass belongs to the simulator. The friction's limit is that at the plant's
load.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from pam_envs.export.model import Block, Model, Variable
from pam_envs.hysteresis.elements import play
from pam_envs.hysteresis.slip import SlipModel, slip_lag
from pam_envs.kernels.build import array_at, kernel
from pam_envs.kernels.machine_code import AddressKernel
from pam_envs.muscle.effective_area import law_and_slope
from pam_envs.muscle.effects import map_force
from pam_envs.plants.single_muscle.friction import law_numbers
from pam_envs.pneumatics.regulator import regulator_step

NAME = "muscle"
"""Name on the command line."""
ONE_IDLE = (np.ones(1), np.zeros((1, 2)), 0.0, 1.0)
"""An element without stiffness, of a muscle without friction (C has no empty arrays)."""
STEP = 1e-3
"""Usual step [s]: that of multibody simulators."""
INPUT, OUTPUT, STATE, SLIDERS, NUMBERS, DATA, LAW, THRESHOLDS, CURVES, HISTORY = range(10)
"""Arrays of the kernel."""
BEGUN, BEFORE = 2, 3
"""Whole numbers: steps since the start; whether only the start is computed."""
(
    PERIOD, WHOLE, PART, LAG, SLEW, REST_LENGTH, FRICTION, GROWTH, LIMIT, LOW, PER,
) = range(11)  # fmt: skip
"""Numbers of the design. The dead time is ``WHOLE + PART`` steps, the factor on the slip forces
``LIMIT + GROWTH * pressure``."""


@kernel
def muscle_by_address(book: Any, mode: int) -> None:
    """Advance the muscle by one step; mode 1 begins at rest, free of friction."""
    inputs, outputs = array_at(book, INPUT, 1, 0), array_at(book, OUTPUT, 1, 0)
    state, sliders = array_at(book, STATE, 1, 0), array_at(book, SLIDERS, 1, 0)
    numbers, data = array_at(book, NUMBERS, 1, 1), array_at(book, DATA, 1, 0)
    law, thresholds = array_at(book, LAW, 2, 0), array_at(book, THRESHOLDS, 1, 0)
    curves, history = array_at(book, CURVES, 2, 0), array_at(book, HISTORY, 1, 0)
    strain = 1.0 - inputs[1] / data[REST_LENGTH]
    if mode & 1:
        state[0] = inputs[0]
        for k in range(len(sliders)):
            sliders[k] = strain
        for k in range(len(history)):
            history[k] = inputs[0]
    if numbers[BEFORE] == 0:
        for k in range(len(history) - 1, 0, -1):
            history[k] = history[k - 1]
        history[0] = inputs[0]
        whole, late = int(data[WHOLE]), data[PART] * data[PERIOD]
        lag, slew = data[LAG], data[SLEW]
        state[0] = regulator_step(
            state[0], history[whole + 1], lag, 1.0 / lag, slew, 1.0 / slew, late
        )
        state[0] = regulator_step(
            state[0], history[whole], lag, 1.0 / lag, slew, 1.0 / slew, data[PERIOD] - late
        )
    pressure = state[0]
    force, _ = law_and_slope(
        pressure, pressure, strain, 1.0, law[0, 0], law[1, 0], law[2, 0], law[3, 0], law[4, 0],
        law[5, 0], law[6, 0], law[7, 0], law[8, 0],
    )  # fmt: skip
    limit = max(0.0, data[LIMIT] + data[GROWTH] * pressure)
    lag_strain, _ = slip_lag(strain, limit, thresholds, curves, data[LOW], data[PER], sliders)
    for k in range(len(thresholds)):
        sliders[k] = play(strain, thresholds[k] * limit, sliders[k])
    outputs[0] = pressure
    outputs[1] = force + map_force(law, 0, 9, pressure, strain) - data[FRICTION] * lag_strain
    numbers[BEGUN] = numbers[BEGUN] + 1


@dataclass(frozen=True)
class MuscleKernel:
    """Kernel of a muscle with imposed length."""

    @property
    def by_address(self) -> AddressKernel:
        """The kernel."""
        return AddressKernel("muscle", muscle_by_address, {}, 4 * (HISTORY + 1))


def muscle_model(plant: Any, step: float = STEP) -> Model:
    """Return the model of a single muscle's plant without its mass.

    Parameters
    ----------
    plant : SingleMuscle
        Without effects; friction driven by length, or none.
    step : float
        Length of a step [s].

    Raises
    ------
    ValueError
        If the plant has effects or a hysteresis driven by pressure.
    """
    held, law = plant.hysteresis, plant.regulator
    if plant.extended or not isinstance(held.operator, SlipModel | None):
        raise ValueError(
            "a muscle with imposed length needs a single_muscle without effects, with the "
            "hysteresis maxwell_slip_length, preisach_length or none"
        )
    elements = ONE_IDLE if held.operator is None else held.operator.arrays
    thresholds, curves, low, per = elements
    dead = law.dead_time / step
    whole = math.floor(dead + 1e-9)
    length = plant.muscle.rest_length
    numbers = [
        step, whole, max(0.0, dead - whole), law.time_constant, law.slew_rate, length,
        held.friction, held.limit_per_pressure, 1.0 + held.limit_per_load * plant.mass.load, low,
        per,
    ]  # fmt: skip
    arrays = {
        "input": (np.array([0.0, length]), False),
        "output": (np.zeros(2), False),
        "state": (np.zeros(1), False),
        "sliders": (np.zeros(len(thresholds)), False),
        "numbers": (np.zeros(4, np.int64), False),
        "data": (np.array(numbers), True),
        "law": (law_numbers(plant.muscle), True),
        "thresholds": (np.asarray(thresholds, float), True),
        "curves": (np.ascontiguousarray(curves), True),
        "history": (np.zeros(whole + 2), False),
    }
    return Model(
        "muscle with imposed length",
        NAME,
        step,
        tuple(Block(name, values, values.shape, fixed) for name, (values, fixed) in arrays.items()),
        {"kernel": MuscleKernel()},
        (
            Variable("set_point", "Pa", "input", 0, 0.0, 0.0, law.max_pressure),
            Variable("length", "m", "input", 1, length, 0.5 * length, 1.2 * length),
        ),
        (
            Variable("output.pressure", "Pa", "output", 0),
            Variable("output.tension", "N", "output", 1),
        ),
        (),
        "plant",
        {"plant": f"{plant.family}, digest {plant.digest()}"},
        "those of the package's kernels to the last bit",
    )
