"""Commands ``pam-envs export`` and ``pam-envs warmup``."""

from __future__ import annotations

import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import gymnasium as gym

from pam_envs import yaml_file
from pam_envs.files import fresh_folder
from pam_envs.wording import near, shown

if TYPE_CHECKING:
    from pam_envs.export.model import Model

Format = Literal["c", "wasm", "fmu", "ptx"]
PLANTS = {
    "single_muscle": ("SingleMuscle", "mas10"),
    "knee_orthosis": ("KneeOrthosis", "rig"),
    "elbow_orthosis": ("ElbowOrthosis", "paper"),
    "antagonistic_joint": ("AntagonisticJoint", "paper"),
    "redundant_manipulator": ("RedundantManipulator", "paper"),
}
"""Class of each family of plants, and the constructor of its default."""


def model_of(
    what: str,
    plant: Path | None = None,
    hysteresis: str | None = None,
    air: str | None = None,
    reference: str | None = None,
    si: bool = False,
) -> Model:
    """Return the model of an environment or of a plant (arguments as of ``pam-envs export``)."""
    from pam_envs.export import actuator
    from pam_envs.export.environment import environment_model
    from pam_envs.export.plant import plant_model

    if what == actuator.NAME:
        if hysteresis or air or reference:
            raise ValueError("a muscle takes --plant alone; give its hysteresis in the plant file")
        return actuator.muscle_model(plant_of("single_muscle" if plant is None else str(plant)))
    if what.endswith((".yaml", ".yml")) or what in PLANTS:
        extra = {"plant": plant, "hysteresis": hysteresis, "air": air, "reference": reference}
        for name, value in extra.items():
            if value is not None:
                raise ValueError(
                    f"--{name} is for environments; for a plant, give a plant file in place of "
                    f"{what}"
                )
        return plant_model(plant_of(what))
    env_id = registered(what)
    given = {"plant": plant, "hysteresis": hysteresis, "air": air, "reference": reference}
    arguments: dict[str, Any] = {name: v for name, v in given.items() if v is not None}
    if si:
        arguments["normalize"] = False
    made = gym.make(env_id, **arguments)
    try:
        return environment_model(env_id, made.unwrapped)
    finally:
        made.close()


def plant_of(what: str) -> Any:
    """Return the default plant of a family, or that of a plant file."""
    plants = import_module("pam_envs.plants")
    if what in PLANTS:
        name, constructor = PLANTS[what]
        return getattr(getattr(plants, name), constructor)()
    path = Path(what)
    data = yaml_file.read(path, "plant file")
    family = data.get("family") if isinstance(data, dict) else None
    if not isinstance(family, str) or family not in PLANTS:
        raise ValueError(
            f"plant file {path}: family is {shown(family)}; known: {', '.join(PLANTS)}"
        )
    return getattr(plants, PLANTS[family][0]).from_yaml(path)


def registered(what: str) -> str:
    """Return the id of an environment, with or without ``PAM/`` and ``-v0``."""
    ids = [name for name in gym.registry if name.startswith("PAM/") or name == what]
    short = {name.removeprefix("PAM/").rpartition("-v")[0]: name for name in ids}
    found = [name for name in ids if what in (name, name.removeprefix("PAM/"))]
    if found or what in short:
        return found[0] if found else short[what]
    raise ValueError(
        f"no environment or plant named {what!r}{near(what, [*short, *PLANTS])}; plants are: "
        f"{', '.join(PLANTS)}, a muscle with imposed length, or a plant file (.yaml)"
    )


def export(model: Model, target: Format, folder: Path, platforms: tuple[str, ...] = ()) -> Path:
    """Write the artefact of a model into a folder, all of it or nothing.

    Raises
    ------
    OSError
        If a linker is missing, or the folder cannot be written.
    """
    if platforms and target != "fmu":
        raise ValueError(f"--platforms is for FMUs; --target {target} needs none")
    with fresh_folder(folder) as fresh:
        if target == "fmu":
            from pam_envs.export.fmu import export_fmu

            export_fmu(model, fresh, platforms)
        else:
            writer = import_module(f"pam_envs.export.{target}")
            getattr(writer, f"export_{target}")(model, fresh)
    return folder


def warm_up(
    ids: tuple[str, ...], hysteresis: str | None, air: str | None, batch: bool
) -> Iterator[tuple[str, float]]:
    """Compile kernels of environments; yield what was compiled or loaded, and its seconds."""
    names = ids or tuple(sorted(name for name in gym.registry if name.startswith("PAM/")))
    given = {"hysteresis": hysteresis, "air": air}
    arguments: dict[str, Any] = {name: v for name, v in given.items() if v is not None}
    for name in map(registered, names):
        began = time.perf_counter()
        env: Any = gym.make(name, **arguments)
        env.unwrapped.setup.kernels.single.wait()
        yield f"{name}, single environment", time.perf_counter() - began
        if batch:
            began = time.perf_counter()
            envs: Any = gym.make_vec(
                name, num_envs=1, vectorization_mode="vector_entry_point", **arguments
            )
            envs.reset(seed=0)
            yield f"{name}, batch", time.perf_counter() - began
            envs.close()
        env.close()
