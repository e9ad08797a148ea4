"""The playground as one HTML file, with everything that it needs."""

import base64
import dataclasses
import gzip
import html
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from agents.policies.emission import policy_model
from agents.policies.policy import OnnxPolicy
from baselines.emission.catalogue import controller_model
from benchmarks.playground.replay import SETTLED, nominal_controller
from benchmarks.playground.scenes import SCENES, SWEEP, SWEEP_STEPS, Scene, acts
from pam_envs.export.environment import environment_model
from pam_envs.export.model import Model
from pam_envs.export.wasm import INSTANCE, description, link
from pam_envs.files import write_text
from pam_envs.wording import package

ASSETS = Path(__file__).parent / "assets"
SCRIPTS = ("engine.js", "charts.js", "scenes.js", "page.js")


def models(scene: Scene) -> Iterator[tuple[str, Model]]:
    """Yield the models of a scene: environments by hysteresis, then controllers by name."""
    envs = {kind: scene.make(kind) for kind in scene.hysteresis}
    for kind, env in envs.items():
        yield kind, environment_model(scene.env, env)
    env = envs[next(iter(envs))]
    for name in scene.controllers:
        if name == SWEEP:
            continue
        made, period = nominal_controller(scene, name, env), env.control_period
        if isinstance(made, OnnxPolicy):
            yield name, policy_model(name, made, period)
        else:
            yield name, controller_model(name, made, env.signals, env.action_signals, period)


def packed(model: Model) -> dict[str, Any]:
    """Return a model's description and its module, compressed, as plain values."""
    code = gzip.compress(link(model), 9, mtime=0)
    return {**description(model), "code": base64.b64encode(code).decode()}


def facts(scene: Scene) -> dict[str, Any]:
    """Return a scene as plain values for the page."""
    plants = {kind: scene.plant(kind) for kind in scene.hysteresis}
    nominal = scene.nominal()
    made = {
        key: value
        for key, value in vars(scene).items()
        if key not in ("plant", "nominal", "arguments", "sliders")
    }
    made["sliders"] = [dataclasses.asdict(slider) for slider in scene.sliders]
    made["idle"] = {
        kind: [slider.name for slider in scene.sliders if not acts(plant, slider)]
        for kind, plant in plants.items()
    }
    made["settled"] = SETTLED
    made["full"] = nominal.regulator.max_pressure
    if scene.name == "knee":
        plant = next(iter(plants.values()))
        made["leg"] = {
            "thigh": plant.leg.thigh, "shank": plant.leg.shank, "arm": plant.lever.arm,
        }  # fmt: skip
    return made


def build() -> str:
    """Return the page; equal sources give equal bytes.

    Raises
    ------
    OSError
        If there is no linker for WebAssembly.
    """
    scenes = {name: facts(scene) for name, scene in SCENES.items()}
    modules = {
        f"{name}/{key}": packed(model)
        for name, scene in SCENES.items()
        for key, model in models(scene)
    }
    data = {
        "scenes": scenes, "modules": modules, "sweep": SWEEP_STEPS, "made": package(),
    }  # fmt: skip
    texts = {name: (ASSETS / name).read_text(encoding="utf-8") for name in SCRIPTS}
    code = "\n".join([INSTANCE, *texts.values()])
    plain = json.dumps(data, separators=(",", ":")).replace("</", "<\\/")
    page = (ASSETS / "page.html").read_text(encoding="utf-8")
    style = (ASSETS / "page.css").read_text(encoding="utf-8")
    parts = {
        "{{style}}": style,
        "{{made}}": html.escape(package()),
        "{{data}}": plain,
        "{{code}}": code,
    }
    for mark, text in parts.items():
        page = page.replace(mark, text)
    return page


def write(folder: Path) -> Path:
    """Write the page into a folder, and return its path."""
    path = folder / "index.html"
    write_text(path, build())
    return path
