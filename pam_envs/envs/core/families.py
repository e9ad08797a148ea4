"""Kernels of a family of environments: the common step with the family's functions in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

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
    name : str
        Name of the machine code on disk: the family and the key.
    maker, key : callable, tuple
        ``maker(*key)`` returns these kernels again: machine code is not pickled.
    report : Report
        Entries of ``info``, in the order in which ``evaluate`` writes them.
    advance : kernel
        Advances the plant by a control period.
    reference : kernel
        Returns a reference at a control period.
    evaluate : kernel
        Writes report and observation.
    begin : routine
        Starts an episode.
    apply : kernel
        Applies actions and disturbances at the start of a control period; default: nothing.
    config, choices : named tuple of int
        Index of each of the family's own numbers and whole numbers in the configuration.
    placeholders : mapping
        Values of further global names in the call graph, such as those of the plant's kernels.
    rows, parameters, counts : int
        Rows of the state, of the parameters, and of the integers without those of the seed.
    signals : int
        Signals of an observation without its references and their previews, at most.
    set_points, old_set_points : int
        First row of the set-points, and of those of the previous period.
    channels : int
        References that are tracked at once.
    """

    name: str
    maker: Callable[..., Any]
    key: tuple[Any, ...]
    report: Report
    advance: Kernel
    reference: Kernel
    evaluate: Kernel
    begin: Kernel
    rows: int
    parameters: int
    counts: int
    signals: int
    set_points: int
    old_set_points: int
    channels: int = 1
    config: Any = NONE
    choices: Any = NONE
    apply: Kernel = do_nothing
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
            "N_WORK_ROWS": self.report.signals + self.signals + channels * (1 + MOST_PREVIEW),
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

    def _build(self, name: str, lanes: int, parallel: bool = False) -> Callable[..., Any]:
        names = {**self.names, "LANES": lanes}
        return build(step_tiles, f"{name}_{self.name}", parallel, **names)

    @cached_property
    def interpreted(self) -> Callable[..., Any]:
        """One environment, in plain Python."""
        return interpreted(step_tiles, {**self.names, "LANES": 1})

    @cached_property
    def single(self) -> Callable[..., Any]:
        """One environment, called with the address book of its arrays."""
        return build(step_by_address, f"single_{self.name}", **{**self.names, "LANES": 1})

    @cached_property
    def batch(self) -> Callable[..., Any]:
        """Tiles on one core."""
        return self._build("batch", LANES)

    @cached_property
    def parallel(self) -> Callable[..., Any]:
        """Tiles on all cores."""
        return self._build("parallel", LANES, parallel=True)
