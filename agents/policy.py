"""A trained policy as a controller: an ONNX file, run by onnxruntime on one thread.

Needs neither torch nor stable-baselines3, and loading one cannot run code.
"""

from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime  # type: ignore[import-untyped]
from numpy.typing import NDArray

from agents.onnx_file import INPUT, OUTPUT, PolicyFileError, read
from pam_envs.parameters import Signal, Signals

FIELDS = tuple(field.name for field in dataclasses.fields(Signal))


def describe(signals: Signals) -> list[dict[str, Any]]:
    """Return signals as plain values, as they stand on a policy's card."""
    return [dataclasses.asdict(signal) for signal in signals]


class OnnxPolicy:
    """A controller (``predict`` as in stable-baselines3) that is data.

    The normaliser and the limits of the action are inside the file. Each row of a batch is
    computed as if it were alone, to the last bit.

    Attributes
    ----------
    card : dict
        Environment, signals, algorithm, steps, seed, versions and command of the training.
    signals, action_signals : Signals
        What it reads and what it writes.
    """

    def __init__(self, data: bytes, card: dict[str, Any], name: str = "the policy") -> None:
        self.card = card
        self.name = name
        self.signals = _signals(card["signals"], name)
        self.action_signals = _signals(card["action_signals"], name)
        self._digest = hashlib.sha256(data).hexdigest()
        self._session = _session(data, name)
        self._check_shapes()

    @classmethod
    def load(
        cls,
        path: str | Path,
        signals: Signals | None = None,
        action_signals: Signals | None = None,
    ) -> OnnxPolicy:
        """Return the policy in a file, for an environment with these signals.

        Parameters
        ----------
        path : str or Path
            An ONNX file of :func:`agents.export.export_policy`.
        signals, action_signals : Signals, optional
            The environment's (``env.unwrapped.signals``); given, they must be those of the
            training.

        Raises
        ------
        PolicyFileError
            If the file may not be run (see :mod:`agents.onnx_file`) or the signals differ.
        """
        file = read(path)
        made = cls(file.data, file.card, Path(path).name)
        made.check(signals, action_signals)
        return made

    def check(self, signals: Signals | None, action_signals: Signals | None = None) -> None:
        """Raise a clear error unless the signals are those of the training."""
        for mine, theirs, kind in (
            (self.signals, signals, "observation"),
            (self.action_signals, action_signals, "action"),
        ):
            if theirs is not None:
                _compare(mine, theirs, f"{self.name} and the environment differ in the {kind}")

    def predict(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], Any]:
        """Return the action for an observation.

        Parameters
        ----------
        observation : array, shape (n_signals,) or (n_env, n_signals)
        state, episode_start
            Not used: the policy has no memory.
        deterministic : bool
            The file holds the deterministic action; False gives the same.

        Returns
        -------
        array, shape (n_actions,) or (n_env, n_actions), and ``state`` as given
        """
        made = np.asarray(observation, np.float32)
        rows = made if made.ndim == 2 else made[None]
        if made.ndim not in (1, 2) or rows.shape[1] != len(self.signals):
            raise ValueError(
                f"the observation has shape {made.shape}, expected ({len(self.signals)},) or "
                f"(n_env, {len(self.signals)}): {', '.join(self.signals.names())}"
            )
        action = self._session.run([OUTPUT], {INPUT: np.ascontiguousarray(rows)})[0]
        return (action if made.ndim == 2 else action[0]), state

    def digest(self) -> str:
        """Return the SHA-256 of the file, 16 hexadecimal digits."""
        return self._digest[:16]

    def _check_shapes(self) -> None:
        for named, found, number in (
            (INPUT, self._session.get_inputs(), len(self.signals)),
            (OUTPUT, self._session.get_outputs(), len(self.action_signals)),
        ):
            shapes = {node.name: (node.type, node.shape[1:]) for node in found}
            if shapes != {named: ("tensor(float)", [number])}:
                raise PolicyFileError(
                    f"{self.name} has {shapes}, but a policy has one {named!r} of float32, shape "
                    f"(batch, {number}); export it with agents.export.export_policy"
                )


def _session(data: bytes, name: str) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise PolicyFileError(f"{name} is no graph that can be run: {error}") from error


def _signals(described: Any, name: str) -> Signals:
    try:
        return Signals(Signal(**entry) for entry in described)
    except (TypeError, KeyError, ValueError) as error:
        raise PolicyFileError(f"{name}: its card describes no signals ({error})") from error


def _compare(mine: Signals, theirs: Signals, what: str) -> None:
    a, b = list(mine.names()), list(theirs.names())
    if a != b:
        raise PolicyFileError(
            f"{what}: it was trained with {', '.join(a)}, but there is {', '.join(b)}; make the "
            "environment with the arguments on the policy's card (env_kwargs)"
        )
    for trained, given in zip(mine, theirs, strict=True):
        for field in FIELDS:
            if getattr(trained, field) != getattr(given, field):
                raise PolicyFileError(
                    f"{what}: {trained.name} had {field} = {getattr(trained, field)!r} in "
                    f"training, now {getattr(given, field)!r}; make the environment alike"
                )
