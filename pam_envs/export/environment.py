"""The model of an environment."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pam_envs.envs.core.setup import Setup
from pam_envs.envs.core.step import CHOICE, FIRST_CHOICE, N_ARRAYS, seed_by_address
from pam_envs.export.model import Block, Model, Variable, parameters_of, signal_variables, snake
from pam_envs.export.units import unit_of
from pam_envs.kernels.machine_code import AddressKernel

SEEDED = "seed"


@dataclass(frozen=True)
class SeedKernel:
    """Kernel that gives an environment its seed."""

    n_counts: int

    @property
    def by_address(self) -> AddressKernel:
        """The kernel, for this number of integer rows."""
        names = {"N_COUNTS": self.n_counts, "LANES": 1}
        return AddressKernel(f"seed_{self.n_counts}", seed_by_address, names, 4 * N_ARRAYS)


def environment_model(env_id: str, env: Any) -> Model:
    """Return the model of an environment as it is configured.

    Parameters
    ----------
    env_id : str
        As ``PAM/KneeWalk-v0``.
    env : PlantEnv
        A single environment.
    """
    setup: Setup = env.setup
    kernels, family = setup.kernels, setup.kernels.family
    signals, actions, keys = setup.signals, setup.action_signals, setup.info_keys
    rows, fixed, counts, ahead = setup.state(1, 1)
    tables, samples, settings, choices = setup.shared
    arrays = {
        "rows": rows,
        "fixed": fixed,
        "counts": counts,
        "ahead": ahead,
        "tables": tables,
        "samples": samples,
        "settings": settings,
        "choices": choices,
        "action": np.zeros((1, len(actions))),
        "observation": np.zeros((1, 1, len(signals)), np.float32),
        "report": np.zeros((1, len(keys) + 1, 1)),
        "flags": np.zeros((2, 1), np.int8),
    }
    shapes = {  # the kernel never touches the half for automatic resets
        "observation": (2, 1, len(signals)),
        "report": (2, len(keys) + 1, 1),
    }
    constant = ("tables", "samples", "choices")
    blocks = tuple(
        Block(name, np.ascontiguousarray(values), shapes.get(name, values.shape), name in constant)
        for name, values in arrays.items()
    )
    own = {"reference": _unit(signals, "reference"), "output": _unit(signals, "reference")}
    if family == "elbow":
        own["command"] = actions[0].unit
    outputs = [
        *signal_variables(signals, "observation", "observation."),
        Variable("reward", "1", "report", 0),
        *(
            Variable(f"info.{k}", unit_of(k, family, own), "report", i + 1)
            for i, k in enumerate(keys)
        ),
        Variable("terminated", "1", "flags", 0),
        Variable("truncated", "1", "flags", 1),
    ]
    inputs = signal_variables(actions, "action")
    at = [int(choices[CHOICE.at_members]) * settings.shape[1], int(choices[CHOICE.members])]
    parameters = (
        parameters_of(setup.plant, setup.fixed_parameters, "settings", at[0])
        if at[1] == 1 and not setup.drawn
        else []
    )
    if family == "positioning" and choices[FIRST_CHOICE] == 1:  # one load, not several to draw from
        load, row = signals["load"], int(choices[CHOICE.at_own])
        parameters.append(
            Variable(
                "load", load.unit, "settings", row * settings.shape[1], float(settings[row, 0]),
                load.low, load.high, "load that hangs at the start",
            )
        )  # fmt: skip
    return Model(
        env_id,
        snake(env_id.rpartition("/")[2]),
        setup.control_period,
        blocks,
        {"kernel": kernels, SEEDED: SeedKernel(kernels.n_counts)},
        tuple(inputs),
        tuple(outputs),
        tuple(parameters),
        "environment",
        {"environment": env_id, "plant": f"{setup.plant.family}, digest {setup.plant.digest()}"},
    )


def _unit(signals: Any, name: str) -> str:
    return next((s.unit for s in signals if s.name.startswith(name)), "1")
