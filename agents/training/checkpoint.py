"""Checkpoint files: replaced atomically, and read without executing code.

A file consists of a magic number, the SHA-256 of the rest, and tensors, numbers and text in torch's
format. It is read with ``weights_only=True``, which builds no other types.
"""

import hashlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import torch

from pam_envs.files import TEMPORARY, write_bytes

MARK = b"PAMCKPT1"


class CheckpointError(ValueError):
    """An unusable checkpoint; the message contains reason and remedy."""


def sweep(folder: Path) -> None:
    """Remove the temporary files of killed writers."""
    for stale in folder.glob(f"*{TEMPORARY}"):
        stale.unlink(missing_ok=True)


def save(path: Path, content: dict[str, Any]) -> None:
    """Write a checkpoint of tensors, arrays, numbers, text, lists and dictionaries."""
    buffer = io.BytesIO()
    torch.save(tensors(content), buffer)
    payload = buffer.getvalue()
    write_bytes(path, MARK + hashlib.sha256(payload).digest() + payload)


def load(path: Path) -> dict[str, Any]:
    """Read a checkpoint of :func:`save`, unless it is damaged; arrays come back as tensors."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise CheckpointError(
            f"no checkpoint can be read at {path}: {error.strerror}; give the folder of a run with "
            "--out, or start anew without --resume (the first checkpoint is written after "
            "checkpoint_steps, 500,000 by default)"
        ) from error
    if not data.startswith(MARK):
        raise CheckpointError(
            f"{path.name} is not a checkpoint of this project, and files of other programs are not "
            "opened because they may run code; start a training of your own and resume that"
        )
    payload = data[len(MARK) + 32 :]
    if hashlib.sha256(payload).digest() != data[len(MARK) : len(MARK) + 32]:
        raise CheckpointError(f"{path.name} is damaged (its checksum differs); start the run anew")
    try:
        content: dict[str, Any] = torch.load(
            io.BytesIO(payload), map_location="cpu", weights_only=True
        )
    except Exception as error:
        raise CheckpointError(
            f"{path.name} holds other things than numbers and text and was not opened"
        ) from error
    return content


def tensors(value: Any) -> Any:
    """Return the content with arrays as tensors of the processor, which need no code to read."""
    if isinstance(value, (np.ndarray, np.generic)):
        return torch.from_numpy(np.array(value))
    if isinstance(value, dict):
        return {key: tensors(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [tensors(entry) for entry in value]
    if isinstance(value, torch.Tensor):
        return value.cpu()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise TypeError(f"a checkpoint holds no {type(value).__name__}")
