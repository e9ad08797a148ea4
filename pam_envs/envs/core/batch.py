"""Common base of batches on any device: spaces, seeds of rows, masks of resets."""

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from pam_envs.envs.core.setup import (
    Configured,
    Setup,
    check_seed,
    check_whole,
    fresh_seed,
    space_of,
)


class Batch(Configured, VectorEnv[Any, Any, Any]):
    """Environments that are stepped together, on any device."""

    metadata = {
        "render_modes": ["rgb_array"],
        "render_fps": 100,
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def _configure_batch(self, num_envs: int, setup: Setup) -> None:
        """Set the number of rows and the spaces."""
        self.num_envs = check_whole("num_envs", num_envs, 1, 2**24)
        self.single_observation_space = space_of(setup.signals)
        self.single_action_space = space_of(setup.action_signals)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._seeded = False

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        """Return which rows a reset with these options starts."""
        self._check_options(options, ("reset_mask",))
        mask = np.ones(self.num_envs, np.bool_)
        if options is not None and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
                raise ValueError(
                    f"reset_mask has shape {mask.shape} and type {mask.dtype}, expected "
                    f"({self.num_envs},) of bool"
                )
        if not self._seeded and not mask.all():
            raise ValueError("the first reset must reset every row; leave reset_mask out")
        return mask

    def _seeds(self, seed: Any) -> list[int | None] | None:
        if seed is None:
            if self._seeded:
                return None
            seed = fresh_seed()
        if isinstance(seed, (int, np.integer)) and not isinstance(seed, bool):
            first = check_seed(seed)
            return [first + i for i in range(self.num_envs)]
        if not isinstance(seed, (list, tuple)) or len(seed) != self.num_envs:
            raise ValueError(
                f"seed = {str(seed)[:60]} must be a non-negative whole number or a list of "
                f"{self.num_envs} of them"
            )
        made: list[int | None] = [None if s is None else check_seed(s) for s in seed]
        if not self._seeded:
            return [fresh_seed() if s is None else s for s in made]
        return made
