"""Saved states of environments: sealed with a digest of their content, and checked before use.

The digest finds damage and unintended changes. It is no signature: :func:`sealed` makes a new one
for a state that was changed on purpose, which is then only checked for its ranges.
"""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.setup import Setup
from pam_envs.envs.core.step import MEMBER

State = dict[str, NDArray[Any]]
SEAL = "digest"
"""Key of the SHA-256 of a saved state's other arrays, as 32 bytes."""
STATE_KEYS = ("rows", "fixed", "counts", "ahead")


def saved(parts: tuple[Any, ...]) -> State:
    """Return copies of the parts of a state, as arrays by name."""
    kinds = {"counts": np.int64}
    return {
        name: np.array(part, kinds.get(name, np.float64))
        for name, part in zip(STATE_KEYS, parts, strict=True)
    }


def check_state(
    state: Any, setup: Setup, tiles: int, lanes: int, started: bool
) -> list[NDArray[Any]]:
    """Return the parts of a saved state of tiles of lanes as new arrays, checked.

    Every integer, and every index in the rows of floats, is bounded on both sides. ``started`` is
    False before the first reset, when all integers are 0.
    """
    parts: list[NDArray[Any]] = []
    least, most = setup.count_limits() if started else (0, 0)
    for name, zeros in zip(STATE_KEYS, setup.state(tiles, lanes), strict=True):
        part = np.array(saved_part(state, name, zeros.shape, "iu" if name == "counts" else "iuf"))
        part = part.astype(zeros.dtype)
        if name == "counts":
            check_limits(name, part, least, most)
        if name == "rows":
            for row, number in setup.kernels.indices.items():
                check_limits(f"{name}[:, {row}]", part[:, row], 0, setup.shared[-1][number] - 1)
        parts.append(part)
    if started:
        low, high = setup.parameter_limits(parts[2][:, MEMBER])
        check_limits("fixed", parts[1], low, high)
    return parts


def saved_part(state: Any, name: str, shape: tuple[int, ...], kinds: str) -> NDArray[Any]:
    """Return one array of a saved state, finite, of a shape and of one of the kinds of types."""
    if not isinstance(state, Mapping) or name not in state:
        raise ValueError(f"the state has no {name!r}: it was not made by get_state")
    try:
        part = np.asarray(state[name])
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"the state's {name!r} are not numbers: {error}") from error
    if part.dtype.kind not in kinds:
        raise ValueError(
            f"the state's {name!r} are of type {part.dtype}: it was not made by get_state"
        )
    if part.shape != shape:
        raise ValueError(
            f"the state's {name!r} has shape {part.shape}, this environment {shape}: it was "
            "taken with other arguments"
        )
    check_limits(name, part, -np.inf, np.inf)
    return part


def check_limits(name: str, part: NDArray[Any], least: Any, most: Any) -> None:
    """Raise ValueError if a part of a saved state has values that are not finite or in a range."""
    wrong = ~(np.isfinite(part) & (part >= least) & (part <= most))
    if wrong.any():
        raise ValueError(
            f"the state's {name!r} hold {part[wrong][0]}, which get_state never returns"
        )


def sealed(state: Mapping[str, Any]) -> State:
    """Return a saved state with a new digest, for ``set_state`` after a change on purpose.

    Parameters
    ----------
    state : mapping
        Arrays of ``get_state``, some of them changed.
    """
    content = {name: np.asarray(part) for name, part in state.items() if name != SEAL}
    code = hashlib.sha256()
    for name in sorted(content, key=str):
        part = content[name]
        code.update(f"{name} {part.dtype.newbyteorder('<').str} {part.shape}\n".encode())
        code.update(part.astype(part.dtype.newbyteorder("<"), copy=False).tobytes())
    return {**content, SEAL: np.frombuffer(code.digest(), np.uint8).copy()}


def check_seal(state: Mapping[str, Any]) -> None:
    """Raise ValueError unless the digest of a saved state is that of its arrays."""
    if not np.array_equal(saved_part(state, SEAL, (32,), "u"), sealed(state)[SEAL]):
        raise ValueError(
            "the state has changed since get_state: its digest differs; restore the original, or "
            "seal a change on purpose with pam_envs.envs.core.saved_state.sealed(state)"
        )
