"""Trained policy as a controller: an ONNX file, run by onnxruntime on one thread.

Inference needs neither torch nor stable-baselines3, and loading a file cannot run code.
"""

import dataclasses
import hashlib
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime  # type: ignore[import-untyped]
from numpy.typing import NDArray

from agents.policies import policy_file as files
from pam_envs.parameters import Signal, Signals
from pam_envs.wording import printable, shown

NAME, UNIT = re.compile(r"[\w .-]{1,100}", re.ASCII), re.compile(r"[\w .^/%°-]{1,20}")
"""Names and units of signals, which an export writes into source code."""
FIELDS = tuple(field.name for field in dataclasses.fields(Signal))


def describe(signals: Signals) -> list[dict[str, Any]]:
    """Return signals as plain values, as on a policy's card."""
    return [dataclasses.asdict(signal) for signal in signals]


class OnnxPolicy:
    """Policy file with the ``predict`` method of stable-baselines3.

    The file includes the normaliser, the history and the limits of the action. A row's action does
    not depend on the other rows of a batch, to the last bit. A policy that corrects a controller
    acts together with it: see :class:`agents.policies.residual.ResidualPolicy`.

    ``data`` are the bytes of the file. ``memory`` is the width of the state, of a recurrent layer
    or a history, 0 for none; ``corrects`` the name of the controller that it corrects, empty for
    none; ``signals`` and ``action_signals`` are those of input and output. The ``card`` has
    environment, signals, algorithm, steps, seed, versions and command of the training.
    """

    def __init__(self, data: bytes, card: dict[str, Any], name: str = "the policy") -> None:
        self.card = card
        self.name = name
        self.signals = _signals(card["signals"], name)
        self.action_signals = _signals(card["action_signals"], name)
        self.corrects = _corrects(card, name)
        self.data = data
        self._digest = hashlib.sha256(data).hexdigest()
        self._session = _session(data, name)
        self.memory = self._check_shapes()

    @classmethod
    def load(
        cls,
        path: str | Path,
        signals: Signals | None = None,
        action_signals: Signals | None = None,
    ) -> "OnnxPolicy":
        """Return the policy in a file, for an environment with these signals.

        The signals (``env.unwrapped.signals``), if given, must equal those of the training; a
        PolicyFileError says that they differ, or that the file is refused
        (:mod:`agents.policies.policy_file`).
        """
        file = files.read(path)
        made = cls(file.data, file.card, Path(path).name)
        made.check(signals, action_signals)
        return made

    def check(self, signals: Signals | None, action_signals: Signals | None = None) -> None:
        """Raise unless the signals are those of the training."""
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
        """Return the action for an observation, and the state for the next call.

        The observation has shape (n_signals,) or (n_env, n_signals), the action likewise. The state
        (1 or n_env, memory) is that of the last call; None begins an episode in every row, and rows
        with ``episode_start`` begin one. It is ignored by a policy without memory, as is
        ``deterministic``: the file holds the deterministic action. A ValueError says that the
        observation has another shape, or that the policy corrects a controller.
        """
        if self.corrects:
            raise ValueError(
                f"{self.name} corrects the controller {self.corrects!r} and does not act alone; "
                "make it with agents.policies.residual.with_controller(policy, plant)"
            )
        return self.answer(observation, state, episode_start)

    def answer(
        self,
        observation: NDArray[Any],
        state: Any = None,
        episode_start: Any = None,
        controller: NDArray[np.float32] | None = None,
    ) -> tuple[NDArray[np.float32], Any]:
        """Return the corrected action, given that of the controller; see :meth:`predict`."""
        made = np.asarray(observation, np.float32)
        rows = made if made.ndim == 2 else made[None]
        if made.ndim not in (1, 2) or rows.shape[1] != len(self.signals):
            raise ValueError(
                f"the observation has shape {made.shape}, expected ({len(self.signals)},) or "
                f"(n_env, {len(self.signals)}): {', '.join(self.signals.names())}"
            )
        fed = {files.INPUT: np.ascontiguousarray(rows)}
        if controller is not None:
            fed[files.CONTROLLER] = np.ascontiguousarray(controller).reshape(len(rows), -1)
        if self.memory:
            fed |= self._state_inputs(state, episode_start, len(rows))
            action, state = self._session.run([files.OUTPUT, files.AFTER], fed)
        else:
            action = self._session.run([files.OUTPUT], fed)[0]
        return (action if made.ndim == 2 else action[0]), state

    def _state_inputs(self, state: Any, episode_start: Any, rows: int) -> dict[str, NDArray[Any]]:
        """Return the graph's inputs for the state and the episode starts."""
        starts = np.zeros((rows, 1), np.float32)
        if state is None:
            starts[:] = 1.0
            return {files.STATE: np.zeros((rows, self.memory), np.float32), files.START: starts}
        if episode_start is not None:
            starts[:, 0] = episode_start
        if np.shape(state) != (rows, self.memory):
            raise ValueError(
                f"the state has shape {np.shape(state)}, expected ({rows}, {self.memory}); "
                "give the state that the last call returned, or None to begin"
            )
        return {files.STATE: state, files.START: starts}

    def digest(self) -> str:
        """Return the SHA-256 of the file, 16 hexadecimal digits."""
        return self._digest[:16]

    def _check_shapes(self) -> int:
        """Raise unless inputs and outputs are a policy's; return the width of its state."""
        actions = len(self.action_signals)
        memory = _width(self._session.get_inputs(), files.STATE)
        inputs = {files.INPUT: len(self.signals)}
        outputs = {files.OUTPUT: actions}
        if self.corrects:
            inputs[files.CONTROLLER] = actions
        if memory:
            inputs |= {files.STATE: memory, files.START: 1}
            outputs[files.AFTER] = memory
        for expected, found in (
            (inputs, self._session.get_inputs()),
            (outputs, self._session.get_outputs()),
        ):
            shapes = {node.name: (node.type, node.shape[1:]) for node in found}
            if shapes != {name: ("tensor(float)", [width]) for name, width in expected.items()}:
                raise files.PolicyFileError(
                    f"{self.name} has {shapes}, but its card requires float32 numbers per row as "
                    f"follows: {expected}; export it with agents.export.export.export_policy"
                )
        return memory


def _width(nodes: Any, name: str) -> int:
    """Return the number of columns of an input, 0 if it does not exist."""
    shapes = [node.shape for node in nodes if node.name == name]
    return shapes[0][1] if shapes and len(shapes[0]) == 2 and isinstance(shapes[0][1], int) else 0


def _corrects(card: dict[str, Any], name: str) -> str:
    try:
        return str(card["baseline"]["name"]) if "baseline" in card else ""
    except (TypeError, KeyError) as error:
        raise files.PolicyFileError(
            f"{name}: its card does not name the controller that it corrects"
        ) from error


def _session(data: bytes, name: str) -> onnxruntime.InferenceSession:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise files.PolicyFileError(
            f"{name} is no executable graph: {printable(str(error))}"
        ) from error


def _signals(described: Any, name: str) -> Signals:
    try:
        made = Signals(Signal(**entry) for entry in described)
        for signal in made:
            numbers = np.array([signal.low, signal.high, signal.ahead])
            text = NAME.fullmatch(signal.name) and UNIT.fullmatch(signal.unit)
            if not text or numbers.dtype.kind not in "iuf" or not np.isfinite(numbers).all():
                raise ValueError(f"signal {shown(signal.name)}")
        return made
    except (TypeError, KeyError, ValueError) as error:
        raise files.PolicyFileError(f"{name}: its card describes no signals ({error})") from error


def _equal(a: Any, b: Any) -> bool:
    """Return whether two entries of a signal are equal, numbers up to the rounding of a product."""
    if isinstance(a, float) and isinstance(b, float):
        return math.isclose(a, b, rel_tol=1e-12)
    return bool(a == b)


def _compare(mine: Signals, theirs: Signals, what: str) -> None:
    a, b = list(mine.names()), list(theirs.names())
    if a != b:
        raise files.PolicyFileError(
            f"{what}: trained with {', '.join(a)}, now {', '.join(b)}; make the "
            "environment with the arguments on the policy's card (env_kwargs)"
        )
    for trained, given in zip(mine, theirs, strict=True):
        for field in FIELDS:
            if not _equal(getattr(trained, field), getattr(given, field)):
                raise files.PolicyFileError(
                    f"{what}: {trained.name} had {field} = {getattr(trained, field)!r} in "
                    f"training, now {getattr(given, field)!r}; make the environment with the "
                    "arguments on the policy's card (env_kwargs)"
                )
