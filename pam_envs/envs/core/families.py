"""Kernels of a family of environments: the common step with the family's functions in it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from pam_envs.envs.core.kernels import advance_plant, trajectory_at
from pam_envs.envs.core.layout import Report, indices
from pam_envs.envs.core.step import (
    MOST_PREVIEW,
    N_ARRAYS,
    N_SEED,
    do_nothing,
    step_by_address,
    step_tiles,
)
from pam_envs.kernels.build import LANES, build, interpreted
from pam_envs.kernels.machine_code import AddressKernel, MachineCode

Kernel = Callable[..., Any]
NONE = indices(())


@dataclass(frozen=True, eq=False)
class Kernels:
    """Kernels of one family, built on first use."""

    family: str
    """Name, also of the machine code on disk."""
    maker: Callable[..., Any]
    key: tuple[Any, ...]
    """``maker(*key)`` returns these kernels again: machine code is not pickled."""
    report: Report
    """Entries of ``info`` and signals of the observation."""
    evaluate: Kernel
    """Writes the computed ones of both."""
    begin: Kernel
    """Starts an episode."""
    rows: int
    parameters: int
    counts: int
    """Rows of state and parameters, and integer rows without those of the seed."""
    set_points: int
    old_set_points: int
    """First row of the setpoints, and of those of the previous period."""
    channels: int = 1
    """References that are tracked at once."""
    config: Any = NONE
    choices: Any = NONE
    """Index of each of the family's own numbers and whole numbers in the configuration."""
    indices: Mapping[int, int] = field(default_factory=dict)
    """Rows of the state that hold an index, with the place of its number of values in ``choices``.
    """
    apply: Kernel = do_nothing
    """Applies actions and disturbances at the start of a control period."""
    advance: Kernel = advance_plant
    """Advances the plant by a control period."""
    reference: Kernel = trajectory_at
    """Returns a reference at a control period."""
    placeholders: Mapping[str, Any] = field(default_factory=dict)
    """Values of further global names in the call graph, such as those of the plant's kernels."""

    @property
    def n_counts(self) -> int:
        """Integer rows with those of the seed."""
        return self.counts + N_SEED

    @cached_property
    def names(self) -> dict[str, Any]:
        """Values of global names in the call graph of the step."""
        keys, channels = self.report.keys, self.channels
        return {
            **self.placeholders,
            "env_apply": self.apply,
            "env_advance": self.advance,
            "env_reference": self.reference,
            "env_evaluate": self.evaluate,
            "env_begin": self.begin,
            "N_ROWS": self.rows,
            "N_PARAMETERS": self.parameters,
            "N_COUNTS": self.n_counts,
            "N_WORK_ROWS": self.report.end + channels * (1 + MOST_PREVIEW),
            "FIRST_INFO": self.report.scratch,
            "N_INFO": len(keys),
            "N_REWARDS": sum(key.startswith("reward/") for key in keys),
            "COPIED": self.report.copied,
            "CHANNELS": channels,
            "FIRST_SET_POINT": self.set_points,
            "FIRST_OLD_SET_POINT": self.old_set_points,
        }

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the key instead of machine code."""
        return self.maker, self.key

    def _name(self, prefix: str) -> str:
        return "_".join((prefix, self.family, *map(str, self.key)))

    def _build(self, prefix: str, parallel: bool = False) -> Kernel:
        return build(step_tiles, self._name(prefix), parallel, **{**self.names, "LANES": LANES})

    @cached_property
    def interpreted(self) -> Kernel:
        """One environment, in plain Python."""
        return interpreted(step_tiles, {**self.names, "LANES": 1})

    @cached_property
    def by_address(self) -> AddressKernel:
        """Kernel of one environment that takes the address book of its arrays."""
        names = {**self.names, "LANES": 1}
        return AddressKernel(self._name("single"), step_by_address, names, 4 * N_ARRAYS)

    @cached_property
    def single(self) -> MachineCode:
        """Machine code of one environment."""
        return MachineCode(self)

    @cached_property
    def batch(self) -> Kernel:
        """Tiles on one core."""
        return self._build("batch")

    @cached_property
    def parallel(self) -> Kernel:
        """Tiles on all cores."""
        return self._build("parallel", parallel=True)
