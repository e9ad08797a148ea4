"""Kernels of a family of environments: the common step with the family's functions in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from pam_envs.envs.core.kernels import advance_plant, trajectory_at
from pam_envs.envs.core.layout import Report, indices
from pam_envs.envs.core.step import MOST_PREVIEW, N_SEED, do_nothing, step_by_address, step_tiles
from pam_envs.kernels.build import LANES, build, interpreted

Kernel = Callable[..., Any]
NONE = indices(())


@dataclass(frozen=True, eq=False)
class Kernels:
    """Kernels of one family, built on first use.

    Attributes
    ----------
    family : str
        Name, also of the machine code on disk.
    maker, key : callable, tuple
        ``maker(*key)`` returns these kernels again: machine code is not pickled.
    report : Report
        Entries of ``info`` and signals of the observation.
    evaluate : kernel
        Writes what is computed of both.
    begin : routine
        Starts an episode.
    rows, parameters, counts : int
        Rows of the state, of the parameters, and of the integers without those of the seed.
    set_points, old_set_points : int
        First row of the set-points, and of those of the previous period.
    channels : int
        References that are tracked at once.
    config, choices : named tuple of int
        Index of each of the family's own numbers and whole numbers in the configuration.
    apply : kernel
        Applies actions and disturbances at the start of a control period; default: nothing.
    advance : kernel
        Advances the plant by a control period; default: by the placeholder ``plant_advance``.
    reference : kernel
        Returns a reference at a control period; default: a drawn trajectory, or given samples.
    placeholders : mapping
        Values of further global names in the call graph, such as those of the plant's kernels.
    """

    family: str
    maker: Callable[..., Any]
    key: tuple[Any, ...]
    report: Report
    evaluate: Kernel
    begin: Kernel
    rows: int
    parameters: int
    counts: int
    set_points: int
    old_set_points: int
    channels: int = 1
    config: Any = NONE
    choices: Any = NONE
    apply: Kernel = do_nothing
    advance: Kernel = advance_plant
    reference: Kernel = trajectory_at
    placeholders: Mapping[str, Any] = field(default_factory=dict)

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

    def _build(
        self, lanes: int, prefix: str, function: Kernel = step_tiles, parallel: bool = False
    ) -> Kernel:
        name = "_".join((prefix, self.family, *map(str, self.key)))
        return build(function, name, parallel, **{**self.names, "LANES": lanes})

    @cached_property
    def interpreted(self) -> Kernel:
        """One environment, in plain Python."""
        return interpreted(step_tiles, {**self.names, "LANES": 1})

    @cached_property
    def single(self) -> Kernel:
        """One environment, called with the address book of its arrays."""
        return self._build(1, "single", step_by_address)

    @cached_property
    def batch(self) -> Kernel:
        """Tiles on one core."""
        return self._build(LANES, "batch")

    @cached_property
    def parallel(self) -> Kernel:
        """Tiles on all cores."""
        return self._build(LANES, "parallel", parallel=True)
