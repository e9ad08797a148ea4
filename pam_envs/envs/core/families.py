"""The common step with a family's functions and sizes in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

from pam_envs.envs.core.step import N_SEED, step_by_address, step_tiles
from pam_envs.kernels.build import LANES, build, interpreted


class Kernels:
    """The functions for one family of environments, built when first asked for.

    Parameters
    ----------
    name : str
        Of the family and what tells its kernels apart; the compiled code is kept under it.
    maker, key : callable, tuple
        ``maker(*key)`` returns these kernels again: compiled code is not copied.
    functions : mapping
        What takes the place of ``env_apply`` (what the world does at the start of a period),
        ``env_advance`` (the plant's step), ``env_reference`` (a reference at a control period),
        ``env_evaluate`` (report and observation) and ``env_begin`` (the start of an episode), and
        of placeholders in the plant's kernels.
    info : tuple of str
        Keys of ``info`` in the order in which ``env_evaluate`` writes them.
    rows, parameters, counts : int
        Rows of the state, of the parameters, and of the integers without those of the seed.
    scratch : int
        Rows of scratch that the plant needs; ``info`` follows them in ``work``.
    signals : int
        Most signals of an observation.
    set_points, old_set_points : int
        First row of the set-points, and of those of the period before.
    channels : int
        References that are tracked at once.
    """

    def __init__(
        self,
        name: str,
        maker: Callable[..., Any],
        key: tuple[Any, ...],
        functions: Mapping[str, Any],
        *,
        info: tuple[str, ...],
        rows: int,
        parameters: int,
        counts: int,
        scratch: int,
        signals: int,
        set_points: int,
        old_set_points: int,
        channels: int = 1,
    ) -> None:
        self.name, self._made_by = name, (maker, key)
        self.info, self.channels = info, channels
        self.n_rows, self.n_parameters, self.n_counts = rows, parameters, counts + N_SEED
        self.names = {
            **functions,
            "N_ROWS": rows,
            "N_PARAMETERS": parameters,
            "N_COUNTS": self.n_counts,
            "N_WORK_ROWS": scratch + len(info) + 1 + signals,
            "FIRST_INFO": scratch,
            "N_INFO": len(info),
            "N_REWARDS": sum(name.startswith("reward/") for name in info),
            "CHANNELS": channels,
            "FIRST_SET_POINT": set_points,
            "FIRST_OLD_SET_POINT": old_set_points,
        }

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the key: compiled code is not copied."""
        return self._made_by

    def _build(self, name: str, lanes: int, parallel: bool = False) -> Callable[..., Any]:
        names = {**self.names, "LANES": lanes}
        return build(step_tiles, f"{name}_{self.name}", parallel, **names)

    @cached_property
    def interpreted(self) -> Callable[..., Any]:
        """One environment, in plain Python."""
        return interpreted(step_tiles, {**self.names, "LANES": 1})

    @cached_property
    def single(self) -> Callable[..., Any]:
        """One environment, by an address book of the arrays."""
        return build(step_by_address, f"single_{self.name}", **{**self.names, "LANES": 1})

    @cached_property
    def batch(self) -> Callable[..., Any]:
        """Tiles on one core."""
        return self._build("batch", LANES)

    @cached_property
    def parallel(self) -> Callable[..., Any]:
        """Tiles over all cores."""
        return self._build("parallel", LANES, parallel=True)
