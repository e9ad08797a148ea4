"""Scenes of the playground: environment, adjustable parameters, controllers and charts."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym

from pam_envs.plants.knee_orthosis.plant import KneeOrthosis
from pam_envs.plants.single_muscle.plant import SingleMuscle

SWEEP = "sweep"
"""Open loop: the setpoint rises and falls, whatever the observation."""
SWEEP_STEPS = 800
"""Control periods of a rise and a fall."""
CREEP = 0.02
"""Creep with which plants are exported, so that their code has this effect; it can be set to 0."""


@dataclass(frozen=True)
class Slider:
    """An adjustable parameter.

    Attributes
    ----------
    name, label, unit : str
        Key in links and in Python; words and unit on the page.
    parameter : str
        Parameter of the exported environment; ``"load"`` is an argument of it.
    low, high, step, usual : float
        Range and initial value in ``unit``.
    factor : float
        SI value of one unit; of a relative slider, the parameter's own value is the unit.
    relative : bool
        Whether the value is a factor on that of the plant.
    """

    name: str
    label: str
    unit: str
    parameter: str
    low: float
    high: float
    step: float
    usual: float
    factor: float = 1.0
    relative: bool = False

    def value(self, shown: float, plant: Any) -> float:
        """Return the parameter's value in SI."""
        if self.relative:
            return shown * float(plant.value(self.parameter))
        return shown * self.factor


@dataclass(frozen=True)
class Scene:
    """One environment of the playground.

    Attributes
    ----------
    name, title, env : str
        Key; title on the page; id of the environment.
    plant : callable
        From a hysteresis model to the plant that is simulated.
    nominal : callable
        Plant from which controllers are designed, whatever is simulated.
    hysteresis : mapping
        Models with their titles, the usual one first.
    sliders : tuple of Slider
    controllers : mapping
        Controllers with their titles, the usual one first.
    arguments : mapping
        Further arguments of the environment.
    error, unit, scale
        Signals whose difference is scored; unit of the score, and units per SI unit.
    gate : tuple of str
        Signals that are 1 in the periods that count.
    """

    name: str
    title: str
    env: str
    plant: Callable[[str], Any]
    nominal: Callable[[], Any]
    hysteresis: Mapping[str, str]
    sliders: tuple[Slider, ...]
    controllers: Mapping[str, str]
    arguments: Mapping[str, Any]
    error: tuple[str, str]
    unit: str
    scale: float
    gate: tuple[str, ...] = ()

    def make(self, hysteresis: str, values: Mapping[str, float] | None = None) -> Any:
        """Return the environment with values of sliders; without, as it is exported."""
        plant = self.plant(hysteresis)
        given = dict(self.arguments)
        if values is not None:
            drawn = {}
            for slider in self.sliders:
                value = slider.value(values[slider.name], plant)
                if slider.parameter == "load":
                    given["load"] = value
                elif acts(plant, slider):
                    drawn[slider.parameter] = (value, value)
            given["randomize"] = drawn  # fixed values, which leave the environment's own numbers
        return gym.make(self.env, plant=plant, **given).unwrapped


def acts(plant: Any, slider: Slider) -> bool:
    """Return whether a slider has an effect on a plant: those of the hysteresis need one."""
    of_hysteresis = slider.parameter in ("hysteresis.friction", "hysteresis.width")
    if of_hysteresis and plant.hysteresis.operator is None:
        return False
    return slider.parameter not in plant.inert


def _muscle(hysteresis: str) -> Any:
    kind = hysteresis if hysteresis == "none" else f"{hysteresis}_length"
    plant = SingleMuscle.mas10(kind, muscle__creep_2=CREEP)
    return dataclasses.replace(plant, ensemble=())


def _knee(hysteresis: str) -> Any:
    plant = gym.make("PAM/KneeWalk-v0", hysteresis=hysteresis).unwrapped.plant  # type: ignore[attr-defined]
    return dataclasses.replace(plant.replace({"hysteresis.creep_2": CREEP}), ensemble=())


def _nominal_knee() -> KneeOrthosis:
    plant: KneeOrthosis = gym.make("PAM/KneeWalk-v0").unwrapped.plant  # type: ignore[attr-defined]
    return plant


MODELS = {"maxwell_slip": "Maxwell-slip", "preisach": "Preisach", "none": "none"}
IDENTIFIED = "× identified"  # noqa: RUF001
DEAD_TIME = Slider(
    "dead_time", "Dead time", "ms", "regulator.dead_time", 0.0, 110.0, 5.0, 45.0, factor=1e-3
)
SCENES = {
    scene.name: scene
    for scene in (
        Scene(
            "muscle",
            "Muscle positioning",
            "PAM/MusclePositioning-v0",
            _muscle,
            SingleMuscle.mas10,
            MODELS,
            (
                Slider("load", "Load", "kg", "load", 0.0, 5.0, 0.05, 2.55),
                Slider(
                    "friction", "Friction", IDENTIFIED, "hysteresis.friction",
                    0.0, 2.0, 0.05, 1.0, relative=True,
                ),
                Slider("creep", "Creep", "%", "muscle.creep_2", 0.0, 30.0, 1.0, 0.0, factor=0.01),
                DEAD_TIME,
            ),
            {
                "inverse_pid": "Inverse + PID",
                "inverse": "Inverse, open loop",
                "pid": "PID",
                "ppo": "Policy (PPO)",
                SWEEP: "Pressure sweep",
            },
            {"reference": "mixed", "load": 2.55, "episode_seconds": 20.0},
            ("output", "reference"),
            "mm",
            1e3,
        ),
        Scene(
            "knee",
            "Knee walk",
            "PAM/KneeWalk-v0",
            _knee,
            _nominal_knee,
            MODELS,
            (
                Slider("load", "Body mass", "kg", "leg.body_mass", 50.0, 110.0, 0.2, 72.6),
                Slider(
                    "friction", "Hysteresis width", IDENTIFIED, "hysteresis.width",
                    0.0, 1.2, 0.05, 1.0, relative=True,
                ),
                Slider(
                    "creep", "Creep", "%", "hysteresis.creep_2", 0.0, 30.0, 1.0, 0.0, factor=0.01
                ),
                DEAD_TIME,
            ),
            {
                "ppo_knee_walk": "Policy (PPO)",
                "knee_inverse_ahead_ltr": "Inverse + LTR",
                "knee_inverse": "Inverse, open loop",
                "knee_pid": "PID",
            },
            {"episode_seconds": 20.0},
            ("output", "reference"),
            "N",
            1.0,
            ("state/stance", "sensor/stance"),
        ),
    )
}  # fmt: skip
"""Scenes by their keys."""
