"""Keyword arguments of environments: the common ones, their checks, and the two classes."""

import dataclasses
import functools
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from pam_envs.entry_points import muscle
from pam_envs.envs.core.plant_env import PlantEnv
from pam_envs.envs.core.setup import Setup, check_choice, check_number, check_whole
from pam_envs.envs.core.step import MOST_PREVIEW
from pam_envs.envs.core.vector_env import PlantVectorEnv
from pam_envs.hysteresis.protocol import DRIVES, kind_of, kinds, model_of
from pam_envs.parameters import check, declarations
from pam_envs.plants.core.everyday import everyday
from pam_envs.plants.core.plant import UnstableParameters
from pam_envs.pneumatics.flow import AIRS, SWITCH
from pam_envs.wording import near

T = TypeVar("T")

RENDER_MODES = (None, "rgb_array", "human")


MOST_SUBSTEPS = 12
"""Sub-steps up to which a plant with flow is refined for the parameters that it draws."""


def inert_of(plant: Any) -> frozenset[str]:
    """Return the parameters that have no effect on a plant, none of a plant of another package."""
    return getattr(plant, "inert", frozenset())


@dataclass(frozen=True)
class Randomization:
    """Parameters of a family that ``randomize`` may draw."""

    parameters: Sequence[str]
    """Parameters of the plant in the order of the kernels' rows."""
    fixed: Sequence[str]
    """Those that cannot be drawn: they scale the action or enter derived numbers."""
    example: str
    """A valid mapping, for the error message."""
    lowest: Sequence[str] = ()
    highest: Sequence[str] = ()
    """Those at the lower and the upper end of whose range the sub-steps or a limit are nearest."""


@dataclass(frozen=True)
class Common:
    """Arguments of every environment.

    Attributes
    ----------
    hysteresis : {"maxwell_slip", "preisach", "none"}, optional
        Hysteresis model of the muscles. Default: that of ``plant``, or Maxwell-slip.
    hysteresis_drive : {"length", "pressure"}, optional
        Input of the hysteresis: friction driven by length is passive, the papers' forms create
        energy. Default: that of ``plant``; else "length", for the knee "pressure".
    air : {"regulator", "flow"}, optional
        Air of the muscles: behind closed-loop regulators, or flowing through their orifices into
        the muscles' volumes (ISO 6358). Default: that of ``plant``, or "regulator".
    plant : plant, path or str, optional
        Plant of the environment's family, as an object, a YAML file, or the name of an entry point
        (:mod:`pam_envs.entry_points`). Default: the published one.
    reference : str or array_like
        Family of references, or samples, one per control period (the last one holds).
    preview : int
        Future reference samples in the observation, 0 to 20.
    preview_stride : int
        Control periods between them.
    episode_seconds : float
        Duration of an episode [s], 0.02 to 3,600.
    randomize : bool, "everyday" or mapping
        True: every episode draws one of the equally good fits (where there are several) and the
        assumed parameters within their declared ranges. "everyday": the effects of a normal day,
        and one of those fits (:mod:`~pam_envs.plants.core.everyday`). A mapping {"mass.damping":
        (low, high)}: only those.
    normalize : bool
        Observation and action in [-1, 1], or SI.
    render_mode : {None, "rgb_array", "human"}
        As in Gymnasium; a batch has no "human".
    reward : mapping, optional
        Weights, scales and limits of the environment's task to change.
    """

    reference: Any
    preview: int
    preview_stride: int
    episode_seconds: float
    hysteresis: str | None = None
    hysteresis_drive: str | None = None
    air: str | None = None
    plant: Any = None
    randomize: Any = False
    normalize: bool = True
    render_mode: str | None = None
    reward: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Check the arguments that do not depend on the family."""
        check_choice("render_mode", self.render_mode, RENDER_MODES)
        check_choice("normalize", self.normalize, (True, False))
        check_whole("preview", self.preview, 0, MOST_PREVIEW)
        check_whole("preview_stride", self.preview_stride, 1, 1000)
        check_number("episode_seconds", self.episode_seconds, 0.02, 3600.0, "s")

    def plant_of(self, kind: type[T], default: Callable[[Any], T], usual: str = DRIVES[0]) -> T:
        """Return the plant that ``plant``, ``hysteresis``, ``hysteresis_drive`` and ``air`` name.

        Without ``plant`` it is ``default`` of a kind of hysteresis: of the model's form with the
        drive ``usual``, where there is one and no other drive is given.
        """
        made = self._hysteretic_plant(kind, default, usual)
        if self.air is None:
            return made
        check_choice("air", self.air, AIRS)
        return made.with_air(self.air)  # type: ignore[attr-defined, no-any-return]

    def _hysteretic_plant(self, kind: type[T], default: Callable[[Any], T], usual: str) -> T:
        plant, hysteresis, drive = self.plant, self.hysteresis, self.hysteresis_drive
        if drive is not None:
            check_choice("hysteresis_drive", drive, DRIVES)
        if hysteresis is not None:
            check_choice("hysteresis", hysteresis, kinds())
        if plant is None:
            return default(kind_of(hysteresis or "maxwell_slip", drive, usual))
        made: Any = muscle(plant) if isinstance(plant, str) else plant
        if made is None or isinstance(made, Path):
            made = kind.from_yaml(plant)  # type: ignore[attr-defined]
        if not isinstance(made, kind):
            raise ValueError(
                f"plant must be a {kind.__name__}, the path of a plant file, the name of an entry "
                f"point, or None, not a {type(made).__name__}"
            )
        own = made.hysteresis.choice  # type: ignore[attr-defined]
        if hysteresis is not None and model_of(hysteresis).identity:
            return made.replace({"hysteresis.operator": None})  # type: ignore[attr-defined, no-any-return]
        if hysteresis is not None and hysteresis != own:
            raise ValueError(
                f"hysteresis = {hysteresis!r} but the plant's hysteresis is {own!r}; leave "
                "hysteresis out, or give a plant identified with that hysteresis"
            )
        if drive not in (None, made.hysteresis.drive):  # type: ignore[attr-defined]
            raise ValueError(
                f"hysteresis_drive = {drive!r} but the plant's hysteresis has another; leave "
                "hysteresis_drive out, or give a plant with that hysteresis"
            )
        return made

    def reference_of(
        self,
        families: Sequence[str],
        unit: str,
        largest: float | Sequence[float],
        channels: int = 1,
        own: Sequence[str] = (),
    ) -> tuple[int, NDArray[np.float64]]:
        """Return the number of the reference's family, and samples of shape (channels, n).

        ``len(families)`` is the number of given samples, shape (n,) or (n, channels), each of at
        most ``largest`` in magnitude; those of the environment's ``own`` families follow. Units of
        several channels are separated by commas.
        """
        reference = self.reference
        if isinstance(reference, str):
            check_choice("reference", reference, (*families, *own))
            return [*families, None, *own].index(reference), np.zeros((channels, 1))
        try:
            samples = np.array(reference, np.float64)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"reference = {str(reference)[:60]!r} must be one of "
                f"{', '.join((*families, *own))} or samples"
            ) from error
        shaped = samples[:, None] if samples.ndim == channels == 1 else samples
        if shaped.ndim != 2 or not len(shaped) or not np.isfinite(shaped).all():
            raise ValueError(
                f"reference has shape {samples.shape}; give a finite sample [{unit}] for each "
                "control period"
            )
        if shaped.shape[1] != channels:
            raise ValueError(
                f"reference has shape {samples.shape}; give {channels} numbers for each control "
                "period"
            )
        sizes, bounds = np.abs(shaped).max(axis=0), np.broadcast_to(largest, channels)
        for size, bound, word in zip(sizes, bounds, unit.split(", "), strict=True):
            if size > bound:
                raise ValueError(
                    f"reference reaches {size:g} {word}; at most {bound:g} {word} is accepted"
                )
        return len(families), np.ascontiguousarray(shaped.T)

    def task_of(self, kind: type[T]) -> T:
        """Return a task with the changes of ``reward``."""
        known, changes = tuple(declarations(kind)), self.reward
        if changes is None:
            return kind()
        if not isinstance(changes, Mapping) or set(changes) - set(known):
            raise ValueError(
                f"reward = {changes!r} must be a mapping with keys among {', '.join(known)}"
            )
        task: Any = dataclasses.replace(kind(), **changes)  # type: ignore[type-var]
        check(task, "reward")
        return task  # type: ignore[no-any-return]

    def drawn(self, plant: Any, which: Randomization) -> tuple[Any, NDArray[np.float64]]:
        """Return the plant and the ranges that every episode draws (:meth:`spread_of`).

        Enclosed air stiffens a muscle: with ``air="flow"`` the plant has as many sub-steps as the
        ranges need.
        """
        while True:
            try:
                return plant, self.spread_of(plant, which)
            except UnstableParameters:
                if getattr(plant, "air", "") != "flow" or plant.substeps >= MOST_SUBSTEPS:
                    raise
            plant = dataclasses.replace(plant, substeps=plant.substeps + 1)

    def spread_of(self, plant: Any, which: Randomization) -> NDArray[np.float64]:
        """Return (row, low, high) of each parameter that every episode draws, checked."""
        names, ranges, table = list(which.parameters), self._ranges(plant, which), []
        inert = inert_of(plant)
        allowed = [name for name in names if name not in (*which.fixed, SWITCH)]
        for name, span in ranges.items():
            if name in inert:
                raise ValueError(
                    f"randomize: {name!r} has no effect on this plant, with air = {plant.air!r}: "
                    "leave it out"
                )
            if name not in allowed:
                raise ValueError(
                    f"randomize: {name!r} is not a parameter that can be drawn{near(name, allowed)}"
                )
            if (
                isinstance(span, str)
                or not isinstance(span, (Sequence, np.ndarray))
                or len(span) != 2
            ):
                raise ValueError(f"randomize: {name} needs (low, high), got {span!r}")
            low, high = (check_number(f"randomize: {name}", v, -1e12, 1e12, "") for v in span)
            if low > high:
                raise ValueError(
                    f"randomize: {name} has low = {low:g} above high = {high:g}; swap them"
                )
            for end in (low, high):
                plant.replace({name: end})  # refuses values out of bounds and unstable plants
            table.append((names.index(name), low, high))
        worst = {name: min(ranges[name]) for name in which.lowest if name in ranges}
        highest = (*which.highest, "regulator.polytropic")
        worst |= {name: max(ranges[name]) for name in highest if name in ranges}
        for member in plant.members() if ranges else ():
            member.replace(worst)  # refuses a corner that the sub-steps cannot follow
        return np.array(table, float).reshape(-1, 3)

    def _ranges(self, plant: Any, which: Randomization) -> dict[str, Any]:
        """Return the range of each parameter that ``randomize`` asks for."""
        randomize = self.randomize
        if randomize is False:
            return {}
        if isinstance(randomize, Mapping):
            return dict(randomize)
        if randomize == "everyday":
            inert = inert_of(plant)
            return {n: span for n, span in everyday(plant).items() if n not in inert}
        if randomize is not True:
            raise ValueError(
                f"randomize = {randomize!r} must be True, False, 'everyday' or a mapping from "
                "parameter to "
                f"(low, high), for example {which.example}"
            )
        ranges, inert = {}, inert_of(plant)
        for name in which.parameters:
            component, _, attribute = name.partition(".")
            declared = declarations(getattr(plant, component))[attribute]
            if declared.spread is not None and name not in (*which.fixed, *inert):
                ranges[name] = declared.spread
        return ranges


def environment_arguments(
    reference: Any, preview: int, preview_stride: int, episode_seconds: float
) -> Callable[[Callable[..., Setup]], Callable[..., Setup]]:
    """Give a function the arguments of :class:`Common`, with these defaults, beside its own.

    The function gets a :class:`Common` as its first argument. An argument of an unknown name raises
    a ``TypeError`` with the nearest known one; every check raises a ``ValueError`` that names the
    argument, its value, the bounds and the remedy.
    """
    defaults = Common(reference, preview, preview_stride, episode_seconds)
    word = inspect.Parameter.KEYWORD_ONLY
    shared = [
        inspect.Parameter(f.name, word, default=getattr(defaults, f.name))
        for f in dataclasses.fields(Common)
    ]

    def decorate(make: Callable[..., Setup]) -> Callable[..., Setup]:
        own = list(inspect.signature(make).parameters.values())[1:]
        fixed = [p for p in own if p.default is p.empty]
        keywords = [*shared, *(p.replace(kind=word) for p in own if p.default is not p.empty)]
        known = [p.name for p in keywords]

        @functools.wraps(make)
        def made(*given: Any, **arguments: Any) -> Setup:
            unknown = {*arguments} - {*known, *(p.name for p in fixed)}
            for name in sorted(unknown):
                raise TypeError(f"there is no argument {name!r}{near(name, known)}")
            common = {p.name: arguments.pop(p.name) for p in shared if p.name in arguments}
            return make(dataclasses.replace(defaults, **common), *given, **arguments)

        made.__signature__ = inspect.Signature([*fixed, *keywords])  # type: ignore[attr-defined]
        return made

    return decorate


def environments(name: str, make_setup: Callable[..., Setup], *fixed: Any) -> tuple[Any, Any]:
    """Return the classes ``NameEnv`` and ``NameVectorEnv``, whose page is that of the module.

    ``fixed`` are the first arguments of ``make_setup``, which the id of the environment fixes.
    """
    module = make_setup.__module__
    scope = {
        "__module__": module,
        "__doc__": sys.modules[module].__doc__,
        "make_setup": staticmethod(functools.partial(make_setup, *fixed)),
    }
    single = type(f"{name}Env", (PlantEnv,), dict(scope))
    return single, type(f"{name}VectorEnv", (PlantVectorEnv,), dict(scope))
