"""The model of a plant."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pam_envs.export.model import Block, Model, Variable, parameters_of
from pam_envs.export.units import unit_of
from pam_envs.kernels.machine_code import AddressKernel
from pam_envs.plants.core.rollout import N_ARRAYS, Loop, run_by_address


@dataclass(frozen=True)
class PlantKernel:
    """Kernel that advances a variant of a plant by one control period."""

    plant: Any

    @property
    def loop(self) -> Loop:
        """Loop of the variant, extended if an effect is on."""
        made: Loop = self.plant.module("rollout").loop_of(self.plant, self.plant.extended)
        return made

    @property
    def by_address(self) -> AddressKernel:
        """The kernel."""
        loop = self.loop
        name = f"plant_{loop.name}"
        return AddressKernel(name, run_by_address, loop.names(1), 4 * N_ARRAYS)


def plant_model(plant: Any) -> Model:
    """Return the model of a plant, which begins at rest as its rollouts do."""
    source, rollout = PlantKernel(plant), plant.module("rollout")
    loop, channels, names = source.loop, rollout.channels_of(plant), rollout.outputs_of(plant)
    rows, counts = loop.state(1, 1)
    column = np.asarray(plant.parameter_rows(), np.float64).reshape(1, -1, 1)
    numbers = np.array([plant.elements, plant.substeps, 0, 0], np.int64)
    drives = np.array(list(channels.values())).reshape(-1, 1, 1)
    period = np.array([plant.control_period])
    arrays = {
        "rows": (rows, False),
        "fixed": (column, False),
        "counts": (counts, False),
        "table": (plant.hysteresis_tables()[:1], True),
        "extra": (loop.extra, True),
        "input": (drives, False),
        "flags": (np.zeros(1, np.int64), False),
        "output": (np.zeros((len(names), 1, 1)), False),
        "numbers": (numbers, False),
        "period": (period, True),
    }
    family = plant.family
    return Model(
        f"{family}, a plant",
        family,
        plant.control_period,
        tuple(
            Block(name, np.ascontiguousarray(values), values.shape, constant)
            for name, (values, constant) in arrays.items()
        ),
        {"kernel": source},
        tuple(
            Variable(name, unit_of(name, family), "input", k, float(usual))
            for k, (name, usual) in enumerate(channels.items())
        ),
        tuple(
            Variable(f"output.{name}", unit_of(name, family), "output", k)
            for k, name in enumerate(names)
        ),
        tuple(parameters_of(plant, (), "fixed", 0)),
        "plant",
        {"plant": f"{family}, digest {plant.digest()}"},
    )
