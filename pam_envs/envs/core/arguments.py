"""Keyword arguments that all environments share, checked and turned into what a setup holds."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.setup import check_choice, check_number, check_whole
from pam_envs.envs.core.step import MOST_PREVIEW
from pam_envs.hysteresis.protocol import kinds, model_of
from pam_envs.parameters import check, declarations

T = TypeVar("T")

RENDER_MODES = (None, "rgb_array", "human")


F = TypeVar("F", bound=Callable[..., Any])


def named_arguments(make: F) -> F:
    """Let a function of keyword arguments say, of one that it does not have, which it has."""
    parameters = inspect.signature(make).parameters
    known = [name for name, p in parameters.items() if p.default is not p.empty]

    @functools.wraps(make)
    def made(*given: Any, **arguments: Any) -> Any:
        for name in arguments:
            if name not in parameters:
                close = difflib.get_close_matches(name, known, n=1)
                hint = f", but {close[0]!r}" if close else ""
                raise TypeError(
                    f"there is no argument {name!r}{hint}; the arguments are {', '.join(known)}"
                )
        return make(*given, **arguments)

    return made  # type: ignore[return-value]


@dataclass(frozen=True)
class Common:
    """Arguments that mean the same in every environment.

    Attributes
    ----------
    preview, stride : int
        Future reference samples, and control periods between them.
    seconds : float
        Duration of an episode [s].
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As Gymnasium means it.
    """

    preview: int
    stride: int
    seconds: float
    normalize: bool
    render_mode: str | None


def common(
    preview: Any, preview_stride: Any, episode_seconds: Any, normalize: Any, render_mode: Any
) -> Common:
    """Return the shared arguments, checked."""
    check_choice("render_mode", render_mode, RENDER_MODES)
    check_choice("normalize", normalize, (True, False))
    return Common(
        preview=check_whole("preview", preview, 0, MOST_PREVIEW),
        stride=check_whole("preview_stride", preview_stride, 1, 1000),
        seconds=check_number("episode_seconds", episode_seconds, 0.02, 3600.0, "s"),
        normalize=normalize,
        render_mode=render_mode,
    )


def plant_of(kind: type[T], plant: Any, hysteresis: Any, stock: Callable[[Any], T]) -> T:
    """Return the plant that ``plant`` and ``hysteresis`` name.

    Parameters
    ----------
    kind : type
        Class of the plants.
    plant : object, path or None
        As given by the user.
    hysteresis : str or None
        As given by the user.
    stock : callable
        Returns the plant to take without ``plant``, by its hysteresis.
    """
    if hysteresis is not None:
        check_choice("hysteresis", hysteresis, kinds())
    if plant is None:
        return stock(hysteresis or "maxwell_slip")
    made: Any = kind.from_yaml(plant) if isinstance(plant, (str, Path)) else plant  # type: ignore[attr-defined]
    if not isinstance(made, kind):
        raise ValueError(
            f"plant = {str(plant)[:60]!r} must be a {kind.__name__}, the path of a plant file, "
            "or None"
        )
    found: Any = made
    if hysteresis is not None and model_of(hysteresis).identity:
        return found.replace({"hysteresis.operator": None})  # type: ignore[no-any-return]
    if hysteresis is not None and hysteresis != found.hysteresis.choice:
        raise ValueError(
            f"hysteresis = {hysteresis!r} but the plant's hysteresis is {found.hysteresis.choice!r}; "
            "leave hysteresis out, or give a plant identified with that hysteresis"
        )
    return made


def reference_of(
    reference: Any,
    families: Sequence[str],
    unit: str,
    largest: float | Sequence[float],
    channels: int = 1,
) -> tuple[int, NDArray[np.float64]]:
    """Return the number of the reference's family, and its samples where it is given as such.

    Parameters
    ----------
    reference : str or array_like, shape (n,) or (n, channels)
        As given by the user.
    families : sequence of str
        Those there are; ``len(families)`` is the number of given samples.
    unit : str
        Of the samples; of several channels with a comma between them.
    largest : float or sequence of float
        Largest size of a sample, of each channel.
    channels : int
        References that are tracked at once.

    Returns
    -------
    family : int
    samples : ndarray, shape (channels, n)
    """
    if isinstance(reference, str):
        check_choice("reference", reference, tuple(families))
        return list(families).index(reference), np.zeros((channels, 1))
    try:
        samples = np.array(reference, np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"reference = {str(reference)[:60]!r} must be one of {', '.join(families)} or samples"
        ) from error
    shaped = samples[:, None] if samples.ndim == channels == 1 else samples
    if shaped.ndim != 2 or not len(shaped) or not np.isfinite(shaped).all():
        raise ValueError(
            f"reference has shape {samples.shape}; give a finite sample [{unit}] for each control "
            "period"
        )
    if shaped.shape[1] != channels:
        raise ValueError(
            f"reference has shape {samples.shape}; give {channels} numbers for each control period"
        )
    sizes, bounds = np.abs(shaped).max(axis=0), np.broadcast_to(largest, channels)
    for size, bound, own in zip(sizes, bounds, unit.split(", "), strict=True):
        if size > bound:
            raise ValueError(f"reference reaches {size:g} {own}; at most {bound:g} {own} is taken")
    return len(families), np.ascontiguousarray(shaped.T)


def payloads_of(payload: Any, most: float) -> NDArray[np.float64]:
    """Return the payloads [kg] that episodes draw from, shape (1, n).

    Parameters
    ----------
    payload : float, sequence of float or None
        As given by the user; None is any up to ``most``.
    most : float
        Largest payload [kg].
    """
    if payload is None:
        return np.array([np.linspace(0.0, most, 6)])
    given = payload if isinstance(payload, (Sequence, np.ndarray)) else [payload]
    if isinstance(payload, str) or not len(given):
        raise ValueError(
            f"payload = {payload!r} must be a mass [kg], several of them, or None for any"
        )
    return np.array([[check_number("payload", mass, 0.0, most, "kg") for mass in given]])


def task_of(kind: type[T], changes: Any) -> T:
    """Return a task with some of its weights, scales and limits changed."""
    known = tuple(declarations(kind))
    if changes is None:
        return kind()
    if not isinstance(changes, Mapping) or set(changes) - set(known):
        raise ValueError(
            f"reward = {changes!r} must be a mapping with keys among {', '.join(known)}"
        )
    task: Any = dataclasses.replace(kind(), **changes)  # type: ignore[type-var]
    check(task, "reward")
    return task  # type: ignore[no-any-return]


def spread_of(
    plant: Any,
    names: Sequence[str],
    fixed: Sequence[str],
    randomize: Any,
    example: str,
    corner: Mapping[str, Callable[..., float]],
) -> NDArray[np.float64]:
    """Return (row, low, high) of each parameter that is drawn anew every episode.

    Parameters
    ----------
    plant : object
        Whose ``replace`` refuses values that are out of bounds or cannot be simulated.
    names : sequence of str
        Its parameters in the order of the kernels' rows.
    fixed : sequence of str
        Those that cannot be drawn: they scale the action or enter derived numbers.
    randomize : bool or mapping
        As given by the user.
    example : str
        A mapping that would do, for the error's sentence.
    corner : mapping of callable
        ``min`` or ``max`` of each parameter that makes the plant harder to follow.
    """
    ranges = _ranges(plant, names, fixed, randomize, example)
    allowed = tuple(name for name in names if name not in fixed)
    table = []
    for name, span in ranges.items():
        if name not in allowed:
            raise ValueError(
                f"randomize: {name!r} is not a parameter that can be drawn; there are: "
                + ", ".join(allowed)
            )
        if not isinstance(span, (Sequence, np.ndarray)) or len(span) != 2 or isinstance(span, str):
            raise ValueError(f"randomize: {name} needs (low, high), got {span!r}")
        low, high = (check_number(f"randomize: {name}", v, -1e12, 1e12, "") for v in span)
        if low > high:
            raise ValueError(
                f"randomize: {name} has low = {low:g} above high = {high:g}; swap them"
            )
        for end in (low, high):
            plant.replace({name: end})  # refuses what is out of bounds or cannot be simulated
        table.append((names.index(name), low, high))
    worst = {name: pick(ranges[name]) for name, pick in corner.items() if name in ranges}
    for member in plant.members() if ranges else ():
        member.replace(worst)  # refuses a corner that the sub-steps cannot follow
    return np.array(table, float).reshape(-1, 3)


def _ranges(
    plant: Any, names: Sequence[str], fixed: Sequence[str], randomize: Any, example: str
) -> dict[str, Any]:
    """Return the range of each parameter that ``randomize`` asks for."""
    if randomize is False:
        return {}
    if isinstance(randomize, Mapping):
        return dict(randomize)
    if randomize is not True:
        raise ValueError(
            f"randomize = {randomize!r} must be True, False or a mapping from parameter to "
            f"(low, high), for example {example}"
        )
    ranges = {}
    for name in names:
        component, _, field = name.partition(".")
        declared = declarations(getattr(plant, component))[field]
        if declared.spread is not None and name not in fixed:
            ranges[name] = declared.spread
    return ranges
