"""Configuration of an environment: checked, laid out as arrays for the kernels, and given to it."""

import copy
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from pam_envs.envs.core.step import CHOICE, EPISODE, MEMBER, N_SEED
from pam_envs.envs.core.step import STEP as STEP_ROW
from pam_envs.hysteresis.protocol import operator_of
from pam_envs.kernels.build import COMPILED, LANES
from pam_envs.parameters import Signal, Signals
from pam_envs.wording import shown

Part = tuple[str, str, float, float]
"""Name, unit and range of a signal."""
STEP, STEP_AND_RESTART, BEGIN = 0, 1, 2
"""Modes of the kernels: step; step and reset ended episodes; reset flagged ones."""
WORD, MOST_STEPS = 2**32 - 1, 2**31 - 1
"""Largest key word, and largest number of an episode or a control period in a saved state."""
FIRST_STACK = MEMBER + 1
"""First integer row of the hysteresis operators."""


@dataclass(frozen=True)
class Setup:
    """Checked configuration that the single environment and the batch share."""

    plant: Any
    signals: Signals
    action_signals: Signals
    kernels: Any
    drawn: bool
    """Whether environments differ in their parameters; otherwise all tiles share them."""
    ring: int
    """Length of the ring buffers of previewed references: a power of two for each channel."""
    shared: tuple[Any, ...]
    """Arrays that all environments share, in the order of the kernels' arguments."""
    control_period: float
    episode_seconds: float
    render_mode: str | None = None
    view: str = ""
    fixed_parameters: tuple[str, ...] = ()
    """Parameters of the plant that scale the action or enter derived numbers of the setup."""

    @property
    def info_keys(self) -> tuple[str, ...]:
        """Keys of ``info``, in the order in which the kernels write them."""
        return self.kernels.report.keys  # type: ignore[no-any-return]

    @property
    def episode_steps(self) -> int:
        """Control periods until an episode is truncated."""
        return math.ceil(self.episode_seconds / self.control_period - 0.5)

    @property
    def seed_rows(self) -> tuple[int, int, int]:
        """Integer rows of the two key words and of the episode number."""
        last = self.kernels.n_counts
        return last - N_SEED, last - N_SEED + 1, EPISODE

    def count_limits(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the smallest and the largest value of each integer row, shape (n, 1) each."""
        operator = operator_of(self.plant.hysteresis.operator)
        least = np.zeros((self.kernels.n_counts, 1), np.int64)
        most = np.full_like(least, WORD)  # key words
        most[[EPISODE, STEP_ROW], 0] = MOST_STEPS
        most[MEMBER] = self.shared[-1][CHOICE.members] - 1
        stacks = slice(FIRST_STACK, -N_SEED)
        least[stacks] = 1 if operator.largest_count > 1 else 0
        most[stacks] = operator.largest_count
        return least, most

    def parameter_limits(self, members: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the range of each parameter of the members of tiles of lanes, (tiles, lanes)."""
        settings, choices = self.shared[2:]
        first = settings[choices[CHOICE.at_members] :, : self.kernels.parameters]
        low = np.moveaxis(first[members if self.drawn else members[:1]], -1, 1)
        high = low.copy()
        for row, least, most in settings[choices[CHOICE.at_spread] :][: choices[CHOICE.spread], :3]:
            slack = 1e-12 * (most - least)  # a drawn number is rounded
            low[:, int(row)], high[:, int(row)] = least - slack, most + slack
        return low, high

    def parameter_hull(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the smallest and the largest value of each parameter, as in ``plant.names``.

        Over the equally good fits and the ranges of drawn parameters, and the nominal value of
        these; shape (n_parameters,) each.
        """
        settings, choices = self.shared[2:]
        first = choices[CHOICE.at_members]
        members = settings[first : first + choices[CHOICE.members], : len(self.plant.names)]
        low, high = members.min(axis=0), members.max(axis=0)
        for row, least, most in settings[choices[CHOICE.at_spread] :][: choices[CHOICE.spread], :3]:
            low[int(row)], high[int(row)] = min(low[int(row)], least), max(high[int(row)], most)
        return low, high

    def state(self, tiles: int, lanes: int) -> tuple[NDArray[Any], ...]:
        """Return zeroed state, parameters, integers and previews for tiles of ``lanes`` lanes."""
        return (
            np.zeros((tiles, self.kernels.rows, lanes)),
            np.zeros((tiles if self.drawn else 1, self.kernels.parameters, lanes)),
            np.zeros((tiles, self.kernels.n_counts, lanes), np.int64),
            np.zeros((tiles, self.ring, lanes)),
        )


def compose(
    plant: Any,
    kernels_for: Callable[[bool], Any],
    given: Any,
    drawn: Any,
    *,
    observation: Sequence[Part],
    references: Iterable[Part],
    action: Iterable[Part],
    config: Mapping[str, float],
    choices: Mapping[str, int] | None = None,
    reference: int = 0,
    sines: int = 0,
    own: NDArray[np.float64] | None = None,
    samples: NDArray[np.float64] | None = None,
    view: str = "",
) -> Setup:
    """Return the setup of an environment with the common arguments ``given``.

    ``kernels_for`` returns the kernels without or with effects, ``drawn`` declares what
    ``randomize`` may draw. ``observation`` holds the signals without references; the preview of
    each reference follows it. ``config`` and ``choices`` are the family's own numbers, by the names
    that the kernels declare, ``own`` its own rows of the settings. ``samples`` are references that
    are given, shape (channels, n), ``reference`` is the number of the reference's family, ``sines``
    how many sines its evaluation sums, and ``view`` the import name of a
    :class:`~pam_envs.envs.rendering.scene.View`.
    """
    plant, spread = given.drawn(plant, drawn)
    kernels = kernels_for(plant.needs_effects(spread))
    parts = [(part, 0.0) for part in observation]
    for name, *span in references:
        parts.append(((name, *span), 0.0))  # type: ignore[arg-type]
        for i in range(1, given.preview + 1):
            ahead = i * given.preview_stride * plant.control_period
            parts.append(((f"{name}_{i}", *span), ahead))  # type: ignore[arg-type]
    signals = Signals(Signal(*p, i, given.normalize, ahead) for i, (p, ahead) in enumerate(parts))
    actions = Signals(Signal(*part, i, given.normalize) for i, part in enumerate(action))
    varied = given.randomize is not False
    members = plant.members() if varied else (plant,)
    own_numbers = [config[name] for name in kernels.config._fields]
    blocks = [
        np.array([(plant.control_period, given.episode_seconds, *own_numbers)], np.float64),
        np.array([(1.0 / a, -b / a, *_bounds(s)) for s in actions for a, b in (s.scale,)]),
        np.array([(*s.scale, *np.array(_bounds(s), np.float32).tolist()) for s in signals]),
        spread,
        np.array([member.parameter_rows() for member in members]),
        np.zeros((1, 1)) if own is None else own,
    ]
    first = np.cumsum([0, *map(len, blocks)]).tolist()
    settings = np.zeros((first[-1], max(block.shape[1] for block in blocks)))
    for begin, block in zip(first, blocks, strict=False):
        settings[begin : begin + len(block), : block.shape[1]] = block
    whole = {
        "substeps": plant.substeps,
        "actions": len(actions),
        "signals": len(signals),
        "fixed": len(observation),
        "preview": int(given.preview),
        "stride": int(given.preview_stride),
        "spread": len(spread),
        "members": len(members),
        "elements": getattr(plant, "elements", 0),
        "reference": reference,
        "sines": sines,
        **dict(zip(CHOICE._fields[-5:], first[1:6], strict=True)),
    }
    numbers = [whole[name] for name in CHOICE._fields]
    numbers += [(choices or {})[name] for name in kernels.choices._fields]
    ring = 1 << (whole["preview"] * whole["stride"]).bit_length()
    return Setup(
        plant=plant,
        signals=signals,
        action_signals=actions,
        kernels=kernels,
        drawn=varied,
        ring=kernels.channels * ring,
        shared=(
            plant.hysteresis_tables()[: len(members)],
            np.zeros((kernels.channels, 1)) if samples is None else samples,
            settings,
            np.array(numbers, np.int64),
        ),
        control_period=plant.control_period,
        episode_seconds=float(given.episode_seconds),
        render_mode=given.render_mode,
        view=view,
        fixed_parameters=tuple(drawn.fixed),
    )


def _bounds(signal: Signal) -> tuple[float, float]:
    """Return the range of a signal's entry in its vector."""
    return (-1.0, 1.0) if signal.normalized else (signal.low, signal.high)


def for_kernels(array: Any) -> Any:
    """Return an array as the kernels take it: itself, or nested lists when uncompiled."""
    return array if COMPILED else array.tolist()


def tiles_for(number: int) -> int:
    """Return how many tiles hold ``number`` environments."""
    return -(-number // LANES)


def check_choice(name: str, value: Any, choices: Sequence[Any]) -> None:
    """Raise a clear error if ``value`` is not one of ``choices``."""
    if not any(value is c or (type(value) is type(c) and value == c) for c in choices):
        listed = ", ".join(repr(c) for c in choices)
        raise ValueError(f"{name} = {value!r} is not known; choose one of {listed}")


def check_number(name: str, value: Any, low: float, high: float, unit: str) -> float:
    """Return ``value`` as a float, or raise naming value, bounds and remedy."""
    good = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not good or not math.isfinite(value) or not low <= value <= high:
        raise ValueError(
            f"{name} = {value!r} must be a number from {low:g} to {high:g} {unit}".rstrip()
            + "; choose a value in this range"
        )
    return float(value)


def masses_of(name: str, given: Any, most: float, default: Any) -> NDArray[np.float64]:
    """Return the masses [kg] from which episodes draw, shape (1, n); None: the default ones."""
    masses = default if given is None else given
    if not isinstance(masses, (Sequence, np.ndarray)):
        masses = [masses]
    if isinstance(masses, str) or len(masses) == 0:
        raise ValueError(f"{name} = {given!r} must be a mass [kg], several of them, or None")
    return np.array([[check_number(name, mass, 0.0, most, "kg") for mass in masses]])


def check_whole(name: str, value: Any, low: int, high: int) -> int:
    """Return ``value`` as an int, or raise naming value, bounds and remedy."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise ValueError(f"{name} = {value!r} must be a whole number from {low} to {high}")
    if not low <= value <= high:
        raise ValueError(f"{name} = {value} must be from {low} to {high}")
    return int(value)


def check_seed(seed: Any) -> int:
    """Return a seed as a non-negative int, or raise."""
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ValueError(f"seed = {seed!r} must be a non-negative whole number")
    return int(seed)


def space_of(signals: Signals) -> gym.spaces.Box[np.float32]:
    """Return the Box of a vector of signals."""
    low = [-1.0 if s.normalized else s.low for s in signals]
    high = [1.0 if s.normalized else s.high for s in signals]
    return gym.spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)


def fresh_seed() -> int:
    """Return a seed from the operating system's entropy."""
    return int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)


class Configured:
    """Environment whose keyword arguments ``make_setup`` turns into its setup."""

    make_setup: Callable[..., Setup]
    setup: Setup
    plant: Any
    signals: Signals
    action_signals: Signals
    control_period: float
    render_mode: str | None
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Specification of the environment; ``max_episode_steps`` is the length of its episodes."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        if spec is not None and spec.max_episode_steps is None:
            spec = copy.deepcopy(spec)
            spec.max_episode_steps = self.setup.episode_steps
        self._spec = spec

    def _check_options(self, options: Mapping[str, Any] | None, known: Sequence[str] = ()) -> None:
        """Refuse options of a reset that the environment does not have."""
        for name in options or {}:
            if name not in known:
                there = f"the only option is {', '.join(known)}" if known else "there are none"
                raise ValueError(
                    f"reset(options={{{name!r}: ...}}): {there}; give {name} to gymnasium.make, "
                    "or randomize=True for parameters that change between episodes"
                )

    def _configure(self, setup: Setup | None, arguments: Mapping[str, Any]) -> Setup:
        """Set the attributes from a setup, or from that of the arguments."""
        setup = self.make_setup(**arguments) if setup is None else setup
        self.setup, self.plant, self.signals = setup, setup.plant, setup.signals
        self.action_signals, self.render_mode = setup.action_signals, setup.render_mode
        self.control_period = setup.control_period
        return setup

    def _numbers(self, given: Any, shape: tuple[int, ...], word: str) -> NDArray[np.float64]:
        """Return actions as an array, or raise an error that names the fault.

        Accepted are finite arrays and lists (or tuples) of booleans, integers and floats; masked
        arrays, text, dates, objects and whatever else converts to an array are refused.
        """
        try:
            _refuse_others(given, len(shape))
            made = np.asarray(given, np.float64)
        except Exception as error:  # of any class: an object runs code of its own
            raise ValueError(
                f"{word} {shown(given)}: not an array or list of numbers of shape {shape}: {error}"
            ) from error
        if made.shape != shape:
            raise ValueError(
                f"{word} of shape {made.shape}, expected {shape}: one number for each of "
                + ", ".join(self.action_signals.names())
            )
        if not np.isfinite(made).all():
            place = np.argwhere(~np.isfinite(made))[0].tolist()
            signal = self.action_signals[place[-1]]
            low, high = (-1.0, 1.0) if signal.normalized else (signal.low, signal.high)
            raise ValueError(
                f"{word}{place} ({signal.name}) is {made[tuple(place)]}; "
                f"give a finite number between {low:g} and {high:g}"
            )
        return made


NUMBER_KINDS = "biuf"
"""Kinds of NumPy types that actions may have: booleans, integers, unsigned ones and floats."""


def _refuse_others(given: Any, depth: int) -> None:
    """Raise TypeError unless ``given`` is an array of numbers, or at most ``depth`` lists deep."""
    if isinstance(given, (np.ndarray, np.generic)):
        if isinstance(given, np.ma.MaskedArray) or given.dtype.kind not in NUMBER_KINDS:
            raise TypeError(f"{type(given).__name__} of type {given.dtype}")
    elif isinstance(given, (list, tuple)):
        if depth == 0:
            raise TypeError("too many lists in lists")
        for value in given:
            _refuse_others(value, depth - 1)
    elif not isinstance(given, (bool, int, float)):
        raise TypeError(f"{type(given).__name__}; convert it with numpy.asarray")
