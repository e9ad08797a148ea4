"""A run of the playground in Python, with the same numbers."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.playground.scenes import SCENES, SWEEP, SWEEP_STEPS, Scene
from benchmarks.runs import controllers
from pam_envs.arrays import Array
from pam_envs.wording import near

SETTLED = 1.0
"""Time [s] after which errors are scored."""


@dataclass(frozen=True)
class Run:
    """Outputs of a run, and its score.

    Attributes
    ----------
    names : tuple of str
        Outputs, as the exported environment names them.
    outputs : ndarray, shape (steps + 1, len(names))
        Those of the start, and of every control period.
    rms : float
        Root mean square of the error, in ``unit``.
    unit : str
    """

    names: tuple[str, ...]
    outputs: Array
    rms: float
    unit: str

    def __getitem__(self, name: str) -> Array:
        """Return an output by name, shape (steps + 1,)."""
        return self.outputs[:, self.names.index(name)]


def sweep(step: int) -> float:
    """Return the scaled setpoint of the open-loop sweep: a triangle between -1 and 0.75."""
    phase = (step % SWEEP_STEPS) / (SWEEP_STEPS / 2)
    up = phase if phase <= 1.0 else 2.0 - phase
    return float(np.float32(1.75 * up - 1.0))


def nominal_controller(scene: Scene, name: str, env: Any) -> Any:
    """Return a controller of a scene, designed from its nominal plant."""
    entrant = controllers.find(name)
    return controllers.make(entrant, scene.nominal(), env, entrant.training_seeds[0])


def replay(
    scene: str,
    hysteresis: str = "maxwell_slip",
    controller: str = "",
    seed: int = 1,
    steps: int | None = None,
    **values: float,
) -> Run:
    """Run a scene of the playground.

    Parameters
    ----------
    scene : {"muscle", "knee"}
    hysteresis, controller : str
        As on the page; the default controller is the scene's first.
    seed : int
        Seed of the episode.
    steps : int, optional
        Control periods; default: the whole episode.
    **values : float
        Values of the sliders in the units of the page, as ``load=2.55``.

    Raises
    ------
    ValueError
        If there is no such scene, model, controller or slider, or a value is outside its range.
    """
    made = SCENES.get(scene)
    if made is None:
        raise ValueError(f"no scene named {scene!r}; there are: {', '.join(SCENES)}")
    name = controller or next(iter(made.controllers))
    for what, given, known in (
        ("controller", name, made.controllers),
        ("hysteresis", hysteresis, made.hysteresis),
    ):
        if given not in known:
            raise ValueError(f"no {what} named {given!r} in {scene}{near(given, known)}")
    env = made.make(hysteresis, _checked(made, values))
    acting = None if name == SWEEP else nominal_controller(made, name, env)
    observation, info = env.reset(seed=seed)
    rows = [[*observation, 0.0, *info.values(), False, False]]
    names = (*(f"observation.{n}" for n in env.signals.names()), "reward")
    names += (*(f"info.{key}" for key in info), "terminated", "truncated")
    state, start = None, True
    ended = False
    while not ended and (steps is None or len(rows) <= steps):
        if acting is None:
            action = np.array([sweep(len(rows) - 1)], np.float32)
        else:
            action, state = acting.predict(observation, state, start, True)
        observation, reward, terminated, truncated, info = env.step(action)
        rows.append([*observation, reward, *info.values(), terminated, truncated])
        start, ended = False, bool(terminated or truncated)
    outputs = np.array(rows, float)
    return Run(names, outputs, _rms(made, names, outputs), made.unit)


def _checked(scene: Scene, values: Mapping[str, float]) -> dict[str, float]:
    sliders = {slider.name: slider for slider in scene.sliders}
    for name, value in values.items():
        if name not in sliders:
            raise ValueError(f"no slider named {name!r}{near(name, sliders)}")
        low, high, unit = sliders[name].low, sliders[name].high, sliders[name].unit
        if not low <= value <= high:
            raise ValueError(f"{name} = {value!r} must be from {low:g} to {high:g} {unit}")
    return {name: float(values.get(name, slider.usual)) for name, slider in sliders.items()}


def _rms(scene: Scene, names: tuple[str, ...], outputs: Array) -> float:
    """Return the root mean square error of the periods that count, NaN if there are none."""

    def signal(name: str) -> Array:
        return outputs[:, names.index(f"info.{name}")]

    counts = signal("time") >= SETTLED
    for name in scene.gate:
        counts = counts & (signal(name) > 0.5)
    error = signal(scene.error[0]) - signal(scene.error[1])
    if not counts.any():
        return float("nan")
    return scene.scale * float(np.sqrt(np.mean(error[counts] ** 2)))
