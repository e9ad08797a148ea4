"""Data sets of ``python -m benchmarks dataset``: columns by name, and transitions for learning."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import minari  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

import pam_envs  # noqa: F401  (registers the environments)
from agents.settings.schema import SettingsError
from pam_envs.arrays import Array
from pam_envs.parameters import Signal, Signals
from pam_envs.wording import near

SPLITS = ("train", "validation", "test")
Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Episode:
    """An episode of n control periods, in SI units."""

    observations: dict[str, Array]
    """Observed signals by name, shape (n + 1,) each."""
    actions: dict[str, Array]
    """Setpoints by name, shape (n,) each."""
    infos: dict[str, Array]
    """Output, reference and true states (privileged), shape (n + 1,) each."""
    rewards: Array
    """Rewards [1], shape (n,)."""
    parameters: dict[str, float]
    """Parameters of the plant that the episode has drawn (privileged)."""
    split: str
    """``"train"``, ``"validation"`` or ``"test"``, by the drawn parameters."""
    seed: int
    """Seed of the reset."""


@dataclass(frozen=True)
class Transitions:
    """Transitions of a data set, observations and actions in [-1, 1]."""

    observations: Floats
    """Shape (n, n_signals)."""
    actions: Floats
    """Shape (n, n_actions)."""
    rewards: Floats
    """Shape (n,)."""
    next_observations: Floats
    """Shape (n, n_signals)."""
    terminations: Floats
    """1 where a limit ended the episode, 0 elsewhere (also at its regular end), shape (n,)."""
    returns: Floats
    """Sum of the rewards of each episode, shape (n_episodes,)."""


class DataSet:
    """A data set in a folder, for example ``datasets/PAM/KneeWalk/expert-v0``.

    ``minari`` is the data set as Minari sees it, ``metadata`` are its settings, scores and
    parameter ranges.

    Parameters
    ----------
    folder : path
        Folder with ``data/main_data.hdf5`` and ``data/metadata.json``.

    Raises
    ------
    SettingsError
        If the folder holds no data set of this package.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        try:
            text = (self.folder / "data" / "metadata.json").read_text(encoding="utf-8")
            self.metadata: dict[str, Any] = json.loads(text)
            self.env = str(self.metadata["settings"]["env"])
            self.signals = Signals(Signal(**entry) for entry in self.metadata["signals"])
            actions = self.metadata["action_signals"]
            self.action_signals = Signals(Signal(**entry) for entry in actions)
            self.minari = minari.MinariDataset(self.folder / "data")
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise SettingsError(
                f"{self.folder} holds no data set of this package ({error}); write one with "
                "python -m benchmarks dataset ENV"
            ) from error

    def episodes(self, split: str = "") -> Iterator[Episode]:
        """Yield the episodes of a split, of all splits by default."""
        if split not in ("", *SPLITS):
            raise SettingsError(f"no split named {split!r}{near(split, SPLITS)}")
        for raw, label in self._raw(split):
            seen, given = raw.observations, raw.actions
            yield Episode(
                {name: seen[:, k].astype(float) for k, name in enumerate(self.signals.names())},
                {
                    name: given[:, k].astype(float)
                    for k, name in enumerate(self.action_signals.names())
                },
                dict(_flat(raw.infos)),
                np.asarray(raw.rewards, np.float64),
                {name: float(value) for name, value in label.get("parameters", {}).items()},
                str(label["split"]),
                int(label["seed"]),
            )

    def _raw(self, split: str) -> Iterator[tuple[Any, dict[str, Any]]]:
        indices = self.minari.episode_indices
        labels = self.minari.storage.get_episode_metadata(indices)
        for raw, label in zip(self.minari.iterate_episodes(indices), labels, strict=True):
            if split in ("", label["split"]):
                yield raw, label

    def transitions(self, split: str = "train") -> Transitions:
        """Return the transitions of a split, normalised by the ranges of the signals."""
        parts: list[tuple[Any, ...]] = []
        for raw, _ in self._raw(split):
            seen = normalised(raw.observations, self.signals)
            given = normalised(raw.actions, self.action_signals)
            rewards = np.asarray(raw.rewards, np.float32)
            ended = np.asarray(raw.terminations, np.float32)
            parts.append((seen[:-1], given, rewards, seen[1:], ended, [rewards.sum()]))
        if not parts:
            raise SettingsError(f"{self.folder} has no episode in the split {split!r}")
        columns = (np.concatenate(column) for column in zip(*parts, strict=True))
        return Transitions(*(column.astype(np.float32) for column in columns))


def normalised(vectors: NDArray[Any], signals: Signals) -> Floats:
    """Return vectors of SI values, shape (n, n_signals), in [-1, 1] by the signals' ranges."""
    low = np.array([signal.low for signal in signals])
    high = np.array([signal.high for signal in signals])
    inside = np.clip(np.asarray(vectors, np.float64), low, high)
    made: Floats = (2.0 * (inside - low) / (high - low) - 1.0).astype(np.float32)
    return made


def _flat(infos: Any, prefix: str = "") -> Iterator[tuple[str, Array]]:
    """Yield the columns of nested infos by their path."""
    for name, value in infos.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}/")
        else:
            yield f"{prefix}{name}", np.asarray(value, np.float64)
